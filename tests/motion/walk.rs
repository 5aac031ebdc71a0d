//! How the head walks: its timetable, and how it speeds up and brakes.

use bench_dragon::source::server::motion::{HeadState, MotionPlan, MotionSettings};
use bench_dragon_geometry::formation::Timetable;
use bench_dragon_ipc::{Request, ShowState};
use proptest::prelude::*;
use test_support::property::random_cases;

use crate::{after, grant, guarded, plan, start};

#[test]
fn running_ticks_advance_show_time_by_exactly_one_step() {
    let motion = after(start(MotionSettings { tick_s: 20.0 / 1000.0, ..plan() }), 12_345);
    assert_eq!(motion.head().show_time_ns, 246_900_000_000);
    assert_eq!(motion.head().travel_m, 12_345.0 * 0.02);
}

proptest! {
    #![proptest_config(random_cases(256))]

    /// A run without commands follows the planner's timetable to its end, at any rate.
    #[test]
    fn a_run_keeps_the_timetable_of_the_planner(
        speed_mps in 0.05..5.0_f64,
        accel_mps2 in prop::option::of(0.01..20.0_f64),
        start_s in -50.0..50.0_f64,
        run_m in 0.5..200.0_f64,
        tick_s in 0.01..0.5_f64,
    ) {
        let (start_travel_m, end_travel_m) = (speed_mps * start_s, speed_mps * start_s + run_m);
        let timetable = Timetable::new(speed_mps, accel_mps2, start_s, end_travel_m);
        let (first_s, last_s) = (start_s, end_travel_m / speed_mps);
        let paces = MotionSettings { speed_mps, accel_mps2, tick_s, start_speed_mps: speed_mps, ..plan() };
        let mut motion = start(MotionSettings { start_s, start_travel_m, first_s, last_s, end_travel_m, ..paces });
        while motion.head().state == ShowState::Running {
            let HeadState { show_time_ns, travel_m, speed_mps: walked_mps, .. } = motion.head();
            let time_s = show_time_ns as f64 / 1e9;
            prop_assert!((timetable.travel_m(time_s) - travel_m).abs() < 1e-7, "{travel_m} m at {time_s} s");
            let is_within = time_s < timetable.end_s() - tick_s && time_s > start_s;
            prop_assert!(!is_within || (timetable.speed_mps(time_s) - walked_mps).abs() < 1e-6);
            motion.advance();
        }
        let head = motion.head();
        prop_assert_eq!((head.state, head.travel_m), (ShowState::Finished, end_travel_m));
        prop_assert!((timetable.end_s() - head.show_time_ns as f64 / 1e9).abs() < 1e-6 * (1.0 + timetable.end_s().abs()));
    }
}

#[test]
fn a_plan_with_impossible_values_is_rejected() {
    let sound = plan();
    assert!(MotionPlan::new(sound.clone()).is_ok());
    for (odd, name) in [
        (MotionSettings { speed_mps: 0.0, ..sound.clone() }, "speed_mps"),
        (MotionSettings { accel_mps2: Some(f64::NAN), ..sound.clone() }, "accel_mps2"),
        (MotionSettings { tick_s: f64::INFINITY, ..sound.clone() }, "tick_s"),
        (MotionSettings { until_s: Some(f64::NAN), ..sound.clone() }, "until_s"),
        (MotionSettings { end_travel_m: f64::INFINITY, ..sound.clone() }, "end_travel_m"),
        (MotionSettings { last_s: -1.0, ..sound.clone() }, "last_s"),
        (MotionSettings { start_speed_mps: 10.1, ..sound.clone() }, "start_speed_mps"),
    ] {
        let message = MotionPlan::new(odd).expect_err(name).to_string();
        assert!(message.starts_with(&format!("{name} of a motion is ")), "{message}");
    }
}

#[test]
fn with_an_acceleration_the_head_ramps_up_and_is_paused_once_it_rests() {
    let mut motion = start(MotionSettings { accel_mps2: Some(0.5), ..plan() });
    motion = after(motion, 1000);
    assert!((motion.head().travel_m - 0.25).abs() < 1e-12 && (motion.head().speed_mps - 0.5).abs() < 1e-12);
    motion.request(Request::Pause).expect("pause is always accepted");
    assert_eq!(after(motion.clone(), 500).head().state, ShowState::Stopping);
    let head = after(motion, 1001).head();
    assert_eq!((head.state, head.speed_mps, head.show_time_ns), (ShowState::Paused, 0.0, 2_000_000_000));
    assert!((head.travel_m - 0.5).abs() < 1e-12, "{}", head.travel_m);
}

#[test]
fn with_an_acceleration_the_head_rests_exactly_at_the_end_of_its_grant() {
    for tick_s in [0.000_1, 0.02, 0.4] {
        let mut motion = start(MotionSettings { accel_mps2: Some(0.5), tick_s, ..guarded() });
        grant(&mut motion, 0.0, 7.5).expect("the grant covers the head");
        let head = after(motion, (20.0 / tick_s) as u64).head();
        assert_eq!((head.state, head.travel_m), (ShowState::Held, 7.5));
        // 2 s and 1 m each to speed up and to brake, and 5.5 s between.
        assert!((head.show_time_ns - 9_500_000_000).abs() <= 1, "{}", head.show_time_ns);
    }
}

/// Settings of a head that brakes evenly from 1 m/s to rest in 0.5 s.
fn braking() -> MotionSettings {
    MotionSettings { accel_mps2: Some(2.0), tick_s: 0.1, ..plan() }
}

#[test]
fn a_head_is_stopping_while_it_brakes() {
    for (request, rests_as) in
        [(Request::Pause, ShowState::Paused), (Request::Hold, ShowState::Held), (Request::Stop, ShowState::Ended)]
    {
        let mut motion = after(start(braking()), 20);
        motion.request(request).expect("the command is never refused");
        let states: Vec<ShowState> = (0..6)
            .map(|_| {
                motion.advance();
                motion.head().state
            })
            .collect();
        assert_eq!(states, [[ShowState::Stopping; 4].as_slice(), &[rests_as; 2]].concat(), "{request:?}");
        assert_eq!(motion.head().speed_mps, 0.0);
    }
}

#[test]
fn a_stopping_head_that_is_released_or_resumed_runs_again() {
    for (stop, go) in [(Request::Pause, Request::Resume), (Request::Hold, Request::Release)] {
        let mut motion = after(start(braking()), 20);
        for request in [stop, go] {
            motion.request(request).expect("the command can be revoked at once");
            motion.advance();
        }
        assert_eq!(motion.head().state, ShowState::Running);
    }
}

#[test]
fn a_head_that_stands_ends_with_the_next_tick() {
    let mut motion = after(start(braking()), 20);
    motion.request(Request::Hold).expect("the command is never refused");
    let mut motion = after(motion, 50);
    motion.request(Request::Stop).expect("the command is never refused");
    assert_eq!(after(motion.clone(), 1).head(), HeadState { state: ShowState::Ended, ..motion.head() });
}
