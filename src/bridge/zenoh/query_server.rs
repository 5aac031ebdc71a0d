//! Answers queries from other hosts: requests for the description and, if allowed, commands.
//!
//! Each kind of query has its own thread, because a server takes up to a tick to answer a command, and a full link may
//! delay an answer. zenoh's threads put queries into bounded queues and never wait.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};

use bench_dragon_ipc::Domain;
use crossbeam::channel;
use zenoh::query::Query;
use zenoh::{Session, Wait as _};

use super::command_forwarder::CommandForwarder;
use super::key_prefix::KeyPrefix;
use super::wire::{DESCRIPTION_ENCODING, Described, encode_described};
use crate::bridge::rate_limit::RateLimit;
use crate::system::clock::monotonic_ns;

/// Most queries of one kind that wait.
const MAX_QUESTIONS: usize = 16;
/// Limit of each kind of query: queries per second, and burst.
const QUESTION_RATE: (u64, u64) = (100, 50);

/// The threads that answer queries. They end when this value is dropped.
#[derive(Debug)]
pub(super) struct QueryServer {
    state: Arc<QueryState>,
    threads: Vec<Queryable>,
}

impl QueryServer {
    /// Starts the threads. Without `allows_commands` there is no queryable for commands.
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
        // Waiting commands are refused instead of forwarded, so that only the current command delays the end.
        self.state.is_closed.store(true, Ordering::Relaxed);
        self.threads.clear();
    }
}

/// A query from another host.
#[derive(Debug)]
pub(super) struct Question {
    pub(super) query: Query,
    /// Arrival time.
    pub(super) asked_ns: u64,
    /// Whether the query exceeds the rate limit.
    pub(super) is_too_many: bool,
}

/// The receiver of one kind of query, and the thread that answers these queries in order.
#[derive(Debug)]
struct Queryable {
    // Holds the sending end of the thread's queue: the thread ends after this is dropped.
    queryable: Option<zenoh::query::Queryable<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Queryable {
    /// Answers the queries under a key on a new thread, with the function that `begin` returns there. Queries that find the
    /// queue full are dropped and counted as refused.
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
                    tracing::debug!("cannot send an answer: {error}");
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
            // A panic has already been reported.
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

/// State shared with the answering threads: the description, and counts.
#[derive(Debug, Default)]
pub(super) struct QueryState {
    description: Mutex<Option<Arc<(Described, String)>>>,
    /// Commands forwarded to the server.
    pub(super) commands: AtomicU64,
    /// Queries that were refused.
    pub(super) refused: AtomicU64,
    /// Whether the bridge is ending. Then no more commands are forwarded.
    pub(super) is_closed: AtomicBool,
}

impl QueryState {
    pub(super) fn describe(&self, described: Described, toml: &str) {
        // The lock is held only while a pointer is stored.
        let mut description = self.description.lock().unwrap_or_else(PoisonError::into_inner);
        *description = Some(Arc::new((described, toml.to_owned())));
    }

    pub(super) fn description(&self) -> Option<Arc<(Described, String)>> {
        self.description.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}
