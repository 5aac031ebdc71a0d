//! Boards that slide along each other, their clearance 0 all along but for rounding: a way in on a line, round a loop,
//! and out beside the way in at the distance of a board's width.

use std::collections::BTreeMap;
use std::sync::Arc;

use bench_dragon_geometry::clearance::{ContactSearch, PairEvent};
use bench_dragon_geometry::dragon::{Dimensions, Dragon};
use bench_dragon_geometry::route::{Route, RoutePoint};
use glam::DVec2;

const WIDTH_M: f64 = 0.4;
const RADIUS_M: f64 = 3.0;
const END_M: f64 = 26.0;

/// Along +x to the origin, through arcs right, left and right, and back along −x at y = `WIDTH_M`. A place is the
/// travel.
#[derive(Debug)]
struct Keyhole {
    /// Where each arc begins, and the way back: travel, point, heading and curvature.
    parts: [(f64, DVec2, f64, f64); 5],
}

impl Keyhole {
    /// The outer arcs turn by α, so that the ways lie r·(4·cos α − 2) apart.
    fn new() -> Self {
        let swerve = (0.25 * (2.0 + WIDTH_M / RADIUS_M)).acos();
        let arcs = [(-swerve, -1.0), (2.0 * swerve + std::f64::consts::PI, 1.0), (-swerve, -1.0)];
        let mut parts = [(0.0, DVec2::ZERO, 0.0, 0.0); 5];
        for (k, (turn, side)) in arcs.into_iter().enumerate() {
            let (from_m, position, heading, _) = parts[k];
            let part = (from_m, position, heading, side / RADIUS_M);
            let to_m = from_m + RADIUS_M * turn.abs();
            parts[k + 1] = (to_m, Self::along(part, to_m).position, heading + turn, 0.0);
            parts[k] = part;
        }
        parts[4] = parts[3];
        // But for rounding: the way back is beside the way in.
        parts[3].1.y = WIDTH_M;
        parts[3].2 = std::f64::consts::PI;
        Self { parts }
    }

    fn along((from_m, position, heading, curvature): (f64, DVec2, f64, f64), place: f64) -> RoutePoint {
        let walked_m = place - from_m;
        let tangent = DVec2::from_angle(heading + curvature * walked_m);
        let offset = if curvature == 0.0 {
            walked_m * tangent
        } else {
            (DVec2::from_angle(heading).perp() - tangent.perp()) / curvature
        };
        RoutePoint { position: position + offset, tangent, pace_m: 1.0 }
    }
}

impl Route for Keyhole {
    fn start_travel_m(&self) -> f64 {
        -1.0
    }

    fn end_travel_m(&self) -> f64 {
        END_M
    }

    fn pitch_m(&self) -> f64 {
        f64::INFINITY
    }

    fn travel(&self, place: f64) -> f64 {
        place
    }

    fn place(&self, travel_m: f64) -> f64 {
        travel_m
    }

    fn point(&self, place: f64) -> RoutePoint {
        if place < 0.0 {
            return RoutePoint { position: DVec2::new(place, 0.0), tangent: DVec2::X, pace_m: 1.0 };
        }
        let part = self.parts[..4].iter().rev().find(|part| place >= part.0).expect("the first part begins at 0");
        Self::along(*part, place)
    }

    fn step_back(&self, place: f64, arc_m: f64) -> f64 {
        place - arc_m
    }

    fn curvature_bound(&self, rear: f64, front: f64) -> f64 {
        if front < 0.0 || rear > self.parts[3].0 { 0.0 } else { 1.0 / RADIUS_M }
    }
}

/// A dragon whose boards are so much narrower than the two ways are apart.
fn dragon(narrower_m: f64) -> Dragon {
    let dimensions = Dimensions::new(30, 1.2, 1.2, WIDTH_M - narrower_m, 0.1).expect("valid benches");
    Dragon::new(dimensions, Arc::new(Keyhole::new())).expect("the dragon stands on the line")
}

#[test]
fn the_way_back_is_beside_the_way_in() {
    let keyhole = Keyhole::new();
    for place in [22.0, 24.0, 26.0] {
        let back = keyhole.point(place);
        assert!((back.position.y - WIDTH_M).abs() < 1e-12 && (back.tangent + DVec2::X).length() < 1e-12, "{back:?}");
    }
    let joint = keyhole.parts[3].0;
    let step = keyhole.point(joint).position.distance(keyhole.point(joint - 1e-9).position);
    assert!(step < 2e-9, "the route jumps by {step} m");
}

/// Where the ways meet benches swing past each other's ends; from there on they touch for as long as they are alongside.
#[test]
fn boards_that_slide_along_each_other_touch_and_part_in_turn() {
    assert_touch_and_part_in_turn(0.0);
}

/// The same with a clearance that is the one searched for all along.
#[test]
fn boards_that_slide_along_at_the_clearance_come_within_it_and_leave_it_in_turn() {
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
fn first_contact_is_where_the_head_comes_alongside() {
    let dragon = dragon(0.0);
    let contact = ContactSearch::new(&dragon).first(dragon.start_travel_m(), dragon.end_travel_m()).expect("no limit");
    let contact = contact.expect("the head comes alongside");
    assert_eq!(contact.benches[0], 0);
    let joint = Keyhole::new().parts[3].0;
    assert!((contact.travel_m - joint).abs() < 1.2, "touches at {} m, alongside from {joint} m", contact.travel_m);
}
