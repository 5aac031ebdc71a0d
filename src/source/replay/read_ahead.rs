//! Reading of frames ahead of the replay, lap by lap, so that a slow disk delays no frame.
//!
//! A thread reads, decompresses and decodes. Frames wait in a bounded channel. Played frames come back to the thread,
//! which frees their memory; so the replay does not free memory between two frames.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use bench_dragon_ipc::FrameHeader;
use crossbeam::channel::{self, Receiver, RecvTimeoutError, Sender};

use super::{ReplayError, ReplaySettings};
use crate::recording::{Bookmark, Configuration, Flaws, FrameReader, IntervalSearch, RecordedFrame, frames_in_flight};

/// A recorded run: its configuration, and a channel of its frames.
#[derive(Debug)]
pub(super) struct RecordedRun {
    pub(super) configuration: Configuration,
    pub(super) bench_count: usize,
    /// Number of finished laps before this run.
    pub(super) lap: u64,
    pub(super) frames: Receiver<PlannedFrame>,
    /// Returns played frames to the reading thread.
    pub(super) played: Sender<RecordedFrame>,
}

/// A frame to play.
#[derive(Debug)]
pub(super) struct PlannedFrame {
    pub(super) frame: RecordedFrame,
    /// Recorded due time, minus the length of all cuts before it. Across a cut, the distance from the played frame
    /// before it is the frame's recorded distance from its predecessor.
    pub(super) due_ns: u64,
    /// Frames that the recorder lost between the last played frame and this one.
    pub(super) missing: u64,
    /// Number of finished laps before this frame.
    pub(super) lap: u64,
}

/// The reading thread. It ends when the receiving ends of its channels are dropped.
#[derive(Debug)]
pub(super) struct ReadAhead {
    runs: Receiver<Result<RecordedRun, ReplayError>>,
    abandoned: Arc<AtomicBool>,
    thread: JoinHandle<Flaws>,
}

impl ReadAhead {
    pub(super) fn start(settings: &ReplaySettings) -> Result<Self, ReplayError> {
        let abandoned = Arc::new(AtomicBool::new(false));
        let excerpt = Excerpt::open(settings, Arc::clone(&abandoned))?;
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

    /// Ends the thread. Returns the parts of the file that could not be read.
    pub(super) fn finish(self) -> Flaws {
        self.abandoned.store(true, Ordering::Relaxed);
        drop(self.runs);
        self.thread.join().expect("the reading thread does not panic")
    }
}

/// Reads the frames whose show time lies in an interval, lap by lap. Frames outside are decompressed and skipped. After
/// the first lap, the reader starts at the interval's first frame and stops at its last chunk.
#[derive(Debug)]
struct Excerpt {
    path: PathBuf,
    search: IntervalSearch,
    /// Number of laps to read; `None`: without end.
    laps: Option<u64>,
    lap: u64,
    reader: FrameReader,
    trail: Trail,
    /// Position of the interval's first frame, and of the chunk with its last frame, as far as the first lap has read.
    bounds: Option<(Bookmark, u64)>,
    flaws: Flaws,
    /// First frame of the next run. It was read to detect the end of the run before.
    first_of_run: Option<PlannedFrame>,
    /// Whether the receiver needs no more frames.
    abandoned: Arc<AtomicBool>,
}

/// The frames of a lap so far, by their headers.
#[derive(Clone, Copy, Debug, Default)]
struct Trail {
    last_played: Option<FrameHeader>,
    /// The last frame read, played or not.
    last: Option<FrameHeader>,
    cut_ns: u64,
}

impl Excerpt {
    fn open(settings: &ReplaySettings, abandoned: Arc<AtomicBool>) -> Result<Self, ReplayError> {
        let ReplaySettings { file, interval, laps, .. } = settings;
        Ok(Self {
            path: file.clone(),
            search: IntervalSearch::new(*interval),
            laps: *laps,
            lap: 0,
            reader: FrameReader::open(file).map_err(ReplayError::Open)?,
            trail: Trail::default(),
            bounds: None,
            flaws: Flaws::default(),
            first_of_run: None,
            abandoned,
        })
    }

    /// Sends all runs, then the error that ended them. Returns the parts of the file that could not be read.
    fn send_all(mut self, runs: &Sender<Result<RecordedRun, ReplayError>>) -> Flaws {
        if let Err(error) = self.send_runs(runs) {
            // Without a receiver the replay has been stopped, and the error is dropped.
            let _ = runs.send(Err(error));
        }
        self.note_flaws();
        self.flaws
    }

    fn send_runs(&mut self, runs: &Sender<Result<RecordedRun, ReplayError>>) -> Result<(), ReplayError> {
        self.first_of_run = self.next()?;
        if self.first_of_run.is_none() {
            return Err(self.search.nothing_found(&self.path, self.flaws).into());
        }
        while let Some(first) = self.first_of_run.take() {
            let in_flight = frames_in_flight(size_of_val(first.frame.handles.as_slice()));
            let (frames, frames_read) = channel::bounded(in_flight);
            // Capacity for all frames that exist: those in flight, one being read and one being played.
            let (played, done) = channel::bounded(in_flight + 2);
            let FrameHeader { run_id, bench_count, .. } = first.frame.header;
            let run = RecordedRun {
                configuration: self.configuration(run_id)?,
                bench_count: bench_count as usize,
                lap: first.lap,
                frames: frames_read,
                played,
            };
            if runs.send(Ok(run)).is_err() || !self.send_frames(first, &frames, &done)? {
                return Ok(());
            }
        }
        Ok(())
    }

