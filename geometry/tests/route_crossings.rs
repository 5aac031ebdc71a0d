//! Crossings of routes with themselves, compared with brute force on dense polylines.

use std::f64::consts::TAU;

use bench_dragon_geometry::route::{
    Crossing, PathSegment, PathSpec, Placement, Route, RouteSpec, SpiralSpec, TurnaroundSpec,
};
use glam::DVec2;
use proptest::prelude::*;
use test_support::property::random_cases;

/// Distance between two points of the polyline, in metres.
const STEP_M: f64 = 0.01;
/// Angle in radians above which polyline and route agree on a crossing.
const CLEAR_ANGLE: f64 = 0.1;
/// Distance of a crossing's travels from those of the polyline.
const NEAR_M: f64 = 0.03;

fn segments() -> impl Strategy<Value = PathSegment> {
    let turn = || prop_oneof![-6.0..-0.2_f64, 0.2..6.0_f64];
    prop_oneof![
        (0.5..8.0_f64).prop_map(|length_m| PathSegment::Line { length_m }),
        (0.5..4.0_f64, turn()).prop_map(|(radius_m, turn)| PathSegment::Arc { radius_m, turn }),
        (0.0..4.0_f64, 0.2..4.0_f64, any::<bool>(), turn()).prop_map(|(less_m, by_m, inward, turn)| {
            let [start_radius_m, end_radius_m] = if inward { [less_m + by_m, less_m] } else { [less_m, less_m + by_m] };
            PathSegment::Spiral { start_radius_m, end_radius_m, turn }
        }),
    ]
}

fn path(segments: Vec<PathSegment>, laps: Option<u32>, placement: Placement) -> Route {
    let plan = RouteSpec { placement, ..RouteSpec::from(PathSpec { segments, laps }) };
    plan.build(1.0, 5.0).expect("a valid path")
}

fn crossings(route: &Route, from_m: f64) -> Vec<Crossing> {
    let found = route.crossings(from_m, route.end_travel_m(), false, u64::MAX);
    assert!(found.is_complete);
    found.found
}

/// The travels at which a dense polyline crosses itself, with the angle between the two pieces.
fn brute_force(route: &Route, from_m: f64) -> Vec<([f64; 2], f64)> {
    let end_m = route.end_travel_m();
    let count = ((end_m - from_m) / STEP_M).ceil();
    let travel_m = |step: usize| from_m + (end_m - from_m) * (step as f64 / count);
    let points: Vec<DVec2> =
        (0..=count as usize).map(|step| route.point(route.parameter(travel_m(step))).position).collect();
    let pieces: Vec<[DVec2; 2]> = points.windows(2).map(|ends| [ends[0], ends[1]]).collect();
    let mut found = Vec::new();
    for (j, &[c, d]) in pieces.iter().enumerate() {
        for (i, &[a, b]) in pieces[..j.saturating_sub(1)].iter().enumerate() {
            if a.distance_squared(c) > 4.0 * STEP_M * STEP_M {
                continue;
            }
            let (u, v, gap) = (b - a, d - c, c - a);
            let across = u.perp_dot(v);
            let (s, t) = (gap.perp_dot(v) / across, gap.perp_dot(u) / across);
            if (0.0..1.0).contains(&s) && (0.0..1.0).contains(&t) {
                let angle = u.angle_to(v).abs();
                let angle = angle.min(TAU / 2.0 - angle);
                found.push(([travel_m(i) + s * STEP_M, travel_m(j) + t * STEP_M], angle));
            }
        }
    }
    found
}

fn is_near(one: [f64; 2], other: [f64; 2]) -> bool {
    (0..2).all(|i| (one[i] - other[i]).abs() < NEAR_M)
}

fn angle_at(route: &Route, crossing: &Crossing) -> f64 {
    let [one, other] = crossing.travels_m.map(|at_m| route.point(route.parameter(at_m)).tangent);
    one.perp_dot(other).abs().asin()
}

