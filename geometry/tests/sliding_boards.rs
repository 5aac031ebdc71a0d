//! Boards that slide along each other, with a clearance of 0 up to rounding. The route goes in on a line, round a loop, and
//! back beside the line at the distance of a board's width. On a spiral that is nearly an arc, boards hardly move against each other.

use std::collections::BTreeMap;
use std::sync::Arc;

use bench_dragon_geometry::clearance::{ContactSearch, PairEvent};
use bench_dragon_geometry::dragon::{Dimensions, Dragon, Meter};
use bench_dragon_geometry::route::{CircularArc, Line, PathSegment, PathSpec, Route, RouteSpec, Segment, Turn};
use glam::DVec2;

const WIDTH_M: f64 = 0.4;
const RADIUS_M: f64 = 3.0;
const END_M: f64 = 26.0;

/// Along +x to the origin, through arcs right, left and right, and back along −x at y = `WIDTH_M`. The outer arcs turn by α, so
/// the two lines are r·(4·cos α − 2) apart.
fn keyhole() -> Route {
    let swerve = (0.25 * (2.0 + WIDTH_M / RADIUS_M)).acos();
    let arcs = [
        (swerve, Turn::Clockwise),
        (2.0 * swerve + std::f64::consts::PI, Turn::CounterClockwise),
        (swerve, Turn::Clockwise),
    ];
    let (mut position, mut tangent, mut length_m) = (DVec2::ZERO, DVec2::X, 0.0);
    let mut segments = vec![Segment::Line(Line::up_to(position, tangent))];
    for (angle, turn) in arcs {
        let arc = Segment::Arc(CircularArc::from_begin(position, tangent, RADIUS_M, angle, turn));
        let end = arc.point(RADIUS_M * angle);
        (position, tangent, length_m) = (end.position, end.tangent, length_m + RADIUS_M * angle);
        segments.push(arc);
    }
    // Corrects rounding: the line back is exactly beside the line in.
    let back = DVec2::new(position.x, WIDTH_M);
    segments.push(Segment::Line(Line::from_begin(back, -DVec2::X, END_M - length_m)));
    Route::new(&segments, 0.0, [-1.0, END_M]).expect("every arc touches the next segment")
}

/// Travel at which the line back begins.
fn back_m() -> f64 {
    let keyhole = keyhole();
    keyhole.travel(keyhole.seams()[3])
}

/// A dragon with boards narrower than the distance of the two lines, by `narrower_m`.
fn dragon(narrower_m: f64) -> Dragon {
    let dimensions = Dimensions::new(30, 1.2, 1.2, WIDTH_M - narrower_m, 0.1).expect("valid benches");
    Dragon::new(dimensions, Arc::new(keyhole())).expect("the dragon stands on the line")
}

#[test]
fn the_line_back_is_beside_the_line_in() {
    let keyhole = keyhole();
    for travel_m in [22.0, 24.0, 26.0] {
        let back = keyhole.point(keyhole.parameter(travel_m));
        assert!((back.position.y - WIDTH_M).abs() < 1e-12 && (back.tangent + DVec2::X).length() < 1e-12, "{back:?}");
    }
    let seam = keyhole.seams()[3];
    let step = keyhole.point(seam).position.distance(keyhole.point(seam + 1e-9).position);
    assert!(step < 2e-9, "the route jumps by {step} m");
}

/// Where the lines meet, benches swing past each other's ends. After that, they touch as long as they are alongside.
#[test]
fn boards_that_slide_along_each_other_touch_and_part_in_turn() {
    assert_touch_and_part_in_turn(0.0);
}

/// The same with boards that stay exactly at the searched clearance.
#[test]
fn boards_that_slide_at_the_clearance_come_within_it_and_leave_it_in_turn() {
    assert_touch_and_part_in_turn(0.05);
}

fn assert_touch_and_part_in_turn(clearance_m: f64) {
    let dragon = dragon(clearance_m);
    let mut search = ContactSearch::within(&dragon, clearance_m);
    let mut changes = BTreeMap::<[usize; 2], Vec<bool>>::new();
    for event in search.sweep(dragon.start_travel_m(), dragon.end_travel_m()).events {
        let touches = matches!(event, PairEvent::Touch(_));
        changes.entry(event.contact().benches).or_default().push(touches);
    }
    assert!(changes.len() > 10, "{} pairs slide along each other", changes.len());
    for (benches, changes) in changes {
        assert!(changes.iter().enumerate().all(|(k, &touches)| touches == (k % 2 == 0)), "{benches:?}: {changes:?}");
        assert!(changes.len() <= 6, "{benches:?}: {changes:?}");
    }
}

#[test]
fn first_contact_is_at_the_travel_where_the_head_comes_alongside() {
    let dragon = dragon(0.0);
    let contact = ContactSearch::new(&dragon).first(dragon.start_travel_m(), dragon.end_travel_m()).expect("no limit");
    let contact = contact.expect("the head comes alongside");
    assert_eq!(contact.benches[0], 0);
    let back_m = back_m();
    assert!((contact.travel_m - back_m).abs() < 1.2, "touches at {} m, alongside from {back_m} m", contact.travel_m);
}

/// The curvature of this spiral hardly changes, and the boards of every other bench overlap a little on it. The bounds of general curves
/// settle only short intervals there.
#[test]
fn sweep_along_a_spiral_that_is_nearly_an_arc_takes_bounded_work() {
    let dimensions = Dimensions::new(8, 0.975, 0.847, 0.368, 0.1987).expect("valid benches");
    let spiral = |start_radius_m, end_radius_m, turn_deg: f64| PathSegment::Spiral {
        start_radius_m,
        end_radius_m,
        turn: turn_deg.to_radians(),
    };
    let line = |length_m| PathSegment::Line { length_m };
    for spiral in [spiral(2.854, 3.006, 246.9), spiral(3.006, 2.854, 246.9), spiral(2.854, 3.006, -246.9)] {
        let path = PathSpec { segments: vec![line(0.87), spiral, line(6.0)], laps: None };
        let route = RouteSpec::from(path).build(1.0, dimensions.links_m()).expect("a path");
        let [known, plain] = [route.clone(), route.without_spiral_bounds()].map(|route| {
            let dragon = Dragon::new(dimensions, Arc::new(route)).expect("the dragon stands on the line");
            let mut search = ContactSearch::new(&dragon.metered(&Meter::of(1_000_000)));
            let swept = search.sweep(dragon.start_travel_m(), dragon.end_travel_m());
            (swept.reached_m == dragon.end_travel_m(), swept.events.len())
        });
        assert!(known.0 && known.1 >= 6, "{known:?}");
        assert!(!plain.0, "{plain:?}");
    }
}
