//! Replay: a recording back onto the bus, as a source like the server.
//!
//! **What is replayed.** Every frame of a recording whose show time lies in an interval, in the recorded order, at the
//! recorded pace or faster or slower by a factor, once or several times. Each recorded run is a *pass*, each time: it has
//! a new `run_id`, its ticks count from 0 without a hole, and `scheduled_ns` and `published_ns` are those of the replay;
//! `time_scale` is multiplied by the factor, since a reader that looks ahead on its own clock needs show seconds per
//! second; all else is bit for bit what was recorded. Its description is published before its first frame. Where the
//! recorder lost frames, so does the replay; how many is in [`PassSummary::missing`], and to a reader the head was put
//! across. So it was where frames outside of the interval are cut out.
//!
//! **What is not.** Alerts: a monitor of the replay makes its own, of the same frames.
//!
//! **Who waits.** The file is read ahead on a thread of its own, into a bounded channel. A frame that comes too late is
//! sent at once, and those behind it are put off by as much ([`pace`]). Nothing waits for a reader.
//!
//! **What clients may ask.** To stop; whatever else is refused with [`Refusal::Replayed`](bench_dragon_ipc::Refusal).
//!
//! **A damaged file** is played without what is damaged, one without its end as far as it goes; [`Replay::finish`] tells.

pub mod pace;

mod error;
mod excerpt;
mod read_ahead;

use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use bench_dragon_ipc::{BusError, Domain, FrameHeader, Refusal, Request, SourceLock};
use crossbeam::channel::RecvTimeoutError;
use serde::{Deserialize, Serialize};

use crate::clock::{monotonic_ns, sleep_precisely, sleep_until};
use crate::histogram::Percentiles;
use crate::record::ShowInterval;
use crate::source::{Stage, TimesOfAll};

pub use error::ReplayError;

use excerpt::{Flaws, PlannedFrame};
use pace::Pace;
use read_ahead::{ReadAhead, RecordedRun};

/// Recorded seconds that may be played per second.
pub const RATE: RangeInclusive<f64> = 0.01..=100.0;

/// How often commands are looked for where frames are further apart.
const COMMAND_PERIOD: Duration = Duration::from_millis(10);
/// How long a replay waits for the readers that it was told to expect.
const READER_PATIENCE: Duration = Duration::from_secs(10);

/// What a replay is started with.
#[derive(Clone, Debug, PartialEq)]
pub struct ReplaySettings {
    /// The recording.
    pub file: PathBuf,
    /// Which frames.
    pub interval: ShowInterval,
    /// Recorded seconds per second, in [`RATE`].
    pub rate: f64,
    /// How often to play it; without a number, until it is stopped.
    pub laps: Option<u64>,
    /// Readers to wait for before the first frame, for ten seconds at most.
    pub readers: usize,
}

/// What a pass came to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PassSummary {
    /// The run that it was on the bus.
    pub run_id: u64,
    /// The run that was recorded.
    pub recorded_run_id: u64,
    /// Frames published.
    pub frames: u64,
    /// Frames between the first and the last one that the recorder had lost.
    pub missing: u64,
    /// Show time of the last one, in seconds.
    pub sim_time_s: f64,
    /// How often a frame came too late, and all behind it were put off.
    pub overruns: u64,
    /// From the instant each frame was due to the start of its tick, in microseconds.
    pub lateness_us: Percentiles,
    /// From the start of each tick until the loop was ready for the next one, in microseconds.
    pub tick_us: Percentiles,
}

/// What a replay came to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReplaySummary {
    /// Runs played: each recorded run, as often as it was played.
    pub passes: u64,
    /// Frames published in all.
    pub frames: u64,
    /// Whether what was read of the file stopped in the middle, as a killed recorder leaves it.
    pub cut: bool,
    /// Bytes of damaged chunks that were passed over.
    pub skipped_bytes: u64,
}

/// A replay: an iterator of passes, as it were, each of which is played before the next.
#[derive(Debug)]
pub struct Replay {
    domain: Domain,
    settings: ReplaySettings,
    read_ahead: ReadAhead,
    pace: Pace,
    /// How often the recording has been begun again.
    lap: u64,
    summary: ReplaySummary,
    is_stopped: bool,
    // Given up last.
    _lock: SourceLock,
}

