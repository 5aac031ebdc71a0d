//! Reading a recording ahead of its replay, so that a slow disk makes no frame late.
//!
//! A thread reads, decompresses and decodes. Frames wait in a channel of bounded size; those that have been played come
//! back, so that their memory is given up here and not between two frames.

use std::path::{Path, PathBuf};
use std::thread::{self, JoinHandle};

use crossbeam::channel::{self, Receiver, Sender};

use crate::record::{Configuration, FrameReader, ReadError, RecordedFrame};

use super::error::ReplayError;

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
    pub(super) frames: Receiver<RecordedFrame>,
    /// Takes back what has been played.
    pub(super) played: Sender<RecordedFrame>,
}

/// The reading thread. It ends by itself when nobody takes what it reads.
#[derive(Debug)]
pub(super) struct ReadAhead {
    runs: Receiver<Result<RecordedRun, ReplayError>>,
    thread: JoinHandle<FrameReader>,
}

impl ReadAhead {
    /// Opens a recording and begins to read.
    pub(super) fn start(path: &Path) -> Result<Self, ReplayError> {
        let reader = FrameReader::open(path).map_err(ReplayError::Open)?;
        // One run is read ahead of at a time.
        let (sender, runs) = channel::bounded(0);
        let path = path.to_owned();
        let thread = thread::Builder::new()
            .name("replay-read".to_owned())
            .spawn(move || Reading { path, reader, first: None }.send_all(&sender))
            .map_err(ReplayError::Thread)?;
        Ok(Self { runs, thread })
    }

    /// The next recorded run, or `None` at the end of the file.
    pub(super) fn next(&self) -> Result<Option<RecordedRun>, ReplayError> {
        self.runs.recv().ok().transpose()
    }

    /// Ends the thread. Returns the reader, which knows what it could not read.
    pub(super) fn finish(self) -> FrameReader {
        drop(self.runs);
        self.thread.join().expect("the reading thread does not panic")
    }
}

/// What the thread works with.
struct Reading {
    path: PathBuf,
    reader: FrameReader,
    /// The frame by which the next run was recognised.
    first: Option<RecordedFrame>,
}

impl Reading {
    /// Sends run after run, and what ended them. Returns the reader, which knows how the file ended.
    fn send_all(mut self, runs: &Sender<Result<RecordedRun, ReplayError>>) -> FrameReader {
        if let Err(error) = self.send_runs(runs) {
            // Nobody listens any more where the replay was stopped.
            let _ = runs.send(Err(error));
        }
        self.reader
    }

    fn send_runs(&mut self, runs: &Sender<Result<RecordedRun, ReplayError>>) -> Result<(), ReplayError> {
        self.first = self.read()?;
        while let Some(first) = self.first.take() {
            let (frames, frames_read) = channel::bounded(frames_ahead(&first));
            let (played, done) = channel::unbounded();
            let bench_count = first.header.bench_count as usize;
            let configuration = self.configuration(first.header.run_id)?;
            let run = RecordedRun { configuration, bench_count, frames: frames_read, played };
            if runs.send(Ok(run)).is_err() || !self.send_frames(first, &frames, &done)? {
                return Ok(());
            }
        }
        Ok(())
    }

    /// Sends the frames of a run. Returns whether somebody took them all.
    fn send_frames(
        &mut self,
        first: RecordedFrame,
        frames: &Sender<RecordedFrame>,
        done: &Receiver<RecordedFrame>,
    ) -> Result<bool, ReplayError> {
        let (run_id, bench_count) = (first.header.run_id, first.header.bench_count);
        let mut next = Some(first);
        while let Some(frame) = next {
            if (frame.header.run_id, frame.header.bench_count) != (run_id, bench_count) {
                self.first = Some(frame);
                return Ok(true);
            }
            if frames.send(frame).is_err() {
                return Ok(false);
            }
            done.try_iter().for_each(drop);
            next = self.read()?;
        }
        Ok(true)
    }

    fn read(&mut self) -> Result<Option<RecordedFrame>, ReplayError> {
        self.reader.next().transpose().map_err(|error: ReadError| ReplayError::Read(error))
    }

    /// The configuration of the run whose frame was read last.
    fn configuration(&self, run_id: u64) -> Result<Configuration, ReplayError> {
        let configuration = self.reader.configuration().filter(|configuration| configuration.run_id == run_id);
        configuration.cloned().ok_or_else(|| ReplayError::NoConfiguration { path: self.path.clone(), run_id })
    }
}

/// Frames of a run that may wait to be played: all are as large as its first one.
fn frames_ahead(first: &RecordedFrame) -> usize {
    let frame_bytes = size_of_val(first.handles.as_slice()).max(1);
    (BYTES_AHEAD / frame_bytes).clamp(LEAST_FRAMES_AHEAD, MOST_FRAMES_AHEAD)
}
