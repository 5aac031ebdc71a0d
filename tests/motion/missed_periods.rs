//! Periods that a server misses: ticks that come later, and how the show keeps time.

use bench_dragon::source::server::motion::{FASTEST, HeadState, Motion, MotionSettings};
use bench_dragon_ipc::{Request, ShowState};
use proptest::prelude::*;
use test_support::property::random_cases;

use crate::{after, grant, guarded, plan, planned, start};

/// Plays a motion that misses this many periods before each of its ticks. Returns periods, heads and paces.
fn play_missing(mut motion: Motion, missed: &[u64]) -> Vec<(u64, HeadState, f64)> {
    let mut period = 0;
    let mut play = |&missed: &u64| {
        motion.miss(missed);
        motion.advance();
        period += missed + 1;
        (period - 1, motion.head(), motion.catch_up().pace())
    };
    missed.iter().map(&mut play).collect()
}

#[test]
fn a_jump_shows_the_head_where_it_should_be_at_its_due_instant() {
    let heads = play_missing(planned(plan()), &[0, 0, 3, 0, 250]);
    let shown: Vec<(u64, i64, f64)> =
        heads.iter().map(|(period, head, pace)| (*period, head.show_time_ns / 1_000_000, *pace)).collect();
    assert_eq!(shown, [(0, 0, 1.0), (1, 1, 1.0), (5, 5, 1.0), (6, 6, 1.0), (257, 257, 1.0)]);
}

