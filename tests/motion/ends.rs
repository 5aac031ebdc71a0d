//! Where a run and a show end.

use bench_dragon::source::server::motion::MotionSettings;
use bench_dragon_ipc::{Refusal, Request, ShowState, Stop, Stops};

use crate::{after, plan, start};

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
    assert_eq!(motion.stops(), Stops::from([Stop::RunEnd]));
}

#[test]
fn the_show_ends_at_the_requested_time_also_after_a_seek_and_at_speed_0() {
    for (request, travel_m) in [(Request::Seek { show_time_s: 0.2 }, 0.5), (Request::Speed { speed_mps: 0.0 }, 0.0)] {
        let mut motion = start(MotionSettings { tick_s: 0.3, until_s: Some(0.5), ..plan() });
        motion.request(request).expect("the request is in range");
        let head = after(motion, 50).head();
        assert_eq!((head.state, head.show_time_ns), (ShowState::Ended, 500_000_000), "{request:?}");
        assert!((head.travel_m - travel_m).abs() < 1e-12, "{request:?}: {} m", head.travel_m);
    }
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
