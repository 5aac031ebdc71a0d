//! Verification: simulates a recording again, and compares it with its frames bit for bit.
//!
//! A recording contains everything that determines its frames: the configuration, the start of the run, and every
//! command with the tick at which it took effect. [`verify`] passes these to the simulation of the server
//! ([`Simulation`]). It compares every recorded frame with the simulated one: all bits of header and handles. It needs
//! neither a bus nor a server.
//!
//! **Missed periods** follow from the frames: each frame was due at `epoch + k / rate`, k the number of its period, in integers.
//!
//! **Lost frames**, also those between two parts, are simulated, but not compared. If the server missed periods among
//! them, or a timecode led the show, the frames are not determined. Then the verification of the run ends.
//!
//! **Values taken from the frames:** the due times, and the time scale while a timecode leads the show. Only the frames
//! contain these. `published_ns` is the time of sending, and is not compared.
//!
//! **Same bits** need the same instructions: handles computed without AVX2 and FMA differ by rounding from handles
//! computed with them ([`Instructions`]). The functions of the route come from the C library.
//!
//! **Bounds.** Files are read twice, with one chunk in memory at a time. The first pass reads the command events, at
//! most [`MOST_EVENTS`]; the second reads the frames. Two passes are needed because an event may be recorded after the
//! frames of its tick.
//!
//! [`Simulation`]: crate::source::server::Simulation
//! [`Instructions`]: bench_dragon_geometry::dragon::Instructions

mod comparison;
mod events;
mod recorded_inputs;
mod run_check;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use bench_dragon_ipc::CommandEvent;
use serde::{Deserialize, Serialize};

use crate::recording::{
    Configuration, Coverage, FlawedFile, IntervalSearch, NothingFound, Parts, PartsReader, ReadError, Recorded,
    RecordedFrame, ShowInterval,
};

pub use comparison::{Difference, Value};
pub use events::MOST_EVENTS;

use events::events_of_runs;
use run_check::RunCheck;

/// Results of a verification.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verification {
    /// The runs, in the recorded order.
    pub runs: Vec<RunVerification>,
    /// Frames of the recording, and those that it lacks.
    pub coverage: Coverage,
    /// Files that could not be read completely.
    pub flawed: Vec<FlawedFile>,
    /// Whether the verification was interrupted.
    pub is_interrupted: bool,
}

/// Results of the verification of one run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RunVerification {
    /// Number of the run.
    pub run_id: u64,
    /// Number of its recorded frames.
    pub frames: u64,
    /// Number of frames that equal the simulated ones. They are consecutive from the first frame on.
    pub verified: u64,
    /// Tick of the first recorded frame.
    pub first_tick: u64,
    /// Tick of the last recorded frame.
    pub last_tick: u64,
    /// Frames missing in the recording, from tick 0 up to the last verified frame. They were simulated.
    pub missing: u64,
    /// Periods that the server missed, up to the last verified frame.
    pub overruns: u64,
    /// Accepted commands that were applied, without grants.
    pub commands: u64,
    /// Grants that were applied.
    pub grants: u64,
    /// Recorded changes of the timecode's effect on the show.
    pub timecode: u64,
    /// Verdict on the run.
    #[serde(flatten)]
    pub verdict: RunVerdict,
}

/// Verdict on a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(tag = "verdict", rename_all = "snake_case")]
pub enum RunVerdict {
    /// Every recorded frame equals the simulated one.
    #[default]
    Verified,
    /// A frame differs. The verdict names the first one.
    Differs {
        /// The first difference.
        difference: Difference,
    },
    /// Some frames cannot be verified.
    Unverifiable {
        /// First tick that cannot be verified.
        from_tick: u64,
        /// Reason, in words.
        reason: String,
    },
}

/// Reason why recordings could not be verified at all.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// A file cannot be read as a recording.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The recording has more command events than fit into memory.
    #[error("the recording holds more than {MOST_EVENTS} events of commands: verify the files of one run at a time")]
    TooManyEvents,
    /// The recording has no frames.
    #[error(transparent)]
    NoFrames(#[from] NothingFound),
}

