//! Why a recording could not begin or had to end.

use std::{io, ops::RangeInclusive, path::PathBuf};

use super::progress::Size;

/// Why a recording could not begin or had to end.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// A setting is out of its range.
    #[error("{name} is {value}, allowed is {}", range_text(allowed))]
    OutOfRange {
        /// Name of the setting.
        name: &'static str,
        /// What it was set to.
        value: u64,
        /// What it may be set to.
        allowed: RangeInclusive<u64>,
    },
    /// A file of that name is there already; a recording overwrites nothing.
    #[error("{} exists already and is not overwritten: record into another file or move it away", .0.display())]
    Exists(PathBuf),
    /// The file could not be made.
    #[error("cannot make {}", .0.display())]
    Create(PathBuf, #[source] io::Error),
    /// The disk has no room for more.
    #[error("the disk is full ({} free): {} ends here, {}", Size(*free_bytes), path.display(), kept.text())]
    DiskFull {
        /// The file that was being written.
        path: PathBuf,
        /// Bytes that an unprivileged process could still write.
        free_bytes: u64,
        /// What became of the file.
        kept: Kept,
    },
    /// The file could not be written for another reason.
    #[error("cannot write {} ({} free on its disk): it ends here, {}", path.display(), Size(*free_bytes), kept.text())]
    Write {
        /// The file that was being written.
        path: PathBuf,
        /// Bytes that an unprivileged process could still write.
        free_bytes: u64,
        /// What became of the file.
        kept: Kept,
        /// What the system or the MCAP library reported.
        source: mcap::McapError,
    },
    /// The oldest file of a bounded recording could not be removed.
    #[error("cannot remove {}, the oldest file of this recording", .0.display())]
    Remove(PathBuf, #[source] io::Error),
    /// The recording has ended by an error that was returned before.
    #[error("the recording has ended already")]
    Ended,
}

impl RecordError {
    /// Whether it is for want of room on the disk: recording is possible again once there is some.
    pub fn is_disk_full(&self) -> bool {
        match self {
            Self::DiskFull { .. } => true,
            Self::Create(_, source) => is_disk_full(source),
            _ => false,
        }
    }
}

/// What is left of a file that could not be written on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kept {
    /// A finished file that any reader opens.
    Finished,
    /// A file without an index: streaming readers read it, and repair finishes it.
    Unfinished,
}

impl Kept {
    fn text(self) -> &'static str {
        match self {
            Self::Finished => "finished and whole up to here",
            Self::Unfinished => "whole up to here but unfinished; once there is room, `record --repair` finishes it",
        }
    }
}

fn range_text(allowed: &RangeInclusive<u64>) -> String {
    match *allowed.end() {
        u64::MAX => format!("{} or more", allowed.start()),
        end => format!("{} to {end}", allowed.start()),
    }
}

/// Whether an error means that the disk, or the user's share of it, has no room.
pub(super) fn is_disk_full(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded)
}
