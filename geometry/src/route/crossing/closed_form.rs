//! Crossings of lines and arcs in closed form.

use std::f64::consts::TAU;

use glam::DVec2;

use super::TOUCH_ANGLE;
use crate::route::segment_part::SegmentPart;
use crate::route::{CircularArc, Line};

/// A curve whose crossings with its like have a closed form.
#[derive(Clone, Copy, Debug)]
pub(in crate::route) enum ClosedForm<'a> {
    /// The straight line through a line.
    Line(&'a Line),
    /// The circle through an arc.
    Circle(&'a CircularArc),
}

impl ClosedForm<'_> {
    /// The points at which the whole lines and circles through two curves cross.
    pub(super) fn crossings(self, other: Self) -> Vec<DVec2> {
        match (self, other) {
            (Self::Line(one), Self::Line(other)) => line_and_line(one, other).into_iter().collect(),
            (Self::Line(line), Self::Circle(arc)) | (Self::Circle(arc), Self::Line(line)) => line_and_arc(line, arc),
            (Self::Circle(one), Self::Circle(other)) => arc_and_arc(one, other),
        }
    }
}

/// The point at which the straight lines through two segments cross.
fn line_and_line(one: &Line, other: &Line) -> Option<DVec2> {
    let across = one.direction().perp_dot(other.direction());
    let share = (other.origin() - one.origin()).perp_dot(other.direction()) / across;
    (across.abs() > TOUCH_ANGLE).then(|| one.origin() + share * one.direction())
}

/// The points at which the straight line and the circle through two segments cross.
fn line_and_arc(line: &Line, arc: &CircularArc) -> Vec<DVec2> {
    let to_centre = arc.centre() - line.origin();
    let foot = line.origin() + to_centre.dot(line.direction()) * line.direction();
    let off_m = to_centre.perp_dot(line.direction());
    let half_m = ((arc.radius_m() - off_m) * (arc.radius_m() + off_m)).max(0.0).sqrt();
    let is_crossing = half_m > TOUCH_ANGLE * arc.radius_m();
    let points = [half_m, -half_m].map(|along_m| foot + along_m * line.direction());
    if is_crossing { points.into() } else { Vec::new() }
}

/// The points at which the circles through two arcs cross.
fn arc_and_arc(one: &CircularArc, other: &CircularArc) -> Vec<DVec2> {
    let (between, [r, s]) = (other.centre() - one.centre(), [one.radius_m(), other.radius_m()]);
    let distance_m = between.length();
    let along_m = 0.5 * (distance_m + (r - s) * (r + s) / distance_m);
    let half_m = ((r - along_m) * (r + along_m)).max(0.0).sqrt();
    let is_crossing = half_m * distance_m > TOUCH_ANGLE * r * s;
    let direction = between / distance_m;
    let points = [half_m, -half_m].map(|off_m| one.centre() + along_m * direction + off_m * direction.perp());
    if is_crossing { points.into() } else { Vec::new() }
}

/// The parameter of a line or an arc nearest to a point, if the piece reaches it. The caller refines it.
pub(super) fn parameter_near(part: &SegmentPart<'_>, near: DVec2) -> Option<f64> {
    let &SegmentPart { placed, rear, front, .. } = part;
    let parameter = match placed.segment.curve().closed_form()? {
        ClosedForm::Line(line) => placed.parameter_of((near - line.origin()).dot(line.direction())),
        ClosedForm::Circle(arc) => {
            let (parameter, turn) = (placed.parameter_of(arc.toward(near)), TAU * arc.radius_m());
            parameter + turn * ((0.5 * (rear + front) - parameter) / turn).round()
        }
    };
    let slack = 1e-3;
    (parameter >= rear - slack && parameter <= front + slack).then(|| parameter.clamp(rear, front))
}
