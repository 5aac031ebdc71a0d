//! The newest frame, copied out of shared memory, so that a bridge holds nothing of a server that has ended; and whether the
//! frame is fresh.

use std::time::Duration;

use bench_dragon_ipc::{BenchState, Frame, FrameHeader};

/// What a bridge sends at one release.
#[derive(Clone, Debug, Default)]
pub struct LatestFrame {
    /// The frame's header.
    pub header: FrameHeader,
    /// The benches, head first.
    pub benches: Vec<BenchState>,
    /// Whether the frame may still be believed.
    pub freshness: Freshness,
}

impl LatestFrame {
    /// Copies a frame that has just been read, into the same memory.
    pub fn replace(&mut self, frame: &Frame) {
        self.header = *frame.header();
        self.benches.clear();
        self.benches.extend(frame.benches());
        self.freshness = Freshness::Fresh;
    }

    /// What turns a speed per show second into one of wall time: the time scale, or 0 where the frame is stale.
    pub fn speed_factor(&self) -> f64 {
        if self.freshness.is_fresh() { self.header.time_scale } else { 0.0 }
    }
}

/// The oldest frame that is fresh, however often they come: the slowest server sends one a second.
const LEAST_LIMIT: Duration = Duration::from_millis(1_500);
/// Where they come more seldom, as many of their periods.
const PERIODS: u32 = 3;

/// How old a frame may be that is fresh, where so many come a second; 0 for a rate that is not known.
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

/// How old a frame may be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Freshness {
    /// Its source was there a moment ago.
    #[default]
    Fresh,
    /// Its source has been silent for too long.
    Stale {
        /// How long ago it was sent, in nanoseconds.
        age_ns: u64,
    },
}

impl Freshness {
    /// Whether it is fresh.
    pub fn is_fresh(self) -> bool {
        self == Self::Fresh
    }
}

/// Judges a frame by the instant at which it was sent, the present and the greatest age that is fresh. Both instants are of
/// `CLOCK_MONOTONIC`, in nanoseconds.
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
