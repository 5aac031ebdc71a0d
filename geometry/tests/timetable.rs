//! The head's timetable, with and without ramps.

use bench_dragon_geometry::formation::Timetable;
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

proptest! {
    #![proptest_config(random_cases(256))]

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
