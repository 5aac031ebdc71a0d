//! A limit on the rate of events. Pure: the time is an argument.

/// A limit on the rate of events: a token bucket.
#[derive(Clone, Copy, Debug)]
pub(super) struct RateLimit {
    /// Nanoseconds per allowed event.
    period_ns: u64,
    /// Most events at once.
    burst: u64,
    /// Virtual instant at which the bucket was empty. The time since then, in periods, is the number of allowed events.
    empty_ns: u64,
}

impl RateLimit {
    /// Allows `per_second` events per second, and `burst` events at once. Both are raised to at least 1.
    pub(super) fn new(per_second: u64, burst: u64) -> Self {
        Self { period_ns: 1_000_000_000 / per_second.clamp(1, 1_000_000_000), burst: burst.max(1), empty_ns: 0 }
    }

    /// Returns whether one more event is allowed now. Counts an allowed event.
    pub(super) fn allows(&mut self, now_ns: u64) -> bool {
        let full_ns = self.period_ns.saturating_mul(self.burst);
        self.empty_ns = self.empty_ns.max(now_ns.saturating_sub(full_ns));
        let next_ns = self.empty_ns.saturating_add(self.period_ns);
        let is_allowed = next_ns <= now_ns;
        if is_allowed {
            self.empty_ns = next_ns;
        }
        is_allowed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND_NS: u64 = 1_000_000_000;

    #[test]
    fn a_burst_is_allowed_and_then_the_rate() {
        let mut limit = RateLimit::new(10, 3);
        let at_once = (0..9).filter(|_| limit.allows(SECOND_NS)).count();
        assert_eq!(at_once, 3);
        assert!(!limit.allows(SECOND_NS + SECOND_NS / 10 - 1));
        assert!(limit.allows(SECOND_NS + SECOND_NS / 10));
        assert!(!limit.allows(SECOND_NS + SECOND_NS / 10));
    }

    #[test]
    fn idle_time_allows_no_more_than_a_burst() {
        let mut limit = RateLimit::new(10, 3);
        assert!(limit.allows(SECOND_NS));
        assert_eq!((0..9).filter(|_| limit.allows(900 * SECOND_NS)).count(), 3);
    }

    #[test]
    fn a_clock_that_stops_or_goes_back_allows_no_more_events() {
        let mut limit = RateLimit::new(1, 1);
        assert!(limit.allows(5 * SECOND_NS));
        assert!(!limit.allows(5 * SECOND_NS) && !limit.allows(0));
    }
}
