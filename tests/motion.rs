//! The motion of the head, tick by tick: requests, grants, ends and missed periods.

use bench_dragon::source::server::motion::{FASTEST, HeadState, Motion, MotionPlan, MotionSettings};
use bench_dragon_geometry::formation::Timetable;
use bench_dragon_ipc::{Refusal, Request, ShowState, Stop, Stops};
use proptest::prelude::*;
use test_support::property::random_cases;

fn plan() -> MotionSettings {
    MotionSettings::plain(0.001, 0.0, 400.0)
}

/// Returns the motion before tick 0.
fn planned(settings: MotionSettings) -> Motion {
    Motion::new(MotionPlan::new(settings).expect("the settings are sound"))
}

/// Returns the motion at tick 0.
fn start(plan: MotionSettings) -> Motion {
    after(planned(plan), 1)
}

fn after(mut motion: Motion, ticks: u64) -> Motion {
    for _ in 0..ticks {
        motion.advance();
    }
    motion
}

#[test]
fn running_ticks_advance_show_time_by_exactly_one_step() {
    let motion = after(start(MotionSettings { tick_s: 20.0 / 1000.0, ..plan() }), 12_345);
    assert_eq!(motion.head().show_time_ns, 246_900_000_000);
    assert_eq!(motion.head().travel_m, 12_345.0 * 0.02);
}

#[test]
fn a_paused_show_stands_and_resumes_where_it_stood() {
    let mut motion = after(start(plan()), 5);
    motion.request(Request::Pause).expect("pause is always accepted");
    let paused = after(motion.clone(), 100).head();
    assert_eq!((paused.state, paused.speed_mps, paused.show_time_ns), (ShowState::Paused, 0.0, 5_000_000));
    motion.request(Request::Resume).expect("the resume is accepted");
    assert_eq!(after(motion, 1).head().show_time_ns, 6_000_000);
}

#[test]
fn only_release_lifts_a_hold() {
    let mut motion = after(start(plan()), 5);
    motion.request(Request::Hold).expect("hold is always accepted");
    assert_eq!(motion.request(Request::Resume), Err(Refusal::Held));
    assert_eq!(after(motion.clone(), 9).head().state, ShowState::Held);
    motion.request(Request::Release).expect("the release is accepted");
    assert_eq!(motion.head().state, ShowState::Running);
    assert_eq!(motion.request(Request::Release), Err(Refusal::NotHeld));
}

#[test]
fn a_seek_to_the_last_show_time_is_at_the_end_in_spite_of_rounding() {
    let (mut rounded_up, mut rounded_down) = (0, 0);
    for number in 1..1000 {
        let (speed_mps, end_travel_m) = (0.1 + 0.0037 * f64::from(number), 61.85);
        let last_s = end_travel_m / speed_mps;
        rounded_up += u32::from(speed_mps * last_s > end_travel_m);
        rounded_down += u32::from(speed_mps * last_s < end_travel_m);
        let mut motion =
            start(MotionSettings { speed_mps, start_speed_mps: speed_mps, end_travel_m, last_s, ..plan() });
        motion.request(Request::Seek { show_time_s: last_s }).expect("the end is inside the run");
        let head = after(motion, 1).head();
        assert_eq!((head.travel_m, head.state), (end_travel_m, ShowState::Finished));
    }
    assert!(rounded_up > 0 && rounded_down > 0, "{rounded_up} cases are rounded up, {rounded_down} down");
}

#[test]
fn a_show_is_ready_at_its_start_until_its_first_release() {
    let mut motion = after(start(MotionSettings { is_ready: true, ..plan() }), 9);
    assert_eq!((motion.head().state, motion.head().travel_m), (ShowState::Ready, 0.0));
    assert_eq!(motion.stops(), Stops::from([Stop::Ready]));
    assert_eq!(motion.request(Request::Resume), Err(Refusal::Ready));
    motion.request(Request::Release).expect("the release starts the show");
    assert_eq!(after(motion.clone(), 3).head().travel_m, 0.003);
    assert_eq!(motion.request(Request::Release), Err(Refusal::NotHeld));
}

#[test]
fn a_hold_before_the_first_release_is_a_safety_stop() {
    let mut motion = start(MotionSettings { is_ready: true, ..plan() });
    motion.request(Request::Hold).expect("hold is always accepted");
    assert_eq!(motion.head().state, ShowState::Held);
    motion.request(Request::Release).expect("the release is accepted");
    assert_eq!(motion.head().state, ShowState::Running);
}

