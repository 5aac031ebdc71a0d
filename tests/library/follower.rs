//! Follower of a timecode, sample by sample: its bounds and the numbers of its controller.

use bench_dragon::source::timecode::{
    Follower, FollowerEvent, FollowerOrder, FollowerSettings, Position, ShowPosition, TimecodeSample,
};
use bench_dragon_ipc::TimecodeState;

const SETTINGS: FollowerSettings =
    FollowerSettings { offset_s: 0.0, timeout_ns: 1_000_000_000, period_s: 0.001, first_s: 0.0, last_s: 400.0 };
const DAY_S: f64 = 86_400.0;

fn sample(position_s: f64, arrived_ms: u64) -> TimecodeSample {
    let position = Position { since_midnight_s: position_s, day_s: DAY_S };
    TimecodeSample { position, arrived_ns: arrived_ms * 1_000_000 }
}

fn show(show_time_s: f64) -> ShowPosition {
    ShowPosition { show_time_s, is_stopped: false, is_resumed: false }
}

/// Returns a follower that has heard a running timecode up to position 20 s at 1000 ms.
fn heard(settings: FollowerSettings) -> Follower {
    let mut follower = Follower::new(settings);
    follower.hear(sample(19.96, 960));
    follower.hear(sample(20.0, 1000));
    follower
}

/// Returns that follower after the show's seek to the timecode.
fn met() -> Follower {
    let mut follower = heard(SETTINGS);
    assert_eq!(steer(&mut follower, 1000, 0.0).seek_s, Some(20.0));
    follower.note_seek(true);
    follower
}

fn steer(follower: &mut Follower, now_ms: u64, show_time_s: f64) -> FollowerOrder {
    follower.steer(now_ms * 1_000_000, show(show_time_s)).0
}

fn assert_near(value: f64, expected: f64) {
    assert!((value - expected).abs() < 1e-12, "{value}, expected {expected}");
}

#[test]
fn the_time_scale_is_the_pace_plus_a_bounded_correction() {
    let mut follower = met();
    // The first sample corrects the difference. It says nothing about the pace.
    assert_near(steer(&mut follower, 1000, 19.97).time_scale, 1.03);
    assert_near(steer(&mut follower, 1001, 19.6).time_scale, 1.03);
    // The show's position contains a period of the earlier correction. A quarter of the correction changes the pace.
    follower.hear(sample(20.04, 1040));
    let correction = 0.02 + 0.03 * 0.001;
    let pace = 1.0 + 0.25 * correction * 0.04;
    assert_near(steer(&mut follower, 1040, 20.02).time_scale, pace + correction);
    // 20 ms later the timecode is that much further at its own pace, which the next sample shows.
    follower.hear(sample(20.08, 1080));
    let correction = 20.08 + pace * 0.02 - 20.11 + correction * 0.001;
    assert_near(steer(&mut follower, 1100, 20.11).time_scale, pace + 0.25 * correction * 0.04 + correction);
}

#[test]
fn correction_and_pace_stay_in_their_ranges() {
    assert_near(Follower::LEAST_TIME_SCALE, 0.9);
    assert_near(Follower::GREATEST_TIME_SCALE, 1.1);
    for (behind_s, bound) in [(0.4, Follower::GREATEST_TIME_SCALE), (-0.4, Follower::LEAST_TIME_SCALE)] {
        let mut follower = met();
        let scales: Vec<f64> = (0..20_u32)
            .map(|number| {
                let (position_s, arrived_ms) = (20.0 + 0.75 * f64::from(number), 1000 + 750 * u64::from(number));
                follower.hear(sample(position_s, arrived_ms));
                steer(&mut follower, arrived_ms, position_s - behind_s).time_scale
            })
            .collect();
        let sign = f64::signum(behind_s);
        assert_near(scales[0], 1.0 + 0.05 * sign);
        assert_near(scales[1], 1.0 + 0.05 * sign + 0.25 * 0.05 * sign * 0.5);
        assert_near(scales[19], bound);
    }
}

#[test]
fn two_positions_agree_within_half_a_second_and_a_twentieth_of_their_interval() {
    let confirms = |timeout_ms: u64, elapsed_ms: u64, step_s: f64| {
        let mut follower = Follower::new(FollowerSettings { timeout_ns: timeout_ms * 1_000_000, ..SETTINGS });
        follower.hear(sample(20.0, 1000));
        follower.hear(sample(20.0 + step_s, 1000 + elapsed_ms));
        follower.steer((1000 + elapsed_ms) * 1_000_000, show(0.0)).1.is_some()
    };
    for (elapsed_ms, step_s, agrees) in [
        (800, 1.33, true),
        (800, 1.35, false),
        (800, 0.27, true),
        (3000, 2.36, true),
        (3000, 2.34, false),
        (3000, 0.5, true),
        (3000, 0.51, false),
        (3000, -0.5, true),
        (3000, -0.51, false),
    ] {
        assert_eq!(confirms(3000, elapsed_ms, step_s), agrees, "{step_s} s in {elapsed_ms} ms");
    }
    assert!(!confirms(2999, 3000, 3.0) && !confirms(2999, 3000, 0.0), "longer than the timeout");
}