    /// Sends the frames of a run. Returns whether the receiver took them all.
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
                self.first_of_run = Some(frame);
                return Ok(true);
            }
            if frames.send(frame).is_err() {
                return Ok(false);
            }
            done.try_iter().for_each(drop);
            next = self.next()?;
        }
        Ok(true)
    }

    /// The configuration of the run of the last frame.
    fn configuration(&self, run_id: u64) -> Result<Configuration, ReplayError> {
        let configuration = self.reader.configuration().filter(|configuration| configuration.run_id == run_id);
        configuration.cloned().ok_or_else(|| ReplayError::NoConfiguration { path: self.path.clone(), run_id })
    }

    /// Returns the next frame; `None` after the last frame of the last lap.
    fn next(&mut self) -> Result<Option<PlannedFrame>, ReplayError> {
        loop {
            if let Some(frame) = self.next_of_lap()? {
                return Ok(Some(frame));
            }
            self.note_flaws();
            let Some((first, last)) = &self.bounds else { return Ok(None) };
            self.lap += 1;
            if self.laps.is_some_and(|laps| self.lap >= laps) {
                return Ok(None);
            }
            self.reader = FrameReader::open_between(&self.path, first, *last).map_err(ReplayError::Read)?;
            self.trail = Trail::default();
        }
    }

    fn next_of_lap(&mut self) -> Result<Option<PlannedFrame>, ReplayError> {
        let Self { reader, search, trail, abandoned, .. } = self;
        let is_wanted = |header: &FrameHeader| {
            let is_inside = search.comes_by(header.sim_time_ns);
            if !is_inside {
                trail.last = Some(*header);
            }
            // Without a receiver, the search for the interval's first frame must end.
            is_inside || abandoned.load(Ordering::Relaxed)
        };
        let frame = reader.next_wanted_frame(is_wanted).map_err(ReplayError::Read)?;
        let Some(frame) = frame else { return Ok(None) };
        if self.lap == 0 {
            let (reader, position) = (&self.reader, self.reader.position());
            self.bounds.get_or_insert_with(|| (reader.bookmark(), position)).1 = position;
        }
        let (due_ns, missing) = self.trail.play(&frame.header);
        Ok(Some(PlannedFrame { frame, due_ns, missing, lap: self.lap }))
    }

    fn note_flaws(&mut self) {
        if self.lap == 0 {
            self.flaws = self.reader.flaws();
        }
    }
}

impl Trail {
    /// Adds a frame to play. Returns its due time without cuts, and the number of missing frames before it.
    fn play(&mut self, header: &FrameHeader) -> (u64, u64) {
        let mut missing = 0;
        if let (Some(played), Some(last)) = (self.last_played, self.last) {
            let same_run = last.run_id == header.run_id;
            if last == played {
                missing = if same_run { header.tick.saturating_sub(last.tick).saturating_sub(1) } else { 0 };
            } else {
                self.cut_ns = self.cut_ns.saturating_add(last.scheduled_ns.saturating_sub(played.scheduled_ns));
            }
        }
        (self.last_played, self.last) = (Some(*header), Some(*header));
        (header.scheduled_ns.saturating_sub(self.cut_ns), missing)
    }
}

/// Key that is the same for all frames of a pass.
fn run_of(PlannedFrame { frame: RecordedFrame { header, .. }, lap, .. }: &PlannedFrame) -> (u64, u64, u32) {
    (*lap, header.run_id, header.bench_count)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(tick: u64, scheduled_ns: u64) -> FrameHeader {
        FrameHeader { run_id: 7, tick, scheduled_ns, ..FrameHeader::default() }
    }

    #[test]
    fn a_cut_takes_as_long_as_one_frame() {
        let mut trail = Trail::default();
        assert_eq!(trail.play(&header(5, 500)), (500, 0));
        assert_eq!(trail.play(&header(6, 600)), (600, 0));
        trail.last = Some(header(90, 9_000));
        assert_eq!(trail.play(&header(91, 9_110)), (710, 0), "110 ns after the frame before, as recorded");
        assert_eq!(trail.play(&header(92, 9_210)), (810, 0));
    }

    #[test]
    fn lost_frames_are_counted_and_cut_frames_are_not() {
        let mut trail = Trail { last: Some(header(3, 300)), ..Trail::default() };
        assert_eq!(trail.play(&header(5, 500)), (500, 0));
        assert_eq!(trail.play(&header(9, 900)), (900, 3));
        trail.last = Some(header(20, 2_000));
        assert_eq!(trail.play(&header(23, 2_300)).1, 0, "the lost frames may have been outside of the interval");
    }
}
