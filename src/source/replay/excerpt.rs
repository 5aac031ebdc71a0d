//! The excerpt of a recording that a replay plays: its frames and events in an interval of show time, lap by lap.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use bench_dragon_ipc::{Alert, CommandEvent, FrameHeader};
use crossbeam::channel::{self, Receiver, Sender};

use super::trail::Trail;
use super::{ReplayError, ReplaySettings};
use crate::recording::{
    Configuration, Coverage, FlawedFile, IntervalSearch, Parts, PartsBookmark, PartsReader, Recorded, RecordedFrame,
    TimelinePlace, frames_in_flight,
};

/// Greatest number of events that wait for the first frame of their run.
const MOST_EARLY: usize = 1 << 12;

/// A recorded run: its configuration, and a channel of its frames and events.
#[derive(Debug)]
pub(super) struct RecordedRun {
    pub(super) configuration: Configuration,
    pub(super) handle_count: usize,
    /// Number of finished laps before this run.
    pub(super) lap: u64,
    pub(super) items: Receiver<Planned>,
    /// Returns played frames to the reading thread.
    pub(super) played: Sender<RecordedFrame>,
}

/// A frame or an event of a run, in the recorded order.
#[derive(Debug)]
pub(super) enum Planned {
    Frame(PlannedFrame),
    Alert(Alert),
    Command(CommandEvent),
}

/// A frame to play.
#[derive(Debug)]
pub(super) struct PlannedFrame {
    pub(super) frame: RecordedFrame,
    /// Recorded due time without the cuts before it, as [`Trail`] has it.
    pub(super) due_ns: u64,
    /// Frames that the recorder lost between the last played frame and this one.
    pub(super) missing: u64,
    /// Number of finished laps before this frame.
    pub(super) lap: u64,
}

/// The begin of a reading.
#[derive(Clone, Debug, Default)]
pub(super) struct ReadFrom {
    /// The chunk to begin with; `None` for the begin of the recording.
    pub(super) place: Option<TimelinePlace>,
    /// Log time of the first frame to play. The last frame is played even if it is before that.
    pub(super) log_time_ns: u64,
    /// Number of finished laps.
    pub(super) lap: u64,
}

/// The parts of a recording that could not be read or are missing.
#[derive(Clone, Debug, Default)]
pub(super) struct Findings {
    pub(super) flawed: Vec<FlawedFile>,
    /// `None` where the recording was not read from its begin to its end.
    pub(super) coverage: Option<Coverage>,
}

/// Reads the frames and events whose show time lies in an interval, lap by lap. Frames outside are decompressed and skipped.
/// After the first lap, the reader starts at the interval's first frame and stops at its last chunk.
#[derive(Debug)]
pub(super) struct Excerpt {
    parts: Arc<Parts>,
    search: IntervalSearch,
    is_frames_only: bool,
    /// Number of laps to read; `None`: without end.
    laps: Option<u64>,
    lap: u64,
    reader: PartsReader,
    trail: Trail,
    /// Log time of the first frame to play, until it is found.
    begin_ns: Option<u64>,
    /// The last frame before that time.
    before: Option<RecordedFrame>,
    /// The configuration of that frame's run. The recording may go on with one of another run, without a frame to play.
    configuration_before: Option<Configuration>,
    /// Position of the interval's first frame, and of the chunk with its last frame, as far as a lap from the begin has read.
    bounds: Option<(PartsBookmark, (usize, u64))>,
    /// Whether this lap began with the recording, and is the first such lap.
    is_first_whole_lap: bool,
    has_found: bool,
    findings: Findings,
    /// First frame of the next run. It was read to detect the end of the run before.
    first_of_run: Option<PlannedFrame>,
    /// Events that were recorded before the first frame of their run.
    early: Vec<Planned>,
    /// Whether the receiver needs no more frames.
    abandoned: Arc<AtomicBool>,
}

impl Excerpt {
    pub(super) fn open(
        parts: Arc<Parts>,
        settings: &ReplaySettings,
        from: ReadFrom,
        abandoned: Arc<AtomicBool>,
    ) -> Result<Self, ReplayError> {
        let ReadFrom { place, log_time_ns, lap } = from;
        let reader = match &place {
            Some(place) => PartsReader::open_at(Arc::clone(&parts), place).map_err(ReplayError::Read)?,
            None => PartsReader::new(Arc::clone(&parts)),
        };
        Ok(Self {
            parts,
            search: IntervalSearch::new(settings.interval),
            is_frames_only: settings.is_frames_only,
            laps: settings.laps,
            lap,
            reader,
            trail: Trail::default(),
            begin_ns: place.is_some().then_some(log_time_ns),
            before: None,
            configuration_before: None,
            bounds: None,
            is_first_whole_lap: place.is_none(),
            has_found: false,
            findings: Findings::default(),
            first_of_run: None,
            early: Vec::new(),
            abandoned,
        })
    }

