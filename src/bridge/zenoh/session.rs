//! The zenoh session of a bridge: opening it, checking for peers, and its errors.

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

/// Period of checks while a session opens.
const LOOK_PERIOD: Duration = Duration::from_millis(20);
/// The bridge reports that it waits for a session after this time.
const SILENT_WAIT: Duration = Duration::from_secs(1);

/// Number of threads that zenoh starts for a session, with a reserve. zenoh panics if it cannot start a thread.
const THREADS: usize = 16;

/// An open session with other machines.
#[derive(Debug)]
pub struct BridgeSession {
    pub(super) zenoh: Session,
    /// Endpoints at which others reach this session.
    pub listens: Vec<String>,
    /// Endpoints that this session connects to.
    pub connects: Vec<String>,
}

impl BridgeSession {
    /// Opens the session; returns `None` if `stop` is set first. Failed connections are retried. A client needs a connection,
    /// so for a client this function waits, and calls `on_waiting` once after a second. Other modes retry in the background.
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
            None => BridgeError::Settings(format!("zenoh rejects these settings: {}", one_line(error))),
        })?;
        let (sender, opened) = channel::bounded(1);
        // The opening of a zenoh session cannot be cancelled. If `stop` is set first, this thread is not joined, and ends with
        // the process.
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
                    return Err(BridgeError::Open("its thread ended without a result".to_owned()));
                }
            }
        };
        // The thread has sent its result, and ends.
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

/// Checks that the system allows the threads that zenoh needs: starts all of them at once, then ends them.
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

/// Period of checks for peers while a peer is connected.
const LOOK_PERIOD_NS: u64 = 1_000_000_000;
/// Period of checks while no peer is connected. It is short, so that few frames are miscounted when a peer connects.
const ALONE_LOOK_PERIOD_NS: u64 = 1_000_000;
/// The bridge reports a missing peer after this time, because connecting takes a moment.
const SILENT_NS: u64 = 1_000_000_000;

/// Tracks whether a peer is connected, and since when none is.
#[derive(Clone, Copy, Debug)]
pub(super) struct PeerPresence {
    looked_ns: Option<u64>,
    alone_since_ns: Option<u64>,
    is_reported: bool,
}

/// A change that the bridge reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Change {
    /// No peer has been connected for a second.
    Alone,
    /// A peer is connected again.
    Connected,
}

impl PeerPresence {
    /// Returns the state without a peer from this instant on.
    pub(super) fn none(now_ns: u64) -> Self {
        Self { looked_ns: None, alone_since_ns: Some(now_ns), is_reported: false }
    }

    /// Whether a peer was connected at the last check.
    pub(super) fn is_there(&self) -> bool {
        self.alone_since_ns.is_none()
    }

    /// Advances to `now_ns`, and calls `look` to check for a peer if a check is due. Returns a change to report.
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

/// Error of a bridge that cannot open a session, or cannot continue.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BridgeError {
    /// The arguments or the configuration file are invalid.
    #[error("{0}")]
    Settings(String),
    /// zenoh cannot listen, or cannot start a thread.
    #[error("cannot open the zenoh session: {0}")]
    Open(String),
    /// The session is closed, or rejects a request.
    #[error("the zenoh session failed: {0}")]
    Session(String),
    /// The bus reports an error.
    #[error(transparent)]
    Bus(#[from] BusError),
}

impl BridgeError {
    pub(super) fn session(error: impl fmt::Display) -> Self {
        Self::Session(one_line(error))
    }

    /// Returns the error for a file that is not a configuration.
    pub(super) fn file(path: &Path, reason: impl fmt::Display) -> Self {
        Self::Settings(format!("{} is not a zenoh configuration: {reason}", path.display()))
    }
}

/// Shortens an error to one line. zenoh's errors have several lines and contain the location in zenoh's sources.
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
    fn a_missing_peer_is_reported_once_after_a_second_and_a_new_peer_at_once() {
        let mut presence = PeerPresence::none(SECOND_NS);
        assert_eq!(presence.note(SECOND_NS, || false), None);
        assert_eq!(presence.note(2 * SECOND_NS, || false), Some(Change::Alone));
        assert_eq!(presence.note(9 * SECOND_NS, || false), None);
        assert_eq!(presence.note(9 * SECOND_NS + ALONE_LOOK_PERIOD_NS, || true), Some(Change::Connected));
        assert!(presence.is_there());
        assert_eq!(presence.note(20 * SECOND_NS, || false), None, "the peer may return within a second");
        assert!(!presence.is_there());
        assert_eq!(presence.note(21 * SECOND_NS, || false), Some(Change::Alone));
    }

    #[test]
    fn a_peer_that_is_connected_from_the_start_is_not_reported() {
        let mut presence = PeerPresence::none(SECOND_NS);
        assert_eq!(presence.note(SECOND_NS, || true), None);
        assert_eq!(presence.note(9 * SECOND_NS, || true), None);
    }

    #[test]
    fn a_connected_peer_is_checked_at_most_once_a_second() {
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
