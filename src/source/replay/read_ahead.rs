//! Reading a recording ahead of its replay, so that a slow disk makes no frame late.
//!
//! A thread reads, decompresses and decodes. Frames wait in a channel of bounded size; those that have been played come
//! back, so that their memory is given up here and not between two frames.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use crossbeam::channel::{self, Receiver, RecvTimeoutError, Sender};

use super::ReplaySettings;
use super::error::ReplayError;
use super::excerpt::{Excerpt, PlannedFrame};
use crate::recording::{Configuration, Flaws, RecordedFrame};

/// What frames that wait to be played take of memory at most: six seconds of the paper's dragon at 1 kHz.
const BYTES_AHEAD: usize = 64 << 20;
/// As many of small frames at most.
const MOST_FRAMES_AHEAD: usize = 8192;
/// As many of large frames at least.
const LEAST_FRAMES_AHEAD: usize = 4;

/// A recorded run: its configuration, then its frames as they are read.
#[derive(Debug)]
pub(super) struct RecordedRun {
    pub(super) configuration: Configuration,
    pub(super) bench_count: usize,
    /// How often the recording was begun again before.
    pub(super) lap: u64,
    pub(super) frames: Receiver<PlannedFrame>,
    /// Takes back what has been played.
    pub(super) played: Sender<RecordedFrame>,
}

/// The reading thread. It ends by itself when nobody takes what it reads.
#[derive(Debug)]
pub(super) struct ReadAhead {
    runs: Receiver<Result<RecordedRun, ReplayError>>,
    abandoned: Arc<AtomicBool>,
    thread: JoinHandle<Flaws>,
}

/// That the next run has not been found yet.
#[derive(Debug)]
pub(super) struct NotYet;

impl ReadAhead {
    /// Opens a recording and begins to read.
    pub(super) fn start(settings: &ReplaySettings) -> Result<Self, ReplayError> {
        let abandoned = Arc::new(AtomicBool::new(false));
        let ReplaySettings { file, interval, laps, .. } = settings;
        let excerpt = Excerpt::open(file, *interval, *laps, Arc::clone(&abandoned)).map_err(ReplayError::Open)?;
        // One run is read ahead of at a time.
        let (sender, runs) = channel::bounded(0);
        let thread = thread::Builder::new()
            .name("replay-read".to_owned())
            .spawn(move || Reading { excerpt, first: None }.send_all(&sender))
            .map_err(ReplayError::Thread)?;
        Ok(Self { runs, abandoned, thread })
    }

    /// The next recorded run, or `None` at the end of all; waits so long at most.
    pub(super) fn next(&self, patience: Duration) -> Result<Result<Option<RecordedRun>, ReplayError>, NotYet> {
        match self.runs.recv_timeout(patience) {
            Ok(run) => Ok(run.map(Some)),
            Err(RecvTimeoutError::Disconnected) => Ok(Ok(None)),
            Err(RecvTimeoutError::Timeout) => Err(NotYet),
        }
    }

    /// Ends the thread. Returns what could not be read.
    pub(super) fn finish(self) -> Flaws {
        self.abandoned.store(true, Ordering::Relaxed);
        drop(self.runs);
        self.thread.join().expect("the reading thread does not panic")
    }
}

/// What the thread works with.
struct Reading {
    excerpt: Excerpt,
    /// The frame by which the next run was recognised.
    first: Option<PlannedFrame>,
}

impl Reading {
    /// Sends run after run, and what ended them. Returns how the file ended.
    fn send_all(mut self, runs: &Sender<Result<RecordedRun, ReplayError>>) -> Flaws {
        if let Err(error) = self.send_runs(runs) {
            // Nobody listens any more where the replay was stopped.
            let _ = runs.send(Err(error));
        }
        self.excerpt.flaws()
    }

    fn send_runs(&mut self, runs: &Sender<Result<RecordedRun, ReplayError>>) -> Result<(), ReplayError> {
        self.first = self.excerpt.next()?;
        if self.first.is_none() {
            return Err(self.excerpt.nothing());
        }
        while let Some(first) = self.first.take() {
            let (frames, frames_read) = channel::bounded(frames_ahead(&first.frame));
            let (played, done) = channel::unbounded();
            let bench_count = first.frame.header.bench_count as usize;
            let configuration = self.configuration(first.frame.header.run_id)?;
            let run = RecordedRun { configuration, bench_count, lap: first.lap, frames: frames_read, played };
            if runs.send(Ok(run)).is_err() || !self.send_frames(first, &frames, &done)? {
                return Ok(());
            }
        }
        Ok(())
    }

    /// Sends the frames of a run. Returns whether somebody took them all.
    fn send_frames(
        &mut self,
        first: PlannedFrame,
        frames: &Sender<PlannedFrame>,
        done: &Receiver<RecordedFrame>,
    ) -> Result<bool, ReplayError> {
        let run = run_of(&first);
        let mut next = Some(first);
        while let Some(frame) = next {
            if run_of(&frame) != run {
                self.first = Some(frame);
                return Ok(true);
            }
            if frames.send(frame).is_err() {
                return Ok(false);
            }
            done.try_iter().for_each(drop);
            next = self.excerpt.next()?;
        }
        Ok(true)
    }

    /// The configuration of the run whose frame was read last.
    fn configuration(&self, run_id: u64) -> Result<Configuration, ReplayError> {
        let configuration = self.excerpt.configuration().filter(|configuration| configuration.run_id == run_id);
        configuration.cloned().ok_or_else(|| self.excerpt.no_configuration(run_id))
    }
}

/// What two frames of one pass have in common.
fn run_of(PlannedFrame { frame: RecordedFrame { header, .. }, lap, .. }: &PlannedFrame) -> (u64, u64, u32) {
    (*lap, header.run_id, header.bench_count)
}

/// Frames of a run that may wait to be played: all are as large as its first one.
fn frames_ahead(first: &RecordedFrame) -> usize {
    let frame_bytes = size_of_val(first.handles.as_slice()).max(1);
    (BYTES_AHEAD / frame_bytes).clamp(LEAST_FRAMES_AHEAD, MOST_FRAMES_AHEAD)
}
