//! The largest speed of any handle, compared with the known value and with a fine walk.

use std::sync::Arc;

use bench_dragon_geometry::dragon::{Dimensions, Dragon, FeasibleEnd, Meter};
use bench_dragon_geometry::planner::{Infeasible, LargestRatio, largest_speed_ratio, passage_through};
use bench_dragon_geometry::route::{Route, Turnaround};
use proptest::prelude::*;
use test_support::dragons::{paper_benches, paper_turnaround};
use test_support::property::random_cases;

/// Short dragons on turns that most of them can walk.
fn passages() -> impl Strategy<Value = Dragon> {
    let benches = (1_usize..30, 1.0..4.0_f64, 1.0..2.5_f64, 0.0..0.4_f64);
    let turns = (0.5..2.0_f64, 3.0..16.0_f64, 0.3..3.0_f64);
    (benches, turns).prop_filter_map(
        "cannot pass",
        |((count, head_m, body_m, hole_m), (pitch_m, diameter_m, ratio))| {
            let dimensions = Dimensions::new(count, head_m, body_m, 0.3, hole_m).ok()?;
            let turnaround = Turnaround::new(pitch_m, diameter_m, ratio).ok()?.between(-5.0, 5.0).ok()?;
            passage_through(turnaround, dimensions, &Meter::unlimited()).ok()
        },
    )
}

/// The fastest handle on a walk in small steps.
fn fastest_of_a_walk(dragon: &Dragon, step_m: f64) -> LargestRatio {
    let start_m = dragon.start_travel_m();
    let steps = ((dragon.end_travel_m() - start_m) / step_m) as u32;
    let mut fastest = LargestRatio { ratio: 1.0, travel_m: start_m, handle: 0 };
    for travel_m in (0..=steps).map(|step| start_m + f64::from(step) * step_m) {
        for (handle, state) in dragon.chain(travel_m).expect("within the run").enumerate() {
            if state.speed_ratio > fastest.ratio {
                fastest = LargestRatio { ratio: state.speed_ratio, travel_m, handle };
            }
        }
    }
    fastest
}

#[test]
fn paper_turnaround_has_the_largest_speed_of_the_table() {
    let passage = passage_through(paper_turnaround(2.0), paper_benches(223), &Meter::unlimited())
        .expect("the paper's dragon passes");
    let largest = largest_speed_ratio(&passage).expect("every handle walks");
    assert!((largest.ratio - 1.604_793).abs() <= 5.001e-7, "{largest:?}");
    assert!((largest.travel_m - 14.480).abs() <= 5.001e-4, "{largest:?}");
    assert!((2.0 / largest.ratio - 1.246_266).abs() <= 5.001e-7, "{largest:?}");
    let walked = fastest_of_a_walk(&passage, 0.05);
    assert!(walked.ratio <= largest.ratio, "{walked:?}");
}

#[test]
fn passage_lasts_until_the_last_handle_has_left_the_turn() {
    let turnaround = paper_turnaround(2.0);
    let passage =
        passage_through(turnaround, paper_benches(223), &Meter::unlimited()).expect("the paper's dragon passes");
    let tail = passage.chain(passage.end_travel_m()).expect("within the run").last().expect("a tail");
    let tail_m = passage.route().travel(tail.parameter);
    assert!((tail_m - turnaround.turn_length_m()).abs() < 2e-9, "{tail_m}");
    assert_eq!(passage.start_travel_m(), -100.0);
}

#[test]
fn passage_includes_the_planned_span() {
    let turnaround = paper_turnaround(2.0).between(-3.0, 1000.0).expect("a valid span");
    let passage =
        passage_through(turnaround, paper_benches(223), &Meter::unlimited()).expect("the paper's dragon passes");
    assert_eq!((passage.start_travel_m(), passage.end_travel_m()), (-3.0, 1000.0));
    let turnaround = paper_turnaround(2.0).between(3.0, 4.0).expect("a valid span");
    assert_eq!(
        passage_through(turnaround, paper_benches(223), &Meter::unlimited())
            .expect("the dragon passes")
            .start_travel_m(),
        0.0
    );
}

#[test]
fn turn_on_which_a_handle_would_stop_is_infeasible() {
    let infeasible = passage_through(paper_turnaround(3.0), paper_benches(223), &Meter::unlimited())
        .expect_err("handle 1 walks backwards");
    let Infeasible::Fault { travel_m, end } = infeasible else { panic!("{infeasible:?}") };
    assert_eq!(end, FeasibleEnd::HandleStops { handle: 1 });
    assert!(travel_m > 10.2 && travel_m < 15.15, "{infeasible}");
}

#[test]
fn spiral_into_its_centre_is_infeasible() {
    let spiral = Route::spiral(0.55, 16.0).expect("the paper's spiral is valid");
    let dragon = Dragon::new(paper_benches(223), Arc::new(spiral)).expect("the paper's dragon stands");
    let infeasible = largest_speed_ratio(&dragon).expect_err("handle 1 stops");
    let Infeasible::Fault { travel_m, end } = infeasible else { panic!("{infeasible:?}") };
    assert_eq!(end, FeasibleEnd::HandleStops { handle: 1 });
    assert!((travel_m - 432.758).abs() < 5e-4, "{infeasible}");
}

proptest! {
    #![proptest_config(random_cases(32))]

    #[test]
    fn no_handle_of_a_walk_is_faster(dragon in passages()) {
        // Excludes jumps too short to end the run.
        prop_assume!(largest_speed_ratio(&dragon).is_ok());
        let largest = largest_speed_ratio(&dragon).expect("no handle jumps");
        let walked = fastest_of_a_walk(&dragon, 0.003);
        prop_assert!(walked.ratio <= largest.ratio * (1.0 + 1e-12), "{walked:?} is faster than {largest:?}");
        prop_assert!(largest.ratio - walked.ratio < 0.02 * largest.ratio.powi(4), "{largest:?} but {walked:?}");
        let handle = dragon.chain(largest.travel_m).expect("within the run").nth(largest.handle).expect("a handle");
        prop_assert!((handle.speed_ratio / largest.ratio - 1.0).abs() <= 1e-12, "{handle:?} {largest:?}");
    }
}
