//! The way to other machines: a zenoh session.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use crossbeam::channel::{self, RecvTimeoutError};
use zenoh::{Config, Session, Wait as _};

use super::link_error::{LinkError, one_line};
use super::link_settings::{LinkSettings, Side, endpoints};

/// How often a session that is being opened is looked for.
const LOOK_PERIOD: Duration = Duration::from_millis(20);
/// How long one is waited for before it is said.
const SILENT_WAIT: Duration = Duration::from_secs(1);

/// Threads that zenoh starts for a session, with some room. It panics where it cannot.
const THREADS: usize = 16;

/// An open way to other machines.
#[derive(Debug)]
pub struct Link {
    pub(super) session: Session,
    listens: Vec<String>,
    connects: Vec<String>,
}

impl Link {
    /// Opens the session; `None` where `stop` was set first. Who cannot be reached yet is tried again and again: by a client
    /// here, which is nothing without anybody, and which says so by `tell_waiting`; else behind our back.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn open(
        settings: &LinkSettings,
        side: Side,
        stop: &AtomicBool,
        tell_waiting: impl FnOnce(&[String]),
    ) -> Result<Option<Self>, LinkError> {
        let document = settings.document(side)?;
        let config = Config::from_json5(&document.to_string()).map_err(|error| match &settings.config {
            Some(path) => LinkError::Config { path: path.clone(), reason: one_line(error) },
            None => LinkError::Settings { reason: one_line(error) },
        })?;
        let (sender, opened) = channel::bounded(1);
        // Where it is not waited for any more, it ends with the process.
        require_threads()
            .map_err(|error| LinkError::Open { reason: format!("cannot start {THREADS} threads: {error}") })?;
        let open = move || sender.send(zenoh::open(config).wait());
        let opening = thread::Builder::new().name("zenoh-open".to_owned()).spawn(open);
        opening.map_err(|error| LinkError::Open { reason: format!("cannot start a thread: {error}") })?;
        let connects = endpoints(&document, "connect");
        let mut waiting = Some((Instant::now() + SILENT_WAIT, tell_waiting));
        let opened = loop {
            match opened.recv_timeout(LOOK_PERIOD) {
                Ok(opened) => break opened,
                Err(_) if stop.load(Ordering::Relaxed) => return Ok(None),
                Err(RecvTimeoutError::Timeout) => {
                    if let Some((_, tell)) = waiting.take_if(|(since, _)| *since <= Instant::now()) {
                        tell(&connects);
                    }
                }
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(LinkError::Open { reason: "its thread has ended".to_owned() });
                }
            }
        };
        let session = opened.map_err(|error| LinkError::Open { reason: one_line(error) })?;
        let listens = session.info().locators().wait().iter().map(ToString::to_string).collect();
        Ok(Some(Self { session, listens, connects }))
    }

    /// Where others reach it.
    pub fn listens(&self) -> &[String] {
        &self.listens
    }

    /// Whether anybody is connected.
    pub(super) fn is_connected(&self) -> bool {
        let info = self.session.info();
        info.peers_zid().wait().next().is_some() || info.routers_zid().wait().next().is_some()
    }

    /// Whom it tries to reach.
    pub fn connects(&self) -> &[String] {
        &self.connects
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