    /// Sends all runs, then the error that ended them. Returns the parts of the recording that could not be read.
    pub(super) fn send_all(mut self, runs: &Sender<Result<RecordedRun, ReplayError>>) -> Findings {
        if let Err(error) = self.send_runs(runs) {
            // Without a receiver the replay has been stopped, and the error is dropped.
            let _ = runs.send(Err(error));
        }
        if self.is_first_whole_lap {
            self.findings.flawed = self.reader.into_flawed();
        }
        self.findings
    }

    fn send_runs(&mut self, runs: &Sender<Result<RecordedRun, ReplayError>>) -> Result<(), ReplayError> {
        self.first_of_run = self.next_frame()?;
        if self.first_of_run.is_none() && self.is_first_whole_lap {
            return Err(self.search.nothing_found(&self.parts.named, self.reader.flaws()).into());
        }
        while let Some(first) = self.first_of_run.take() {
            let in_flight = frames_in_flight(size_of_val(first.frame.handles.as_slice()));
            let (items, items_read) = channel::bounded(in_flight);
            // Capacity for all frames that exist: those in flight, one being read and two being played.
            let (played, done) = channel::bounded(in_flight + 3);
            let FrameHeader { run_id, .. } = first.frame.header;
            let run = RecordedRun {
                configuration: self.configuration(run_id)?,
                handle_count: first.frame.header.handle_count(),
                lap: first.lap,
                items: items_read,
                played,
            };
            if runs.send(Ok(run)).is_err() || !self.send_run(first, &items, &done)? {
                return Ok(());
            }
        }
        Ok(())
    }

    /// Sends the frames and events of a run. Returns whether the receiver took them all.
    fn send_run(
        &mut self,
        first: PlannedFrame,
        items: &Sender<Planned>,
        done: &Receiver<RecordedFrame>,
    ) -> Result<bool, ReplayError> {
        let (run, run_id) = (run_of(&first), first.frame.header.run_id);
        if items.send(Planned::Frame(first)).is_err() {
            return Ok(false);
        }
        let (own, others) = self.early.drain(..).partition(|item| item.run_id() == run_id);
        self.early = others;
        for item in Vec::into_iter(own) {
            if items.send(item).is_err() {
                return Ok(false);
            }
        }
        while let Some(item) = self.next()? {
            match item {
                Planned::Frame(frame) if run_of(&frame) != run => {
                    self.first_of_run = Some(frame);
                    return Ok(true);
                }
                event @ (Planned::Alert(_) | Planned::Command(_)) if event.run_id() != run_id => self.keep_early(event),
                item => {
                    if items.send(item).is_err() {
                        return Ok(false);
                    }
                    done.try_iter().for_each(drop);
                }
            }
        }
        Ok(true)
    }

    fn keep_early(&mut self, event: Planned) {
        if self.early.len() < MOST_EARLY {
            self.early.push(event);
        }
    }

    /// The configuration of the run of the last frame.
    fn configuration(&self, run_id: u64) -> Result<Configuration, ReplayError> {
        let mut known = self.reader.configuration().into_iter().chain(&self.configuration_before);
        let configuration = known.find(|configuration| configuration.run_id == run_id);
        let missing = || ReplayError::NoConfiguration { path: self.parts.named.clone(), run_id };
        configuration.cloned().ok_or_else(missing)
    }

    /// Returns the next frame, and keeps the events before it for its run.
    fn next_frame(&mut self) -> Result<Option<PlannedFrame>, ReplayError> {
        loop {
            match self.next()? {
                Some(Planned::Frame(frame)) => return Ok(Some(frame)),
                Some(event) => self.keep_early(event),
                None => return Ok(None),
            }
        }
    }