#[test]
fn a_timecode_is_lost_only_after_its_timeout_and_stands_only_after_a_tenth_of_a_second() {
    let mut follower = met();
    let event = |follower: &mut Follower, now_ms: u64| follower.steer(now_ms * 1_000_000, show(20.0)).1;
    assert_eq!(event(&mut follower, 2000), None);
    assert_eq!((follower.timecode_state(), follower.leads()), (TimecodeState::Locked, true));
    assert_eq!(event(&mut follower, 2001), Some(FollowerEvent::Lost { position_s: 20.0 }));
    assert_eq!((follower.timecode_state(), follower.leads()), (TimecodeState::Lost, false));
    let mut follower = met();
    follower.hear(sample(20.0, 1100));
    assert_eq!(event(&mut follower, 1100), None);
    follower.hear(sample(20.0, 1101));
    assert_eq!(event(&mut follower, 1101), Some(FollowerEvent::Stands { position_s: 20.0 }));
    assert_eq!((follower.timecode_state(), follower.leads()), (TimecodeState::Standing, true));
}

#[test]
fn a_refused_seek_is_tried_again_after_a_tenth_of_a_second() {
    let mut follower = heard(SETTINGS);
    let sought: Vec<bool> =
        [1000, 1001, 1099, 1100, 1101].map(|now_ms| steer(&mut follower, now_ms, 0.0).seek_s.is_some()).into();
    assert_eq!(sought, [true, false, false, true, false]);
    follower.note_seek(true);
    assert!(steer(&mut follower, 1102, 0.0).seek_s.is_some(), "another jump is sought at once");
}

#[test]
fn a_show_that_has_not_met_the_timecode_seeks_it_however_near_it_is() {
    for (repeats, stands) in [(false, "runs"), (true, "stands")] {
        let mut follower = heard(SETTINGS);
        if repeats {
            follower.hear(sample(20.0, 1101));
        }
        let order = steer(&mut follower, 1101, if repeats { 20.0 } else { 20.101 });
        assert!(order.stands && order.seek_s.is_some(), "the timecode {stands}: {order:?}");
    }
}

#[test]
fn a_stopped_show_seeks_nothing_and_stands_only_before_its_first_meeting() {
    for (mut follower, stands) in [(heard(SETTINGS), true), (met(), false)] {
        let stopped = ShowPosition { show_time_s: 0.0, is_stopped: true, is_resumed: false };
        let order = follower.steer(1_000_000_000, stopped).0;
        assert_eq!((order.seek_s, order.stands), (None, stands));
        follower.hear(sample(20.0, 1101));
        let order = follower.steer(1_101_000_000, stopped).0;
        assert_eq!((order.seek_s, order.stands), (None, true), "the timecode stands");
    }
}

#[test]
fn a_show_that_stood_at_once_moves_to_the_place_of_a_standing_timecode() {
    let standing = || {
        let mut follower = met();
        follower.hear(sample(20.0, 1101));
        follower
    };
    for (beside_s, is_sought) in [(0.1, true), (-0.1, true), (3e-9, true), (1e-9, false), (0.0, false)] {
        let mut follower = standing();
        let first = steer(&mut follower, 1101, 20.0 + beside_s);
        assert_eq!((first.stands, first.seek_s), (true, None), "the head may still walk");
        assert_eq!(steer(&mut follower, 1102, 20.0 + beside_s).seek_s, is_sought.then_some(20.0), "{beside_s} s");
    }
    // The head brakes for a second, up to more than a jump past the timecode, and stays there.
    let mut follower = standing();
    let walked_s = [0.0, 0.4, 0.7, 0.9, 1.0, 1.0, 1.0];
    let orders: Vec<Option<f64>> =
        (1101..).zip(walked_s).map(|(now_ms, walked_s)| steer(&mut follower, now_ms, 20.0 + walked_s).seek_s).collect();
    assert_eq!(orders, [None; 7]);
    assert_eq!(steer(&mut follower, 1108, 19.0).seek_s, Some(20.0), "an operator has moved the show");
}

