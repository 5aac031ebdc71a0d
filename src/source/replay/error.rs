//! Why a recording could not be replayed.

use std::io;
use std::path::PathBuf;

use bench_dragon_ipc::BusError;

use crate::recording::{NothingFound, ReadError};

/// Why a recording could not be replayed, or not to its end.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReplayError {
    /// The file cannot be opened as a recording.
    #[error(transparent)]
    Open(ReadError),
    /// What follows in the file cannot be read.
    #[error("the replay ends early")]
    Read(#[source] ReadError),
    /// There is nothing to replay.
    #[error(transparent)]
    Nothing(#[from] NothingFound),
    /// Frames without the configuration that tells readers what they are of.
    #[error("{} holds frames of run {run_id}, but not its configuration", path.display())]
    NoConfiguration {
        /// The file.
        path: PathBuf,
        /// The run, as recorded.
        run_id: u64,
    },
    /// The thread that reads the file could not be started.
    #[error("cannot start a thread")]
    Thread(#[source] io::Error),
    /// The bus.
    #[error(transparent)]
    Bus(#[from] BusError),
}