    /// Returns the next frame or event; `None` after the last frame of the last lap.
    fn next(&mut self) -> Result<Option<Planned>, ReplayError> {
        loop {
            if let Some(item) = self.next_of_lap()? {
                return Ok(Some(item));
            }
            let has_found = std::mem::take(&mut self.has_found);
            if self.is_first_whole_lap {
                self.findings.coverage = Some(self.reader.coverage());
            }
            self.lap += 1;
            let is_over = self.laps.is_some_and(|laps| self.lap >= laps);
            if is_over || self.is_first_whole_lap && !has_found {
                return Ok(None);
            }
            self.begin_lap()?;
        }
    }

    /// Begins the next lap at the begin of the interval.
    fn begin_lap(&mut self) -> Result<(), ReplayError> {
        let parts = Arc::clone(&self.parts);
        let reader = match &self.bounds {
            Some((first, last)) => PartsReader::open_between(parts, first, *last).map_err(ReplayError::Read)?,
            None => PartsReader::new(parts),
        };
        let read = std::mem::replace(&mut self.reader, reader);
        let was_first = std::mem::replace(&mut self.is_first_whole_lap, self.bounds.is_none());
        if was_first {
            self.findings.flawed = read.into_flawed();
        }
        self.trail = Trail::default();
        self.early.clear();
        Ok(())
    }

    fn next_of_lap(&mut self) -> Result<Option<Planned>, ReplayError> {
        loop {
            let Self { reader, search, trail, abandoned, .. } = self;
            let is_wanted = |header: &FrameHeader| {
                let is_inside = search.comes_by(header.show_time_ns);
                if !is_inside {
                    trail.skip(header);
                }
                // Without a receiver, the search for the interval's first frame must end.
                is_inside || abandoned.load(Ordering::Relaxed)
            };
            let recorded = reader.next_wanted(is_wanted).map_err(ReplayError::Read)?;
            let Some(recorded) = recorded else {
                // A recording that ends before the sought position is played from its last frame on.
                self.begin_ns = None;
                return Ok(self.before.take().map(|frame| self.plan(frame)));
            };
            if let Some(item) = self.take(recorded) {
                return Ok(Some(item));
            }
        }
    }

    fn take(&mut self, recorded: Recorded) -> Option<Planned> {
        let is_wanted = |excerpt: &Self, show_time_ns| {
            !excerpt.is_frames_only && excerpt.begin_ns.is_none() && excerpt.search.contains(show_time_ns)
        };
        match recorded {
            Recorded::Frame(frame) if self.begin_ns.is_some_and(|begin_ns| frame.log_time_ns < begin_ns) => {
                let is_of_run = |configuration: &&Configuration| configuration.run_id == frame.header.run_id;
                if self.configuration_before.as_ref().is_none_or(|known| !is_of_run(&known)) {
                    self.configuration_before = self.reader.configuration().filter(is_of_run).cloned();
                }
                self.before = Some(frame);
                None
            }
            Recorded::Frame(frame) => {
                (self.begin_ns, self.before) = (None, None);
                Some(self.plan(frame))
            }
            Recorded::Alert(recorded) => {
                is_wanted(self, recorded.alert.show_time_ns).then_some(Planned::Alert(recorded.alert))
            }
            Recorded::Command(event) => is_wanted(self, event.show_time_ns).then_some(Planned::Command(event)),
        }
    }

    fn plan(&mut self, frame: RecordedFrame) -> Planned {
        self.has_found = true;
        if self.is_first_whole_lap {
            let (reader, position) = (&self.reader, self.reader.position());
            if let Some(bookmark) = reader.bookmark() {
                self.bounds.get_or_insert((bookmark, position)).1 = position;
            }
        }
        let (due_ns, missing) = self.trail.play(&frame.header);
        Planned::Frame(PlannedFrame { frame, due_ns, missing, lap: self.lap })
    }
}

impl Planned {
    fn run_id(&self) -> u64 {
        match self {
            Self::Frame(planned) => planned.frame.header.run_id,
            Self::Alert(alert) => alert.run_id,
            Self::Command(event) => event.run_id,
        }
    }

    /// The recorded tick of an event; `None` for a frame.
    pub(super) fn tick_of_event(&self) -> Option<u64> {
        match self {
            Self::Frame(_) => None,
            Self::Alert(alert) => Some(alert.tick),
            Self::Command(event) => Some(event.tick),
        }
    }
}

/// Key that is the same for all frames of a pass.
fn run_of(PlannedFrame { frame: RecordedFrame { header, .. }, lap, .. }: &PlannedFrame) -> (u64, u64, u32) {
    (*lap, header.run_id, header.bench_count)
}
