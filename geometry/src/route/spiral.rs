//! A part of an Archimedean spiral r = b·θ, anywhere in the plane.

use std::f64::consts::{FRAC_PI_4, PI, TAU};

use glam::DVec2;

use super::capability::{ArcLength, Bounds, CHORD_TURN, Crosses, PlaneCurve};
use super::crossing::MEETING_M;
use super::kernel::{Formula, PolarFormula};
use super::spiral_chord::chord_angle;
use super::{Kernel, Placement, Segment, Turn};

/// Largest deviation from half a turn that counts as rounding, in radians.
const HALF_TURN_TOLERANCE: f64 = 1e-12;

/// A part of a spiral: r = b·θ for θ >= 0 about a centre. θ = 0 lies in the direction of the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spiral {
    centre: DVec2,
    /// Direction of θ = 0 from the centre, in radians.
    axis: f64,
    /// Direction in which the spiral turns as θ grows.
    winding: Turn,
    /// 1 if walked outward, −1 if walked inward: θ = sense·parameter.
    sense: f64,
    pitch_m: f64,
    /// b in metres: the pitch divided by 2π.
    radius_per_radian_m: f64,
    /// The spiral's own parameters at its beginning and end.
    begin: f64,
    end: f64,
}

impl Spiral {
    /// The spiral of this pitch (2π·b, in metres) about the origin, counter-clockwise from +x as θ grows. It is walked from
    /// `from_angle` to `to_angle`, inward if θ falls. Both angles are 0 or more. A spiral that begins at infinity has no
    /// beginning.
    ///
    /// # Panics
    /// Panics if an angle is below 0, or if both are equal.
    pub fn new(pitch_m: f64, from_angle: f64, to_angle: f64) -> Self {
        assert!(from_angle.min(to_angle) >= 0.0 && from_angle != to_angle, "a spiral from {from_angle} to {to_angle}");
        let sense = if from_angle < to_angle { 1.0 } else { -1.0 };
        Self {
            centre: DVec2::ZERO,
            axis: 0.0,
            winding: Turn::CounterClockwise,
            sense,
            pitch_m,
            radius_per_radian_m: pitch_m / TAU,
            begin: sense * from_angle,
            end: sense * to_angle,
        }
    }

    /// The same spiral, moved and turned so that it begins at a given point with a given tangent. `winding` is its direction as
    /// θ grows.
    ///
    /// # Panics
    /// Panics for a spiral without a beginning.
    #[must_use]
    pub fn from_begin(self, position: DVec2, tangent: DVec2, winding: Turn) -> Self {
        assert!(self.begin.is_finite(), "a spiral without a beginning has no point at its beginning");
        let about_origin = self.about(DVec2::ZERO, 0.0, winding);
        let unturned = Segment::Spiral(about_origin).point(self.begin).tangent;
        let axis = f64::atan2(unturned.perp_dot(tangent), unturned.dot(tangent));
        let turned = self.about(DVec2::ZERO, axis, winding);
        self.about(position - Segment::Spiral(turned).point(self.begin).position, axis, winding)
    }

    /// The same spiral about another centre. θ = 0 lies in the direction `axis`; `winding` is the direction as θ grows.
    #[must_use]
    pub fn about(self, centre: DVec2, axis: f64, winding: Turn) -> Self {
        Self { centre, axis, winding, ..self }
    }

    /// Centre of the spiral.
    pub fn centre(&self) -> DVec2 {
        self.centre
    }

    /// Distance between neighbouring turns, in metres.
    pub fn pitch_m(&self) -> f64 {
        self.pitch_m
    }

    /// b in metres.
    pub fn radius_per_radian_m(&self) -> f64 {
        self.radius_per_radian_m
    }

    /// Whether the head walks towards the centre.
    #[inline]
    pub fn is_inward(&self) -> bool {
        self.sense < 0.0
    }

    /// θ at a parameter.
    #[inline]
    pub fn angle(&self, at: f64) -> f64 {
        self.sense * at
    }

