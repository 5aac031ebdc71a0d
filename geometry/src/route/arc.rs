//! A circular arc, walked clockwise or counter-clockwise.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec2;

use super::capability::{ArcLength, Bounds, CHORD_TURN, Crosses, PlaneCurve};
use super::crossing::{ClosedForm, TOUCH_ANGLE};
use super::kernel::{Formula, PolarFormula};
use super::{Kernel, Placement, Segment};

/// Direction in which an arc turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// To the right.
    Clockwise,
    /// To the left.
    CounterClockwise,
}

impl Turn {
    /// The direction of an angle, above 0 to the left.
    pub(super) fn of(angle: f64) -> Self {
        if angle > 0.0 { Self::CounterClockwise } else { Self::Clockwise }
    }

    /// Returns 1 for a left turn, −1 for a right turn.
    #[inline]
    pub(super) fn sign(self) -> f64 {
        match self {
            Self::Clockwise => -1.0,
            Self::CounterClockwise => 1.0,
        }
    }
}

/// A circular arc. Its parameter is in metres from its beginning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CircularArc {
    centre: DVec2,
    radius_m: f64,
    turn: Turn,
    /// Unit vector from the centre to the arc's beginning.
    begin: DVec2,
    angle: f64,
}

impl CircularArc {
    /// The arc that turns by `angle` radians and begins at a given point with a given tangent.
    pub fn from_begin(position: DVec2, tangent: DVec2, radius_m: f64, angle: f64, turn: Turn) -> Self {
        let begin = outward(tangent, turn);
        Self { centre: position - radius_m * begin, radius_m, turn, begin, angle }
    }

    /// The arc that turns by `angle` radians and ends at a given point with a given tangent.
    pub fn to_end(position: DVec2, tangent: DVec2, radius_m: f64, angle: f64, turn: Turn) -> Self {
        let end = outward(tangent, turn);
        let begin = DVec2::from_angle(-turn.sign() * angle).rotate(end);
        Self { centre: position - radius_m * end, radius_m, turn, begin, angle }
    }

    /// Centre of the circle.
    pub fn centre(&self) -> DVec2 {
        self.centre
    }

    /// Radius of the circle, in metres.
    pub fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// Angle by which the arc turns, in radians.
    pub fn angle(&self) -> f64 {
        self.angle
    }

    /// Arc length, in metres.
    pub fn length_m(&self) -> f64 {
        self.radius_m * self.angle
    }

    /// The parameter in the direction of a point from the centre, at most half a turn from the beginning.
    pub(super) fn toward(&self, point: DVec2) -> f64 {
        let direction = point - self.centre;
        let angle = f64::atan2(self.begin.perp_dot(direction), self.begin.dot(direction));
        self.turn.sign() * angle * self.radius_m
    }
}

impl PlaneCurve for CircularArc {
    #[inline]
    fn span(&self) -> (f64, f64) {
        (0.0, self.length_m())
    }

    fn place(&mut self, placement: &Placement) {
        (self.centre, self.begin) = (placement.place(self.centre), placement.turn(self.begin));
    }

    fn kernel(&self, begin: f64, offset: f64) -> Kernel {
        let turn = self.curvature(0.0);
        let formula = PolarFormula {
            centre: self.centre,
            angle: self.begin.to_angle() + turn * offset,
            turn,
            radius_m: self.radius_m,
            radius_per_radian_m: 0.0,
            axis: 0.0,
        };
        Kernel { begin, formula: Formula::Polar(formula) }
    }

    fn reference(&self) -> DVec2 {
        self.centre
    }
}

impl ArcLength for CircularArc {
    #[inline]
    fn chord_back(&self, at: f64, chord_m: f64) -> Option<f64> {
        // Where the arc begins within the chord, it begins within the step, which is longer: nothing to calculate.
        if at < chord_m {
            return None;
        }
        let turn = 2.0 * (0.5 * chord_m / self.radius_m).asin();
        (turn <= CHORD_TURN).then_some(turn * self.radius_m)
    }
}

impl Bounds for CircularArc {
    #[inline]
    fn curvature(&self, _at: f64) -> f64 {
        self.turn.sign() / self.radius_m
    }

    fn constant_curvature(&self) -> Option<f64> {
        Some(self.turn.sign() / self.radius_m)
    }

    /// The furthest point of the arc lies beyond the centre, or is an end of the arc.
    fn furthest_m(&self, from: DVec2) -> f64 {
        let away = self.centre - from;
        let direction = away.normalize_or(self.begin);
        let passes = (0..2).any(|round| {
            let angle = f64::atan2(self.begin.perp_dot(direction), self.begin.dot(direction));
            let turned = self.turn.sign() * angle + f64::from(round) * TAU;
            (0.0..=self.angle).contains(&turned)
        });
        if passes {
            away.length() + self.radius_m
        } else {
            let kernel = self.kernel(0.0, 0.0);
            kernel.at(0.0).position.distance(from).max(kernel.at(self.length_m()).position.distance(from))
        }
    }
}

impl Crosses for CircularArc {
    fn right_angle(&self) -> f64 {
        FRAC_PI_2 * self.radius_m
    }

    fn closed_form(&self) -> Option<ClosedForm<'_>> {
        Some(ClosedForm::Circle(self))
    }

    /// Arcs of the same circle never cross.
    fn never_crosses(&self, other: &Segment) -> bool {
        let (Segment::Arc(other), tolerance_m) = (other, 0.1 * TOUCH_ANGLE * self.radius_m) else { return false };
        self.centre.distance(other.centre) <= tolerance_m && (self.radius_m - other.radius_m).abs() <= tolerance_m
    }
}

/// Unit vector from the centre to the point of an arc that has this tangent.
fn outward(tangent: DVec2, turn: Turn) -> DVec2 {
    match turn {
        Turn::Clockwise => tangent.perp(),
        Turn::CounterClockwise => -tangent.perp(),
    }
}
