//! The paper's dragon, random boards and paths, and the poses of any dragon by the reference solver.

use std::collections::BTreeSet;
use std::f64::consts::TAU;
use std::sync::Arc;

use bench_dragon_geometry::dragon::{Board, ChainSolver, Dimensions, Dragon, Handle};
use bench_dragon_geometry::formation::{Formation, Planned, Timetable};
use bench_dragon_geometry::route::{PathSegment, PathSpec, Route, Turnaround};
use glam::DVec2;
use proptest::collection::{SizeRange, vec};
use proptest::prelude::*;

/// More than the rounding of a distance between boards.
const ROUNDING_M: f64 = 1e-9;

/// The paper's benches, as many as `count`. The paper's dragon has 223.
pub fn paper_benches(count: usize) -> Dimensions {
    Dimensions::new(count, 3.41, 2.20, 0.30, 0.275).expect("the paper's benches are valid")
}

/// The paper's turnaround, for a ratio of its radii. The paper's is 2.
pub fn paper_turnaround(radius_ratio: f64) -> Turnaround {
    Turnaround::new(1.7, 9.0, radius_ratio).expect("the paper's turnaround is valid")
}

/// The paper's dragon on its spiral.
pub fn paper_dragon() -> Dragon {
    paper_dragon_of(223)
}

/// A dragon of `count` benches on the paper's spiral. A longer body extends further out.
pub fn paper_dragon_of(count: usize) -> Dragon {
    dragon_on(Route::spiral(0.55, 16.0).expect("the paper's spiral is valid"), paper_benches(count))
}

/// The paper's dragon on its turnaround.
pub fn turning_dragon() -> Dragon {
    dragon_on(paper_turnaround(2.0).route(), paper_benches(223))
}

/// A dragon on a route where it can stand.
pub fn dragon_on(route: Route, dimensions: Dimensions) -> Dragon {
    Dragon::new(dimensions, Arc::new(route)).expect("the dragon stands")
}

/// All handles at a travel of the run.
pub fn handles_at(dragon: &Dragon, travel_m: f64) -> Vec<Handle> {
    ChainSolver::new(dragon).solve(dragon, travel_m).expect("within the run").to_vec()
}

/// All boards at a travel of the run.
pub fn boards_at(dragon: &Dragon, travel_m: f64) -> Vec<Board> {
    let mut boards = Vec::new();
    dragon.place_boards(&handles_at(dragon, travel_m), &mut boards);
    boards
}

/// All pairs of benches that share no hinge.
pub fn pairs(benches: usize) -> impl Iterator<Item = [usize; 2]> {
    (0..benches).flat_map(move |first| (first + 2..benches).map(move |second| [first, second]))
}

/// The least clearance of all boards that share no hinge.
///
/// Boards are no nearer to each other than the circles about them. So pairs with circles further apart than the least clearance so far
/// are not measured.
pub fn least_clearance_m(boards: &[Board]) -> f64 {
    let radii_m: Vec<f64> = boards.iter().map(|board| board.half_length.hypot(board.half_width)).collect();
    pairs(boards.len()).fold(f64::INFINITY, |least_m, [first, second]| {
        let apart_m = boards[first].centre.distance(boards[second].centre) - radii_m[first] - radii_m[second];
        if apart_m > least_m + ROUNDING_M { least_m } else { boards[first].clearance(&boards[second]).min(least_m) }
    })
}

/// The pairs that share no hinge and are at most this far apart, each measured.
pub fn pairs_within(dragon: &Dragon, travel_m: f64, clearance_m: f64) -> BTreeSet<[usize; 2]> {
    let boards = boards_at(dragon, travel_m);
    pairs(boards.len()).filter(|&[first, second]| boards[first].clearance(&boards[second]) <= clearance_m).collect()
}

/// Whether two boards that share no hinge overlap.
pub fn some_pair_overlaps(dragon: &Dragon, travel_m: f64) -> bool {
    let boards = boards_at(dragon, travel_m);
    pairs(boards.len()).any(|[first, second]| boards[first].overlaps(&boards[second]))
}

/// Clearance of two boards at a travel of the run.
pub fn clearance_at(dragon: &Dragon, travel_m: f64, [first, second]: [usize; 2]) -> f64 {
    let boards = boards_at(dragon, travel_m);
    boards[first].clearance(&boards[second])
}

/// Fails unless a position has these coordinates, which are given to six decimals.
pub fn assert_near(actual: DVec2, x: f64, y: f64, what: &str) {
    let error_m = actual - DVec2::new(x, y);
    assert!(error_m.abs().max_element() <= 5.001e-7, "{what} is at {actual}, not at ({x}, {y})");
}

/// Boards whose centres are up to this far from the origin in x and in y.
pub fn boards(spread_m: f64) -> impl Strategy<Value = Board> {
    let centres = (-spread_m..spread_m, -spread_m..spread_m);
    (centres, 0.0..TAU, 0.2..2.0_f64, 0.05..0.5_f64).prop_map(|((x, y), angle, half_length, half_width)| Board {
        centre: DVec2::new(x, y),
        heading: DVec2::from_angle(angle),
        half_length,
        half_width,
    })
}

/// Open paths of lines, arcs and spirals on which most dragons can walk.
pub fn wide_paths(segments: impl Into<SizeRange>) -> impl Strategy<Value = PathSpec> {
    let radius_m = 3.0..9.0_f64;
    let turn = (0.3..4.0_f64, any::<bool>()).prop_map(|(turn, left)| if left { turn } else { -turn });
    let segment = prop_oneof![
        (1.0..10.0_f64).prop_map(|length_m| PathSegment::Line { length_m }),
        (radius_m.clone(), turn.clone()).prop_map(|(radius_m, turn)| PathSegment::Arc { radius_m, turn }),
        (radius_m.clone(), radius_m, turn).prop_map(|(start_radius_m, end_radius_m, turn)| {
            PathSegment::Spiral { start_radius_m, end_radius_m, turn }
        }),
    ];
    vec(segment, segments).prop_map(|segments| PathSpec { segments, laps: None })
}

/// The formation of one dragon that walks at 1 m/s.
pub fn plain_formation(dragon: Dragon) -> Arc<Formation> {
    let timetable = Timetable::new(1.0, None, dragon.start_travel_m(), dragon.end_travel_m());
    Arc::new(Formation::of_one(Planned { dragon: Arc::new(dragon), timetable }))
}