/// Verifies the runs of a recording. `look` receives the number of bytes read so far, of twice the size of all parts.
/// `stop` interrupts the verification.
///
/// # Errors
/// [`VerifyError`].
pub fn verify(parts: &Parts, stop: &AtomicBool, mut look: impl FnMut(u64)) -> Result<Verification, VerifyError> {
    let parts = Arc::new(parts.clone());
    let (mut events, bytes_before) = events_of_runs(&parts, stop, &mut look)?;
    let mut recordings = PartsReader::new(Arc::clone(&parts));
    let mut runs = Vec::new();
    while !stop.load(Ordering::Relaxed)
        && let Some(recorded) = recordings.next_wanted(|_| true)?
    {
        if let Recorded::Frame(frame) = recorded {
            let run = run_of(&mut runs, &frame, recordings.configuration(), &mut events);
            run.take(&frame, stop);
            look(bytes_before + recordings.bytes_read());
        }
    }
    let is_interrupted = stop.load(Ordering::Relaxed);
    if runs.is_empty() && !is_interrupted {
        let all = IntervalSearch::new(ShowInterval::ALL);
        return Err(all.nothing_found(&parts.named, recordings.flaws()).into());
    }
    if let Some(last) = runs.last_mut() {
        last.finish();
    }
    let runs = runs.into_iter().map(|run| run.found).collect();
    let coverage = recordings.coverage();
    Ok(Verification { runs, coverage, flawed: recordings.into_flawed(), is_interrupted })
}

/// Returns the run of a frame: the last run, or a new one.
fn run_of<'a>(
    runs: &'a mut Vec<RunInProgress>,
    frame: &RecordedFrame,
    configuration: Option<&Configuration>,
    events: &mut BTreeMap<u64, Vec<CommandEvent>>,
) -> &'a mut RunInProgress {
    let run_id = frame.header.run_id;
    if runs.last().is_none_or(|run| run.found.run_id != run_id) {
        if let Some(last) = runs.last_mut() {
            last.finish();
        }
        let check = if runs.iter().any(|run| run.found.run_id == run_id) {
            Err("its frames are not in the recorded order: name the files oldest first".to_owned())
        } else {
            let configuration = configuration.filter(|configuration| configuration.run_id == run_id);
            RunCheck::begin(run_id, configuration, events.remove(&run_id).unwrap_or_default())
        };
        runs.push(RunInProgress::new(frame, check));
    }
    runs.last_mut().expect("a missing run has been added")
}

/// A run during or after the reading of its frames.
struct RunInProgress {
    found: RunVerification,
    /// `None` for a run that cannot be simulated. The check continues while the verdict is [`RunVerdict::Verified`].
    check: Option<RunCheck>,
}

impl RunInProgress {
    fn new(frame: &RecordedFrame, check: Result<RunCheck, String>) -> Self {
        let tick = frame.header.tick;
        let (check, verdict) = match check {
            Ok(check) => (Some(check), RunVerdict::Verified),
            Err(reason) => (None, RunVerdict::Unverifiable { from_tick: tick, reason }),
        };
        let run_id = frame.header.run_id;
        let found =
            RunVerification { run_id, first_tick: tick, last_tick: tick, verdict, ..RunVerification::default() };
        Self { found, check }
    }

    fn take(&mut self, frame: &RecordedFrame, stop: &AtomicBool) {
        self.found.frames += 1;
        self.found.last_tick = frame.header.tick;
        let Some(check) = self.check.as_mut().filter(|_| self.found.verdict == RunVerdict::Verified) else { return };
        let checked = check.take(frame, &mut self.found, stop);
        self.found.overruns = check.periods.overruns();
        match checked {
            Ok(()) => self.found.verified += 1,
            Err(verdict) => self.found.verdict = verdict,
        }
    }

    /// Ends the run. A killed server or recorder does not record the last commands. A difference that they may explain has an
    /// unknown cause, so the verdict is then [`RunVerdict::Unverifiable`].
    fn finish(&mut self) {
        let open_end = self.check.take().and_then(|check| check.open_end());
        if let RunVerdict::Differs { difference } = &self.found.verdict
            && let Some(open_end) = open_end
            && open_end.explains(difference.tick, self.found.last_tick)
        {
            let reason = format!(
                "the record of commands has no end, as after a crash: its last commands may be missing; as recorded, \
                 the run differs {difference}"
            );
            self.found.verdict = RunVerdict::Unverifiable { from_tick: difference.tick, reason };
        }
    }
}
