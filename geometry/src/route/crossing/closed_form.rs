//! Crossings of lines and arcs in closed form.

use std::f64::consts::TAU;

use glam::DVec2;

use super::{MEETING_M, TOUCH_ANGLE};
use crate::route::stretch::Stretch;
use crate::route::{CircularArc, Line, Segment};

/// Whether two segments lie on curves that never cross: the same circle, or spirals that are turned copies of each other. A
/// line does not cross a parallel line, which [`line_and_line`] finds.
pub(super) fn never_cross(one: &Segment, other: &Segment) -> bool {
    match (one, other) {
        (Segment::Arc(one), Segment::Arc(other)) => {
            let tolerance_m = 0.1 * TOUCH_ANGLE * one.radius_m();
            one.centre().distance(other.centre()) <= tolerance_m
                && (one.radius_m() - other.radius_m()).abs() <= tolerance_m
        }
        (Segment::Spiral(one), Segment::Spiral(other)) => one.is_turned_copy(other, MEETING_M),
        _ => false,
    }
}

/// The point at which the straight lines through two segments cross.
pub(super) fn line_and_line(one: &Line, other: &Line) -> Option<DVec2> {
    let across = one.direction().perp_dot(other.direction());
    let share = (other.origin() - one.origin()).perp_dot(other.direction()) / across;
    (across.abs() > TOUCH_ANGLE).then(|| one.origin() + share * one.direction())
}

/// The points at which the straight line and the circle through two segments cross.
pub(super) fn line_and_arc(line: &Line, arc: &CircularArc) -> Option<[DVec2; 2]> {
    let to_centre = arc.centre() - line.origin();
    let foot = line.origin() + to_centre.dot(line.direction()) * line.direction();
    let off_m = to_centre.perp_dot(line.direction());
    let half_m = ((arc.radius_m() - off_m) * (arc.radius_m() + off_m)).max(0.0).sqrt();
    let is_crossing = half_m > TOUCH_ANGLE * arc.radius_m();
    is_crossing.then(|| [half_m, -half_m].map(|along_m| foot + along_m * line.direction()))
}

/// The points at which the circles through two arcs cross.
pub(super) fn arc_and_arc(one: &CircularArc, other: &CircularArc) -> Option<[DVec2; 2]> {
    let (between, [r, s]) = (other.centre() - one.centre(), [one.radius_m(), other.radius_m()]);
    let distance_m = between.length();
    let along_m = 0.5 * (distance_m + (r - s) * (r + s) / distance_m);
    let half_m = ((r - along_m) * (r + along_m)).max(0.0).sqrt();
    let is_crossing = half_m * distance_m > TOUCH_ANGLE * r * s;
    let direction = between / distance_m;
    is_crossing.then(|| [half_m, -half_m].map(|off_m| one.centre() + along_m * direction + off_m * direction.perp()))
}

/// The parameter of a line or an arc nearest to a point, if the piece reaches it. The caller refines it.
pub(super) fn parameter_near(stretch: &Stretch<'_>, near: DVec2) -> Option<f64> {
    let &Stretch { placed, rear, front, .. } = stretch;
    let parameter = match &placed.segment {
        Segment::Line(line) => placed.parameter_of((near - line.origin()).dot(line.direction())),
        Segment::Arc(arc) => {
            let (parameter, turn) = (placed.parameter_of(arc.toward(near)), TAU * arc.radius_m());
            parameter + turn * ((0.5 * (rear + front) - parameter) / turn).round()
        }
        Segment::Spiral(_) => return None,
    };
    let slack = 1e-3;
    (parameter >= rear - slack && parameter <= front + slack).then(|| parameter.clamp(rear, front))
}
