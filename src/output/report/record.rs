//! What a recorder says.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// A line of `record`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum RecordLine {
    /// The file is open.
    Started {
        /// The file.
        file: PathBuf,
    },
    /// Something that may go wrong later.
    Warning {
        /// What.
        message: String,
    },
    /// The recorder has ended.
    Summary(RecordSummary),
}

/// What a recorder wrote.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RecordSummary {
    /// Frames written.
    pub frames: u64,
    /// Frames lost between the first and the last one written.
    pub lost: u64,
    /// Alerts written.
    pub alerts: u64,
    /// Events of commands written.
    #[serde(default)]
    pub commands: u64,
    /// Events of commands lost, those from long before the recording began included.
    #[serde(default)]
    pub commands_lost: u64,
    /// Bytes written.
    pub bytes: u64,
    /// Files that were removed to stay under the allowed total.
    pub removed: u64,
    /// The files that are there, oldest first.
    pub files: Vec<PathBuf>,
}
