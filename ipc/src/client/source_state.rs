//! Whether the source of the frames publishes, and if not, why.

#![allow(unsafe_code, reason = "reads the clock of the frames")]

use std::time::Duration;

use crate::domain::{Domain, SourceLock};
use crate::wire::{FrameHeader, ShowState};

/// State of the source, as a reader sees it. A reader whose wait ends without a frame asks for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SourceState {
    /// A source runs, and the newest frame is recent.
    Publishing,
    /// A source runs, but its newest frame is this old: the process is suspended, stuck, or still starting.
    Hanging {
        /// Time since the newest frame was sent, or since the reader was opened where it has read no frame.
        silent: Duration,
    },
    /// The run has ended in order, and the last frame that was read is the run's last one.
    Ended,
    /// No source runs, and the run has not ended in order: the process was killed or has failed. It is also the state of a
    /// reader that has read no frame and finds no source.
    Lost,
}

impl SourceState {
    /// Lower-case name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Publishing => "publishing",
            Self::Hanging { .. } => "hanging",
            Self::Ended => "ended",
            Self::Lost => "lost",
        }
    }
}

/// Remembers what the state of the source depends on.
#[derive(Debug)]
pub(crate) struct SourceWatch {
    domain: Domain,
    /// `CLOCK_MONOTONIC` instant of the newest frame; before the first frame, of the opening.
    newest_ns: u64,
    has_ended: bool,
}

impl SourceWatch {
    pub(crate) fn new(domain: &Domain) -> Self {
        Self { domain: domain.clone(), newest_ns: monotonic_ns(), has_ended: false }
    }

    /// Takes a frame that was read.
    pub(crate) fn note(&mut self, header: &FrameHeader) {
        self.newest_ns = header.published_ns;
        self.has_ended = header.state == ShowState::Ended as u32;
    }

    pub(crate) fn state(&self, limit: Duration) -> SourceState {
        let silent = Duration::from_nanos(monotonic_ns().saturating_sub(self.newest_ns));
        state(self.has_ended, silent, limit, || SourceLock::is_held(&self.domain))
    }
}

fn state(has_ended: bool, silent: Duration, limit: Duration, runs: impl FnOnce() -> bool) -> SourceState {
    if has_ended {
        SourceState::Ended
    } else if !runs() {
        SourceState::Lost
    } else if silent > limit {
        SourceState::Hanging { silent }
    } else {
        SourceState::Publishing
    }
}

/// Reads `CLOCK_MONOTONIC` by the C library: rustix's own reading does not run under valgrind.
pub(super) fn monotonic_ns() -> u64 {
    let mut now = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the call writes to a variable of this function. It cannot fail for this clock.
    unsafe { libc::clock_gettime(libc::CLOCK_MONOTONIC, &raw mut now) };
    now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ended_lost_hanging_and_publishing_are_four_states() {
        let [short, limit, long] = [1, 2, 3].map(Duration::from_secs);
        assert_eq!(state(false, short, limit, || true), SourceState::Publishing);
        assert_eq!(state(false, limit, limit, || true), SourceState::Publishing);
        assert_eq!(state(false, long, limit, || true), SourceState::Hanging { silent: long });
        assert_eq!(state(false, short, limit, || false), SourceState::Lost);
        assert_eq!(state(true, long, limit, || false), SourceState::Ended);
        assert_eq!(state(true, long, limit, || true), SourceState::Ended, "the next source has not published yet");
    }
}
