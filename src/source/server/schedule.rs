//! Schedule of the ticks.
//!
//! A period begins at its *due instant*, when a tick is due. That of period k is `epoch + k / rate`, computed in integers from
//! the epoch, so that rounding never accumulates. The schedule skips a period that begins while the server is busy or suspended,
//! and counts it as missed. Ticks are not skipped.
//! [`super::motion::CatchUp`] decides how the show makes up for a missed period.

/// The periods of a server, counted from its epoch.
#[derive(Clone, Copy, Debug)]
pub struct Schedule {
    epoch_ns: u64,
    rate_hz: u32,
    next: u64,
    overruns: u64,
}

impl Schedule {
    /// Creates a schedule whose period 0 begins at the epoch. The rate is above 0.
    pub fn new(epoch_ns: u64, rate_hz: u32) -> Self {
        assert!(rate_hz > 0, "the rate must be above 0");
        Self { epoch_ns, rate_hz, next: 0, overruns: 0 }
    }

    /// Due instant of the next period, in nanoseconds of `CLOCK_MONOTONIC`.
    pub fn due_ns(&self) -> u64 {
        self.begin_ns(self.next)
    }

    /// Moves to the next period at the end of a tick: the first one that begins at `now_ns` or later.
    ///
    /// Returns the number of periods that it misses.
    pub fn advance(&mut self, now_ns: u64) -> u64 {
        self.next += 1;
        let first_ahead = if self.due_ns() < now_ns { self.first_period_from(now_ns) } else { self.next };
        let missed = first_ahead - self.next;
        self.overruns += missed;
        self.next = first_ahead;
        missed
    }

    /// Periods a second.
    pub fn rate_hz(&self) -> u32 {
        self.rate_hz
    }

    /// Periods missed so far.
    pub fn overruns(&self) -> u64 {
        self.overruns
    }

    /// Returns the period whose due instant is nearest to an instant, and the distance in nanoseconds; `None` for an instant
    /// before the epoch.
    pub fn nearest_period(epoch_ns: u64, rate_hz: u32, instant_ns: u64) -> Option<(u64, u64)> {
        let elapsed_ns = u128::from(instant_ns.checked_sub(epoch_ns)?);
        let first_ahead = Self::new(epoch_ns, rate_hz).first_period_from(instant_ns);
        let away_ns = |period: u64| since_epoch_ns(period, rate_hz).abs_diff(elapsed_ns) as u64;
        let nearest = [first_ahead, first_ahead.saturating_sub(1)].into_iter().min_by_key(|&period| away_ns(period))?;
        Some((nearest, away_ns(nearest)))
    }

    /// Time from the epoch to a period's due instant, in whole nanoseconds; `None` where it exceeds a `u64`.
    pub fn from_epoch_ns(period: u64, rate_hz: u32) -> Option<u64> {
        since_epoch_ns(period, rate_hz).try_into().ok()
    }

    fn begin_ns(&self, period: u64) -> u64 {
        self.epoch_ns + since_epoch_ns(period, self.rate_hz) as u64
    }

    /// The first period that begins at `now_ns` or later.
    fn first_period_from(&self, now_ns: u64) -> u64 {
        let elapsed = u128::from(now_ns.saturating_sub(self.epoch_ns));
        // Period k begins at the whole nanoseconds of k / rate, so k is the least one with k ≥ elapsed · rate.
        (elapsed * u128::from(self.rate_hz)).div_ceil(1_000_000_000) as u64
    }
}

/// Time from the epoch to a period's due instant, in whole nanoseconds.
fn since_epoch_ns(period: u64, rate_hz: u32) -> u128 {
    u128::from(period) * 1_000_000_000 / u128::from(rate_hz)
}
