//! The newest frame and its freshness. The frame is a copy, so a bridge holds no shared memory of a server that has ended.

use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;
use std::time::Duration;

use bench_dragon_ipc::{BenchState, Frame, FrameHeader};

/// The frame that a bridge sends at a due instant.
#[derive(Clone, Debug, Default)]
pub struct LatestFrame {
    /// The frame's header.
    pub header: FrameHeader,
    /// The benches, head first.
    pub benches: Vec<BenchState>,
    /// Whether the frame is fresh or stale.
    pub freshness: Freshness,
}

impl LatestFrame {
    /// Copies a frame that has just been read, and marks it fresh. Reuses the memory of the previous copy.
    pub fn replace(&mut self, frame: &Frame) {
        self.header = *frame.header();
        self.benches.clear();
        self.benches.extend(frame.benches());
        self.freshness = Freshness::Fresh;
    }

    /// Factor from a speed per show second to a speed per wall-clock second: the time scale, or 0 if the frame is stale.
    pub fn speed_factor(&self) -> f64 {
        if self.freshness.is_fresh() { self.header.time_scale } else { 0.0 }
    }
}

/// The freshness limit in frame periods, unless the operator's limit is longer.
const PERIODS: u32 = 3;
/// The freshness limit of a source of unknown period, unless the operator's limit is longer. The slowest server sends one frame a
/// second.
const UNKNOWN_PERIOD_LIMIT: Duration = Duration::from_millis(1_500);

/// An age from which a frame is stale, in seconds. Slow sources have more time: three of their periods.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StaleAfter {
    limit: Duration,
}

/// Error for a text that is not such an age.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("must be seconds from {} to {}", StaleAfter::SECONDS.start(), StaleAfter::SECONDS.end())]
pub struct StaleAfterError;

impl StaleAfter {
    /// Allowed seconds. Less would call a server stale that a busy machine delays.
    pub const SECONDS: RangeInclusive<f64> = 0.05..=60.0;

    /// Returns the greatest age of a fresh frame. `period` is the time between two frames of the source, if it is known.
    ///
    /// ```
    /// use bench_dragon::bridge::StaleAfter;
    /// use std::time::Duration;
    ///
    /// let stale_after = StaleAfter::default();
    /// assert_eq!(stale_after.limit(Some(Duration::from_millis(1))), Duration::from_millis(300));
    /// assert_eq!(stale_after.limit(Some(Duration::from_secs(1))), Duration::from_secs(3));
    /// assert_eq!(stale_after.limit(None), Duration::from_millis(1_500));
    /// ```
    pub fn limit(self, period: Option<Duration>) -> Duration {
        self.limit.max(period.map_or(UNKNOWN_PERIOD_LIMIT, |period| period.saturating_mul(PERIODS)))
    }
}

impl Default for StaleAfter {
    /// 0.3 s: a dragon of 1 m/s has then walked on by 0.3 m on a desk that extrapolates.
    fn default() -> Self {
        Self { limit: Duration::from_millis(300) }
    }
}

impl FromStr for StaleAfter {
    type Err = StaleAfterError;

    fn from_str(text: &str) -> Result<Self, StaleAfterError> {
        let seconds: Option<f64> = text.parse().ok().filter(|seconds| Self::SECONDS.contains(seconds));
        seconds.map(|seconds| Self { limit: Duration::from_secs_f64(seconds) }).ok_or(StaleAfterError)
    }
}

impl fmt::Display for StaleAfter {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&self.limit.as_secs_f64(), formatter)
    }
}

/// Whether a frame is recent enough for its speeds to be used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Freshness {
    /// The source sent the frame within the freshness limit.
    #[default]
    Fresh,
    /// The source has been silent for longer than the freshness limit.
    Stale {
        /// Time since the frame was sent, in nanoseconds.
        age_ns: u64,
    },
}

impl Freshness {
    /// Whether the value is `Fresh`.
    pub fn is_fresh(self) -> bool {
        self == Self::Fresh
    }
}

/// Returns whether a frame is fresh at `now_ns`. `limit` is the greatest age of a fresh frame.
///
/// Both instants are nanoseconds of `CLOCK_MONOTONIC`.
///
/// ```
/// use bench_dragon::bridge::{Freshness, freshness};
/// use std::time::Duration;
///
/// let limit = Duration::from_nanos(100);
/// assert_eq!(freshness(1_000, 1_100, limit), Freshness::Fresh);
/// assert_eq!(freshness(1_000, 1_101, limit), Freshness::Stale { age_ns: 101 });
/// assert_eq!(freshness(1_000, 900, limit), Freshness::Fresh);
/// ```
pub fn freshness(published_ns: u64, now_ns: u64, limit: Duration) -> Freshness {
    let age_ns = now_ns.saturating_sub(published_ns);
    if u128::from(age_ns) <= limit.as_nanos() { Freshness::Fresh } else { Freshness::Stale { age_ns } }
}
