//! Answers the other side's queries: for the description and, where that is allowed, commands.
//!
//! Each kind of query has a thread of its own, because a server takes up to a tick to answer a command, and a full link may
//! delay an answer. zenoh's threads hand queries over and never wait.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};

use bench_dragon_ipc::Domain;
use crossbeam::channel;
use zenoh::query::Query;
use zenoh::{Session, Wait as _};

use super::command_forwarder::CommandForwarder;
use super::key_prefix::KeyPrefix;
use super::rate_limit::RateLimit;
use super::wire::{DESCRIPTION_ENCODING, Described, encode_described};
use crate::system::clock::monotonic_ns;

/// Questions of a kind that wait at most.
const MAX_QUESTIONS: usize = 16;
/// Questions of a kind a second, and at once.
const QUESTION_RATE: (u64, u64) = (100, 50);

/// The threads that answer. They end with it.
#[derive(Debug)]
pub(super) struct QueryServer {
    state: Arc<QueryState>,
    threads: Vec<Queryable>,
}

impl QueryServer {
    /// Begins to answer. Without `allows_commands` there is nobody to send one to.
    pub(super) fn start(
        session: &Session,
        prefix: &KeyPrefix,
        domain: &Domain,
        state: &Arc<QueryState>,
        allows_commands: bool,
    ) -> zenoh::Result<Self> {
        let key = prefix.description();
        let mut server = Self { state: Arc::clone(state), threads: Vec::new() };
        server.threads.push(Queryable::open(session, key.clone(), state, {
            let state = Arc::clone(state);
            move || move |question: &Question| describe(&state, &key, question)
        })?);
        if allows_commands {
            let (domain, state_there, key) = (domain.clone(), Arc::clone(state), prefix.commands());
            server.threads.push(Queryable::open(session, key.clone(), state, move || {
                let mut forwarder = CommandForwarder::new(domain, state_there, key);
                move |question: &Question| forwarder.pass_on(question)
            })?);
        }
        Ok(server)
    }
}

impl Drop for QueryServer {
    fn drop(&mut self) {
        // Those that wait are refused instead of passed on, so that the end takes no longer than the one at hand.
        self.state.is_closed.store(true, Ordering::Relaxed);
        self.threads.clear();
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
struct Queryable {
    // With it goes the way to the thread, which then ends.
    queryable: Option<zenoh::query::Queryable<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Queryable {
    /// Has the questions under a key answered, as far as there is room for them, by what `begin` returns on their thread.
    fn open<Answer: FnMut(&Question) -> zenoh::Result<()>>(
        session: &Session,
        key: String,
        state: &Arc<QueryState>,
        begin: impl FnOnce() -> Answer + Send + 'static,
    ) -> zenoh::Result<Self> {
        let (sender, questions) = channel::bounded(MAX_QUESTIONS);
        let there = Arc::clone(state);
        let take = move |query| {
            let question = Question { query, asked_ns: monotonic_ns(), is_too_many: false };
            if sender.try_send(question).is_err() {
                there.refused.fetch_add(1, Ordering::Relaxed);
            }
        };
        let queryable = session.declare_queryable(key).callback(take).wait()?;
        let state = Arc::clone(state);
        let thread = thread::Builder::new().name("answers".to_owned()).spawn(move || {
            let mut answer = begin();
            let mut limit = RateLimit::new(QUESTION_RATE.0, QUESTION_RATE.1);
            for question in questions {
                let is_too_many = !limit.allows(monotonic_ns());
                if is_too_many {
                    state.refused.fetch_add(1, Ordering::Relaxed);
                }
                if let Err(error) = answer(&Question { is_too_many, ..question }) {
                    tracing::debug!("an answer is not sent: {error}");
                }
            }
        })?;
        Ok(Self { queryable: Some(queryable), thread: Some(thread) })
    }
}

impl Drop for Queryable {
    fn drop(&mut self) {
        self.queryable = None;
        if let Some(thread) = self.thread.take() {
            // A panic has been reported already.
            let _ = thread.join();
        }
    }
}

fn describe(state: &QueryState, key: &str, question: &Question) -> zenoh::Result<()> {
    let Some(description) = state.description().filter(|_| !question.is_too_many) else { return Ok(()) };
    let (described, toml) = &*description;
    question
        .query
        .reply(key, toml.as_bytes())
        .encoding(DESCRIPTION_ENCODING)
        .attachment(encode_described(*described))
        .express(true)
        .wait()
}

/// What is answered, and what has been.
#[derive(Debug, Default)]
pub(super) struct QueryState {
    description: Mutex<Option<Arc<(Described, String)>>>,
    /// Commands passed on to the server.
    pub(super) commands: AtomicU64,
    /// Questions that were not taken.
    pub(super) refused: AtomicU64,
    /// Whether the bridge is ending: then nothing more is passed on.
    pub(super) is_closed: AtomicBool,
}

impl QueryState {
    pub(super) fn describe(&self, described: Described, toml: &str) {
        // Held for as long as it takes to store a pointer.
        let mut description = self.description.lock().unwrap_or_else(PoisonError::into_inner);
        *description = Some(Arc::new((described, toml.to_owned())));
    }

    pub(super) fn description(&self) -> Option<Arc<(Described, String)>> {
        self.description.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}
