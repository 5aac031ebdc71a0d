//! Verification: a recording simulated again, and compared with itself bit for bit.
//!
//! A recording holds all that decides on its frames: the configuration, how the run began, and every command with the tick
//! from which it holds. [`verify`] gives these to the simulation of the server ([`Simulation`]) and compares every
//! recorded frame with the simulated one, all bits of header and handles. It needs neither a bus nor a server.
//!
//! **Releases that were missed** follow from the frames: each was due at `epoch + release / rate`, in integers.
//!
//! **Frames that the recorder lost** are simulated as well, but not compared. Releases that were missed meanwhile, or a
//! timecode that led the show, leave open how; there the verification of the run ends.
//!
//! **What a verification takes from the frames:** the instants at which they were due, and the time scale while a timecode
//! leads the show, which only they have. `published_ns` is when a frame was sent; nothing can be compared with it.
//!
//! **The same bits** come from the same instructions: on a machine without AVX2 and FMA handles differ by rounding from those
//! of a machine that has them ([`Instructions`]). The route's functions are those of the C library.
//!
//! **Bounds.** Files are read twice, one chunk in memory at a time: first the events of commands, [`MOST_EVENTS`] at most, and
//! then the frames. For an event may be recorded behind the frames of its tick.
//!
//! [`Simulation`]: crate::source::server::Simulation
//! [`Instructions`]: bench_dragon_geometry::dragon::Instructions

mod comparison;
mod events;
mod run_check;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use bench_dragon_ipc::CommandEvent;
use serde::{Deserialize, Serialize};

use crate::recording::{Configuration, Flaws, ReadError, Recorded, RecordedFrame};

pub use comparison::{Difference, Value};
pub use events::MOST_EVENTS;

use events::{Recordings, events_of_runs};
use run_check::RunCheck;

/// What a verification found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verification {
    /// The runs, in the recorded order.
    pub runs: Vec<RunVerification>,
    /// The files that could not be read whole.
    pub flawed: Vec<FlawedFile>,
    /// Whether it was broken off.
    pub is_interrupted: bool,
}

/// A file that could not be read whole.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FlawedFile {
    /// The file.
    pub file: PathBuf,
    /// What could not be read.
    #[serde(flatten)]
    pub flaws: Flaws,
}

/// What a verification found of one run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RunVerification {
    /// The run.
    pub run_id: u64,
    /// Its frames in the recording.
    pub frames: u64,
    /// Those that are as simulated: all from the first one on, unless the verdict names where that ends.
    pub verified: u64,
    /// Tick of the first recorded frame.
    pub first_tick: u64,
    /// Tick of the last recorded frame.
    pub last_tick: u64,
    /// Frames that are missing in the recording up to the last verified one, from tick 0 on. They were simulated.
    pub missing: u64,
    /// Releases that the server missed, up to the last verified frame.
    pub overruns: u64,
    /// Accepted commands that were applied, grants excepted.
    pub commands: u64,
    /// Grants that were applied.
    pub grants: u64,
    /// Changes of what the timecode had the show do.
    pub timecode: u64,
    /// The result.
    #[serde(flatten)]
    pub verdict: RunVerdict,
}

/// The result of a verification.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(tag = "verdict", rename_all = "snake_case")]
pub enum RunVerdict {
    /// Every recorded frame is as simulated.
    #[default]
    Verified,
    /// A frame is not: the first one.
    Differs {
        /// What differs, and where.
        difference: Difference,
    },
    /// Some frames cannot be verified.
    Unverifiable {
        /// The tick from which on.
        from_tick: u64,
        /// Why not.
        reason: String,
    },
}

/// Why recordings could not be verified at all.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// A file cannot be read as a recording.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// More events of commands than are kept in memory.
    #[error("the recording holds more than {MOST_EVENTS} events of commands: verify the files of one run at a time")]
    TooManyEvents,
    /// There is nothing to verify.
    #[error("there are no frames in the recording")]
    NoFrames,
}

/// Verifies the runs of a recording: its files, oldest first. `look` is shown how many bytes were read, of twice the bytes of
/// all files; `stop` breaks it off.
///
/// # Errors
/// [`VerifyError`].
pub fn verify(files: &[PathBuf], stop: &AtomicBool, mut look: impl FnMut(u64)) -> Result<Verification, VerifyError> {
    let (mut events, bytes_before) = events_of_runs(files, stop, &mut look)?;
    let mut recordings = Recordings::new(files);
    let mut runs = Vec::new();
    while !stop.load(Ordering::Relaxed)
        && let Some(recorded) = recordings.next(|_| true)?
    {
        if let Recorded::Frame(frame) = recorded {
            let run = run_of(&mut runs, &frame, recordings.configuration(), &mut events);
            run.take(&frame, stop);
            look(bytes_before + recordings.bytes_read());
        }
    }
    let is_interrupted = stop.load(Ordering::Relaxed);
    if runs.is_empty() && !is_interrupted {
        return Err(VerifyError::NoFrames);
    }
    if let Some(last) = runs.last_mut() {
        last.finish();
    }
    let runs = runs.into_iter().map(|run| run.found).collect();
    Ok(Verification { runs, flawed: recordings.into_flawed(), is_interrupted })
}

/// The run of a frame: the last one, or another that follows it.
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
    runs.last_mut().expect("begun where it was missing")
}

/// A run whose frames are being read, or have been.
struct RunInProgress {
    found: RunVerification,
    /// `None` where it cannot be simulated. It goes on as long as the verdict is [`RunVerdict::Verified`].
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
        self.found.overruns = check.releases.overruns();
        match checked {
            Ok(()) => self.found.verified += 1,
            Err(verdict) => self.found.verdict = verdict,
        }
    }

    /// A server or a recorder that is killed leaves the commands of its last moments unrecorded. Where a frame differs only
    /// there, nothing is known of why.
    fn finish(&mut self) {
        let open_end = self.check.take().and_then(|check| check.open_end());
        if let RunVerdict::Differs { difference } = &self.found.verdict
            && let Some((last_event, last_moments)) = open_end
            && difference.tick >= last_event
            && self.found.last_tick.saturating_sub(difference.tick) <= last_moments
        {
            let reason = format!(
                "the record of commands has no end, as after a crash: some of its last moments may be missing; as recorded, \
                 the run differs {difference}"
            );
            self.found.verdict = RunVerdict::Unverifiable { from_tick: difference.tick, reason };
        }
    }
}