#[test]
fn only_the_first_hold_of_a_restarted_server_is_that_of_its_restart() {
    let mut motion = start(MotionSettings { is_held: true, is_restarted: true, ..plan() });
    assert_eq!(motion.head().state, ShowState::Held);
    assert_eq!(motion.stops(), Stops::from([Stop::Held, Stop::Restarted]));
    motion.request(Request::Hold).expect("hold is always accepted");
    assert_eq!(motion.stops(), Stops::from([Stop::Held]));
}

#[test]
fn a_pause_outlasts_a_hold() {
    let mut motion = start(plan());
    for request in [Request::Pause, Request::Hold, Request::Release] {
        motion.request(request).expect("the three commands are accepted");
    }
    assert_eq!(motion.head().state, ShowState::Paused);
}

#[test]
fn a_new_speed_changes_the_travel_and_not_the_show_time() {
    let mut motion = after(start(plan()), 1000);
    motion.request(Request::Speed { speed_mps: 2.0 }).expect("2 m/s is allowed");
    let head = after(motion, 500).head();
    assert_eq!(head.show_time_ns, 1_500_000_000);
    assert!((head.travel_m - 2.0).abs() < 1e-12, "{}", head.travel_m);
}

#[test]
fn impossible_speeds_are_refused_with_the_range() {
    let mut motion = start(plan());
    for speed_mps in [-0.1, 10.1, f64::NAN, f64::INFINITY] {
        let refusal = motion.request(Request::Speed { speed_mps });
        assert_eq!(refusal, Err(Refusal::OutOfRange { lowest: 0.0, highest: 10.0 }), "{speed_mps}");
    }
}

#[test]
fn a_seek_goes_to_the_configured_speed_times_the_time() {
    let mut motion = after(start(MotionSettings { speed_mps: 0.5, start_speed_mps: 0.5, last_s: 800.0, ..plan() }), 10);
    motion.request(Request::Speed { speed_mps: 3.0 }).expect("3 m/s is allowed");
    motion.request(Request::Seek { show_time_s: 100.0 }).expect("100 s is inside the run");
    assert_eq!(motion.head().travel_m, 50.0);
    assert_eq!(motion.head().speed_mps, 3.0);
    let refusal = motion.request(Request::Seek { show_time_s: 800.1 });
    assert_eq!(refusal, Err(Refusal::OutOfRange { lowest: 0.0, highest: 800.0 }));
}

#[test]
fn a_run_that_starts_before_0_accepts_seeks_back_to_its_start() {
    let plan = MotionSettings { start_s: -2.0, start_travel_m: -2.0, first_s: -2.0, ..plan() };
    let mut motion = after(start(plan), 100);
    assert_eq!(motion.head().show_time_ns, -1_900_000_000);
    motion.request(Request::Seek { show_time_s: -1.5 }).expect("-1.5 s is inside the run");
    assert_eq!(motion.head().travel_m, -1.5);
    let refusal = motion.request(Request::Seek { show_time_s: -2.1 });
    assert_eq!(refusal, Err(Refusal::OutOfRange { lowest: -2.0, highest: 400.0 }));
}

#[test]
fn the_run_ends_exactly_at_its_end() {
    let motion = after(start(MotionSettings { tick_s: 0.3, end_travel_m: 1.0, ..plan() }), 50);
    let head = motion.head();
    assert_eq!((head.state, head.travel_m, head.show_time_ns), (ShowState::Finished, 1.0, 1_000_000_000));
    assert_eq!(motion.clone().request(Request::Resume), Err(Refusal::Finished));
}

#[test]
fn the_show_ends_exactly_at_the_requested_time() {
    let motion = after(start(MotionSettings { tick_s: 0.3, until_s: Some(0.5), ..plan() }), 50);
    let head = motion.head();
    assert_eq!((head.state, head.show_time_ns), (ShowState::Ended, 500_000_000));
    assert!((head.travel_m - 0.5).abs() < 1e-12);
}

#[test]
fn a_seek_starts_a_finished_show_again() {
    let mut motion = after(start(MotionSettings { end_travel_m: 0.002, ..plan() }), 9);
    assert_eq!(motion.head().state, ShowState::Finished);
    motion.request(Request::Seek { show_time_s: 0.0 }).expect("the start is inside the run");
    assert_eq!(after(motion.clone(), 1).head().show_time_ns, 0, "the tick of a seek shows its target");
    assert_eq!(after(motion, 2).head().show_time_ns, 1_000_000);
}

