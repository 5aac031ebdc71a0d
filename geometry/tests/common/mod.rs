//! Small random dragons, and their clearances by the reference solver.
#![allow(dead_code, missing_docs, unreachable_pub, reason = "each test uses some of it")]

use std::ops::Range;
use std::sync::Arc;

use bench_dragon_geometry::dragon::{Board, ChainSolver, Dimensions, Dragon};
use bench_dragon_geometry::formation::{Formation, Planned, Timetable};
use bench_dragon_geometry::route::{PathSegment, PathSpec, Placement, RouteShape, RouteSpec, SpiralSpec};
use glam::DVec2;
use proptest::prelude::*;

/// A dragon of small benches on a route, with its timetable.
pub fn planned(
    benches: usize,
    route: &RouteSpec,
    [start_s, speed_mps]: [f64; 2],
    accel_mps2: Option<f64>,
) -> Option<Planned> {
    let dimensions = Dimensions::new(benches, 1.2, 0.9, 0.25, 0.1).expect("small benches");
    let curve = route.build(speed_mps, dimensions.links_m()).ok()?;
    let dragon = Dragon::new(dimensions, Arc::new(curve)).ok()?;
    let (start_m, end_m) = (dragon.start_travel_m(), dragon.end_travel_m());
    let timetable = Timetable::leaving(start_s, start_m, speed_mps, accel_mps2, end_m);
    Some(Planned { dragon: Arc::new(dragon), timetable })
}

pub fn path(segments: Vec<PathSegment>, placement: Placement) -> RouteSpec {
    let spec = PathSpec { segments, laps: None };
    RouteSpec { shape: RouteShape::Path(spec), placement, start_s: 0.0, end_s: None, ground: None }
}

pub fn straight(from: DVec2, heading_rad: f64, length_m: f64) -> RouteSpec {
    path(vec![PathSegment::Line { length_m }], Placement { position: from, heading: heading_rad })
}

/// The boards of all dragons at a plan time, by the reference solver.
pub fn boards_at(formation: &Formation, time_s: f64) -> Vec<Vec<Board>> {
    let of = |planned: &Planned| {
        let (mut solver, mut boards) = (ChainSolver::new(&planned.dragon), Vec::new());
        let handles = solver.solve(&planned.dragon, planned.travel_m(time_s)).expect("a travel of the run");
        planned.dragon.place_boards(handles, &mut boards);
        boards
    };
    formation.dragons().iter().map(of).collect()
}

/// The least clearance of any two benches of two dragons, and of any two of one dragon that share no hinge if `within` is set.
pub fn least_clearance_m(formation: &Formation, time_s: f64, within: bool) -> f64 {
    let dragons = boards_at(formation, time_s);
    let all: Vec<(usize, usize, &Board)> = dragons
        .iter()
        .enumerate()
        .flat_map(|(dragon, boards)| boards.iter().enumerate().map(move |(bench, board)| (dragon, bench, board)))
        .collect();
    let mut least_m = f64::INFINITY;
    for (number, &(dragon, bench, board)) in all.iter().enumerate() {
        for &(other_dragon, other_bench, other) in &all[number + 1..] {
            if dragon != other_dragon || (within && bench.abs_diff(other_bench) > 1) {
                least_m = least_m.min(board.clearance(other));
            }
        }
    }
    least_m
}

fn routes() -> impl Strategy<Value = RouteSpec> {
    let placements = (-6.0..6.0_f64, -6.0..6.0_f64, 0.0..std::f64::consts::TAU)
        .prop_map(|(x, y, heading)| Placement { position: DVec2::new(x, y), heading });
    let spirals = (0.6..2.0_f64, 1.0..3.0_f64)
        .prop_map(|(pitch_m, start_turns)| RouteShape::Spiral(SpiralSpec { pitch_m, start_turns }));
    let line = (0.5..8.0_f64).prop_map(|length_m| PathSegment::Line { length_m });
    let arc = (1.0..4.0_f64, -200.0..200.0_f64).prop_map(|(radius_m, turn_deg)| PathSegment::Arc {
        radius_m,
        turn: if turn_deg.abs() < 5.0 { 0.5 } else { turn_deg.to_radians() },
    });
    let paths = prop::collection::vec(prop_oneof![line, arc], 1..5)
        .prop_map(|segments| RouteShape::Path(PathSpec { segments, laps: None }));
    (prop_oneof![spirals, paths], placements).prop_map(|(shape, placement)| RouteSpec {
        shape,
        placement,
        start_s: 0.0,
        end_s: None,
        ground: None,
    })
}

/// Random formations of this many dragons.
pub fn formations_of(count: Range<usize>) -> impl Strategy<Value = Formation> {
    let accels = prop_oneof![Just(None), (0.1..2.0_f64).prop_map(Some)];
    let dragons = (1..7_usize, routes(), [0.0..15.0_f64, 0.3..2.0_f64], accels);
    prop::collection::vec(dragons, count).prop_filter_map("cannot stand", |dragons| {
        let all: Option<Vec<_>> =
            dragons.iter().map(|(benches, route, times, accel)| planned(*benches, route, *times, *accel)).collect();
        all.map(Formation::new)
    })
}
