//! Why a recording could not be exported.

use std::io;

use crate::output::table;
use crate::recording::{NothingFound, ReadError};

/// Why a recording could not be exported.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// The file cannot be opened as a recording.
    #[error(transparent)]
    Open(ReadError),
    /// What follows in the file cannot be read.
    #[error("the export ends early")]
    Read(#[source] ReadError),
    /// There is nothing to export.
    #[error(transparent)]
    Nothing(#[from] NothingFound),
    /// A workbook has no room for it.
    #[error("{what}, a workbook has room for {most}: choose a greater --every, a shorter --from and --to, or .csv")]
    TooMuch {
        /// What there is too much of, with its number.
        what: String,
        /// How much there may be.
        most: usize,
    },
    /// The rows could not be written.
    #[error("cannot write the rows")]
    Write(#[source] io::Error),
    /// The workbook's writer refused.
    #[error(transparent)]
    Table(#[from] table::ExportError),
}
