//! Whether there is a source, and whether it says anything.

use std::time::Duration;

/// How an observer stands to the source of the frames.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Link {
    /// No frame has been seen yet.
    #[default]
    Waiting,
    /// Frames come.
    Live,
    /// The source's process is there, and says nothing: it hangs, or was suspended.
    Silent {
        /// How long ago the last frame was sent, in nanoseconds.
        age_ns: u64,
    },
    /// The run has ended in order.
    Ended {
        /// How long ago its last frame was sent, in nanoseconds.
        age_ns: u64,
    },
    /// The source's process is gone, and the run has not ended in order.
    Gone {
        /// How long ago the last frame was sent, in nanoseconds.
        age_ns: u64,
    },
    /// The bus cannot be read.
    Failed {
        /// Why, in one line.
        reason: String,
    },
}

/// Beyond this age, and this many periods where frames come seldom, a source that is there is silent.
const SILENT: (Duration, u32) = (Duration::from_millis(500), 3);
/// The same of a source whose process is not to be found. In a process namespace of its own it would never be.
const GONE: (Duration, u32) = (Duration::from_millis(200), 2);

impl Link {
    /// Lower-case name, as clients print it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Waiting => "waiting",
            Self::Live => "live",
            Self::Silent { .. } => "silent",
            Self::Ended { .. } => "ended",
            Self::Gone { .. } => "gone",
            Self::Failed { .. } => "failed",
        }
    }

    /// How long ago the last frame was sent, in nanoseconds, where that is too long or the run has ended.
    pub fn age_ns(&self) -> Option<u64> {
        match self {
            Self::Silent { age_ns } | Self::Gone { age_ns } | Self::Ended { age_ns } => Some(*age_ns),
            Self::Waiting | Self::Live | Self::Failed { .. } => None,
        }
    }

    /// Judges the last frame by its age, in nanoseconds, the rate at which frames come, and whether the source's process is
    /// there.
    ///
    /// ```
    /// use bench_dragon::display::observe::Link;
    ///
    /// let ms = 1_000_000;
    /// assert_eq!(Link::judge(500 * ms, 1_000, true), Link::Live);
    /// assert_eq!(Link::judge(501 * ms, 1_000, true), Link::Silent { age_ns: 501 * ms });
    /// assert_eq!(Link::judge(501 * ms, 2, true), Link::Live);
    /// assert_eq!(Link::judge(201 * ms, 1_000, false), Link::Gone { age_ns: 201 * ms });
    /// ```
    pub fn judge(age_ns: u64, rate_hz: u32, source_is_there: bool) -> Self {
        let (least, periods) = if source_is_there { SILENT } else { GONE };
        let limit = Duration::from_secs(periods.into()).checked_div(rate_hz).unwrap_or_default().max(least);
        match (u128::from(age_ns) <= limit.as_nanos(), source_is_there) {
            (true, _) => Self::Live,
            (false, true) => Self::Silent { age_ns },
            (false, false) => Self::Gone { age_ns },
        }
    }
}
