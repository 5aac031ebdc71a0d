//! The newest frame and its freshness. The frame is a copy, so a bridge holds no shared memory of a server that has ended.

use std::time::Duration;

use bench_dragon_ipc::{BenchState, Frame, FrameHeader};

/// The frame that a bridge sends at one release.
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

/// Smallest freshness limit. The slowest server sends one frame a second.
const LEAST_LIMIT: Duration = Duration::from_millis(1_500);
/// The freshness limit in frame periods, unless the smallest limit is longer.
const PERIODS: u32 = 3;

/// Returns the greatest age of a fresh frame. `rate_hz` is the source's frames per second; 0 means that it is unknown.
///
/// ```
/// use bench_dragon::bridge::freshness_limit;
/// use std::time::Duration;
///
/// assert_eq!(freshness_limit(1_000), Duration::from_millis(1_500));
/// assert_eq!(freshness_limit(1), Duration::from_secs(3));
/// assert_eq!(freshness_limit(0), Duration::from_millis(1_500));
/// ```
pub fn freshness_limit(rate_hz: u32) -> Duration {
    let periods = Duration::from_secs(PERIODS.into()).checked_div(rate_hz);
    periods.map_or(LEAST_LIMIT, |periods| periods.max(LEAST_LIMIT))
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
