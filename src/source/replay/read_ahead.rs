//! Reading of a recording ahead of its replay, lap by lap, so that a slow disk delays no frame.
//!
//! A thread reads, decompresses and decodes. Frames, alerts and command events wait in a bounded channel, in the recorded
//! order. Played frames come back to the thread, which frees their memory; so the replay does not free memory between two
//! frames.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use crossbeam::channel::{self, Receiver, RecvTimeoutError};

use super::excerpt::{Excerpt, Findings, ReadFrom, RecordedRun};
use super::{ReplayError, ReplaySettings};
use crate::recording::Parts;

/// The reading thread. It ends when the receiving ends of its channels are dropped.
#[derive(Debug)]
pub(super) struct ReadAhead {
    runs: Receiver<Result<RecordedRun, ReplayError>>,
    abandoned: Arc<AtomicBool>,
    thread: JoinHandle<Findings>,
}

impl ReadAhead {
    pub(super) fn start(parts: &Arc<Parts>, settings: &ReplaySettings, from: ReadFrom) -> Result<Self, ReplayError> {
        let abandoned = Arc::new(AtomicBool::new(false));
        let excerpt = Excerpt::open(Arc::clone(parts), settings, from, Arc::clone(&abandoned))?;
        // A channel without capacity: the thread reads one run ahead at a time.
        let (sender, runs) = channel::bounded(0);
        let thread = thread::Builder::new()
            .name("replay-read".to_owned())
            .spawn(move || excerpt.send_all(&sender))
            .map_err(ReplayError::Thread)?;
        Ok(Self { runs, abandoned, thread })
    }

    /// Waits for the next recorded run. Returns `None` after `timeout`, and `Some(Ok(None))` after the last run.
    pub(super) fn next(&self, timeout: Duration) -> Option<Result<Option<RecordedRun>, ReplayError>> {
        match self.runs.recv_timeout(timeout) {
            Ok(run) => Some(run.map(Some)),
            Err(RecvTimeoutError::Disconnected) => Some(Ok(None)),
            Err(RecvTimeoutError::Timeout) => None,
        }
    }

    /// Ends the thread. Returns the parts that could not be read. The receiver of the last run must be dropped before.
    pub(super) fn finish(self) -> Findings {
        self.abandoned.store(true, Ordering::Relaxed);
        drop(self.runs);
        self.thread.join().expect("the reading thread does not panic")
    }
}
