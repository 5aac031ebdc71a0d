//! The zenoh session of a bridge: how it is opened, whether a peer is connected, and why it fails.

use std::fmt;
use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use bench_dragon_ipc::BusError;
use crossbeam::channel::{self, RecvTimeoutError};
use zenoh::{Config, Session, Wait as _};

use super::session_settings::{SessionSettings, Side, endpoints};

/// How often a session that is being opened is looked for.
const LOOK_PERIOD: Duration = Duration::from_millis(20);
/// How long one is waited for before it is said.
const SILENT_WAIT: Duration = Duration::from_secs(1);

/// Threads that zenoh starts for a session, with some room. It panics where it cannot.
const THREADS: usize = 16;

/// An open way to other machines.
#[derive(Debug)]
pub struct BridgeSession {
    pub(super) zenoh: Session,
    /// Where others reach it.
    pub listens: Vec<String>,
    /// Whom it tries to reach.
    pub connects: Vec<String>,
}

impl BridgeSession {
    /// Opens the session; `None` where `stop` was set first. Who cannot be reached yet is tried again and again: by a client
    /// here, which is nothing without anybody, and which reports it by `on_waiting`; else in the background.
    ///
    /// # Errors
    /// [`BridgeError`].
    pub fn open(
        settings: &SessionSettings,
        side: Side,
        stop: &AtomicBool,
        on_waiting: impl FnOnce(&[String]),
    ) -> Result<Option<Self>, BridgeError> {
        let document = settings.document(side)?;
        let config = Config::from_json5(&document.to_string()).map_err(|error| match &settings.config {
            Some(path) => BridgeError::file(path, one_line(error)),
            None => BridgeError::Settings(format!("these settings are none for zenoh: {}", one_line(error))),
        })?;
        let (sender, opened) = channel::bounded(1);
        // zenoh cannot be told to give up: where `stop` comes first, this one thread is not joined, and ends with the process.
        require_threads().map_err(|error| BridgeError::Open(format!("cannot start {THREADS} threads: {error}")))?;
        let open = move || sender.send(zenoh::open(config).wait());
        let opening = thread::Builder::new().name("zenoh-open".to_owned()).spawn(open);
        let opening = opening.map_err(|error| BridgeError::Open(format!("cannot start a thread: {error}")))?;
        let connects = endpoints(&document, "connect");
        let mut waiting = Some((Instant::now() + SILENT_WAIT, on_waiting));
        let opened = loop {
            match opened.recv_timeout(LOOK_PERIOD) {
                Ok(opened) => break opened,
                Err(_) if stop.load(Ordering::Relaxed) => return Ok(None),
                Err(RecvTimeoutError::Timeout) => {
                    if let Some((_, on_waiting)) = waiting.take_if(|(since, _)| *since <= Instant::now()) {
                        on_waiting(&connects);
                    }
                }
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(BridgeError::Open("its thread has ended".to_owned()));
                }
            }
        };
        // It has sent, and ends.
        let _ = opening.join();
        let zenoh = opened.map_err(|error| BridgeError::Open(one_line(error)))?;
        let listens = zenoh.info().locators().wait().iter().map(ToString::to_string).collect();
        Ok(Some(Self { zenoh, listens, connects }))
    }

    pub(super) fn is_connected(&self) -> bool {
        let info = self.zenoh.info();
        info.peers_zid().wait().next().is_some() || info.routers_zid().wait().next().is_some()
    }
}

/// Starts as many threads as zenoh needs, all at once, and ends them again.
fn require_threads() -> io::Result<()> {
    let gate = Mutex::new(());
    thread::scope(|scope| {
        let closed = gate.lock().unwrap_or_else(PoisonError::into_inner);
        let wait = || drop(gate.lock());
        let started = (0..THREADS).try_for_each(|_| thread::Builder::new().spawn_scoped(scope, wait).map(drop));
        drop(closed);
        started
    })
}

/// How often it is looked for where somebody was there.
const LOOK_PERIOD_NS: u64 = 1_000_000_000;
/// How often where nobody was, so that hardly a frame is counted wrongly when somebody comes.
const ALONE_LOOK_PERIOD_NS: u64 = 1_000_000;
/// How long nobody may be there before it is said: connecting takes a moment.
const SILENT_NS: u64 = 1_000_000_000;

