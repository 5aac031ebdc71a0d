//! The connection of one page: its questions come in, answers go out. Three threads work for it: one answers at once,
//! one studies, one waits for questions of `solve`.

use std::io;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use axum::extract::ws::{Message, WebSocket, close_code};
use serde::Deserialize;
use serde_json::Value;
use tokio::sync::{OwnedSemaphorePermit, mpsc, watch};
use tokio::time::timeout;

use super::answerer::Answerer;
use super::asker::{self, Asked};
use super::newest::Newest;
use super::page_question::PageQuestion;
use super::plan_folder::PlanFolder;
use super::study::{Study, study_all};
use crate::display::web::{close, closed};

/// Answers that wait to be sent. The threads wait while a slow page has that many.
const MAX_ANSWERS: usize = 4;
/// Timeout for sending an answer.
const PAGE_TIMEOUT: Duration = Duration::from_secs(30);

/// The questions of a page, and the work for them. Dropping it ends the threads after the step in progress; they are not joined. Each
/// thread has one too, so that both end if one fails.
struct Work {
    questions: Newest<PageQuestion>,
    studies: Newest<Study>,
    /// `None` cancels a question of `solve`.
    asked: Newest<Option<Asked>>,
}

/// A message of a page.
#[derive(Deserialize)]
#[serde(untagged)]
enum PageMessage {
    Question(PageQuestion),
    Asked(Asked),
    /// Cancels the question of `solve` under way.
    Cancel {
        cancel: bool,
    },
}

impl Work {
    fn start(folder: Arc<PlanFolder>, answers: &mpsc::Sender<String>) -> io::Result<Self> {
        let work = Self { questions: Newest::new(), studies: Newest::new(), asked: Newest::new() };
        let send_to = |answers: &mpsc::Sender<String>| {
            let answers = answers.clone();
            move |answer: &Value| answers.blocking_send(answer.to_string()).is_ok()
        };
        let (asked, its_folder, send) = (work.asked.clone(), Arc::clone(&folder), send_to(answers));
        let ends = work.same();
        let ask = move || {
            let _ends = ends;
            asker::answer_all(&its_folder, &asked, send);
        };
        thread::Builder::new().name("asker".to_owned()).spawn(ask)?;
        let its_folder = Arc::clone(&folder);
        let (questions, studies, send) = (work.questions.clone(), work.studies.clone(), send_to(answers));
        let ends = work.same();
        let answer = move || {
            let _ends = ends;
            Answerer::new(its_folder, &studies).answer_all(&questions, send);
        };
        thread::Builder::new().name("answers".to_owned()).spawn(answer)?;
        let (studies, send) = (work.studies.clone(), send_to(answers));
        let ends = work.same();
        let study = move || {
            let _ends = ends;
            study_all(&folder, &studies, send);
        };
        thread::Builder::new().name("study".to_owned()).spawn(study)?;
        Ok(work)
    }

    fn same(&self) -> Self {
        Self { questions: self.questions.clone(), studies: self.studies.clone(), asked: self.asked.clone() }
    }
}

impl Drop for Work {
    fn drop(&mut self) {
        self.questions.close();
        self.studies.close();
        self.asked.close();
    }
}

/// Serves a page until it or the planner ends. `_place` counts the page.
pub(super) async fn serve(
    mut socket: WebSocket,
    folder: Arc<PlanFolder>,
    mut closing: watch::Receiver<bool>,
    _place: OwnedSemaphorePermit,
) {
    let (sender, mut answers) = mpsc::channel(MAX_ANSWERS);
    let Ok(work) = Work::start(folder, &sender) else {
        return close(socket, close_code::ERROR, "no thread can be started").await;
    };
    // The channel ends if both threads do, for example by a panic.
    drop(sender);
    let (code, reason) = loop {
        tokio::select! {
            message = socket.recv() => match page_message(message) {
                Ok(Some(PageMessage::Question(question))) => work.questions.put(question, |older, newer| newer.after(older)),
                Ok(Some(PageMessage::Asked(asked))) => work.asked.put(Some(asked), |_, newer| newer),
                Ok(Some(PageMessage::Cancel { cancel: true })) => work.asked.put(None, |_, newer| newer),
                Ok(None | Some(PageMessage::Cancel { .. })) => {}
                Err(Some(reason)) => break (close_code::POLICY, reason),
                Err(None) => return,
            },
            answer = answers.recv() => match answer {
                Some(answer) => {
                    let sent = timeout(PAGE_TIMEOUT, socket.send(Message::Text(answer.into()))).await;
                    if !matches!(sent, Ok(Ok(()))) {
                        return;
                    }
                }
                None => break (close_code::ERROR, "the planner has failed"),
            },
            () = closed(&mut closing) => break (close_code::AWAY, "the planner has ended"),
        }
    };
    drop(work);
    close(socket, code, reason).await;
}

/// What a message holds. Fails with a reason, or without one if the page has gone.
fn page_message(message: Option<Result<Message, axum::Error>>) -> Result<Option<PageMessage>, Option<&'static str>> {
    match message {
        None | Some(Ok(Message::Close(_)) | Err(_)) => Err(None),
        Some(Ok(Message::Ping(_) | Message::Pong(_))) => Ok(None),
        Some(Ok(Message::Binary(_))) => Err(Some("a message must be a question, as JSON")),
        Some(Ok(Message::Text(text))) => match serde_json::from_str(&text) {
            Ok(question) => Ok(Some(question)),
            Err(_) => Err(Some("a message must be a question, as JSON")),
        },
    }
}
