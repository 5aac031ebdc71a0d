//! What a child does in the show.

use std::time::Duration;

use super::life::{LONGEST_DISK_SILENCE, LONGEST_SILENCE};

/// What a child does in the show, by which it is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// Publishes the frames.
    Serve,
    /// Looks for contacts, and guards.
    Monitor,
    /// Writes the recording.
    Record,
    /// Serves the page.
    View,
    /// Runs the configuration's command of this number.
    Also(usize),
}

impl Role {
    /// How long a child may be silent that is not stopped.
    pub(super) fn longest_silence(self) -> Duration {
        match self {
            Self::Record => LONGEST_DISK_SILENCE,
            Self::Serve | Self::Monitor | Self::View | Self::Also(_) => LONGEST_SILENCE,
        }
    }

    /// Whether the server waits for it before it begins.
    pub(super) fn is_awaited(self) -> bool {
        matches!(self, Self::Monitor | Self::Record)
    }
}