    /// Whether this spiral is the other one, turned by half a turn.
    pub(super) fn is_half_turned(&self, other: &Self) -> bool {
        let (centre, pitch) = (self.centre == other.centre, self.radius_per_radian_m == other.radius_per_radian_m);
        centre && pitch && self.winding == other.winding && (self.axis - other.axis - PI).abs() <= HALF_TURN_TOLERANCE
    }

    /// Metres of arc per radian.
    #[inline]
    pub(super) fn speed_m_per_unit(&self, at: f64) -> f64 {
        self.radius_per_radian_m * unit_speed(self.angle(at))
    }
}

/// A spiral under a part of a route, by the route's parameter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SpiralPart {
    /// b in metres.
    pub(crate) radius_per_radian_m: f64,
    /// Whether it is walked towards the centre.
    pub(crate) is_inward: bool,
    /// θ at the route's parameter 0, on the spiral continued to there.
    pub(super) angle_at_0: f64,
}

impl SpiralPart {
    /// θ at a parameter of the route.
    pub(crate) fn angle(&self, parameter: f64) -> f64 {
        self.angle_at_0 + if self.is_inward { -parameter } else { parameter }
    }
}

impl PlaneCurve for Spiral {
    #[inline]
    fn span(&self) -> (f64, f64) {
        (self.begin, self.end)
    }

    fn place(&mut self, placement: &Placement) {
        *self = self.about(placement.place(self.centre), self.axis + placement.heading, self.winding);
    }

    fn kernel(&self, begin: f64, offset: f64) -> Kernel {
        let (turn, slope_m) = (self.winding.sign() * self.sense, self.winding.sign() * self.radius_per_radian_m);
        let formula = PolarFormula {
            centre: self.centre,
            angle: self.axis + turn * offset,
            turn,
            radius_m: -slope_m * self.axis,
            radius_per_radian_m: slope_m,
            axis: self.axis,
        };
        Kernel { begin, formula: Formula::Polar(formula) }
    }

    fn reference(&self) -> DVec2 {
        self.centre
    }
}

impl ArcLength for Spiral {
    /// Arc length from the centre, negative for an inward spiral.
    #[inline]
    fn arc_m(&self, at: f64) -> f64 {
        self.sense * (self.radius_per_radian_m * unit_length(self.angle(at)))
    }

    #[inline]
    fn at_arc(&self, arc_m: f64) -> f64 {
        let sign = self.sense;
        sign * unit_angle((sign * arc_m / self.radius_per_radian_m).max(0.0))
    }

    #[inline]
    fn at_arc_near(&self, arc_m: f64, guess: f64) -> f64 {
        let sign = self.sense;
        sign * unit_angle_near((sign * arc_m / self.radius_per_radian_m).max(0.0), sign * guess)
    }

    /// A step back in radians that covers at most `arc_m` of arc, and at least 1/√8 of it. An outward spiral may have less arc
    /// behind a parameter than that.
    ///
    /// 1. Behind a parameter of an inward spiral, the speed grows by at most b per radian. So a step of δ covers at most
    ///    δ·(speed + b·δ) of arc; the result is the δ for which that bound equals `arc_m`. The speed after x radians is at
    ///    least (speed + b·x)/√2, so the step covers at least 1/√8 of the bound.
    /// 2. Behind a parameter of an outward spiral, the speed falls. Its mean over any step that ends at the parameter is at
    ///    least half of the speed at the parameter.
    #[inline]
    fn step_back(&self, at: f64, arc_m: f64) -> f64 {
        if !self.is_inward() {
            return arc_m / self.speed_m_per_unit(at);
        }
        let (unit_arc, angle) = (arc_m / self.radius_per_radian_m, self.angle(at));
        let unit_speed2 = 1.0 + angle * angle;
        2.0 * unit_arc / (unit_speed2.sqrt() + (unit_speed2 + 4.0 * unit_arc).sqrt())
    }