#[test]
fn a_standstill_is_made_up_exactly_at_a_tenth_more_a_tick() {
    let mut motion = after(start(MotionSettings { most_jumped: 250, ..plan() }), 100);
    motion.miss(251);
    for tick in 1..=2510 {
        motion.advance();
        let expected_ns = 100_000_000 + tick * 1_100_000;
        assert_eq!((motion.head().show_time_ns, motion.catch_up().pace()), (expected_ns, FASTEST), "tick {tick}");
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
    assert_eq!((stood.head().show_time_ns, stood.catch_up().behind_ns(1000)), (10_000_000, 5_000_000));
    let mut motion = stood;
    motion.request(Request::Release).expect("the release is accepted");
    assert_eq!(after(motion.clone(), 1).head().show_time_ns, 11_100_000, "the show catches up");
    motion.request(Request::Seek { show_time_s: 3.0 }).expect("3 s is inside the run");
    assert_eq!((after(motion.clone(), 2).head().show_time_ns, motion.catch_up().behind_ns(1000)), (3_001_000_000, 0));
}

#[test]
fn before_its_first_tick_a_show_misses_nothing() {
    for most_jumped in [0, 250] {
        let mut motion = planned(MotionSettings { most_jumped, ..plan() });
        motion.miss(5);
        motion.advance();
        assert_eq!((motion.head().show_time_ns, motion.catch_up().behind_ns(1000)), (0, 0));
    }
}

#[test]
fn a_show_may_forget_its_lag() {
    let mut motion = after(start(MotionSettings { most_jumped: 0, ..plan() }), 10);
    motion.miss(5);
    motion.forget_lag();
    assert_eq!((motion.catch_up().behind_ns(1000), after(motion, 1).head().show_time_ns), (0, 11_000_000));
}

#[test]
fn commands_apply_from_their_tick_whatever_was_missed_before() {
    let mut motion = after(start(plan()), 10);
    motion.miss(5);
    motion.request(Request::Pause).expect("pause is always accepted");
    assert_eq!(after(motion.clone(), 1).head().show_time_ns, 15_000_000, "the head walked during the missed periods");
    motion.advance();
    motion.miss(5);
    motion.request(Request::Resume).expect("the resume is accepted");
    assert_eq!(after(motion, 1).head().show_time_ns, 16_000_000, "the head stood during the missed periods");
}

#[test]
fn a_guarded_head_that_misses_periods_rests_at_the_end_of_its_grant() {
    for missed in [5, 300] {
        let mut motion = start(MotionSettings { most_jumped: 250, ..guarded() });
        grant(&mut motion, 0.0, 0.003_5).expect("the grant covers the head");
        motion.miss(missed);
        let head = after(motion, 10).head();
        assert_eq!((head.state, head.travel_m, head.show_time_ns), (ShowState::Held, 0.003_5, 3_500_000));
    }
}

#[test]
fn a_run_and_a_show_that_miss_periods_end_exactly_at_their_ends() {
    let ends = [
        (MotionSettings { end_travel_m: 0.010_25, ..plan() }, ShowState::Finished),
        (MotionSettings { until_s: Some(0.010_25), ..plan() }, ShowState::Ended),
        (MotionSettings { until_s: Some(0.010_25), most_jumped: 0, ..plan() }, ShowState::Ended),
    ];
    for (plan, state) in ends {
        let mut motion = start(plan);
        motion.miss(500);
        let head = after(motion, 20).head();
        assert_eq!((head.state, head.show_time_ns), (state, 10_250_000));
        assert!((head.travel_m - 0.010_25).abs() < 1e-15, "{}", head.travel_m);
    }
}

/// Commands to a show, each with the number of periods before it.
fn orders() -> impl Strategy<Value = Vec<(u64, Request)>> {
    let request = prop_oneof![
        Just(Request::Pause),
        Just(Request::Resume),
        Just(Request::Hold),
        Just(Request::Release),
        (0.0..10.0_f64).prop_map(|speed_mps| Request::Speed { speed_mps }),
        (0.0..400.0_f64).prop_map(|show_time_s| Request::Seek { show_time_s }),
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
    #![proptest_config(random_cases(256))]

    /// Two shows get the same commands in the same periods. One ticks in each period. The other misses some periods, but
    /// none with a command. At the ticks of both, they are equal to the bit.
    #[test]
    fn a_show_that_misses_periods_equals_one_that_does_not_to_the_bit(
        plan in plans(),
        orders in orders(),
        gaps in prop::collection::vec(0..30_u64, 1..60),
    ) {
        let (mut whole, mut missing) = (planned(plan.clone()), planned(plan));
        let mut due: Vec<(u64, Request)> = Vec::new();
        for (after, order) in orders {
            due.push((due.last().map_or(0, |(period, _)| *period) + after, order));
        }
        let (mut gaps, mut left, mut missed) = (gaps.iter().cycle(), 0, 0);
        for period in 0..4_000 {
            let now: Vec<Request> = due.iter().filter(|(at, _)| *at == period).map(|(_, order)| *order).collect();
            let outcomes: Vec<_> = now.iter().map(|order| whole.request(*order)).collect();
            whole.advance();
            if period > 0 && left > 0 && now.is_empty() {
                (left, missed) = (left - 1, missed + 1);
                continue;
            }
            missing.miss(missed);
            (left, missed) = (*gaps.next().expect("the cycle has no end"), 0);
            prop_assert_eq!(now.iter().map(|order| missing.request(*order)).collect::<Vec<_>>(), outcomes);
            missing.advance();
            prop_assert_eq!(missing.head(), whole.head(), "period {}", period);
            prop_assert_eq!(missing.limits(), whole.limits());
        }
    }

    /// For any missed periods and any length of jumps: a repetition gives the same bits, show time advances at most a tenth
    /// too fast, and the reported delay is exact.
    #[test]
    fn a_show_keeps_time_or_reports_its_delay(
        missed in prop::collection::vec(prop_oneof![4 => Just(0), 2 => 1..5_u64, 1 => 5..200_u64], 1..300),
        most_jumped in 0..50_u64,
        tick_s in 0.000_01..0.01_f64,
    ) {
        let plan = MotionSettings { tick_s, most_jumped, ..MotionSettings::plain(tick_s, 0.0, 1e6) };
        // No period is missed before the first tick.
        let missed = [vec![0], missed].concat();
        let heads = play_missing(planned(plan.clone()), &missed);
        prop_assert_eq!(&play_missing(planned(plan.clone()), &missed), &heads);
        let mut motion = planned(plan);
        let mut period = 0;
        for missed in missed {
            let before_s = motion.head().travel_m;
            period += missed;
            motion.miss(missed);
            motion.advance();
            // At this rate a tenth of a period is a nanosecond, so the delay is exact.
            let behind = motion.catch_up().behind_ns(100_000_000) as f64 / 10.0;
            let shown = motion.head().travel_m / tick_s;
            prop_assert!((shown + behind - period as f64).abs() < 1e-6, "{} and {} at {}", shown, behind, period);
            let step = (motion.head().travel_m - before_s) / tick_s;
            let most = if missed > most_jumped { 1.1 } else { 1.1 * (missed as f64 + 1.0) };
            prop_assert!(step <= most + 1e-6, "{} after {} missed", step, missed);
            period += 1;
        }
    }
}
