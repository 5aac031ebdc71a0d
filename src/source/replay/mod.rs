//! Replay: publishes a recording on the bus, as a source like the server.
//!
//! **Frames.** A replay publishes every frame whose show time lies in an interval, in the recorded order, once or
//! several times. The pace is the recorded one times a factor. Each replay of a recorded run is a *pass*.
//!
//! - A pass has a new `run_id`. Its description is published before its first frame.
//! - Its ticks count from 0 without a gap. `scheduled_ns` and `published_ns` are those of the replay.
//! - `time_scale` is multiplied by the factor, since a reader that extrapolates on its own clock needs show seconds per
//!   second. While the replay catches up, it is a tenth higher.
//! - All other values are bit for bit as recorded.
//!
//! **Gaps.** Frames that the recorder lost are missing in the replay too; [`PassSummary::missing`] counts them. A
//! reader sees the gap as a reposition of the head, unless the head could have walked there in the elapsed time. The
//! same applies where frames outside of the interval are cut out. A gap takes at most a second of recorded time.
//!
//! **Alerts and commands** are published after the frames after which they were recorded, with the run and the ticks of the
//! pass. The start and the end of the recorded run are left out: the record of a replay is no complete record of a run.
//!
//! **Waiting.** A thread reads the recording ahead into a bounded channel. A late frame is sent at once. The frames behind
//! it follow a tenth faster until the replay is on time again ([`PlaybackClock`]). The replay never waits for a slow
//! reader.
//!
//! **Commands.** Clients may pause a replay, resume it, seek in it, change its pace, and stop it. Any other command is refused
//! with [`Refusal::Replayed`](bench_dragon_ipc::Refusal). These commands are answered, but they are not part of the record.
//!
//! - A paused replay repeats its last frame as a standing one: state paused, all speeds 0. At the end of the recording, a
//!   replay that stays does the same with the state finished.
//! - A seek takes a position: wall time since the first frame of the recording. Within a recorded run it is what a seek of a
//!   server is: the ticks go on, and the head jumps. In another recorded run, another pass begins.
//!
//! **Verification** ([`verify`](mod@verify)) publishes nothing: it simulates a recorded run again and compares it with
//! its frames.
//!
//! **Damaged files.** The replay skips damaged parts, and plays a file without its end up to the last readable frame.
//! [`ReplaySummary::flaws`] reports both.

mod excerpt;
mod outlets;
mod pass;
mod playback_clock;
mod read_ahead;
mod steering;
mod trail;
pub mod verify;

use std::io;
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use bench_dragon_ipc::source::SourceLock;
use bench_dragon_ipc::{BusError, Domain, SourceKind};
use serde::{Deserialize, Serialize};

use crate::config::RATE_HZ;
use crate::recording::{Coverage, FlawedFile, Flaws, NothingFound, Parts, ReadError, ShowInterval, Timeline};
use crate::source::{ExpectedReaders, SourcePorts, described_rate_hz, take_instance};

pub(crate) use pass::Pass;
pub use pass::PassSummary;
pub use playback_clock::PlaybackClock;

use excerpt::{Findings, ReadFrom, RecordedRun};
use read_ahead::ReadAhead;
use steering::Steering;

/// Allowed rates, in recorded seconds per second.
pub const RATE: RangeInclusive<f64> = 0.01..=100.0;
/// Greatest frame rate of a run on a bus: that of the fastest server, replayed at the greatest rate.
pub const FASTEST_HZ: u32 = *RATE_HZ.end() * *RATE.end() as u32;

/// Period at which a replay takes commands if frames are further apart.
const COMMAND_PERIOD: Duration = Duration::from_millis(10);

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ReplaySettings {
    pub(crate) parts: Parts,
    pub(crate) interval: ShowInterval,
    /// Recorded seconds per second, in [`RATE`].
    pub(crate) rate: f64,
    /// Number of laps; `None`: until it is stopped.
    pub(crate) laps: Option<u64>,
    /// The readers to wait for before the first frame.
    pub(crate) readers: ExpectedReaders,
    /// Whether alerts and commands are left out.
    pub(crate) is_frames_only: bool,
    /// Whether the replay begins paused.
    pub(crate) is_paused: bool,
    /// Whether the replay stands at the end of the recording until it is stopped.
    pub(crate) stays: bool,
}

/// Results of a replay.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReplaySummary {
    /// Passes played: each recorded run counts once a lap.
    pub passes: u64,
    /// Frames published in all passes.
    pub frames: u64,
    /// Parts of the recording that could not be read.
    #[serde(flatten)]
    pub flaws: Flaws,
}

/// A replay: a sequence of passes, each of which is played before the next.
#[derive(Debug)]
pub(crate) struct Replay {
    domain: Domain,
    settings: ReplaySettings,
    parts: Arc<Parts>,
    timeline: Timeline,
    /// `None` only while it is replaced.
    read_ahead: Option<ReadAhead>,
    /// The run after a seek into another run.
    sought_run: Option<RecordedRun>,
    findings: ReplayFindings,
    clock: PlaybackClock,
    steering: Steering,
    /// Number of finished laps.
    lap: u64,
    summary: ReplaySummary,
    // Dropped last.
    _lock: SourceLock,
}

