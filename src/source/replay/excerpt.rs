//! The frames of a recording that are to be played, once or again and again.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use bench_dragon_ipc::FrameHeader;

use super::error::ReplayError;
use crate::recording::{
    Bookmark, Configuration, Flaws, FrameReader, IntervalSearch, ReadError, RecordedFrame, ShowInterval,
};

/// A frame that is to be played.
#[derive(Debug)]
pub(super) struct PlannedFrame {
    pub(super) frame: RecordedFrame,
    /// When it was due, with what is not played cut out: the frame behind a cut comes as long after the one before the cut
    /// as it came after the frame that it followed.
    pub(super) due_ns: u64,
    /// Frames that the recorder lost between the frame played before and this one.
    pub(super) missing: u64,
    /// How often the recording was begun again before.
    pub(super) lap: u64,
}

/// Reads the frames whose show time lies in an interval, lap after lap. What lies outside is passed over, which takes as
/// long as it takes to unpack it; after the first lap, only where it lies between frames of the interval.
#[derive(Debug)]
pub(super) struct Excerpt {
    path: PathBuf,
    search: IntervalSearch,
    /// Laps to read; without a number, for ever.
    laps: Option<u64>,
    lap: u64,
    reader: FrameReader,
    trail: Trail,
    /// Where the first and the last frame of the interval lie, as far as the first lap has come.
    bounds: Option<Bounds>,
    /// How the first lap ended.
    flaws: Flaws,
    /// That nobody wants any more frames.
    abandoned: Arc<AtomicBool>,
}

#[derive(Debug)]
struct Bounds {
    first: Bookmark,
    /// Where the chunk of the last frame begins.
    last: u64,
}

/// The frames of a lap so far, by their headers.
#[derive(Clone, Copy, Debug, Default)]
struct Trail {
    last_played: Option<FrameHeader>,
    /// The frame before, played or not.
    last: Option<FrameHeader>,
    cut_ns: u64,
}

impl Excerpt {
    /// Opens a recording.
    ///
    /// # Errors
    /// [`ReadError`], where it is none.
    pub(super) fn open(
        path: &Path,
        interval: ShowInterval,
        laps: Option<u64>,
        abandoned: Arc<AtomicBool>,
    ) -> Result<Self, ReadError> {
        Ok(Self {
            path: path.to_owned(),
            search: IntervalSearch::new(interval),
            laps,
            lap: 0,
            reader: FrameReader::open(path)?,
            trail: Trail::default(),
            bounds: None,
            flaws: Flaws::default(),
            abandoned,
        })
    }

    /// The next frame; `None` behind the last one of the last lap.
    pub(super) fn next(&mut self) -> Result<Option<PlannedFrame>, ReplayError> {
        loop {
            if let Some(frame) = self.next_of_lap()? {
                return Ok(Some(frame));
            }
            self.note_flaws();
            let Some(Bounds { first, last }) = &self.bounds else { return Ok(None) };
            self.lap += 1;
            if self.laps.is_some_and(|laps| self.lap >= laps) {
                return Ok(None);
            }
            self.reader = FrameReader::open_between(&self.path, first, *last).map_err(ReplayError::Read)?;
            self.trail = Trail::default();
        }
    }

    /// The configuration of the frame that was read last.
    pub(super) fn configuration(&self) -> Option<&Configuration> {
        self.reader.configuration()
    }

    /// What could not be read.
    pub(super) fn flaws(mut self) -> Flaws {
        self.note_flaws();
        self.flaws
    }

    /// That frames of a run have no configuration.
    pub(super) fn no_configuration(&self, run_id: u64) -> ReplayError {
        ReplayError::NoConfiguration { path: self.path.clone(), run_id }
    }

    /// Why there is no frame at all.
    pub(super) fn nothing(&self) -> ReplayError {
        self.search.nothing_found(&self.path, self.flaws).into()
    }

    fn next_of_lap(&mut self) -> Result<Option<PlannedFrame>, ReplayError> {
        let Self { reader, search, trail, abandoned, .. } = self;
        let is_wanted = |header: &FrameHeader| {
            let is_inside = search.comes_by(header.sim_time_ns);
            if !is_inside {
                trail.last = Some(*header);
            }
            // Whoever has given up need not wait for the interval to begin.
            is_inside || abandoned.load(Ordering::Relaxed)
        };
        let frame = reader.next_wanted_frame(is_wanted).map_err(ReplayError::Read)?;
        let Some(frame) = frame else { return Ok(None) };
        if self.lap == 0 {
            let (reader, position) = (&self.reader, self.reader.position());
            self.bounds.get_or_insert_with(|| Bounds { first: reader.bookmark(), last: position }).last = position;
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
    /// Takes a frame that is to be played. Returns when it is due and how many are missing before it.
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
        assert_eq!(trail.play(&header(91, 9_110)), (710, 0), "110 after the frame before, as it was recorded");
        assert_eq!(trail.play(&header(92, 9_210)), (810, 0));
    }

    #[test]
    fn frames_that_the_recorder_lost_are_counted_and_those_that_are_cut_out_are_not() {
        let mut trail = Trail { last: Some(header(3, 300)), ..Trail::default() };
        assert_eq!(trail.play(&header(5, 500)), (500, 0));
        assert_eq!(trail.play(&header(9, 900)), (900, 3));
        trail.last = Some(header(20, 2_000));
        assert_eq!(trail.play(&header(23, 2_300)).1, 0, "whether they were to be played is not known");
    }
}