impl Replay {
    /// Opens the recording and takes the instance.
    ///
    /// # Errors
    /// [`ReplayError::Open`] where the file is no recording, [`BusError::SourceRunning`] where a source runs on the
    /// instance.
    pub fn open(domain: &Domain, settings: ReplaySettings) -> Result<Self, ReplayError> {
        let read_ahead = ReadAhead::start(&settings)?;
        let lock = SourceLock::take(domain)?;
        for path in lock.cleared() {
            tracing::warn!("removed {}, which a killed server had left half made", path.display());
        }
        Ok(Self {
            domain: domain.clone(),
            pace: Pace::new(settings.rate),
            settings,
            read_ahead,
            lap: 0,
            summary: ReplaySummary::default(),
            is_stopped: false,
            _lock: lock,
        })
    }

    /// Puts the services and the description of the next pass on the bus; `None` where there is none, or the replay was
    /// stopped, by a client or by `stop`.
    ///
    /// # Errors
    /// [`ReplayError::Read`], [`ReplayError::NoFrames`], [`ReplayError::NothingThere`], [`ReplayError::NoConfiguration`] and
    /// what is wrong with the bus.
    pub fn next_pass(&mut self, stop: &AtomicBool) -> Result<Option<Pass<'_>>, ReplayError> {
        let Some(run) = self.next_run(stop)? else { return Ok(None) };
        let stage = Stage::open(&self.domain, "replay", &run.configuration.toml, run.bench_count)?;
        if run.lap != self.lap {
            self.lap = run.lap;
            self.pace.begin_lap();
        }
        self.summary.passes += 1;
        let progress = Progress { tick: 0, sim_time_s: 0.0, missing: 0, overruns_before: self.pace.overruns() };
        Ok(Some(Pass { replay: self, run, stage, progress }))
    }

    /// Ends the replay.
    pub fn finish(self) -> ReplaySummary {
        let Flaws { cut, skipped_bytes } = self.read_ahead.finish();
        ReplaySummary { cut, skipped_bytes, ..self.summary }
    }

    /// Waits for the next run to be found in the file.
    fn next_run(&self, stop: &AtomicBool) -> Result<Option<RecordedRun>, ReplayError> {
        while !self.is_stopped && !stop.load(Ordering::Relaxed) {
            if let Ok(run) = self.read_ahead.next(COMMAND_PERIOD) {
                return run;
            }
        }
        Ok(None)
    }
}

/// A recorded run that is on the bus, and about to be played.
#[derive(Debug)]
pub struct Pass<'a> {
    replay: &'a mut Replay,
    run: RecordedRun,
    stage: Stage,
    progress: Progress,
}

/// How far a pass has been played.
#[derive(Debug)]
struct Progress {
    /// The next tick.
    tick: u64,
    /// Show time of the last frame.
    sim_time_s: f64,
    missing: u64,
    overruns_before: u64,
}

/// That a signal or a client has asked for the end.
#[derive(Debug)]
struct Stopped;

