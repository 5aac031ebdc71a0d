//! Routes of lines, arcs and spirals that the benches measure.

use std::f64::consts::PI;
use std::sync::Arc;

use bench_dragon_geometry::dragon::{Dimensions, Dragon};
use bench_dragon_geometry::formation::{Planned, Timetable};
use bench_dragon_geometry::ground::{Ground, HeightMap};
use bench_dragon_geometry::route::{PathSegment, PathSpec, Placement, Route, RouteSpec};
use glam::DVec2;
use test_support::dragons::paper_benches;

/// A street of two straights and a bend, a spiral inward, an S, a spiral outward and a straight: 1 km. The spirals keep 1.7 m
/// between their turns.
pub fn mixed() -> Route {
    let spiral =
        |start_radius_m: f64, end_radius_m: f64, turn: f64| PathSegment::Spiral { start_radius_m, end_radius_m, turn };
    route(vec![
        PathSegment::Line { length_m: 150.0 },
        PathSegment::Arc { radius_m: 12.0, turn: 0.5 * PI },
        PathSegment::Line { length_m: 100.0 },
        PathSegment::Arc { radius_m: 25.0, turn: -0.5 * PI },
        spiral(17.0, 5.1, -14.0 * PI),
        PathSegment::Arc { radius_m: 3.0, turn: -PI },
        PathSegment::Arc { radius_m: 3.0, turn: 0.5 * PI },
        PathSegment::Line { length_m: 150.0 },
    ])
}

/// A winding street of this many arcs, each 1.2 to 1.8 m long and of a radius of 4 to 40 m, as a fitted drawing has them.
pub fn winding(segments: usize) -> Route {
    let arc = |number: usize| {
        // Multiples of irrational numbers, without their whole parts, are spread evenly.
        let spread = |step: f64| (number as f64 * step).fract();
        let (radius_m, length_m) = (4.0 + 36.0 * spread(0.618_034), 1.2 + 0.6 * spread(0.414_214));
        // Eight arcs to one side, then eight to the other.
        let side = if (number / 8).is_multiple_of(2) { 1.0 } else { -1.0 };
        PathSegment::Arc { radius_m, turn: side * length_m / radius_m }
    };
    route((0..segments).map(arc).collect())
}

/// A dragon of 223 benches that leaves at 0, coils in on a square and out again, and leaves it: a route of
/// `examples/square.toml`.
pub fn through_a_square(position: DVec2, heading_deg: f64) -> Planned {
    let spiral =
        |start_radius_m: f64, end_radius_m: f64, turn: f64| PathSegment::Spiral { start_radius_m, end_radius_m, turn };
    let segments = vec![
        PathSegment::Line { length_m: 110.0 },
        spiral(8.0, 4.0, 4.0 * PI),
        PathSegment::Arc { radius_m: 2.0, turn: PI },
        PathSegment::Arc { radius_m: 2.0, turn: -PI },
        spiral(4.0, 8.0, -4.0 * PI),
        PathSegment::Line { length_m: 80.0 },
    ];
    let placement = Placement { position, heading: heading_deg.to_radians() };
    let spec = RouteSpec { placement, ..RouteSpec::from(PathSpec { segments, laps: None }) };
    let dimensions = Dimensions::new(223, 2.4, 1.6, 0.3, 0.2).expect("valid benches");
    let route = spec.build(1.0, dimensions.links_m()).expect("each segment is valid");
    let dragon = Dragon::new(dimensions, Arc::new(route)).expect("the dragon stands");
    let timetable = Timetable::leaving(0.0, dragon.start_travel_m(), 1.0, Some(0.5), dragon.end_travel_m());
    Planned { dragon: Arc::new(dragon), timetable }
}

fn route(segments: Vec<PathSegment>) -> Route {
    let spec = RouteSpec::from(PathSpec { segments, laps: None });
    spec.build(1.0, paper_benches(223).links_m()).expect("each segment is valid")
}

/// The paper's spiral on hills of half a metre: a map with a height each half metre.
pub fn on_hills() -> Route {
    const COLUMNS: usize = 161;
    let at = |index: usize| -40.0 + 0.5 * index as f64;
    let heights_m = (0..COLUMNS * COLUMNS).map(|k| {
        let (x, y) = (at(k % COLUMNS), at(k / COLUMNS));
        0.25 * ((0.3 * x).sin() + (0.4 * y).cos())
    });
    let map = HeightMap::new([COLUMNS; 2], DVec2::splat(-40.0), DVec2::splat(0.5), heights_m.collect());
    let ground = Ground::map(map.expect("a valid map"));
    let spiral = Route::spiral(0.55, 16.0).expect("the paper's spiral");
    spiral.on_ground(&ground, 0.0, None, paper_benches(223).links_m()).expect("the map is large enough")
}
