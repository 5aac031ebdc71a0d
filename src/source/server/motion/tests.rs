//! The motion, tick by tick.

use bench_dragon_geometry::planner::HeadTimetable;
use proptest::prelude::*;

use super::*;

pub(super) fn plan() -> MotionSettings {
    MotionSettings::plain(0.001, 0.0, 400.0)
}

/// The motion before tick 0.
pub(super) fn planned(settings: MotionSettings) -> Motion {
    Motion::new(MotionPlan::new(settings).expect("the settings are sound"))
}

/// The motion at tick 0.
pub(super) fn start(plan: MotionSettings) -> Motion {
    after(planned(plan), 1)
}

pub(super) fn after(mut motion: Motion, ticks: u64) -> Motion {
    for _ in 0..ticks {
        motion.advance();
    }
    motion
}

#[test]
fn running_ticks_advance_show_time_by_exactly_one_step() {
    let motion = after(start(MotionSettings { tick_s: 20.0 / 1000.0, ..plan() }), 12_345);
    assert_eq!(motion.head().sim_time_ns, 246_900_000_000);
    assert_eq!(motion.head().travel_m, 12_345.0 * 0.02);
}

#[test]
fn a_paused_show_stands_and_resumes_where_it_stood() {
    let mut motion = after(start(plan()), 5);
    motion.request(Request::Pause).expect("pause is always accepted");
    let paused = after(motion, 100).head();
    assert_eq!((paused.state, paused.speed_mps, paused.sim_time_ns), (ShowState::Paused, 0.0, 5_000_000));
    motion.request(Request::Resume).expect("a paused show resumes");
    assert_eq!(after(motion, 1).head().sim_time_ns, 6_000_000);
}

#[test]
fn only_release_lifts_a_hold() {
    let mut motion = after(start(plan()), 5);
    motion.request(Request::Hold).expect("hold is always accepted");
    assert_eq!(motion.request(Request::Resume), Err(Refusal::Held));
    assert_eq!(after(motion, 9).head().state, ShowState::Held);
    motion.request(Request::Release).expect("a held show is released");
    assert_eq!(motion.head().state, ShowState::Running);
    assert_eq!(motion.request(Request::Release), Err(Refusal::NotHeld));
}

#[test]
fn a_pause_outlasts_a_hold() {
    let mut motion = start(plan());
    for request in [Request::Pause, Request::Hold, Request::Release] {
        motion.request(request).expect("the three are accepted");
    }
    assert_eq!(motion.head().state, ShowState::Paused);
}

#[test]
fn a_new_speed_bends_the_travel_and_not_the_show_time() {
    let mut motion = after(start(plan()), 1000);
    motion.request(Request::Speed { speed_mps: 2.0 }).expect("2 m/s is allowed");
    let head = after(motion, 500).head();
    assert_eq!(head.sim_time_ns, 1_500_000_000);
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
    motion.request(Request::Seek { sim_time_s: 100.0 }).expect("100 s is inside the run");
    assert_eq!(motion.head().travel_m, 50.0);
    assert_eq!(motion.head().speed_mps, 3.0);
    let refusal = motion.request(Request::Seek { sim_time_s: 800.1 });
    assert_eq!(refusal, Err(Refusal::OutOfRange { lowest: 0.0, highest: 800.0 }));
}

#[test]
fn a_run_that_starts_before_0_may_be_sought_as_far_back() {
    let plan = MotionSettings { start_s: -2.0, start_travel_m: -2.0, first_s: -2.0, ..plan() };
    let mut motion = after(start(plan), 100);
    assert_eq!(motion.head().sim_time_ns, -1_900_000_000);
    motion.request(Request::Seek { sim_time_s: -1.5 }).expect("-1.5 s is inside the run");
    assert_eq!(motion.head().travel_m, -1.5);
    let refusal = motion.request(Request::Seek { sim_time_s: -2.1 });
    assert_eq!(refusal, Err(Refusal::OutOfRange { lowest: -2.0, highest: 400.0 }));
}

#[test]
fn the_run_ends_exactly_at_its_end() {
    let motion = after(start(MotionSettings { tick_s: 0.3, end_travel_m: 1.0, ..plan() }), 50);
    let head = motion.head();
    assert_eq!((head.state, head.travel_m, head.sim_time_ns), (ShowState::Finished, 1.0, 1_000_000_000));
    assert_eq!(motion.clone().request(Request::Resume), Err(Refusal::Finished));
}

