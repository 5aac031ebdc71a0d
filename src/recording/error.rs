//! Errors of a recording: reasons why it cannot start or had to end.

use std::{io, ops::RangeInclusive, path::PathBuf};

use super::progress::Size;

/// Reason why a recording cannot start or had to end.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// A setting is out of its range.
    #[error("{name} is {value}, allowed is {}", range_text(allowed))]
    OutOfRange {
        /// Name of the setting.
        name: &'static str,
        /// Given value.
        value: u64,
        /// Allowed range.
        allowed: RangeInclusive<u64>,
    },
    /// A file with this name already exists. A recording overwrites no file.
    #[error("{} already exists and is not overwritten: choose another file name, or move the file", .0.display())]
    Exists(PathBuf),
    /// The file cannot be created.
    #[error("cannot create {}", .0.display())]
    Create(PathBuf, #[source] io::Error),
    /// The disk is full.
    #[error("the disk is full ({} free): the recording stops; {} {}", Size(*free_bytes), path.display(), kept.text())]
    DiskFull {
        /// The file that was being written.
        path: PathBuf,
        /// Bytes that an unprivileged process could still write.
        free_bytes: u64,
        /// State of the file.
        kept: Kept,
    },
    /// The file cannot be written for another reason.
    #[error(
        "cannot write {} ({} free on its disk): the recording stops; the file {}",
        path.display(), Size(*free_bytes), kept.text()
    )]
    Write {
        /// The file that was being written.
        path: PathBuf,
        /// Bytes that an unprivileged process could still write.
        free_bytes: u64,
        /// State of the file.
        kept: Kept,
        /// Error from the system or the MCAP library.
        source: mcap::McapError,
    },
    /// The oldest file of a bounded recording cannot be removed.
    #[error("cannot remove {}, the oldest file of this recording", .0.display())]
    Remove(PathBuf, #[source] io::Error),
    /// An earlier error ended the recording.
    #[error("an earlier error has ended the recording")]
    Ended,
}

impl RecordError {
    /// Whether the disk is full. Recording is possible again after files are removed.
    pub fn is_disk_full(&self) -> bool {
        match self {
            Self::DiskFull { .. } => true,
            Self::Create(_, source) => is_disk_full(source),
            _ => false,
        }
    }
}

/// State of a file that could not be written further.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kept {
    /// A finished file that any reader opens.
    Finished,
    /// A file without an index. Streaming readers can read it, and repair finishes it.
    Unfinished,
}

impl Kept {
    fn text(self) -> &'static str {
        match self {
            Self::Finished => "is finished and complete up to here",
            Self::Unfinished => {
                "is complete up to here but has no index: free some disk space, then finish it with `record --repair`"
            }
        }
    }
}

fn range_text(allowed: &RangeInclusive<u64>) -> String {
    match *allowed.end() {
        u64::MAX => format!("{} or more", allowed.start()),
        end => format!("{} to {end}", allowed.start()),
    }
}

/// Whether an error means that the disk or the user's quota is full.
pub(super) fn is_disk_full(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded)
}
