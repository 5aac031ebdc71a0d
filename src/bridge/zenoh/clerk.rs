//! Answers the other side's questions: what the description is, and, where that is allowed, commands.
//!
//! Each kind has a thread of its own, because a server takes up to a tick to answer a command, and a way that is full may keep
//! an answer. zenoh's threads hand questions over and never wait.

use std::sync::Arc;
use std::thread::{self, JoinHandle};

use bench_dragon_ipc::Domain;
use crossbeam::channel;
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait as _};

use super::desk::Desk;
use super::keys::KeyPrefix;
use super::orders::Orders;
use super::rate_limit::RateLimit;
use super::wire::{DESCRIPTION_ENCODING, encode_described};
use crate::system::clock::monotonic_ns;

/// Questions of a kind that wait at most.
const MAX_QUESTIONS: usize = 16;
/// Questions of a kind a second, and at once.
const QUESTION_RATE: (u64, u64) = (100, 50);

/// The running clerk.
#[derive(Debug)]
pub(super) struct Clerk {
    desk: Arc<Desk>,
    windows: Vec<Window>,
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
        let key = prefix.description();
        let mut clerk = Self { desk: Arc::clone(desk), windows: Vec::new() };
        clerk.windows.push(Window::open(session, key.clone(), desk, {
            let desk = Arc::clone(desk);
            move || move |question: &Question| describe(&desk, &key, question)
        })?);
        if allows_commands {
            let (domain, desk_there, key) = (domain.clone(), Arc::clone(desk), prefix.commands());
            clerk.windows.push(Window::open(session, key.clone(), desk, move || {
                let mut orders = Orders::new(domain, desk_there, key);
                move |question: &Question| orders.pass_on(question)
            })?);
        }
        Ok(clerk)
    }
}

impl Drop for Clerk {
    fn drop(&mut self) {
        // Those that wait are refused instead of passed on, so that the end takes no longer than the one at hand.
        self.desk.close();
        self.windows.clear();
    }
}

/// Something that the other side asks.
#[derive(Debug)]
pub(super) struct Question {
    pub(super) query: Query,
    /// When it came.
    pub(super) asked_ns: u64,
    /// Whether it is one of more than are taken at a time.
    pub(super) is_too_many: bool,
}

/// Where questions of one kind come, and who answers them, one after the other.
#[derive(Debug)]
struct Window {
    // With it goes the way to the thread, which then ends.
    queryable: Option<Queryable<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Window {
    /// Has the questions under a key answered, as far as there is room for them, by what `begin` returns on their thread.
    fn open<Answer: FnMut(&Question) -> zenoh::Result<()>>(
        session: &Session,
        key: String,
        desk: &Arc<Desk>,
        begin: impl FnOnce() -> Answer + Send + 'static,
    ) -> zenoh::Result<Self> {
        let (sender, questions) = channel::bounded(MAX_QUESTIONS);
        let there = Arc::clone(desk);
        let take = move |query| {
            let question = Question { query, asked_ns: monotonic_ns(), is_too_many: false };
            if sender.try_send(question).is_err() {
                there.count_refused();
            }
        };
        let queryable = session.declare_queryable(key).callback(take).wait()?;
        let desk = Arc::clone(desk);
        let thread = thread::Builder::new().name("answers".to_owned()).spawn(move || {
            let mut answer = begin();
            let mut limit = RateLimit::new(QUESTION_RATE.0, QUESTION_RATE.1);
            for question in questions {
                let is_too_many = !limit.allows(monotonic_ns());
                if is_too_many {
                    desk.count_refused();
                }
                if let Err(error) = answer(&Question { is_too_many, ..question }) {
                    tracing::debug!("an answer is not sent: {error}");
                }
            }
        })?;
        Ok(Self { queryable: Some(queryable), thread: Some(thread) })
    }
}

impl Drop for Window {
    fn drop(&mut self) {
        self.queryable = None;
        if let Some(thread) = self.thread.take() {
            // One that panicked has been told of already.
            let _ = thread.join();
        }
    }
}

fn describe(desk: &Desk, key: &str, question: &Question) -> zenoh::Result<()> {
    let Some(description) = desk.description().filter(|_| !question.is_too_many) else { return Ok(()) };
    let (described, toml) = &*description;
    question
        .query
        .reply(key, toml.as_bytes())
        .encoding(DESCRIPTION_ENCODING)
        .attachment(encode_described(*described))
        .express(true)
        .wait()
}
