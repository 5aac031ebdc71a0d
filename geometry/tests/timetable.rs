//! The head's timetable, with and without ramps.

use bench_dragon_geometry::formation::{Change, Timetable};
use proptest::prelude::*;
use test_support::property::random_cases;

#[test]
fn without_an_acceleration_time_is_travel_over_speed_to_the_bit() {
    let timetable = Timetable::new(0.7, None, -3.0, 51.3);
    for travel_m in [-2.1, 0.0, 0.1, 17.3, 51.3] {
        assert_eq!(timetable.time_s(travel_m), travel_m / 0.7);
    }
    assert_eq!((timetable.travel_m(17.3), timetable.speed_mps(-3.0)), (0.7 * 17.3, 0.7));
}

#[test]
fn a_run_too_short_for_the_planned_speed_brakes_from_its_middle() {
    let timetable = Timetable::new(5.0, Some(1.0), 0.0, 4.0);
    assert_eq!((timetable.end_s(), timetable.time_s(2.0)), (4.0, 2.0));
    assert_eq!((timetable.speed_mps(2.0), timetable.travel_m(3.0)), (2.0, 3.5));
}

#[test]
fn a_run_without_length_is_over_at_once() {
    let timetable = Timetable::new(2.0, Some(1.0), 3.0, 6.0);
    assert_eq!((timetable.end_s(), timetable.time_s(6.0), timetable.travel_m(9.0)), (3.0, 3.0, 6.0));
}

#[test]
fn a_change_to_the_same_speed_changes_nothing() {
    for accel_mps2 in [None, Some(0.2)] {
        let plain = Timetable::leaving(3.0, -1.5, 0.9, accel_mps2, 40.0);
        let changed = plain.with_changes(&[Change::Speed { at_s: 20.0, speed_mps: 0.9 }], [-1.5, 40.0]);
        assert!((changed.end_s() - plain.end_s()).abs() < 1e-9);
        for time_s in (0..60).map(f64::from) {
            let here = time_s.clamp(plain.start_s(), plain.end_s());
            assert!((changed.travel_m(time_s) - plain.travel_m(here)).abs() < 1e-9, "{time_s} s");
        }
    }
}

#[test]
fn a_planned_stop_stands_until_the_next_speed() {
    let changes = [Change::Speed { at_s: 5.0, speed_mps: 0.0 }, Change::Speed { at_s: 9.0, speed_mps: 2.0 }];
    let timetable = Timetable::leaving(0.0, 0.0, 1.0, Some(1.0), 30.0).with_changes(&changes, [0.0, 30.0]);
    assert_eq!((timetable.travel_m(6.0), timetable.travel_m(8.9), timetable.speed_mps(8.0)), (5.0, 5.0, 0.0));
    assert_eq!((timetable.time_s(5.0), timetable.ordered_mps(7.0), timetable.speed_mps(11.0)), (6.0, 0.0, 2.0));
}

proptest! {
    #![proptest_config(random_cases(256))]

    /// Travel is continuous and never falls, the speed changes no faster than the acceleration, and the head stands at each rest and
    /// at the end. Each speed that is planned long enough is walked.
    #[test]
    fn a_walk_with_changes_keeps_its_promises(
        speed_mps in 0.05..5.0_f64,
        accel_mps2 in prop::option::of(0.05..5.0_f64),
        start_s in -20.0..20.0_f64,
        run_m in 0.5..200.0_f64,
        waits in prop::collection::vec((0.0..15.0_f64, prop::option::of(0.0..5.0_f64)), 1..9),
    ) {
        let mut at_s = start_s - 5.0;
        let changes: Vec<Change> = waits
            .into_iter()
            .map(|(after_s, speed_mps)| {
                at_s += after_s;
                speed_mps.map_or(Change::Rest { at_s }, |speed_mps| Change::Speed { at_s, speed_mps })
            })
            .collect();
        let (start_m, end_m) = (3.0, 3.0 + run_m);
        let timetable = Timetable::leaving(start_s, start_m, speed_mps, accel_mps2, end_m).with_changes(&changes, [start_m, end_m]);
        prop_assert_eq!((timetable.start_s(), timetable.travel_m(start_s - 9.0)), (start_s, start_m));
        let most_mps = 5.0_f64;
        let (mut last_m, mut last_mps) = (start_m, 0.0);
        let step_s = (at_s.max(timetable.end_s()) + 5.0 - start_s) / 997.0;
        for number in 0..=997 {
            let time_s = start_s + f64::from(number) * step_s;
            let (travel_m, speed_mps) = (timetable.travel_m(time_s), timetable.speed_mps(time_s));
            prop_assert!((0.0..=most_mps * step_s + 1e-9).contains(&(travel_m - last_m)), "{last_m} to {travel_m} m at {time_s} s");
            if let Some(accel_mps2) = accel_mps2 {
                let off_m = (travel_m - last_m - 0.5 * (speed_mps + last_mps) * step_s).abs();
                prop_assert!(number == 0 || off_m <= 0.25 * accel_mps2 * step_s * step_s + 1e-9, "{off_m} m at {time_s} s");
                prop_assert!((speed_mps - last_mps).abs() <= accel_mps2 * step_s + 1e-9, "{last_mps} to {speed_mps} m/s");
            }
            (last_m, last_mps) = (travel_m, speed_mps);
        }
        for change in changes.iter().filter(|change| accel_mps2.is_some() && matches!(change, Change::Rest { .. })) {
            prop_assert!(timetable.speed_mps(change.at_s()) < 1e-6, "{change:?}: {}", timetable.speed_mps(change.at_s()));
        }
        let last_speed = changes.iter().rev().find_map(|change| match change {
            Change::Speed { speed_mps, .. } => Some(*speed_mps),
            Change::Rest { .. } => None,
        });
        if last_speed.unwrap_or(speed_mps) > 0.0 {
            prop_assert_eq!((timetable.travel_m(timetable.end_s()), timetable.speed_mps(timetable.end_s() + 1.0)), (end_m, 0.0));
        }
        for part in [0.0, 0.1, 0.37, 0.5, 0.93, 1.0] {
            let travel_m = start_m + part * (timetable.travel_m(timetable.end_s()) - start_m);
            let again_m = timetable.travel_m(timetable.time_s(travel_m));
            prop_assert!((again_m - travel_m).abs() < 1e-7, "{} becomes {}", travel_m, again_m);
        }
    }

    #[test]
    fn time_and_travel_are_inverse(
        speed_mps in 0.01..10.0_f64,
        accel_mps2 in prop::option::of(0.001..20.0_f64),
        start_s in -100.0..100.0_f64,
        run_m in 0.01..500.0_f64,
        part in 0.0..1.0_f64,
    ) {
        let timetable = Timetable::new(speed_mps, accel_mps2, start_s, speed_mps * start_s + run_m);
        let travel_m = speed_mps * start_s + part * run_m;
        let again_m = timetable.travel_m(timetable.time_s(travel_m));
        prop_assert!((again_m - travel_m).abs() < 1e-9, "{travel_m} becomes {again_m}");
    }
}