#[test]
fn the_lead_of_a_braked_head_is_forgotten_once_the_show_is_near_the_timecode() {
    let braked = || {
        let mut follower = met();
        follower.hear(sample(20.0, 1101));
        for (now_ms, show_time_s) in [(1101, 20.0), (1102, 20.4), (1103, 20.8)] {
            steer(&mut follower, now_ms, show_time_s);
        }
        follower.hear(sample(20.25, 1110));
        follower
    };
    assert_eq!(steer(&mut braked(), 1110, 21.05).seek_s, None, "0.8 s ahead, all of it by braking");
    for (near_s, seek_s) in [(0.3, None), (0.25, None), (0.24, Some(20.29)), (-0.24, Some(20.29)), (-0.26, None)] {
        let mut follower = braked();
        assert_eq!(steer(&mut follower, 1110, 20.25 + near_s).seek_s, None);
        follower.hear(sample(20.29, 1150));
        assert_eq!(steer(&mut follower, 1150, 21.09).seek_s, seek_s, "{near_s} s ahead in between");
    }
}

#[test]
fn of_the_three_days_a_position_is_on_the_one_nearest_to_the_run() {
    for (offset_s, first_s, last_s, target_s) in [
        (0.0, 0.0, 400.0, 20.0),
        (5.0, 0.0, 400.0, 25.0),
        (-DAY_S, 0.0, 400.0, 20.0),
        (DAY_S, 0.0, 400.0, 20.0),
        (0.0, -DAY_S, -DAY_S + 400.0, 20.0 - DAY_S),
        (0.0, DAY_S, DAY_S + 400.0, 20.0 + DAY_S),
    ] {
        let mut follower = heard(FollowerSettings { offset_s, first_s, last_s, ..SETTINGS });
        assert_eq!(steer(&mut follower, 1000, first_s).seek_s, Some(target_s), "offset {offset_s} s, from {first_s} s");
    }
    // In a run longer than a day, the nearest to the show.
    for (show_time_s, target_s) in [(0.0, 20.0), (50_000.0, DAY_S + 20.0), (DAY_S, DAY_S + 20.0)] {
        let mut follower = heard(FollowerSettings { last_s: 3.0 * DAY_S, ..SETTINGS });
        assert_eq!(steer(&mut follower, 1000, show_time_s).seek_s, Some(target_s), "show at {show_time_s} s");
    }
}

#[test]
fn before_its_run_a_show_stands_also_without_the_timecode_and_starts_at_the_first_instant() {
    let before = FollowerSettings { first_s: 20.5, ..SETTINGS };
    let mut follower = heard(before);
    assert_eq!(steer(&mut follower, 1000, 20.5).seek_s, Some(20.5));
    follower.note_seek(true);
    assert!(steer(&mut follower, 1499, 20.5).stands);
    assert!(!steer(&mut follower, 1500, 20.5).stands, "the run starts now");
    let mut lost = heard(FollowerSettings { first_s: 22.0, ..SETTINGS });
    assert_eq!(steer(&mut lost, 1000, 22.0).seek_s, Some(22.0));
    lost.note_seek(true);
    assert!(steer(&mut lost, 2999, 22.0).stands && !lost.leads());
    assert!(!steer(&mut lost, 3000, 22.0).stands);
}

#[test]
fn a_resume_lets_a_show_walk_on_by_itself_until_timecode_leads() {
    // Before the first timecode, and after one that was lost before the show had reached it.
    let fresh = Follower::new(SETTINGS);
    let lost = heard(SETTINGS);
    for (mut follower, now_ms) in [(fresh, 1000), (lost, 2500)] {
        assert!(steer(&mut follower, now_ms, 5.0).stands);
        let resume = |follower: &mut Follower, now_ms: u64, show_time_s: f64| {
            follower.steer(now_ms * 1_000_000, ShowPosition { is_resumed: true, ..show(show_time_s) }).0.stands
        };
        assert!(!resume(&mut follower, now_ms + 1, 5.0));
        assert!(!steer(&mut follower, now_ms + 2, 5.0).stands);
        follower.hear(sample(30.0, now_ms + 40));
        follower.hear(sample(30.04, now_ms + 80));
        assert_eq!(steer(&mut follower, now_ms + 80, 5.1).seek_s, Some(30.04));
        follower.note_seek(true);
        assert!(!steer(&mut follower, now_ms + 81, 30.04).stands);
        // A timecode that leads is the master: it stands, and is lost, so the show stands.
        assert!(!resume(&mut follower, now_ms + 90, 30.05));
        follower.hear(sample(30.04, now_ms + 300));
        assert!(steer(&mut follower, now_ms + 301, 30.04).stands);
        assert!(steer(&mut follower, now_ms + 2000, 30.04).stands);
    }
}