impl Pass<'_> {
    /// The number of the run that it is on the bus.
    pub fn run_id(&self) -> u64 {
        self.stage.run_id()
    }

    /// The number of the run that was recorded.
    pub fn recorded_run_id(&self) -> u64 {
        self.run.configuration.run_id
    }

    /// Publishes frame after frame until the recorded run ends, `stop` is set, or a client asks for it.
    ///
    /// # Errors
    /// [`BusError::Failed`] where a frame cannot be published.
    pub fn play(mut self, stop: &AtomicBool) -> Result<PassSummary, BusError> {
        sleep_precisely();
        self.replay.is_stopped = self.wait_for_readers(stop).is_err();
        while !self.replay.is_stopped {
            match self.next_frame(stop) {
                Ok(Some(frame)) => self.play_frame(frame, stop)?,
                Ok(None) => break,
                Err(Stopped) => self.replay.is_stopped = true,
            }
        }
        Ok(self.into_summary())
    }

    /// Publishes a frame when it is due.
    fn play_frame(
        &mut self,
        PlannedFrame { frame, due_ns, missing, .. }: PlannedFrame,
        stop: &AtomicBool,
    ) -> Result<(), BusError> {
        let due_ns = self.replay.pace.due_ns(due_ns, monotonic_ns());
        if let Err(Stopped) = self.wait_until(due_ns, stop) {
            self.replay.is_stopped = true;
            return Ok(());
        }
        let begun_ns = monotonic_ns();
        let header = FrameHeader { time_scale: frame.header.time_scale * self.replay.settings.rate, ..frame.header };
        let tick = self.progress.tick;
        self.stage.publish(&header, &frame.handles, tick, due_ns)?;
        self.progress.take(&header, missing);
        let overruns = self.overruns();
        self.stage.report().tell(&FrameHeader { tick, ..header }, overruns);
        // The reading thread is gone where it has read all: then the frame is given up here.
        let _ = self.run.played.send(frame);
        self.stage.report().count(begun_ns - due_ns, monotonic_ns() - begun_ns);
        Ok(())
    }

    /// The next frame, as soon as it has been read; `None` where the recorded run ends.
    fn next_frame(&self, stop: &AtomicBool) -> Result<Option<PlannedFrame>, Stopped> {
        loop {
            match self.run.frames.recv_timeout(COMMAND_PERIOD) {
                Ok(frame) => return Ok(Some(frame)),
                Err(RecvTimeoutError::Disconnected) => return Ok(None),
                Err(RecvTimeoutError::Timeout) => self.look_for_stop(stop)?,
            }
        }
    }

    fn wait_until(&self, due_ns: u64, stop: &AtomicBool) -> Result<(), Stopped> {
        self.look_for_stop(stop)?;
        loop {
            let now_ns = monotonic_ns();
            if now_ns >= due_ns {
                return Ok(());
            }
            let is_far = due_ns - now_ns > COMMAND_PERIOD.as_nanos() as u64;
            sleep_until(if is_far { now_ns + COMMAND_PERIOD.as_nanos() as u64 } else { due_ns });
            if is_far || stop.load(Ordering::Relaxed) {
                self.look_for_stop(stop)?;
            }
        }
    }

    /// Answers the commands that have come.
    fn look_for_stop(&self, stop: &AtomicBool) -> Result<(), Stopped> {
        let mut asked_to_stop = false;
        self.stage.take_commands(self.progress.tick, |request| match request {
            Request::Stop => {
                asked_to_stop = true;
                Ok(())
            }
            _ => Err(Refusal::Replayed),
        });
        if asked_to_stop || stop.load(Ordering::Relaxed) { Err(Stopped) } else { Ok(()) }
    }

    fn wait_for_readers(&self, stop: &AtomicBool) -> Result<(), Stopped> {
        const LOOK_PERIOD: Duration = Duration::from_millis(1);
        let is_first = self.replay.summary.passes == 1;
        let expected = if is_first { self.replay.settings.readers } else { 0 };
        let deadline = Instant::now() + READER_PATIENCE;
        while self.stage.reader_count() < expected {
            if Instant::now() >= deadline {
                tracing::warn!("starting with {} of {expected} readers", self.stage.reader_count());
                return Ok(());
            }
            self.look_for_stop(stop)?;
            std::thread::sleep(LOOK_PERIOD);
        }
        Ok(())
    }

    fn overruns(&self) -> u64 {
        self.replay.pace.overruns() - self.progress.overruns_before
    }

    fn into_summary(self) -> PassSummary {
        let (run_id, recorded_run_id, overruns) = (self.run_id(), self.recorded_run_id(), self.overruns());
        let Progress { tick: frames, sim_time_s, missing, .. } = self.progress;
        self.replay.summary.frames += frames;
        let TimesOfAll { lateness_us, tick_us } = self.stage.finish();
        PassSummary { run_id, recorded_run_id, frames, missing, sim_time_s, overruns, lateness_us, tick_us }
    }
}

impl Progress {
    fn take(&mut self, recorded: &FrameHeader, missing: u64) {
        self.missing = self.missing.saturating_add(missing);
        self.sim_time_s = recorded.sim_time_s();
        self.tick += 1;
    }
}
