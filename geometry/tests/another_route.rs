//! The dragon on a route without a spiral: a straight line that bends into a circle. The curvature jumps, and at times handles
//! are faster than the head.

use std::sync::Arc;

use bench_dragon_geometry::clearance::first_contact;
use bench_dragon_geometry::dragon::{Dimensions, Dragon, FeasibleEnd};
use bench_dragon_geometry::route::{CircularArc, Line, Route, Segment, Turn};
use glam::DVec2;
use test_support::dragons::some_pair_overlaps;

/// Along +x up to the origin, then left around a circle. t = 0 is 1 m before the origin.
fn bend(radius_m: f64, end_m: f64) -> Route {
    let line = Line::up_to(DVec2::ZERO, DVec2::X);
    let circle = CircularArc::from_begin(DVec2::ZERO, DVec2::X, radius_m, end_m / radius_m, Turn::CounterClockwise);
    let segments = [Segment::Line(line), Segment::Arc(circle)];
    Route::new(&segments, 1.0, [0.0, 1.0 + end_m]).expect("the circle touches the line")
}

fn dragon(benches: usize, radius_m: f64, end_m: f64) -> Dragon {
    let dimensions = Dimensions::new(benches, 2.2, 2.2, 0.3, 0.1).expect("valid benches");
    Dragon::new(dimensions, Arc::new(bend(radius_m, end_m))).expect("the dragon stands on the line")
}

#[test]
fn every_handle_on_the_line_is_as_fast_as_the_head() {
    let dragon = dragon(5, 3.0, 6.0);
    assert!(dragon.chain(0.5).expect("within the run").all(|handle| handle.speed_ratio == 1.0));
    assert_eq!((dragon.end_travel_m(), dragon.feasible_end()), (7.0, FeasibleEnd::RouteEnd));
}

#[test]
fn every_handle_on_the_circle_is_as_fast_as_the_head() {
    let dragon = dragon(3, 3.0, 18.0);
    for handle in dragon.chain(17.0).expect("within the run") {
        assert!((handle.speed_ratio - 1.0).abs() < 1e-12 && handle.parameter > 0.0, "{handle:?}");
    }
}

/// When the head has turned by φ, the rear handle is still a = −r·tan φ before the circle. The link is perpendicular to the
/// head's direction: r²·(sin φ − tan φ)² + r²·(1 − cos φ)² = d².
#[test]
fn handle_stops_where_the_bend_is_too_tight() {
    let (radius_m, link_m) = (0.8, 2.0);
    let dragon = dragon(1, radius_m, 10.0);
    assert_eq!(dragon.feasible_end(), FeasibleEnd::HandleStops { handle: 1 });
    let angle: f64 = (dragon.end_travel_m() - 1.0) / radius_m;
    let squared = (angle.sin() - angle.tan()).powi(2) + (1.0 - angle.cos()).powi(2);
    assert!((radius_m * squared.sqrt() - link_m).abs() < 1e-9, "the run ends at {} m", dragon.end_travel_m());
}

#[test]
fn first_contact_is_at_the_first_overlap_of_a_fine_walk() {
    let (mut contacts, step_m) = (0, 1e-3);
    for benches in [3, 6, 9] {
        for radius_m in [1.2, 1.5, 2.0, 3.0] {
            let dragon = dragon(benches, radius_m, 12.0 * radius_m);
            let steps = (dragon.end_travel_m() / step_m) as u32;
            let travels = (0..=steps).map(|step| f64::from(step) * step_m);
            let overlap_m = travels.into_iter().find(|&travel_m| some_pair_overlaps(&dragon, travel_m));
            let contact = first_contact(&dragon, 0.0, dragon.end_travel_m()).expect("no limit");
            let contact_m = contact.map(|contact| contact.travel_m);
            let agree = match (contact_m, overlap_m) {
                (Some(contact_m), Some(overlap_m)) => contact_m <= overlap_m && contact_m > overlap_m - step_m,
                (None, None) => true,
                _ => false,
            };
            assert!(agree, "{benches} benches, radius {radius_m} m: {contact:?} but {overlap_m:?}");
            contacts += u32::from(contact.is_some());
        }
    }
    assert!(contacts > 0, "some of the dragons touch themselves");
}