/// Checks that both travels of each crossing lead to its point.
fn assert_exact(route: &Route, found: &[Crossing]) -> Result<(), TestCaseError> {
    for crossing in found {
        for travel_m in crossing.travels_m {
            let off_m = route.point(route.parameter(travel_m)).position.distance(crossing.point);
            prop_assert!(off_m < 1e-8, "{crossing:?} is {off_m:e} m from the route at {travel_m}");
        }
        prop_assert!(crossing.travels_m[0] < crossing.travels_m[1]);
    }
    Ok(())
}

proptest! {
    #![proptest_config(random_cases(400))]

    #[test]
    fn crossings_are_those_of_a_dense_polyline(
        segments in prop::collection::vec(segments(), 1..12), heading in -3.0..3.0_f64, at in (-50.0..50.0_f64, -50.0..50.0_f64),
    ) {
        let route = path(segments, None, Placement { position: at.into(), heading });
        let (found, expected) = (crossings(&route, -5.0), brute_force(&route, -5.0));
        assert_exact(&route, &found)?;
        let end_m = route.end_travel_m();
        let is_inner = |travels_m: [f64; 2]| travels_m[0] > -5.0 + NEAR_M && travels_m[1] < end_m - NEAR_M;
        for (travels_m, angle) in &expected {
            let is_known = found.iter().any(|crossing| is_near(crossing.travels_m, *travels_m));
            prop_assert!(is_known || *angle < CLEAR_ANGLE || !is_inner(*travels_m), "{travels_m:?} at {angle} is missing");
        }
        for crossing in &found {
            let is_known = expected.iter().any(|(travels_m, _)| is_near(crossing.travels_m, *travels_m));
            let is_clear = angle_at(&route, crossing) >= CLEAR_ANGLE && is_inner(crossing.travels_m);
            prop_assert!(is_known || !is_clear, "{crossing:?} is no crossing");
        }
        for (i, one) in found.iter().enumerate() {
            prop_assert!(found[..i].iter().all(|other| (0..2).any(|k| (one.travels_m[k] - other.travels_m[k]).abs() > 1e-6)));
        }
    }

    #[test]
    fn a_moved_route_has_the_same_crossings(
        segments in prop::collection::vec(segments(), 1..12), heading in -3.0..3.0_f64, at in (-50.0..50.0_f64, -50.0..50.0_f64),
    ) {
        let plain = path(segments.clone(), None, Placement::default());
        let placement = Placement { position: at.into(), heading };
        let moved = crossings(&path(segments, None, placement), -5.0);
        let clear = |route: &Route, found: &[Crossing]| {
            found.iter().filter(|crossing| angle_at(route, crossing) > 1e-3).map(|crossing| crossing.travels_m).collect::<Vec<_>>()
        };
        for travels_m in clear(&plain, &crossings(&plain, -5.0)) {
            prop_assert!(moved.iter().any(|crossing| (0..2).all(|i| (crossing.travels_m[i] - travels_m[i]).abs() < 1e-6)));
        }
    }
}

fn line(length_m: f64) -> PathSegment {
    PathSegment::Line { length_m }
}

fn arc(radius_m: f64, degrees: f64) -> PathSegment {
    PathSegment::Arc { radius_m, turn: degrees.to_radians() }
}

#[test]
fn known_routes_do_not_cross_themselves() {
    for plan in [RouteSpec::from(SpiralSpec::default()), RouteSpec::from(TurnaroundSpec::default())] {
        let route = plan.build(1.0, 400.0).expect("the paper's");
        assert_eq!(crossings(&route, route.start_travel_m() - 400.0), []);
    }
}

#[test]
fn a_crossing_at_seams_is_one_crossing() {
    let eight = [line(20.0), line(20.0), arc(20.0, 270.0), line(20.0), line(20.0), arc(20.0, -270.0)];
    let route = path(eight.to_vec(), Some(2), Placement::default());
    let lap_m = 0.5 * route.end_travel_m();
    let found = route.crossings(0.0, lap_m, true, u64::MAX).found;
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].point.distance(DVec2::new(20.0, 0.0)) < 1e-9, "{found:?}");
}

