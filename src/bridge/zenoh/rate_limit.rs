//! How much may come from another host: events at a rate, and ticks no later than the run can have reached. Pure: the time
//! is an argument.

use crate::source::replay::FASTEST_HZ;

/// A limit. It reads no clock: the time is handed to it.
#[derive(Clone, Copy, Debug)]
pub(super) struct RateLimit {
    /// Nanoseconds in which one more is allowed.
    period_ns: u64,
    /// How many may come at once.
    burst: u64,
    /// When the bucket was last empty, as it were: what has passed since then is what is allowed.
    empty_ns: u64,
}

impl RateLimit {
    /// So many a second, and `burst` of them at once; both at least 1.
    pub(super) fn new(per_second: u64, burst: u64) -> Self {
        Self { period_ns: 1_000_000_000 / per_second.clamp(1, 1_000_000_000), burst: burst.max(1), empty_ns: 0 }
    }

    /// Whether one more is allowed now, and if so counts it.
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

/// How much later than it was sent the first frame may have come, in seconds: what a cut way holds back.
const MAX_DELAY_S: u64 = 10;
/// Clocks differ by less than this share of the time that has passed.
const DRIFT: u64 = 1_000;

/// What the first frame of a run says of those that follow. It reads no clock: the time is handed to it.
#[derive(Clone, Copy, Debug)]
pub(super) struct TickBound {
    /// The rate that is counted on.
    pub(super) rate_hz: u64,
    first: Option<(u64, u64)>,
}

impl TickBound {
    /// Of a run of this rate; of the greatest one where it is not known.
    pub(super) fn new(rate_hz: u64) -> Self {
        let most_hz = u64::from(FASTEST_HZ);
        Self { rate_hz: if rate_hz == 0 { most_hz } else { rate_hz.min(most_hz) }, first: None }
    }

    /// Whether the run can have come to this tick by now. The first one is believed.
    pub(super) fn allows(&mut self, tick: u64, now_ns: u64) -> bool {
        let &mut (first_tick, first_ns) = self.first.get_or_insert((tick, now_ns));
        let elapsed_ms = now_ns.saturating_sub(first_ns) / 1_000_000;
        let passed = (elapsed_ms + elapsed_ms / DRIFT).saturating_mul(self.rate_hz) / 1_000;
        tick.saturating_sub(first_tick) <= passed.saturating_add(MAX_DELAY_S * self.rate_hz)
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
    fn waiting_saves_up_no_more_than_a_burst() {
        let mut limit = RateLimit::new(10, 3);
        assert!(limit.allows(SECOND_NS));
        assert_eq!((0..9).filter(|_| limit.allows(900 * SECOND_NS)).count(), 3);
    }

    #[test]
    fn a_clock_that_stands_or_goes_back_allows_nothing_more() {
        let mut limit = RateLimit::new(1, 1);
        assert!(limit.allows(5 * SECOND_NS));
        assert!(!limit.allows(5 * SECOND_NS) && !limit.allows(0));
    }

    #[test]
    fn frames_that_were_held_up_and_those_of_now_behind_them_are_believed() {
        let mut tick_bound = TickBound::new(1_000);
        assert!(tick_bound.allows(40, SECOND_NS));
        assert!(tick_bound.allows(2_040, 3 * SECOND_NS), "the last before a cut");
        for tick in [2_041, 2_100, 7_900, 8_040] {
            assert!(tick_bound.allows(tick, 9 * SECOND_NS), "{tick}: what TCP has kept, and what is new, at once");
        }
        assert!(tick_bound.allows(3_600_040, 3_601 * SECOND_NS));
    }

    #[test]
    fn a_first_frame_that_was_held_up_itself_makes_no_later_one_look_early() {
        let mut tick_bound = TickBound::new(1_000);
        assert!(tick_bound.allows(0, SECOND_NS));
        assert!(tick_bound.allows(9_000, SECOND_NS + 1), "it had been on its way for nine seconds");
    }

    #[test]
    fn a_tick_that_the_run_cannot_have_come_to_is_not_believed_and_spoils_nothing() {
        let mut tick_bound = TickBound::new(1_000);
        assert!(tick_bound.allows(0, SECOND_NS));
        for tick in [u64::MAX, 1 << 40, 12_000] {
            assert!(!tick_bound.allows(tick, 2 * SECOND_NS), "{tick}");
        }
        assert!(tick_bound.allows(1_000, 2 * SECOND_NS));
    }

    #[test]
    fn a_rate_that_nobody_can_have_is_none() {
        assert_eq!([0, 60, u64::MAX].map(|rate_hz| TickBound::new(rate_hz).rate_hz), [10_000_000, 60, 10_000_000]);
    }
}
