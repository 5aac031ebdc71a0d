//! What a replay says.

use serde::{Deserialize, Serialize};

use crate::source::replay::verify::{FlawedFile, RunVerification};
use crate::source::replay::{PassSummary, ReplaySummary};

/// A line of `replay`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum ReplayLine {
    /// The services of a pass are there.
    Started {
        /// The number of the run that it is on the bus.
        run_id: u64,
        /// The number of the run that was recorded.
        recorded_run_id: u64,
    },
    /// A pass has ended.
    Pass(PassSummary),
    /// The replay has ended.
    Summary(ReplaySummary),
    /// A run has been verified, or not.
    Run(RunVerification),
    /// The verification has ended.
    Verification(VerificationSummary),
}

/// What the verification of a recording came to.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct VerificationSummary {
    /// Whether every frame of the recording is as simulated.
    pub verified: bool,
    /// Runs in the recording.
    pub runs: u64,
    /// Their frames.
    pub frames: u64,
    /// Frames that are as simulated.
    pub frames_verified: u64,
    /// Whether it was broken off.
    pub interrupted: bool,
    /// The files that could not be read whole.
    pub flawed: Vec<FlawedFile>,
}