#[test]
fn the_show_ends_exactly_at_the_time_asked_for() {
    let motion = after(start(MotionSettings { tick_s: 0.3, until_s: Some(0.5), ..plan() }), 50);
    let head = motion.head();
    assert_eq!((head.state, head.sim_time_ns), (ShowState::Ended, 500_000_000));
    assert!((head.travel_m - 0.5).abs() < 1e-12);
}

#[test]
fn a_seek_starts_a_finished_show_again() {
    let mut motion = after(start(MotionSettings { end_travel_m: 0.002, ..plan() }), 9);
    assert_eq!(motion.head().state, ShowState::Finished);
    motion.request(Request::Seek { sim_time_s: 0.0 }).expect("the start is inside the run");
    assert_eq!(after(motion, 1).head().sim_time_ns, 0, "the tick of a seek shows its target");
    assert_eq!(after(motion, 2).head().sim_time_ns, 1_000_000);
}

#[test]
fn a_show_that_starts_at_its_end_is_finished() {
    assert_eq!(
        start(MotionSettings { start_s: 400.0, start_travel_m: 400.0, ..plan() }).head().state,
        ShowState::Finished
    );
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// A run that nobody interferes with is danced as the planner's timetable has it, at any rate, to its end.
    #[test]
    fn a_run_keeps_the_timetable_of_the_planner(
        speed_mps in 0.05..5.0_f64,
        accel_mps2 in prop::option::of(0.01..20.0_f64),
        start_s in -50.0..50.0_f64,
        run_m in 0.5..200.0_f64,
        tick_s in 0.01..0.5_f64,
    ) {
        let (start_travel_m, end_travel_m) = (speed_mps * start_s, speed_mps * start_s + run_m);
        let timetable = HeadTimetable::new(speed_mps, accel_mps2, start_s, end_travel_m);
        let (first_s, last_s) = (start_s, end_travel_m / speed_mps);
        let paces = MotionSettings { speed_mps, accel_mps2, tick_s, start_speed_mps: speed_mps, ..plan() };
        let mut motion = start(MotionSettings { start_s, start_travel_m, first_s, last_s, end_travel_m, ..paces });
        while motion.head().state == ShowState::Running {
            let HeadState { sim_time_ns, travel_m, speed_mps: walked_mps, .. } = motion.head();
            let time_s = sim_time_ns as f64 / 1e9;
            prop_assert!((timetable.travel_m(time_s) - travel_m).abs() < 1e-7, "{travel_m} m at {time_s} s");
            let is_within = time_s < timetable.end_s() - tick_s && time_s > start_s;
            prop_assert!(!is_within || (timetable.speed_mps(time_s) - walked_mps).abs() < 1e-6);
            motion.advance();
        }
        let head = motion.head();
        prop_assert_eq!((head.state, head.travel_m), (ShowState::Finished, end_travel_m));
        prop_assert!((timetable.end_s() - head.sim_time_ns as f64 / 1e9).abs() < 1e-6 * (1.0 + timetable.end_s().abs()));
    }
}

pub(super) fn guarded() -> MotionSettings {
    MotionSettings { guarded_run: Some(7), ..plan() }
}

pub(super) fn grant(motion: &mut Motion, from_m: f64, to_m: f64) -> Result<(), Refusal> {
    motion.request(Request::Grant { run_id: 7, from_m, to_m, is_final: false })
}

#[test]
fn a_guarded_head_starts_held_and_walks_exactly_as_far_as_it_was_granted() {
    let mut motion = after(start(guarded()), 10);
    assert_eq!((motion.head().state, motion.head().sim_time_ns), (ShowState::Held, 0));
    grant(&mut motion, 0.0, 0.012_345_6).expect("the head is there");
    assert_eq!(after(motion, 12).head().state, ShowState::Running);
    let head = after(motion, 20).head();
    assert_eq!((head.state, head.travel_m, head.sim_time_ns), (ShowState::Held, 0.012_345_6, 12_345_600));
    let mut motion = after(motion, 50);
    grant(&mut motion, 0.01, 1.0).expect("the head is there");
    assert_eq!(after(motion, 1).head().sim_time_ns, 13_345_600, "a whole step from where it stood");
}

#[test]
fn neither_release_nor_resume_lifts_a_guards_stop() {
    let mut motion = start(guarded());
    assert_eq!(motion.request(Request::Release), Err(Refusal::HeldByGuard));
    assert_eq!(motion.request(Request::Resume), Err(Refusal::HeldByGuard));
    motion.request(Request::Hold).expect("hold is always accepted");
    motion.request(Request::Release).expect("the hold is lifted");
    assert_eq!(after(motion, 5).head().state, ShowState::Held);
}

