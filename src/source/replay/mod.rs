//! Replay: a recording back onto the bus, as a source like the server.
//!
//! **What is replayed.** Every frame of a recording whose show time lies in an interval, in the recorded order, at the
//! recorded pace or faster or slower by a factor, once or several times. Each recorded run is a *pass*, each time: it has
//! a new `run_id`, its ticks count from 0 without a hole, and `scheduled_ns` and `published_ns` are those of the replay;
//! `time_scale` is multiplied by the factor, since a reader that looks ahead on its own clock needs show seconds per
//! second, and by a tenth more while the replay makes up for frames that came too late; all else is bit for bit what was recorded. Its description is published before its first frame. Where the
//! recorder lost frames, so does the replay; how many is in [`PassSummary::missing`], and to a reader the head was put
//! across, unless the time that has passed allows that it walked there. So it was where frames outside of the interval are
//! cut out.
//!
//! **What is not.** Alerts: a monitor of the replay makes its own, of the same frames.
//!
//! **Who waits.** The file is read ahead on a thread of its own, into a bounded channel. A frame that comes too late is
//! sent at once, and those behind it follow a tenth faster until the replay is on time again ([`PlaybackClock`]). Nothing waits for a
//! reader.
//!
//! **What clients may ask.** To stop; whatever else is refused with [`Refusal::Replayed`](bench_dragon_ipc::Refusal).
//!
//! **Verification** ([`verify`](mod@verify)) plays nothing: it simulates a recorded run again and compares it with its frames.
//!
//! **A damaged file** is played without what is damaged, one without its end as far as it goes; [`ReplaySummary::flaws`] reports it.

mod pass;
mod playback_clock;
mod read_ahead;
pub mod verify;

use std::io;
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use bench_dragon_ipc::{BusError, Domain, SourceKind, SourceLock};
use serde::{Deserialize, Serialize};

use crate::config::RATE_HZ;
use crate::recording::{Flaws, NothingFound, ReadError, ShowInterval};
use crate::source::{SourcePorts, described_rate_hz, take_instance};

pub(crate) use pass::Pass;
pub use pass::PassSummary;
pub use playback_clock::PlaybackClock;

use read_ahead::{ReadAhead, RecordedRun};

/// Recorded seconds that may be played per second.
pub const RATE: RangeInclusive<f64> = 0.01..=100.0;
/// Frames that any run on a bus has a second at most: those of the fastest server, replayed as fast as can be.
pub const FASTEST_HZ: u32 = *RATE_HZ.end() * *RATE.end() as u32;

/// How often commands are looked for where frames are further apart.
const COMMAND_PERIOD: Duration = Duration::from_millis(10);

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ReplaySettings {
    pub(crate) file: PathBuf,
    pub(crate) interval: ShowInterval,
    /// Recorded seconds per second, in [`RATE`].
    pub(crate) rate: f64,
    /// How often to play it; without a number, until it is stopped.
    pub(crate) laps: Option<u64>,
    /// Readers to wait for before the first frame, for ten seconds at most.
    pub(crate) readers: usize,
}

/// What a replay came to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReplaySummary {
    /// Runs played: each recorded run, as often as it was played.
    pub passes: u64,
    /// Frames published in all.
    pub frames: u64,
    /// What could not be read of the recording.
    #[serde(flatten)]
    pub flaws: Flaws,
}

/// A replay: an iterator of passes, as it were, each of which is played before the next.
#[derive(Debug)]
pub(crate) struct Replay {
    domain: Domain,
    settings: ReplaySettings,
    read_ahead: ReadAhead,
    clock: PlaybackClock,
    /// How often the recording has been begun again.
    lap: u64,
    summary: ReplaySummary,
    is_stopped: bool,
    // Given up last.
    _lock: SourceLock,
}

impl Replay {
    /// Opens the recording and takes the instance, on which no other source may run.
    pub(crate) fn open(domain: &Domain, settings: ReplaySettings) -> Result<Self, ReplayError> {
        let read_ahead = ReadAhead::start(&settings)?;
        let lock = take_instance(domain)?;
        Ok(Self {
            domain: domain.clone(),
            clock: PlaybackClock::new(settings.rate),
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
    pub(crate) fn next_pass(&mut self, stop: &AtomicBool) -> Result<Option<Pass<'_>>, ReplayError> {
        let Some(run) = self.next_run(stop)? else { return Ok(None) };
        let toml = &run.configuration.toml;
        let rate_hz = published_rate_hz(described_rate_hz(toml), self.settings.rate);
        let ports = SourcePorts::open(&self.domain, SourceKind::Replay, toml, run.bench_count, rate_hz)?;
        if run.lap != self.lap {
            self.lap = run.lap;
            self.clock.begin_lap();
        }
        self.summary.passes += 1;
        Ok(Some(Pass::new(self, run, ports)))
    }

    pub(crate) fn finish(self) -> ReplaySummary {
        ReplaySummary { flaws: self.read_ahead.finish(), ..self.summary }
    }

    /// Waits for the next run to be found in the file.
    fn next_run(&self, stop: &AtomicBool) -> Result<Option<RecordedRun>, ReplayError> {
        while !self.is_stopped && !stop.load(Ordering::Relaxed) {
            if let Some(run) = self.read_ahead.next(COMMAND_PERIOD) {
                return run;
            }
        }
        Ok(None)
    }
}

#[derive(Debug, thiserror::Error)]
pub(crate) enum ReplayError {
    /// The file cannot be opened as a recording.
    #[error(transparent)]
    Open(ReadError),
    #[error("the replay ends early")]
    Read(#[source] ReadError),
    #[error(transparent)]
    Nothing(#[from] NothingFound),
    /// Frames without the configuration that tells readers what they are of.
    #[error("{} holds frames of run {run_id}, but not its configuration", path.display())]
    NoConfiguration { path: PathBuf, run_id: u64 },
    #[error("cannot start a thread")]
    Thread(#[source] io::Error),
    #[error(transparent)]
    Bus(#[from] BusError),
}

/// Frames a second, rounded up, of a run that had so many and is played at a rate; 0 where that is not known.
fn published_rate_hz(recorded_hz: u32, rate: f64) -> u32 {
    (f64::from(recorded_hz) * rate).ceil() as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recording_that_is_played_faster_has_more_frames_a_second_and_never_none() {
        let published = [(1_000, 10.0), (1_000, 1.0), (50, 0.01), (20, 0.01), (0, 3.0), (100_000, 100.0)];
        let rates_hz = published.map(|(recorded_hz, rate)| published_rate_hz(recorded_hz, rate));
        assert_eq!(rates_hz, [10_000, 1_000, 1, 1, 0, FASTEST_HZ]);
    }
}
