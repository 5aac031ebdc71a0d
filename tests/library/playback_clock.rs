//! Due times of a recording's frames in a replay.

use bench_dragon::source::replay::PlaybackClock;
use bench_dragon::source::server::motion::FASTEST;

#[test]
fn frames_keep_their_recorded_intervals() {
    let mut clock = PlaybackClock::new(1.0);
    let due: Vec<u64> = [700, 800, 1_800, 1_801].map(|recorded_ns| clock.due_ns(recorded_ns, 50)).into();
    assert_eq!(due, [50, 150, 1_150, 1_151]);
    assert_eq!(clock.overruns(), 0);
}

#[test]
fn a_stall_is_counted_once_and_made_up_a_tenth_faster() {
    let mut clock = PlaybackClock::new(1.0);
    assert_eq!(clock.due_ns(0, 0), 0);
    assert_eq!((clock.due_ns(1_100, 1_350), clock.behind_ns()), (1_350, 250), "250 too late");
    let rest: Vec<_> =
        (2..6).map(|frame| (clock.due_ns(1_100 * frame, 1_351), clock.behind_ns(), clock.rate())).collect();
    assert_eq!(rest, [(2_350, 150, FASTEST), (3_350, 50, FASTEST), (4_400, 0, 1.0), (5_500, 0, 1.0)]);
    assert_eq!(clock.overruns(), 1);
}

#[test]
fn a_machine_that_is_too_slow_makes_no_burst() {
    let mut clock = PlaybackClock::new(1.0);
    let due: Vec<u64> = (0..1_000).map(|frame| clock.due_ns(100 * frame, 150 * frame)).collect();
    assert!(due.windows(2).all(|pair| pair[1] - pair[0] == 150), "each frame is due at its arrival");
    assert_eq!((clock.overruns(), clock.behind_ns()), (999, 50 * 999));
}

#[test]
fn a_frame_that_is_due_now_is_not_late() {
    let mut clock = PlaybackClock::new(1.0);
    clock.due_ns(0, 10);
    assert_eq!((clock.due_ns(5, 15), clock.overruns()), (15, 0));
}

#[test]
fn at_another_rate_the_intervals_are_scaled_without_drift() {
    for (rate, last_ns) in [(10.0, 1_000_000_000), (3.0, 3_333_333_333), (0.01, 1_000_000_000_000)] {
        let mut clock = PlaybackClock::new(rate);
        let due: Vec<u64> = (0..=10_000).map(|tick| clock.due_ns(5 + tick * 1_000_000, 0)).collect();
        assert_eq!((due[0], due[10_000], clock.overruns()), (0, last_ns, 0), "at rate {rate}");
    }
}

#[test]
fn another_lap_begins_when_the_next_frame_would_be_due() {
    let mut clock = PlaybackClock::new(1.0);
    let mut lap = |now_ns| [700, 800, 900].map(|recorded_ns| clock.due_ns(recorded_ns, now_ns));
    assert_eq!(lap(50), [50, 150, 250]);
    clock.begin_lap();
    let mut lap = |now_ns| [700, 800, 900].map(|recorded_ns| clock.due_ns(recorded_ns, now_ns));
    assert_eq!(lap(260), [350, 450, 550]);
    clock.begin_lap();
    assert_eq!((clock.due_ns(700, 9_000), clock.overruns()), (9_000, 0), "a late start is not an overrun");
}

#[test]
fn impossible_instants_cause_no_overflow() {
    let mut clock = PlaybackClock::new(1.0);
    assert_eq!(clock.due_ns(1_000, 100), 100);
    assert_eq!(clock.due_ns(3, 200), 200, "a frame is due before its predecessor");
    assert_eq!(clock.due_ns(u64::MAX, 300), u64::MAX);
}