/// Who was there, and since when nobody is.
#[derive(Clone, Copy, Debug)]
pub(super) struct PeerPresence {
    looked_ns: Option<u64>,
    alone_since_ns: Option<u64>,
    is_reported: bool,
}

/// What is to be reported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Change {
    /// Nobody is there, and has not been for a while.
    Alone,
    /// Somebody is there again.
    Connected,
}

impl PeerPresence {
    /// Nobody, from this instant on.
    pub(super) fn none(now_ns: u64) -> Self {
        Self { looked_ns: None, alone_since_ns: Some(now_ns), is_reported: false }
    }

    /// Whether somebody was there when it was last looked.
    pub(super) fn is_there(&self) -> bool {
        self.alone_since_ns.is_none()
    }

    /// Takes note of the present, having `look` find out whether anybody is there, if it is time for that.
    pub(super) fn note(&mut self, now_ns: u64, look: impl FnOnce() -> bool) -> Option<Change> {
        let period_ns = if self.is_there() { LOOK_PERIOD_NS } else { ALONE_LOOK_PERIOD_NS };
        if self.looked_ns.is_none_or(|looked_ns| now_ns.saturating_sub(looked_ns) >= period_ns) {
            self.looked_ns = Some(now_ns);
            self.alone_since_ns = if look() { None } else { self.alone_since_ns.or(Some(now_ns)) };
        }
        let is_long = |since_ns: u64| now_ns.saturating_sub(since_ns) >= SILENT_NS;
        let is_reported = self.alone_since_ns.is_some_and(|since_ns| self.is_reported || is_long(since_ns));
        let is_change = std::mem::replace(&mut self.is_reported, is_reported) != is_reported;
        is_change.then_some(if is_reported { Change::Alone } else { Change::Connected })
    }
}

/// Why a bridge has no session, or cannot go on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BridgeError {
    /// The arguments or the configuration file are to blame.
    #[error("{0}")]
    Settings(String),
    /// Listening, or what that takes, did not work.
    #[error("zenoh cannot be opened: {0}")]
    Open(String),
    /// The session has been closed, or takes no more.
    #[error("zenoh: {0}")]
    Session(String),
    /// The bus.
    #[error(transparent)]
    Bus(#[from] BusError),
}

impl BridgeError {
    pub(super) fn session(error: impl fmt::Display) -> Self {
        Self::Session(one_line(error))
    }

    /// A file that is no configuration.
    pub(super) fn file(path: &Path, reason: impl fmt::Display) -> Self {
        Self::Settings(format!("{} is no configuration of zenoh's: {reason}", path.display()))
    }
}

/// zenoh's errors name the place in its sources, and go over several lines.
pub(super) fn one_line(error: impl fmt::Display) -> String {
    let text = error.to_string();
    let text = text.split(" at /").next().unwrap_or_default();
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ").trim_end_matches('.').to_owned();
    let is_cut = line.matches('[').count() > line.matches(']').count();
    if is_cut { line + "]" } else { line }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND_NS: u64 = 1_000_000_000;

    #[test]
    fn nobody_is_reported_of_after_a_second_and_once_and_so_is_whoever_comes() {
        let mut presence = PeerPresence::none(SECOND_NS);
        assert_eq!(presence.note(SECOND_NS, || false), None);
        assert_eq!(presence.note(2 * SECOND_NS, || false), Some(Change::Alone));
        assert_eq!(presence.note(9 * SECOND_NS, || false), None);
        assert_eq!(presence.note(9 * SECOND_NS + ALONE_LOOK_PERIOD_NS, || true), Some(Change::Connected));
        assert!(presence.is_there());
        assert_eq!(presence.note(20 * SECOND_NS, || false), None, "it may be back in a moment");
        assert!(!presence.is_there());
        assert_eq!(presence.note(21 * SECOND_NS, || false), Some(Change::Alone));
    }

    #[test]
    fn whoever_is_there_at_once_is_not_reported() {
        let mut presence = PeerPresence::none(SECOND_NS);
        assert_eq!(presence.note(SECOND_NS, || true), None);
        assert_eq!(presence.note(9 * SECOND_NS, || true), None);
    }

    #[test]
    fn it_is_looked_no_more_often_than_once_a_second_where_somebody_is() {
        let mut presence = PeerPresence::none(0);
        let mut looks = 0;
        for now_ms in 0..10_000 {
            presence.note(now_ms * 1_000_000, || {
                looks += 1;
                true
            });
        }
        assert_eq!(looks, 10);
    }
}
