//! The shortest S: clear itself, and nothing tighter on a grid of its own.

use bench_dragon::dragon::{Dimensions, Meter, RunEnd};
use bench_dragon::plan::{Obstacle, TurnPassage, passage_through, shortest_turn, walk_through};
use bench_dragon::route::{Route, Turnaround};

fn paper_benches(benches: usize) -> Dimensions {
    Dimensions::new(benches, 3.41, 2.20, 0.30, 0.275).expect("the paper's benches are valid")
}

fn turn(pitch_m: f64, radius_m: f64, ratio: f64) -> Turnaround {
    Turnaround::new(pitch_m, 2.0 * radius_m, ratio).expect("valid")
}

#[test]
fn shortest_turn_of_the_paper_lies_between_a_stop_and_a_jump_of_the_first_handle() {
    let shortest = shortest_turn(turn(1.7, 4.5, 2.0), paper_benches(223), &Meter::unlimited(), |_| ())
        .expect("no limit")
        .expect("the paper's dragon turns");
    let radius_m = 0.5 * shortest.turnaround.turn_diameter_m();
    assert!(matches!(
        walk_through(shortest.turnaround, paper_benches(223), &Meter::unlimited(), |_| ()),
        TurnPassage::Clear { .. }
    ));
    let ends =
        shortest.limits.map(|limit| if let Some(Obstacle::Fault { end, .. }) = limit { end } else { RunEnd::RouteEnd });
    assert_eq!(ends, [RunEnd::HandleStops { handle: 1 }, RunEnd::HandleJumps { handle: 1 }]);
    // The way out is the way in turned and walked backwards, and a jump is a stop walked backwards.
    assert!((shortest.radius_ratio - 1.0).abs() < 1e-4, "{shortest:?}");
    let passes = |radius_m: f64, ratio: f64| {
        let turn = turn(1.7, radius_m, ratio).between(-1.0, 1.0).expect("valid");
        passage_through(turn, paper_benches(4), &Meter::unlimited()).is_ok()
    };
    assert!(passes(radius_m, shortest.radius_ratio));
    for i in 0..=400 {
        let near = shortest.radius_ratio * (1.0 + 1e-5 * (f64::from(i) / 200.0 - 1.0));
        assert!(!passes(radius_m - 3e-5, near), "ratio {near}");
        let far = 8.0_f64.powf(f64::from(i) / 200.0 - 1.0);
        assert!(!passes(radius_m - 3e-5, far), "ratio {far}");
        assert!(!passes(0.9 * radius_m, far), "ratio {far}");
    }
}

#[test]
fn circle_too_small_for_any_turn_has_none() {
    assert_eq!(
        shortest_turn(turn(1.7, 2.5, 2.0), paper_benches(20), &Meter::unlimited(), |_| ()).expect("no limit"),
        None
    );
}

#[test]
fn shortest_turn_stays_on_its_spiral() {
    let shortest = shortest_turn(turn(1.7, 4.5, 2.0), paper_benches(20), &Meter::unlimited(), |_| ())
        .expect("no limit")
        .expect("it turns");
    assert!((shortest.turnaround.pitch_m() - 1.7).abs() < 1e-15);
}
