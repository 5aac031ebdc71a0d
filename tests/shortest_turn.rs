//! The shortest S: clear itself, and nothing tighter on a grid of its own.

use bench_dragon::dragon::{Dimensions, RunEnd};
use bench_dragon::plan::{Obstacle, TurnPassage, passage_through, shortest_turn, walk_through};
use bench_dragon::route::{Route, Turnaround};

fn paper_benches(benches: usize) -> Dimensions {
    Dimensions::new(benches, 3.41, 2.20, 0.30, 0.275).expect("the paper's benches are valid")
}

fn turn(pitch_m: f64, radius_m: f64, ratio: f64) -> Turnaround {
    Turnaround::new(pitch_m, 2.0 * radius_m, ratio).expect("valid")
}

#[test]
fn shortest_turn_of_the_paper_lies_between_two_stops_of_the_first_handle() {
    let shortest = shortest_turn(turn(1.7, 4.5, 2.0), paper_benches(223), |_| ()).expect("the paper's dragon turns");
    let radius_m = 0.5 * shortest.turnaround.turn_diameter_m();
    assert!(matches!(walk_through(shortest.turnaround, paper_benches(223)), TurnPassage::Clear { .. }));
    for limit in shortest.limits {
        let Some(Obstacle::Fault { end, .. }) = limit else { panic!("{limit:?}") };
        assert_eq!(end, RunEnd::HandleStops { handle: 1 });
    }
    assert_ne!(shortest.limits[0].map(piece), shortest.limits[1].map(piece), "one arc each");
    let passes = |radius_m: f64, ratio: f64| {
        let turn = turn(1.7, radius_m, ratio).between(-1.0, 1.0).expect("valid");
        passage_through(turn, paper_benches(4)).is_ok()
    };
    assert!(passes(radius_m, shortest.radius_ratio));
    for i in 0..=400 {
        let near = shortest.radius_ratio * (1.0 + 1e-5 * (f64::from(i) / 200.0 - 1.0));
        assert!(!passes(radius_m - 1e-7, near), "ratio {near}");
        let far = 8.0_f64.powf(f64::from(i) / 200.0 - 1.0);
        assert!(!passes(radius_m - 1e-7, far), "ratio {far}");
        assert!(!passes(0.9 * radius_m, far), "ratio {far}");
    }
}

fn piece(obstacle: Obstacle) -> usize {
    if let Obstacle::Fault { piece, .. } = obstacle { piece } else { usize::MAX }
}

#[test]
fn circle_too_small_for_any_turn_has_none() {
    assert_eq!(shortest_turn(turn(1.7, 2.5, 2.0), paper_benches(20), |_| ()), None);
}

#[test]
fn shortest_turn_stays_on_its_spiral() {
    let shortest = shortest_turn(turn(1.7, 4.5, 2.0), paper_benches(20), |_| ()).expect("it turns");
    assert!((shortest.turnaround.pitch_m() - 1.7).abs() < 1e-15);
}
