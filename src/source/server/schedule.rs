//! Schedule of the ticks.
//!
//! Release k is due at `epoch + k / rate`, computed in integers from the epoch, so that rounding never accumulates. The
//! schedule skips a release that passes while the server is busy or suspended, and counts it. Ticks are not skipped.
//! [`super::motion::CatchUp`] decides how the show makes up for a missed release.

/// The releases of a server, counted from its epoch.
#[derive(Clone, Copy, Debug)]
pub struct Schedule {
    epoch_ns: u64,
    rate_hz: u32,
    next: u64,
    overruns: u64,
}

impl Schedule {
    /// Creates a schedule whose release 0 is due at the epoch. The rate is above 0.
    pub fn new(epoch_ns: u64, rate_hz: u32) -> Self {
        assert!(rate_hz > 0, "the rate must be above 0");
        Self { epoch_ns, rate_hz, next: 0, overruns: 0 }
    }

    /// Instant at which the next release is due, in nanoseconds of `CLOCK_MONOTONIC`.
    pub fn due_ns(&self) -> u64 {
        self.release_ns(self.next)
    }

    /// Moves to the next release at the end of a tick: the first release that is due at `now_ns` or later.
    ///
    /// Returns the number of releases that it skips.
    pub fn advance(&mut self, now_ns: u64) -> u64 {
        self.next += 1;
        let first_ahead = if self.due_ns() < now_ns { self.first_release_from(now_ns) } else { self.next };
        let missed = first_ahead - self.next;
        self.overruns += missed;
        self.next = first_ahead;
        missed
    }

    /// Releases a second.
    pub fn rate_hz(&self) -> u32 {
        self.rate_hz
    }

    /// Releases skipped so far.
    pub fn overruns(&self) -> u64 {
        self.overruns
    }

    /// Returns the release nearest to an instant, and its distance in nanoseconds; `None` for an instant before the
    /// epoch.
    pub fn nearest_release(epoch_ns: u64, rate_hz: u32, instant_ns: u64) -> Option<(u64, u64)> {
        let elapsed_ns = u128::from(instant_ns.checked_sub(epoch_ns)?);
        let first_ahead = Self::new(epoch_ns, rate_hz).first_release_from(instant_ns);
        let away_ns = |release: u64| since_epoch_ns(release, rate_hz).abs_diff(elapsed_ns) as u64;
        let nearest =
            [first_ahead, first_ahead.saturating_sub(1)].into_iter().min_by_key(|&release| away_ns(release))?;
        Some((nearest, away_ns(nearest)))
    }

    /// Time from the epoch to a release, in whole nanoseconds; `None` where it exceeds a `u64`.
    pub fn from_epoch_ns(release: u64, rate_hz: u32) -> Option<u64> {
        since_epoch_ns(release, rate_hz).try_into().ok()
    }

    fn release_ns(&self, release: u64) -> u64 {
        self.epoch_ns + since_epoch_ns(release, self.rate_hz) as u64
    }

    /// The first release that is due at `now_ns` or later.
    fn first_release_from(&self, now_ns: u64) -> u64 {
        let elapsed = u128::from(now_ns.saturating_sub(self.epoch_ns));
        // Release r is due at the whole nanoseconds of r / rate, so r is the least one with r ≥ elapsed · rate.
        (elapsed * u128::from(self.rate_hz)).div_ceil(1_000_000_000) as u64
    }
}

/// Time from the epoch to a release, in whole nanoseconds.
fn since_epoch_ns(release: u64, rate_hz: u32) -> u128 {
    u128::from(release) * 1_000_000_000 / u128::from(rate_hz)
}