    /// From the axis, the tangent's direction is θ + atan θ. So it turns by at most the step times 1 + 1/(1 + θ²), with the least θ.
    #[inline]
    fn chord_back(&self, at: f64, chord_m: f64) -> Option<f64> {
        let angle = self.angle(at);
        let step = chord_angle(angle, -self.sense, chord_m / self.radius_per_radian_m);
        let nearest = angle.min(angle - self.sense * step);
        let speed2 = 1.0 + nearest * nearest;
        (step > 0.0 && nearest >= 0.0 && step * (1.0 + speed2) <= CHORD_TURN * speed2).then_some(step)
    }
}

impl Bounds for Spiral {
    /// |κ| = (2 + θ²) / (b·(1 + θ²)^(3/2)) in 1/m.
    #[inline]
    fn curvature(&self, at: f64) -> f64 {
        let squared = self.angle(at) * self.angle(at);
        let size = (2.0 + squared) / (self.radius_per_radian_m * (1.0 + squared).sqrt() * (1.0 + squared));
        self.winding.sign() * self.sense * size
    }

    /// |Curvature| falls from the centre outward.
    #[inline]
    fn curvature_bound(&self, rear: f64, front: f64) -> f64 {
        self.curvature(if self.is_inward() { front } else { rear }).abs()
    }

    fn pitch_m(&self) -> Option<f64> {
        (self.end - self.begin > TAU).then_some(self.pitch_m)
    }
}

impl Crosses for Spiral {
    /// A spiral turns by at most twice its angle: the angle between spoke and tangent is atan θ.
    fn right_angle(&self) -> f64 {
        FRAC_PI_4
    }

    /// A spiral turned by any angle about its centre is equal, or has only the centre in common with it.
    fn never_crosses(&self, other: &Segment) -> bool {
        let Segment::Spiral(other) = other else { return false };
        let has_equal_pitch = (self.pitch_m - other.pitch_m).abs() <= f64::EPSILON.sqrt() * self.pitch_m;
        let distance_m = self.centre.distance(other.centre);
        has_equal_pitch
            && self.winding == other.winding
            && distance_m <= MEETING_M * (1.0 + self.centre.abs().max_element())
    }
}

/// Arc length per radian on r = θ.
fn unit_speed(angle: f64) -> f64 {
    (1.0 + angle * angle).sqrt()
}

/// Arc length of r = θ from the centre to `angle`: ½(θ·√(1 + θ²) + asinh θ). From θ = 1 on, the logarithm has no fewer exact digits
/// than the library's asinh, which takes longer.
fn unit_length(angle: f64) -> f64 {
    let speed = unit_speed(angle);
    let area = if angle >= 1.0 { (angle + speed).ln() } else { angle.asinh() };
    0.5 * (angle * speed + area)
}

/// The inverse of [`unit_length`] for `length >= 0`, exact to a few units of rounding.
///
/// The length is convex in the angle, and at least θ and at least ½θ². Each of the two gives an upper bound on the angle.
/// Newton's method starts at the smaller of them and falls monotonically onto the root. It starts within a factor of 1.31, and
/// each step at least squares the relative error, so six steps are enough. The loop ends when rounding stops the fall.
fn unit_angle(length: f64) -> f64 {
    let mut angle = length.min((2.0 * length).sqrt());
    for _ in 0..8 {
        let next = angle - (unit_length(angle) - length) / unit_speed(angle);
        if next >= angle {
            break;
        }
        angle = next;
    }
    angle
}

/// The same as [`unit_angle`], up to rounding.
///
/// A step of Newton's method leaves at most half of the square of the error. This follows because the speed grows by at most 1
/// per radian and is at least 1. So a step under 10⁻⁸ is the last. A guess that has not converged after two steps is discarded.
fn unit_angle_near(length: f64, guess: f64) -> f64 {
    let mut angle = guess;
    for _ in 0..2 {
        let step = (length - unit_length(angle)) / unit_speed(angle);
        angle += step;
        if step.abs() < 1e-8 {
            return angle.max(0.0);
        }
    }
    unit_angle(length)
}
