//! How a show keeps time with the clock although releases are missed. Pure.
//!
//! - *A jump.* A show that has missed a few releases goes on by as many periods at once, so that the next frame shows the
//!   dragon where it should be when that frame is due.
//! - *Making up.* After a longer standstill the show is *behind* by all the releases missed. Every tick from then on goes on
//!   by a tenth of a period more than it should, until the show is behind by nothing.
//!
//! Show time is counted in *parts*, ten to a period: whole numbers, so that nothing drifts, and a show that has caught up is
//! exactly where it would have been. Only a running show falls behind or makes up; one that stands keeps what it is behind.

/// Parts of a period.
pub(super) const PARTS: u64 = 10;

/// The most that a show which makes up goes on by, in times its pace.
pub const FASTEST: f64 = (PARTS + 1) as f64 / PARTS as f64;

/// How far a show is behind the clock, and what it does about missed releases.
#[derive(Clone, Copy, Debug)]
pub struct CatchUp {
    most_jumped: u64,
    behind: u64,
    most_behind: u64,
    /// Releases jumped since the last tick, and the parts that the show went on by.
    jumped: (u64, u64),
    pace: f64,
}

impl CatchUp {
    /// A show that is on time, and that jumps at most so many releases at once.
    pub(super) fn new(most_jumped: u64) -> Self {
        Self { most_jumped, behind: 0, most_behind: 0, jumped: (0, 0), pace: 1.0 }
    }

    /// How far the show is behind the clock, in nanoseconds of wall time, at a rate.
    pub fn behind_ns(&self, rate_hz: u32) -> u64 {
        duration_ns(self.behind, rate_hz)
    }

    /// The furthest that it has been behind, in nanoseconds of wall time, at a rate.
    pub fn most_behind_ns(&self, rate_hz: u32) -> u64 {
        duration_ns(self.most_behind, rate_hz)
    }

    /// How fast show time went on to the last tick, over the releases since the tick before: 1, or up to [`FASTEST`] while
    /// the show makes up.
    pub fn pace(&self) -> f64 {
        self.pace
    }

    /// Parts by which a running show goes on because of missed releases, before its tick: none after a longer standstill.
    pub(super) fn miss(&mut self, releases: u64) -> u64 {
        if releases > self.most_jumped {
            self.behind = self.behind.saturating_add(releases.saturating_mul(PARTS));
            return 0;
        }
        let parts = self.go_on(releases);
        self.jumped = (releases, parts);
        parts
    }

    /// Parts by which a tick goes on, if the show runs.
    pub(super) fn tick(&mut self, runs: bool) -> u64 {
        self.most_behind = self.most_behind.max(self.behind);
        let (releases, parts) = std::mem::take(&mut self.jumped);
        let tick_parts = if runs { self.go_on(1) } else { PARTS };
        self.pace = (parts + tick_parts) as f64 / ((releases + 1) * PARTS) as f64;
        tick_parts
    }

    /// Puts the show on time.
    pub(super) fn clear(&mut self) {
        self.behind = 0;
    }

    /// Parts of so many periods, and of what is made up in them.
    fn go_on(&mut self, releases: u64) -> u64 {
        let made_up = self.behind.min(releases);
        self.behind -= made_up;
        releases * PARTS + made_up
    }
}