#[test]
fn a_show_that_starts_at_its_end_is_finished() {
    assert_eq!(
        start(MotionSettings { start_s: 400.0, start_travel_m: 400.0, ..plan() }).head().state,
        ShowState::Finished
    );
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

fn guarded() -> MotionSettings {
    MotionSettings { guarded_run: Some(7), ..plan() }
}

fn grant(motion: &mut Motion, from_m: f64, to_m: f64) -> Result<(), Refusal> {
    motion.request(Request::Grant { run_id: 7, from_m, to_m, is_final: false })
}

#[test]
fn a_guarded_head_starts_held_and_walks_exactly_as_far_as_it_was_granted() {
    let mut motion = after(start(guarded()), 10);
    assert_eq!((motion.head().state, motion.head().show_time_ns), (ShowState::Held, 0));
    grant(&mut motion, 0.0, 0.012_345_6).expect("the grant covers the head");
    assert_eq!(after(motion.clone(), 12).head().state, ShowState::Running);
    let head = after(motion.clone(), 20).head();
    assert_eq!((head.state, head.travel_m, head.show_time_ns), (ShowState::Held, 0.012_345_6, 12_345_600));
    let mut motion = after(motion, 50);
    grant(&mut motion, 0.01, 1.0).expect("the grant covers the head");
    assert_eq!(after(motion, 1).head().show_time_ns, 13_345_600, "one step from the place of rest");
}

#[test]
fn neither_release_nor_resume_lifts_a_guards_stop() {
    let mut motion = start(guarded());
    assert_eq!(motion.request(Request::Release), Err(Refusal::HeldByGuard));
    assert_eq!(motion.request(Request::Resume), Err(Refusal::HeldByGuard));
    motion.request(Request::Hold).expect("hold is always accepted");
    motion.request(Request::Release).expect("the release is accepted");
    assert_eq!(after(motion, 5).head().state, ShowState::Held);
}

#[test]
fn a_grant_does_not_lift_a_hold() {
    let mut motion = start(MotionSettings { is_held: true, ..guarded() });
    grant(&mut motion, 0.0, 10.0).expect("the grant covers the head");
    assert_eq!(after(motion.clone(), 5).head().state, ShowState::Held);
    motion.request(Request::Release).expect("the release is accepted");
    assert_eq!(after(motion, 5).head().travel_m, 0.005);
}

#[test]
fn a_guarded_head_is_repositioned_only_where_its_guard_has_proved_it() {
    let mut motion = start(guarded());
    let seek = Request::Seek { show_time_s: 300.0 };
    assert_eq!((motion.request(seek), motion.limits().asked_m), (Err(Refusal::NotProved), Some(300.0)));
    grant(&mut motion, 300.0, 300.5).expect("the grant begins at the target of the seek");
    assert_eq!(motion.head().travel_m, 0.0);
    motion.request(seek).expect("the target is proved");
    assert_eq!(after(motion, 2000).head().travel_m, 300.5);
}

#[test]
fn grants_of_an_unguarded_head_for_another_run_and_outside_the_run_are_refused() {
    let grant = |run_id, from_m, to_m| Request::Grant { run_id, from_m, to_m, is_final: false };
    assert_eq!(start(plan()).request(grant(7, 0.0, 1.0)), Err(Refusal::NotGuarded));
    let mut motion = start(guarded());
    assert_eq!(motion.request(grant(8, 0.0, 1.0)), Err(Refusal::OtherRun));
    for (from_m, to_m) in
        [(2.0, 1.0), (f64::NAN, 1.0), (0.0, f64::NAN), (0.0, f64::INFINITY), (0.0, 401.0), (-1.0, 1.0)]
    {
        let refusal = motion.request(grant(7, from_m, to_m));
        assert!(matches!(refusal, Err(Refusal::OutOfRange { .. })), "{from_m} to {to_m}: {refusal:?}");
    }
    assert_eq!(motion.limits().granted_to_m, Some(0.0));
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

#[test]
fn with_timecode_a_run_ends_where_the_head_has_walked_and_not_where_a_seek_has_repositioned_it() {
    let mut motion = start(MotionSettings { until_s: Some(300.0), ..plan() });
    motion.follow();
    motion.set_stands(false);
    for (show_time_s, state) in [(300.0, ShowState::Finished), (299.0, ShowState::Ended)] {
        motion.request(Request::Seek { show_time_s }).expect("the time is within the run");
        motion = after(motion, 2_000);
        assert_eq!(motion.head().state, state, "from {show_time_s} s");
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

#[test]
fn a_performance_stands_finished_at_its_end_time_until_a_seek_or_a_stop() {
    let mut motion = start(MotionSettings { until_s: Some(0.01), stays: true, ..plan() });
    for _ in 0..2 {
        motion = after(motion, 50);
        assert_eq!((motion.head().state, motion.head().show_time_ns), (ShowState::Finished, 10_000_000));
        motion.request(Request::Seek { show_time_s: 0.005 }).expect("the time is within the run");
        motion = after(motion, 3);
        assert_eq!(motion.head().state, ShowState::Running);
    }
    motion.request(Request::Stop).expect("the command is never refused");
    assert_eq!(after(motion, 1).head().state, ShowState::Ended);
}

#[test]
fn a_run_with_an_end_has_ended_there_and_one_without_is_finished() {
    let ended = after(start(MotionSettings { until_s: Some(0.01), ..plan() }), 20).head();
    assert_eq!((ended.state, ended.show_time_ns), (ShowState::Ended, 10_000_000));
    let finished = after(start(MotionSettings { end_travel_m: 0.01, ..plan() }), 20).head();
    assert_eq!((finished.state, finished.show_time_ns), (ShowState::Finished, 10_000_000));
}

#[test]
fn a_head_reports_every_cause_of_its_stop() {
    let mut motion = start(MotionSettings { is_held: true, ..guarded() });
    motion.request(Request::Pause).expect("the command is never refused");
    assert_eq!(motion.stops(), Stops::from([Stop::Paused, Stop::Held, Stop::GuardLimit]));
    motion.follow();
    motion.request(Request::Stop).expect("the command is never refused");
    assert!(
        motion.stops().has(Stop::Timecode) && motion.stops().has(Stop::Ending) && !motion.stops().has(Stop::RunEnd)
    );
}

/// Returns a guarded head at this travel.
fn guarded_at(travel_m: f64) -> Motion {
    start(MotionSettings { start_s: travel_m, start_travel_m: travel_m, ..guarded() })
}

#[test]
fn without_a_grant_the_head_stays_where_it_is() {
    assert_eq!(guarded_at(12.5).limits().granted_to_m, Some(12.5));
}

#[test]
fn grants_are_joined_and_never_shrink() {
    let mut motion = guarded_at(1.5);
    for (from_m, to_m, limit_m) in [(0.0, 2.0, 2.0), (0.0, 5.0, 5.0), (1.0, 3.0, 5.0)] {
        grant(&mut motion, from_m, to_m).expect("the grant is for this run");
        assert_eq!(motion.limits().granted_to_m, Some(limit_m));
    }
}

#[test]
fn the_permanent_end_is_known_with_its_grant_and_then_stays() {
    let mut motion = guarded_at(1.5);
    for (to_m, is_final, end_m) in [(2.0, false, None), (5.0, true, Some(5.0)), (3.0, false, Some(5.0))] {
        motion.request(Request::Grant { run_id: 7, from_m: 0.0, to_m, is_final }).expect("the grant is for this run");
        assert_eq!(motion.limits().end_m, end_m);
    }
}

#[test]
fn a_grant_for_another_run_is_refused() {
    let mut motion = start(guarded());
    let grant = Request::Grant { run_id: 8, from_m: 0.0, to_m: 9.0, is_final: false };
    assert_eq!(motion.request(grant), Err(Refusal::OtherRun));
    assert_eq!(motion.limits().granted_to_m, Some(0.0));
}

#[test]
fn a_grant_elsewhere_moves_nothing_and_allows_a_seek_to_it() {
    let mut motion = start(guarded());
    let seek =
        |motion: &mut Motion, show_time_s| (motion.request(Request::Seek { show_time_s }), motion.limits().asked_m);
    assert_eq!(seek(&mut motion, 100.0), (Err(Refusal::NotProved), Some(100.0)));
    grant(&mut motion, 100.0, 101.0).expect("the grant is for this run");
    assert_eq!(motion.limits().granted_to_m, Some(0.0));
    assert_eq!(seek(&mut motion, 100.5), (Ok(()), None));
    assert_eq!(motion.limits().granted_to_m, Some(101.0));
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