#[test]
fn a_lap_that_begins_at_its_crossing_has_one_crossing() {
    let eight = [line(20.0), arc(20.0, 270.0), line(40.0), arc(20.0, -270.0), line(20.0)];
    let route = path(eight.to_vec(), Some(1), Placement::default());
    let found = route.crossings(0.0, route.end_travel_m(), true, u64::MAX).found;
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].travels_m[0] == 0.0 && found[0].point.length() < 1e-9, "{found:?}");
}

/// Decimals of a millimetre leave a gap at the joint, in which the end of the lap may cross its beginning.
#[test]
fn a_lap_with_a_gap_at_its_joint_has_no_crossing_there() {
    for (off_m, off_deg) in [(0.0003, 0.002), (-0.0003, 0.002), (0.0003, -0.002), (-0.0004, -0.003)] {
        let oval = vec![line(10.0 + off_m), arc(5.0, 180.0 + off_deg), line(10.0), arc(5.0, 180.0)];
        let route = path(oval, Some(2), Placement::default());
        let found = route.crossings(0.0, 0.5 * route.end_travel_m(), true, u64::MAX).found;
        assert_eq!(found, [], "{off_m} m and {off_deg}°");
    }
}

#[test]
fn a_route_that_touches_itself_or_repeats_itself_does_not_cross_itself() {
    // Two rounds of a circle, and a straight line that touches it.
    let rounds = path(vec![arc(5.0, 720.0), line(30.0)], None, Placement::default());
    assert_eq!(crossings(&rounds, -5.0), []);
    // Two laps of an oval, written one after the other.
    let oval = [line(10.0), arc(5.0, 180.0), line(10.0), arc(5.0, 180.0)];
    assert_eq!(crossings(&path([oval, oval].concat(), None, Placement::default()), -5.0), []);
    // The end lies on the run-up.
    let square = [line(10.0), arc(2.0, 90.0), line(6.0), arc(2.0, 90.0), line(10.0), arc(2.0, 90.0), line(8.0)];
    assert_eq!(crossings(&path(square.to_vec(), None, Placement::default()), -5.0), []);
}

#[test]
fn a_line_across_a_spiral_crosses_each_turn() {
    let inward = PathSegment::Spiral { start_radius_m: 10.0, end_radius_m: 5.0, turn: 10.0 * TAU };
    let route = path(vec![inward, arc(2.0, 100.0), line(40.0)], None, Placement::default());
    let found = crossings(&route, 0.0);
    let expected = brute_force(&route, 0.0);
    assert_eq!(found.len(), expected.iter().filter(|(_, angle)| *angle > CLEAR_ANGLE).count());
    assert!(found.len() > 8, "{found:?}");
}

#[test]
fn a_limit_of_work_ends_the_search() {
    let zigzag: Vec<PathSegment> = (0..1000).map(|turn| arc(1.0 + f64::from(turn % 7), 200.0)).collect();
    let route = path(zigzag, None, Placement::default());
    assert!(!route.crossings(0.0, route.end_travel_m(), false, 30_000).is_complete);
    let all = route.crossings(0.0, route.end_travel_m(), false, u64::MAX);
    assert!(all.is_complete && all.found.len() > 1000, "{} crossings in {} steps", all.found.len(), all.steps);
}

/// The default limit of `solve route` is 100 million steps.
#[test]
fn ten_thousand_segments_take_few_steps() {
    let segment = |i: u32| {
        let turn = [70.0_f64, -110.0, 45.0, -20.0, 160.0, -130.0][i as usize * i as usize % 6].to_radians();
        match i % 3 {
            0 => line(20.0 + 9.0 * f64::from(i % 11)),
            1 => PathSegment::Arc { radius_m: 2.0 + f64::from(i % 5), turn },
            _ => PathSegment::Spiral { start_radius_m: 3.0, end_radius_m: 4.0 + f64::from(i % 7), turn },
        }
    };
    let route = path((0..10_000).map(segment).collect(), None, Placement::default());
    let all = route.crossings(0.0, route.end_travel_m(), false, u64::MAX);
    assert!(all.steps < 50_000_000 && all.found.len() > 100, "{} crossings in {} steps", all.found.len(), all.steps);
}