fn duration_ns(parts: u64, rate_hz: u32) -> u64 {
    let duration_ns = u128::from(parts) * (1_000_000_000 / u128::from(PARTS)) / u128::from(rate_hz);
    u64::try_from(duration_ns).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::{Request, ShowState};
    use proptest::prelude::*;

    use super::super::tests::{after, grant, guarded, plan, planned, start};
    use super::super::{HeadState, Motion, MotionSettings};
    use super::*;

    #[test]
    fn a_short_miss_is_jumped_at_the_same_pace() {
        let mut catch_up = CatchUp::new(5);
        assert_eq!((catch_up.miss(5), catch_up.tick(true), catch_up.pace()), (50, 10, 1.0));
        assert_eq!((catch_up.behind_ns(1000), catch_up.most_behind_ns(1000)), (0, 0));
    }

    #[test]
    fn a_standstill_is_made_up_by_a_tenth_more_a_tick_and_no_more() {
        let mut catch_up = CatchUp::new(5);
        assert_eq!((catch_up.miss(6), catch_up.behind_ns(1000)), (0, 6_000_000));
        let parts: Vec<u64> = (0..62).map(|_| catch_up.tick(true)).collect();
        assert_eq!(parts, [[11; 60].as_slice(), &[10; 2]].concat());
        assert_eq!((catch_up.behind_ns(1000), catch_up.most_behind_ns(1000)), (0, 6_000_000));
    }

    #[test]
    fn a_jump_while_it_makes_up_makes_up_for_each_release() {
        let mut catch_up = CatchUp::new(5);
        catch_up.miss(6);
        assert_eq!((catch_up.miss(3), catch_up.tick(true), catch_up.pace()), (33, 11, 1.1));
        assert_eq!(catch_up.behind_ns(1000), 5_600_000);
    }

    #[test]
    fn a_show_that_stands_makes_up_nothing_and_a_seek_puts_it_on_time() {
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

    /// A motion that misses so many releases before each of its ticks: their releases, the heads, and the pace.
    fn play_missing(mut motion: Motion, missed: &[u64]) -> Vec<(u64, HeadState, f64)> {
        let mut release = 0;
        let mut play = |&missed: &u64| {
            motion.miss(missed);
            motion.advance();
            release += missed + 1;
            (release - 1, motion.head(), motion.catch_up().pace())
        };
        missed.iter().map(&mut play).collect()
    }

    #[test]
    fn a_jump_shows_the_head_where_it_should_be_at_its_release() {
        let heads = play_missing(planned(plan()), &[0, 0, 3, 0, 250]);
        let shown: Vec<(u64, i64, f64)> =
            heads.iter().map(|(release, head, pace)| (*release, head.sim_time_ns / 1_000_000, *pace)).collect();
        assert_eq!(shown, [(0, 0, 1.0), (1, 1, 1.0), (5, 5, 1.0), (6, 6, 1.0), (257, 257, 1.0)]);
    }

    #[test]
    fn a_standstill_is_made_up_exactly_at_a_tenth_more_a_tick() {
        let mut motion = after(start(MotionSettings { most_jumped: 250, ..plan() }), 100);
        motion.miss(251);
        for tick in 1..=2510 {
            motion.advance();
            let expected_ns = 100_000_000 + tick * 1_100_000;
            assert_eq!((motion.head().sim_time_ns, motion.catch_up().pace()), (expected_ns, FASTEST), "tick {tick}");
        }
        assert_eq!((motion.catch_up().behind_ns(1000), motion.catch_up().most_behind_ns(1000)), (0, 251_000_000));
        let on_time = after(start(plan()), 100 + 251 + 2510);
        assert_eq!(motion.head(), on_time.head(), "to the bit");
        motion.advance();
        assert_eq!((motion.head(), motion.catch_up().pace()), (after(on_time, 1).head(), 1.0));
    }

    #[test]
    fn a_show_that_stands_falls_no_further_behind_and_a_seek_puts_it_on_time() {
        let mut motion = after(start(MotionSettings { most_jumped: 0, ..plan() }), 10);
        motion.miss(5);
        motion.request(Request::Hold).expect("hold is always accepted");
        motion.advance();
        motion.miss(1000);
        let stood = after(motion, 3);
        assert_eq!((stood.head().sim_time_ns, stood.catch_up().behind_ns(1000)), (10_000_000, 5_000_000));
        let mut motion = stood;
        motion.request(Request::Release).expect("a held show is released");
        assert_eq!(after(motion, 1).head().sim_time_ns, 11_100_000, "what it was behind by is made up");
        motion.request(Request::Seek { sim_time_s: 3.0 }).expect("3 s is inside the run");
        assert_eq!((after(motion, 2).head().sim_time_ns, motion.catch_up().behind_ns(1000)), (3_001_000_000, 0));
    }

    #[test]
    fn commands_hold_from_their_release_whatever_was_missed_before() {
        let mut motion = after(start(plan()), 10);
        motion.miss(5);
        motion.request(Request::Pause).expect("pause is always accepted");
        assert_eq!(after(motion, 1).head().sim_time_ns, 15_000_000, "it walked through the releases missed");
        motion.advance();
        motion.miss(5);
        motion.request(Request::Resume).expect("a paused show resumes");
        assert_eq!(after(motion, 1).head().sim_time_ns, 16_000_000, "it stood through the releases missed");
    }

    #[test]
    fn a_guarded_head_that_misses_releases_rests_at_the_end_of_its_grant() {
        for missed in [5, 300] {
            let mut motion = start(MotionSettings { most_jumped: 250, ..guarded() });
            grant(&mut motion, 0.0, 0.003_5).expect("the head is there");
            motion.miss(missed);
            let head = after(motion, 10).head();
            assert_eq!((head.state, head.travel_m, head.sim_time_ns), (ShowState::Held, 0.003_5, 3_500_000));
        }
    }

    #[test]
    fn a_run_and_a_show_that_miss_releases_end_exactly_at_their_ends() {
        let ends = [
            (MotionSettings { end_travel_m: 0.010_25, ..plan() }, ShowState::Finished),
            (MotionSettings { until_s: Some(0.010_25), ..plan() }, ShowState::Ended),
            (MotionSettings { until_s: Some(0.010_25), most_jumped: 0, ..plan() }, ShowState::Ended),
        ];
        for (plan, state) in ends {
            let mut motion = start(plan);
            motion.miss(500);
            let head = after(motion, 20).head();
            assert_eq!((head.state, head.sim_time_ns), (state, 10_250_000));
            assert!((head.travel_m - 0.010_25).abs() < 1e-15, "{}", head.travel_m);
        }
    }

    /// What happens to a show, after so many releases more.
    fn orders() -> impl Strategy<Value = Vec<(u64, Request)>> {
        let request = prop_oneof![
            Just(Request::Pause),
            Just(Request::Resume),
            Just(Request::Hold),
            Just(Request::Release),
            (0.0..10.0_f64).prop_map(|speed_mps| Request::Speed { speed_mps }),
            (0.0..400.0_f64).prop_map(|sim_time_s| Request::Seek { sim_time_s }),
            (0.0..40.0_f64).prop_map(|to_m| Request::Grant { run_id: 7, from_m: 0.0, to_m, is_final: false }),
        ];
        prop::collection::vec((1..400_u64, request), 0..10)
    }

    fn plans() -> impl Strategy<Value = MotionSettings> {
        let pace = (0.000_01..0.5_f64, prop::option::of(0.05..20.0_f64), prop::bool::ANY);
        (pace, prop::option::of(0.0..50.0_f64)).prop_map(|((tick_s, accel_mps2, guards), until_s)| MotionSettings {
            tick_s,
            accel_mps2,
            until_s,
            guarded_run: guards.then_some(7),
            ..plan()
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Two shows with the same commands at the same releases: one ticks at each, the other misses some, but for those at
        /// which there is a command. Where both tick they are equal to the bit.
        #[test]
        fn a_show_that_misses_releases_is_where_it_would_be_to_the_bit(
            plan in plans(),
            orders in orders(),
            gaps in prop::collection::vec(0..30_u64, 1..60),
        ) {
            let (mut whole, mut missing) = (planned(plan), planned(plan));
            let mut due: Vec<(u64, Request)> = Vec::new();
            for (after, order) in orders {
                due.push((due.last().map_or(0, |(release, _)| *release) + after, order));
            }
            let (mut gaps, mut left, mut missed) = (gaps.iter().cycle(), 0, 0);
            for release in 0..4_000 {
                let now: Vec<Request> = due.iter().filter(|(at, _)| *at == release).map(|(_, order)| *order).collect();
                let outcomes: Vec<_> = now.iter().map(|order| whole.request(*order)).collect();
                whole.advance();
                if release > 0 && left > 0 && now.is_empty() {
                    (left, missed) = (left - 1, missed + 1);
                    continue;
                }
                missing.miss(missed);
                (left, missed) = (*gaps.next().expect("they go round"), 0);
                prop_assert_eq!(now.iter().map(|order| missing.request(*order)).collect::<Vec<_>>(), outcomes);
                missing.advance();
                prop_assert_eq!(missing.head(), whole.head(), "release {}", release);
                prop_assert_eq!(missing.limits(), whole.limits());
            }
        }

        /// Any releases missed, any length of jumps: twice the same gives the same bits, show time goes on by no more than a
        /// tenth too much, and what the show is behind by is what it lacks.
        #[test]
        fn a_show_keeps_time_or_says_how_far_it_is_behind(
            missed in prop::collection::vec(prop_oneof![4 => Just(0), 2 => 1..5_u64, 1 => 5..200_u64], 1..300),
            most_jumped in 0..50_u64,
            tick_s in 0.000_01..0.01_f64,
        ) {
            let plan = MotionSettings { tick_s, most_jumped, ..MotionSettings::plain(tick_s, 0.0, 1e6) };
            // Nothing is missed before the first tick.
            let missed = [vec![0], missed].concat();
            let heads = play_missing(planned(plan), &missed);
            prop_assert_eq!(&play_missing(planned(plan), &missed), &heads);
            let mut motion = planned(plan);
            let mut release = 0;
            for missed in missed {
                let before_s = motion.head().travel_m;
                release += missed;
                motion.miss(missed);
                motion.advance();
                // A rate at which a tenth of a period is a nanosecond: what it is behind by is exact.
                let behind = motion.catch_up().behind_ns(100_000_000) as f64 / 10.0;
                let shown = motion.head().travel_m / tick_s;
                prop_assert!((shown + behind - release as f64).abs() < 1e-6, "{} and {} at {}", shown, behind, release);
                let step = (motion.head().travel_m - before_s) / tick_s;
                let most = if missed > most_jumped { 1.1 } else { 1.1 * (missed as f64 + 1.0) };
                prop_assert!(step <= most + 1e-6, "{} after {} missed", step, missed);
                release += 1;
            }
        }
    }
}