#[test]
fn a_grant_does_not_lift_a_hold() {
    let mut motion = start(MotionSettings { held: true, ..guarded() });
    grant(&mut motion, 0.0, 10.0).expect("the head is there");
    assert_eq!(after(motion, 5).head().state, ShowState::Held);
    motion.request(Request::Release).expect("a held show is released");
    assert_eq!(after(motion, 5).head().travel_m, 0.005);
}

#[test]
fn a_guarded_head_is_repositioned_only_where_its_guard_has_proved_it() {
    let mut motion = start(guarded());
    let seek = Request::Seek { sim_time_s: 300.0 };
    assert_eq!((motion.request(seek), motion.limits().asked_m), (Err(Refusal::NotProved), Some(300.0)));
    grant(&mut motion, 300.0, 300.5).expect("it is where the seek asked to go");
    assert_eq!(motion.head().travel_m, 0.0);
    motion.request(seek).expect("it is proved now");
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
    assert_eq!(after(motion, 500).head().state, ShowState::Stopping);
    let head = after(motion, 1001).head();
    assert_eq!((head.state, head.speed_mps, head.sim_time_ns), (ShowState::Paused, 0.0, 2_000_000_000));
    assert!((head.travel_m - 0.5).abs() < 1e-12, "{}", head.travel_m);
}

#[test]
fn with_an_acceleration_the_head_rests_exactly_at_the_end_of_its_grant() {
    for tick_s in [0.000_1, 0.02, 0.4] {
        let mut motion = start(MotionSettings { accel_mps2: Some(0.5), tick_s, ..guarded() });
        grant(&mut motion, 0.0, 7.5).expect("the head is there");
        let head = after(motion, (20.0 / tick_s) as u64).head();
        assert_eq!((head.state, head.travel_m), (ShowState::Held, 7.5));
        // 2 s and 1 m each to speed up and to brake, and 5.5 s between.
        assert!((head.sim_time_ns - 9_500_000_000).abs() <= 1, "{}", head.sim_time_ns);
    }
}

#[test]
fn with_timecode_a_run_ends_where_the_head_has_walked_and_not_where_a_seek_has_repositioned_it() {
    let mut motion = start(MotionSettings { until_s: Some(300.0), ..plan() });
    motion.follow();
    motion.set_stands(false);
    for (sim_time_s, state) in [(300.0, ShowState::Finished), (299.0, ShowState::Ended)] {
        motion.request(Request::Seek { sim_time_s }).expect("it is within the run");
        motion = after(motion, 2_000);
        assert_eq!(motion.head().state, state, "from {sim_time_s} s");
    }
}

/// A head that brakes evenly from 1 m/s to rest in 0.5 s.
fn braking() -> MotionSettings {
    MotionSettings { accel_mps2: Some(2.0), tick_s: 0.1, ..plan() }
}

#[test]
fn a_head_that_is_to_stand_is_stopping_while_it_brakes() {
    for (request, rests_as) in
        [(Request::Pause, ShowState::Paused), (Request::Hold, ShowState::Held), (Request::Stop, ShowState::Ended)]
    {
        let mut motion = after(start(braking()), 20);
        motion.request(request).expect("it is never refused");
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
            motion.request(request).expect("it may be taken back at once");
            motion.advance();
        }
        assert_eq!(motion.head().state, ShowState::Running);
    }
}

#[test]
fn a_head_that_stands_ends_with_the_next_tick() {
    let mut motion = after(start(braking()), 20);
    motion.request(Request::Hold).expect("never refused");
    let mut motion = after(motion, 50);
    motion.request(Request::Stop).expect("never refused");
    assert_eq!(after(motion, 1).head(), HeadState { state: ShowState::Ended, ..motion.head() });
}

#[test]
fn a_run_with_an_end_has_ended_there_and_one_without_is_finished() {
    let ended = after(start(MotionSettings { until_s: Some(0.01), ..plan() }), 20).head();
    assert_eq!((ended.state, ended.sim_time_ns), (ShowState::Ended, 10_000_000));
    let finished = after(start(MotionSettings { end_travel_m: 0.01, ..plan() }), 20).head();
    assert_eq!((finished.state, finished.sim_time_ns), (ShowState::Finished, 10_000_000));
}

#[test]
fn a_head_tells_everything_that_keeps_it_from_walking() {
    let mut motion = start(MotionSettings { held: true, ..guarded() });
    motion.request(Request::Pause).expect("never refused");
    assert_eq!(motion.stops(), Stops { paused: true, held: true, guard_limit: true, ..Stops::default() });
    motion.follow();
    motion.request(Request::Stop).expect("never refused");
    assert!(motion.stops().timecode && motion.stops().ending && !motion.stops().run_end);
}
