//! What a replay says.

use serde::{Deserialize, Serialize};

use crate::replay::{PassSummary, ReplaySummary};

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
}
