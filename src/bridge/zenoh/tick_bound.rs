//! The highest tick that a run of another host can have reached. Pure: the time is an argument.

use crate::source::replay::FASTEST_HZ;

/// Longest delay of a run's first frame that the bound accepts, in seconds. A cut link delays frames.
const MAX_DELAY_S: u64 = 10;
/// Two clocks drift apart by less than one part in this number.
const DRIFT: u64 = 1_000;

/// Upper bound of a run's ticks, derived from its first frame and the elapsed time.
#[derive(Clone, Copy, Debug)]
pub(super) struct TickBound {
    /// Assumed rate of the run's ticks.
    pub(super) rate_hz: u64,
    first: Option<(u64, u64)>,
}

impl TickBound {
    /// Returns the bound of a run of this rate. An unknown rate (0) counts as the highest rate.
    pub(super) fn new(rate_hz: u64) -> Self {
        let most_hz = u64::from(FASTEST_HZ);
        Self { rate_hz: if rate_hz == 0 { most_hz } else { rate_hz.min(most_hz) }, first: None }
    }

    /// Returns whether the run can have reached this tick by now. The first tick is always accepted.
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
    fn delayed_frames_and_the_current_frames_after_them_are_accepted() {
        let mut tick_bound = TickBound::new(1_000);
        assert!(tick_bound.allows(40, SECOND_NS));
        assert!(tick_bound.allows(2_040, 3 * SECOND_NS), "the last frame before a cut");
        for tick in [2_041, 2_100, 7_900, 8_040] {
            assert!(
                tick_bound.allows(tick, 9 * SECOND_NS),
                "{tick}: frames that TCP has buffered, and new ones, at once"
            );
        }
        assert!(tick_bound.allows(3_600_040, 3_601 * SECOND_NS));
    }

    #[test]
    fn a_delayed_first_frame_does_not_make_later_frames_too_early() {
        let mut tick_bound = TickBound::new(1_000);
        assert!(tick_bound.allows(0, SECOND_NS));
        assert!(tick_bound.allows(9_000, SECOND_NS + 1), "the first frame was delayed by nine seconds");
    }

    #[test]
    fn an_impossible_tick_is_rejected_and_changes_nothing() {
        let mut tick_bound = TickBound::new(1_000);
        assert!(tick_bound.allows(0, SECOND_NS));
        for tick in [u64::MAX, 1 << 40, 12_000] {
            assert!(!tick_bound.allows(tick, 2 * SECOND_NS), "{tick}");
        }
        assert!(tick_bound.allows(1_000, 2 * SECOND_NS));
    }

    #[test]
    fn an_unknown_or_impossible_rate_counts_as_the_highest() {
        assert_eq!([0, 60, u64::MAX].map(|rate_hz| TickBound::new(rate_hz).rate_hz), [10_000_000, 60, 10_000_000]);
    }
}
