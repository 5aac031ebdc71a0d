//! Rule by which a show keeps time with the clock although periods are missed. Pure.
//!
//! - *Jump.* After a few missed periods the show advances by as many periods at once. So the next frame shows the
//!   dragon at the position that is due.
//! - *Catch-up.* After a longer standstill the show is *behind* by all missed periods. Each later tick advances by a
//!   tenth of a period more than usual, until the lag is zero.
//!
//! Show time is counted in *parts*, ten to a period. Parts are whole numbers, so nothing drifts: a show that has caught
//! up has exactly the time of one that missed nothing. Only a running show falls behind or catches up. A standing show
//! keeps its lag.

/// Parts of a period.
pub(super) const PARTS: u64 = 10;

/// Greatest pace of a show that catches up, in multiples of its normal pace.
pub const FASTEST: f64 = (PARTS + 1) as f64 / PARTS as f64;

/// Lag of a show behind the clock, and the response to missed periods.
#[derive(Clone, Copy, Debug)]
pub struct CatchUp {
    most_jumped: u64,
    behind: u64,
    most_behind: u64,
    /// Periods jumped since the last tick, and the parts by which the show advanced for them.
    jumped: (u64, u64),
    pace: f64,
}

impl CatchUp {
    /// Creates the state of a show that is on time. It jumps at most `most_jumped` periods at once.
    pub(super) fn new(most_jumped: u64) -> Self {
        Self { most_jumped, behind: 0, most_behind: 0, jumped: (0, 0), pace: 1.0 }
    }

    /// Lag of the show behind the clock, in nanoseconds of wall time, at a rate.
    pub fn behind_ns(&self, rate_hz: u32) -> u64 {
        duration_ns(self.behind, rate_hz)
    }

    /// Greatest lag so far, in nanoseconds of wall time, at a rate.
    pub fn most_behind_ns(&self, rate_hz: u32) -> u64 {
        duration_ns(self.most_behind, rate_hz)
    }

    /// Pace of show time up to the last tick, over the periods since the tick before: 1, or up to [`FASTEST`] while
    /// the show catches up.
    pub fn pace(&self) -> f64 {
        self.pace
    }

    /// Returns the parts by which a running show advances for missed periods, before its tick: 0 after a longer
    /// standstill.
    pub(super) fn miss(&mut self, periods: u64) -> u64 {
        if periods > self.most_jumped {
            self.behind = self.behind.saturating_add(periods.saturating_mul(PARTS));
            return 0;
        }
        let parts = self.go_on(periods);
        self.jumped = (periods, parts);
        parts
    }

    /// Returns the parts by which a tick advances if the show runs.
    pub(super) fn tick(&mut self, runs: bool) -> u64 {
        self.most_behind = self.most_behind.max(self.behind);
        let (periods, parts) = std::mem::take(&mut self.jumped);
        let tick_parts = if runs { self.go_on(1) } else { PARTS };
        self.pace = (parts + tick_parts) as f64 / ((periods + 1) * PARTS) as f64;
        tick_parts
    }

    pub(super) fn clear(&mut self) {
        self.behind = 0;
    }

    /// Returns the parts of `periods` periods, plus the lag that the show makes up in them.
    fn go_on(&mut self, periods: u64) -> u64 {
        let made_up = self.behind.min(periods);
        self.behind -= made_up;
        periods * PARTS + made_up
    }
}

fn duration_ns(parts: u64, rate_hz: u32) -> u64 {
    let duration_ns = u128::from(parts) * (1_000_000_000 / u128::from(PARTS)) / u128::from(rate_hz);
    u64::try_from(duration_ns).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_show_jumps_a_few_missed_periods_at_its_normal_pace() {
        let mut catch_up = CatchUp::new(5);
        assert_eq!((catch_up.miss(5), catch_up.tick(true), catch_up.pace()), (50, 10, 1.0));
        assert_eq!((catch_up.behind_ns(1000), catch_up.most_behind_ns(1000)), (0, 0));
    }

    #[test]
    fn after_a_standstill_each_tick_makes_up_a_tenth_of_a_period() {
        let mut catch_up = CatchUp::new(5);
        assert_eq!((catch_up.miss(6), catch_up.behind_ns(1000)), (0, 6_000_000));
        let parts: Vec<u64> = (0..62).map(|_| catch_up.tick(true)).collect();
        assert_eq!(parts, [[11; 60].as_slice(), &[10; 2]].concat());
        assert_eq!((catch_up.behind_ns(1000), catch_up.most_behind_ns(1000)), (0, 6_000_000));
    }

    #[test]
    fn a_jump_during_catch_up_makes_up_a_tenth_for_each_period() {
        let mut catch_up = CatchUp::new(5);
        catch_up.miss(6);
        assert_eq!((catch_up.miss(3), catch_up.tick(true), catch_up.pace()), (33, 11, 1.1));
        assert_eq!(catch_up.behind_ns(1000), 5_600_000);
    }

    #[test]
    fn a_standing_show_keeps_its_lag_and_a_seek_clears_it() {
        let mut catch_up = CatchUp::new(0);
        catch_up.miss(1);
        assert_eq!((catch_up.tick(false), catch_up.pace(), catch_up.behind_ns(1000)), (10, 1.0, 1_000_000));
        catch_up.clear();
        assert_eq!((catch_up.tick(true), catch_up.behind_ns(1000), catch_up.most_behind_ns(1000)), (10, 0, 1_000_000));
    }

    #[test]
    fn a_standstill_of_any_length_overflows_nothing() {
        let mut catch_up = CatchUp::new(0);
        catch_up.miss(u64::MAX);
        catch_up.miss(u64::MAX);
        assert_eq!((catch_up.tick(true), catch_up.behind_ns(1)), (11, u64::MAX));
    }
}
