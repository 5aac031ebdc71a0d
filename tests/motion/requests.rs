//! Requests of operators: stops, speeds and seeks.

use bench_dragon::source::server::motion::MotionSettings;
use bench_dragon_ipc::{Refusal, Request, ShowState, Stop, Stops};

use crate::{after, guarded, plan, start};

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
fn a_pace_is_the_ratio_to_the_planned_speed() {
    let mut motion = start(MotionSettings { speed_mps: 0.5, start_speed_mps: 0.5, last_s: 800.0, ..plan() });
    motion.request(Request::Pace { factor: 20.0 }).expect("10 m/s is allowed");
    assert_eq!(after(motion.clone(), 1).head().speed_mps, 10.0);
    for factor in [-0.1, 20.1, f64::NAN, f64::INFINITY] {
        let refusal = motion.request(Request::Pace { factor });
        assert_eq!(refusal, Err(Refusal::OutOfRange { lowest: 0.0, highest: 20.0 }), "{factor}");
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
