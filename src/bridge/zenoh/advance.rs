//! How far a run of another host can have come: its ticks pass at its rate, whatever happens to the way.
//!
//! A frame of a later tick is nobody's; taken, it would make all that follow look old.

use crate::source::replay::FASTEST_HZ;

/// How much later than it was sent the first frame may have come, in seconds: what a cut way holds back.
const MAX_DELAY_S: u64 = 10;
/// Clocks differ by less than this share of the time that has passed.
const DRIFT: u64 = 1_000;

/// What the first frame of a run says of those that follow. It reads no clock: the time is handed to it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Advance {
    rate_hz: u64,
    first: Option<(u64, u64)>,
}

impl Advance {
    /// Of a run of this rate; of the greatest one where it is not known.
    pub(super) fn new(rate_hz: u64) -> Self {
        let most_hz = u64::from(FASTEST_HZ);
        Self { rate_hz: if rate_hz == 0 { most_hz } else { rate_hz.min(most_hz) }, first: None }
    }

    /// The rate that is counted on.
    pub(super) fn rate_hz(&self) -> u64 {
        self.rate_hz
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
    fn frames_that_were_held_up_and_those_of_now_behind_them_are_believed() {
        let mut advance = Advance::new(1_000);
        assert!(advance.allows(40, SECOND_NS));
        assert!(advance.allows(2_040, 3 * SECOND_NS), "the last before a cut");
        for tick in [2_041, 2_100, 7_900, 8_040] {
            assert!(advance.allows(tick, 9 * SECOND_NS), "{tick}: what TCP has kept, and what is new, at once");
        }
        assert!(advance.allows(3_600_040, 3_601 * SECOND_NS));
    }

    #[test]
    fn a_first_frame_that_was_held_up_itself_makes_no_later_one_look_early() {
        let mut advance = Advance::new(1_000);
        assert!(advance.allows(0, SECOND_NS));
        assert!(advance.allows(9_000, SECOND_NS + 1), "it had been on its way for nine seconds");
    }

    #[test]
    fn a_tick_that_the_run_cannot_have_come_to_is_not_believed_and_spoils_nothing() {
        let mut advance = Advance::new(1_000);
        assert!(advance.allows(0, SECOND_NS));
        for tick in [u64::MAX, 1 << 40, 12_000] {
            assert!(!advance.allows(tick, 2 * SECOND_NS), "{tick}");
        }
        assert!(advance.allows(1_000, 2 * SECOND_NS));
    }

    #[test]
    fn a_rate_that_nobody_can_have_is_none() {
        assert_eq!([0, 60, u64::MAX].map(|rate_hz| Advance::new(rate_hz).rate_hz()), [10_000_000, 60, 10_000_000]);
    }
}
