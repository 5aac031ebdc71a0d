//! Answers the other side's questions: what the description is, and, where that is allowed, commands.
//!
//! A thread of its own, because a server takes up to a tick to answer. zenoh's threads hand questions over and never wait.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use bench_dragon_ipc::{BusError, CommandClient, CommandReply, Domain, Refusal, Request};
use crossbeam::channel::{self, Receiver, Sender};
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait as _};

use super::keys::KeyPrefix;
use super::rate_limit::RateLimit;
use super::wire::{
    COMMAND_BYTES, DESCRIPTION_ENCODING, Described, REPLY_ENCODING, decode_command, encode_described, encode_reply,
};
use crate::clock::monotonic_ns;

/// Questions that wait at most.
const MAX_QUESTIONS: usize = 16;
/// Questions a second, and at once.
const QUESTION_RATE: (u64, u64) = (100, 50);
/// How long a server may take to answer: less than the other side waits.
const PATIENCE: Duration = Duration::from_secs(2);

/// What the clerk and those who ask have in common.
#[derive(Debug, Default)]
pub(super) struct Desk {
    description: Mutex<Option<Arc<(Described, String)>>>,
    commands: AtomicU64,
    refused: AtomicU64,
}

impl Desk {
    /// What is answered from now on.
    pub(super) fn describe(&self, described: Described, toml: &str) {
        // Held for as long as it takes to store a pointer.
        let mut description = self.description.lock().unwrap_or_else(PoisonError::into_inner);
        *description = Some(Arc::new((described, toml.to_owned())));
    }

    fn description(&self) -> Option<Arc<(Described, String)>> {
        self.description.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Commands passed on to the server.
    pub(super) fn commands(&self) -> u64 {
        self.commands.load(Ordering::Relaxed)
    }

    /// Questions that were not taken.
    pub(super) fn refused(&self) -> u64 {
        self.refused.load(Ordering::Relaxed)
    }

    fn count_refused(&self) {
        self.refused.fetch_add(1, Ordering::Relaxed);
    }
}

/// The running clerk.
#[derive(Debug)]
pub(super) struct Clerk {
    // With them goes the way to the thread, which then ends.
    queryables: Vec<Queryable<()>>,
    thread: Option<JoinHandle<()>>,
}

enum Question {
    Description(Query),
    Command(Query),
}

impl Clerk {
    /// Begins to answer. Without `allows_commands` there is nobody to send one to.
    pub(super) fn start(
        session: &Session,
        prefix: &KeyPrefix,
        domain: &Domain,
        desk: &Arc<Desk>,
        allows_commands: bool,
    ) -> zenoh::Result<Self> {
        let (sender, questions) = channel::bounded(MAX_QUESTIONS);
        let mut queryables = vec![answer(session, prefix.description(), &sender, desk, Question::Description)?];
        if allows_commands {
            queryables.push(answer(session, prefix.commands(), &sender, desk, Question::Command)?);
        }
        drop(sender);
        let orders = Orders { domain: domain.clone(), desk: Arc::clone(desk), prefix: prefix.clone() };
        let answer_all = move || Work { client: None, orders }.answer_all(&questions);
        Ok(Self { queryables, thread: Some(thread::spawn(answer_all)) })
    }
}

impl Drop for Clerk {
    fn drop(&mut self) {
        self.queryables.clear();
        if let Some(thread) = self.thread.take() {
            // One that panicked has been told of already.
            let _ = thread.join();
        }
    }
}

/// Makes questions for a key come to the clerk, as far as there is room for them.
fn answer(
    session: &Session,
    key: String,
    sender: &Sender<Question>,
    desk: &Arc<Desk>,
    question: fn(Query) -> Question,
) -> zenoh::Result<Queryable<()>> {
    let (sender, desk) = (sender.clone(), Arc::clone(desk));
    let take = move |query| {
        if sender.try_send(question(query)).is_err() {
            desk.count_refused();
        }
    };
    session.declare_queryable(key).callback(take).wait()
}

/// What the thread is given.
struct Orders {
    domain: Domain,
    desk: Arc<Desk>,
    prefix: KeyPrefix,
}

/// What the thread works with.
struct Work {
    // A port stays on the thread that it was made on.
    client: Option<CommandClient>,
    orders: Orders,
}

impl Work {
    fn answer_all(mut self, questions: &Receiver<Question>) {
        let mut limit = RateLimit::new(QUESTION_RATE.0, QUESTION_RATE.1);
        for question in questions {
            let is_allowed = limit.allows(monotonic_ns());
            if !is_allowed {
                self.orders.desk.count_refused();
            }
            let answered = match question {
                Question::Description(query) if is_allowed => self.describe(&query),
                Question::Description(_) => Ok(()),
                Question::Command(query) => self.pass_on(&query, is_allowed),
            };
            if let Err(error) = answered {
                tracing::debug!("an answer is not sent: {error}");
            }
        }
    }

    fn describe(&self, query: &Query) -> zenoh::Result<()> {
        let Some(description) = self.orders.desk.description() else { return Ok(()) };
        let (described, toml) = &*description;
        query
            .reply(self.orders.prefix.description(), toml.as_bytes())
            .encoding(DESCRIPTION_ENCODING)
            .attachment(encode_described(*described))
            .express(true)
            .wait()
    }

    fn pass_on(&mut self, query: &Query, is_allowed: bool) -> zenoh::Result<()> {
        let payload = query.payload().filter(|payload| payload.len() == COMMAND_BYTES);
        let Some(command) = payload.and_then(|payload| decode_command(&payload.to_bytes()).ok()) else {
            self.orders.desk.count_refused();
            return query.reply_err(format!("a command has {COMMAND_BYTES} bytes")).wait();
        };
        let nowhere = |refusal| CommandReply::refused(0, 0, refusal);
        let reply = match Request::from_wire(&command) {
            _ if !is_allowed => nowhere(Refusal::TooMany),
            None => nowhere(Refusal::Unknown),
            // A guard stands where the server is: what it grants has to reach it, whatever happens to the way.
            Some(Request::Grant { .. }) => nowhere(Refusal::NotGuarded),
            Some(request) => {
                self.orders.desk.commands.fetch_add(1, Ordering::Relaxed);
                self.call(request).unwrap_or_else(|_| nowhere(Refusal::Unreachable))
            }
        };
        query.reply(self.orders.prefix.commands(), encode_reply(&reply)).encoding(REPLY_ENCODING).express(true).wait()
    }

    /// Sends a command to the server. Where that fails, the next one is sent by another client.
    fn call(&mut self, request: Request) -> Result<CommandReply, BusError> {
        let client = match self.client.take() {
            Some(client) => client,
            None => CommandClient::open(&self.orders.domain, "bridge-commands")?,
        };
        let reply = client.call(request, PATIENCE)?;
        self.client = Some(client);
        Ok(reply)
    }
}