impl Replay {
    /// Opens the recording and takes the instance. No other source may run on it.
    pub(crate) fn open(domain: &Domain, settings: ReplaySettings) -> Result<Self, ReplayError> {
        let parts = Arc::new(settings.parts.clone());
        let timeline = Timeline::of(&parts).map_err(ReplayError::Read)?;
        let read_ahead = Some(ReadAhead::start(&parts, &settings, ReadFrom::default())?);
        let lock = take_instance(domain)?;
        Ok(Self {
            domain: domain.clone(),
            clock: PlaybackClock::new(settings.rate),
            steering: Steering::new(settings.is_paused, settings.rate),
            settings,
            parts,
            timeline,
            read_ahead,
            sought_run: None,
            findings: ReplayFindings::default(),
            lap: 0,
            summary: ReplaySummary::default(),
            _lock: lock,
        })
    }

    /// Publishes the services and the description of the next pass. Returns `None` after the last pass, or where a
    /// client or `stop` has stopped the replay.
    pub(crate) fn next_pass(&mut self, stop: &AtomicBool) -> Result<Option<Pass<'_>>, ReplayError> {
        let Some(run) = self.next_run(stop)? else { return Ok(None) };
        let toml = &run.configuration.toml;
        let rate_hz = published_rate_hz(described_rate_hz(toml), self.steering.pace);
        let ports = SourcePorts::open(&self.domain, SourceKind::Replay, toml, run.handle_count, rate_hz)?;
        if run.lap != self.lap {
            self.lap = run.lap;
            self.clock.begin_lap();
        }
        self.summary.passes += 1;
        Ok(Some(Pass::new(self, run, ports, rate_hz)?))
    }

    pub(crate) fn finish(mut self) -> (ReplaySummary, ReplayFindings) {
        self.end_reading();
        let flaws = self.findings.flawed.iter().fold(Flaws::default(), |all, file| all.and(file.flaws));
        (ReplaySummary { flaws, ..self.summary }, self.findings)
    }

    /// Waits until the next run has been read from the recording.
    fn next_run(&mut self, stop: &AtomicBool) -> Result<Option<RecordedRun>, ReplayError> {
        if let Some(run) = self.sought_run.take() {
            return Ok(Some(run));
        }
        while !self.steering.is_stopped && !stop.load(Ordering::Relaxed) {
            let Some(read_ahead) = &self.read_ahead else { return Ok(None) };
            if let Some(run) = read_ahead.next(COMMAND_PERIOD) {
                return run;
            }
        }
        Ok(None)
    }

    /// Reads from a position on, and returns the run there; `None` if the replay is stopped. Beyond the last frame to play, it is
    /// the run of that frame: then the reading begins ever earlier. The receiver of the present run must be dropped before.
    fn run_at(&mut self, position_ns: u64, stop: &AtomicBool) -> Result<Option<RecordedRun>, ReplayError> {
        let mut back = 0;
        loop {
            self.read_from(position_ns, back)?;
            let run = self.next_run(stop)?;
            let is_stopped = self.steering.is_stopped || stop.load(Ordering::Relaxed);
            if run.is_some() || is_stopped || back >= self.timeline.chunks() {
                return Ok(run);
            }
            // Doubled, so that the whole search reads each chunk at most a few times.
            back = 2 * back + 1;
        }
    }

    /// Reads from a position on, or from a place that is some chunks before it.
    fn read_from(&mut self, position_ns: u64, back: usize) -> Result<(), ReplayError> {
        self.end_reading();
        let from = ReadFrom {
            place: self.timeline.place(position_ns, back),
            log_time_ns: self.timeline.log_time_ns(position_ns),
            lap: self.lap,
        };
        self.read_ahead = Some(ReadAhead::start(&self.parts, &self.settings, from)?);
        Ok(())
    }

    fn end_reading(&mut self) {
        let Some(read_ahead) = self.read_ahead.take() else { return };
        let Findings { flawed, coverage } = read_ahead.finish();
        if !flawed.is_empty() {
            self.findings.flawed = flawed;
        }
        self.findings.coverage = coverage.or(self.findings.coverage.take());
    }
}

/// The parts of the recording that could not be read, and its gaps.
#[derive(Clone, Debug, Default)]
pub(crate) struct ReplayFindings {
    pub(crate) flawed: Vec<FlawedFile>,
    /// `None` unless the recording was read from its begin to its end.
    pub(crate) coverage: Option<Coverage>,
}

#[derive(Debug, thiserror::Error)]
pub(crate) enum ReplayError {
    #[error("the replay ends early")]
    Read(#[source] ReadError),
    #[error(transparent)]
    Nothing(#[from] NothingFound),
    /// The configuration of these frames is missing, so readers could not interpret them.
    #[error("{} holds frames of run {run_id}, but not its configuration", path.display())]
    NoConfiguration { path: PathBuf, run_id: u64 },
    #[error("cannot start a thread")]
    Thread(#[source] io::Error),
    #[error(transparent)]
    Bus(#[from] BusError),
}

/// Frames a second of a run that is played at a rate, rounded up; 0 where the recorded rate is not known.
fn published_rate_hz(recorded_hz: u32, rate: f64) -> u32 {
    (f64::from(recorded_hz) * rate).ceil() as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_published_rate_is_the_recorded_one_times_the_replay_rate_rounded_up() {
        let published = [(1_000, 10.0), (1_000, 1.0), (50, 0.01), (20, 0.01), (0, 3.0), (100_000, 100.0)];
        let rates_hz = published.map(|(recorded_hz, rate)| published_rate_hz(recorded_hz, rate));
        assert_eq!(rates_hz, [10_000, 1_000, 1, 1, 0, FASTEST_HZ]);
    }
}
