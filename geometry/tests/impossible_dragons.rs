//! Invalid values are rejected with the name of the value and the allowed range.

use std::sync::Arc;

use bench_dragon_geometry::dragon::{Dimensions, Dragon, FeasibleEnd};
use bench_dragon_geometry::route::Route;
use test_support::dragons::paper_benches;

fn on_spiral(dimensions: Dimensions, pitch_m: f64, start_turns: f64) -> Result<Dragon, String> {
    let spiral = Route::spiral(pitch_m, start_turns).map_err(|error| error.to_string())?;
    Dragon::new(dimensions, Arc::new(spiral)).map_err(|error| error.to_string())
}

fn refusal(result: Result<Dragon, String>) -> String {
    result.expect_err("this is impossible")
}

#[test]
fn spirals_out_of_range_are_rejected() {
    let pitch = |pitch_m| refusal(on_spiral(paper_benches(223), pitch_m, 16.0));
    let turns = |turns| refusal(on_spiral(paper_benches(223), 0.55, turns));
    assert_eq!(pitch(-1.0), "pitch_m is -1, must be above 0 and at most 1000");
    assert_eq!(pitch(f64::NAN), "pitch_m is NaN, must be above 0 and at most 1000");
    assert_eq!(pitch(f64::INFINITY), "pitch_m is inf, must be above 0 and at most 1000");
    assert_eq!(turns(0.0), "start_turns is 0, must be above 0 and at most 10000");
    assert_eq!(turns(f64::NAN), "start_turns is NaN, must be above 0 and at most 10000");
}

#[test]
fn dimensions_out_of_range_are_rejected() {
    let refuse = |benches, head, body, width, hole| {
        Dimensions::new(benches, head, body, width, hole).expect_err("this is impossible").to_string()
    };
    assert_eq!(refuse(0, 3.41, 2.2, 0.3, 0.275), "benches is 0, must be from 1 to 100000");
    assert_eq!(refuse(100_001, 3.41, 2.2, 0.3, 0.275), "benches is 100001, must be from 1 to 100000");
    assert_eq!(refuse(3, 0.0, 2.2, 0.3, 0.275), "head_length_m is 0, must be from 0.02 to 100");
    assert_eq!(refuse(3, 3.41, f64::INFINITY, 0.3, 0.275), "body_length_m is inf, must be from 0.02 to 100");
    assert_eq!(refuse(3, 3.41, 2.2, f64::NAN, 0.275), "width_m is NaN, must be from 0.01 to 100");
    let holes = "must be at least 0 and under 1.1, half of the shortest bench";
    assert_eq!(refuse(3, 3.41, 2.2, 0.3, 1.1), format!("hole_offset_m is 1.1, {holes}"));
    assert_eq!(refuse(3, 3.41, 2.2, 0.3, -0.1), format!("hole_offset_m is -0.1, {holes}"));
    let apart = "the hinges of a bench with body_length_m 2.2 are";
    let near = refuse(3, 3.41, 2.2, 0.3, 1.096);
    assert!(near.starts_with(&format!("hole_offset_m is 1.096: {apart} 0.00")), "{near}");
    assert!(near.contains(" m apart, must be at least 0.11"), "{near}");
    assert_eq!(
        refuse(3, 3.41, 2.2, 0.03, 0.275),
        "width_m is 0.03, must be at least 0.0341, a hundredth of head_length_m 3.41"
    );
}

#[test]
fn boards_wider_than_the_pitch_are_rejected() {
    let error = refusal(on_spiral(paper_benches(223), 0.2, 16.0));
    assert_eq!(error, "pitch_m is 0.2, must be above width_m 0.3");
}

#[test]
fn start_too_tight_for_a_link_is_rejected() {
    let error = refusal(on_spiral(paper_benches(223), 0.55, 0.865));
    let tight = "the route is too tight at its start: bench 0 cannot follow at 0.000 m of travel, at (0.315, -0.357) m: \
                 handle 1 cannot stand and walk 2.860 m behind handle 0";
    assert_eq!(error, tight);
}

#[test]
fn as_many_benches_as_allowed_walk_as_far_as_few() {
    let [few, most] = [2, 100_000].map(|benches| on_spiral(paper_benches(benches), 0.55, 16.0).expect("possible"));
    assert_eq!(most.feasible_end(), FeasibleEnd::HandleStops { handle: 1 });
    assert_eq!(most.end_travel_m(), few.end_travel_m());
}

#[test]
fn wide_spiral_is_walked_into_its_centre() {
    let dragon = on_spiral(paper_benches(10), 50.0, 2.0).expect("possible");
    assert_eq!(dragon.feasible_end(), FeasibleEnd::RouteEnd);
    assert!(
        dragon.chain(dragon.end_travel_m()).expect("within the run").next().is_some_and(|head| head.parameter == 0.0)
    );
}
