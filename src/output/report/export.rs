//! What an export says.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::recording::Flaws;
use crate::recording::export::ExportCounts;

/// What `export` wrote.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ExportReport {
    /// The file.
    pub file: PathBuf,
    /// How much of the recording is in it.
    #[serde(flatten)]
    pub counts: ExportCounts,
    /// What could not be read of the recording.
    #[serde(flatten)]
    pub flaws: Flaws,
}
