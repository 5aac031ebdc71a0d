//! A part of an Archimedean spiral r = b·θ, anywhere in the plane.

use std::f64::consts::{PI, TAU};

use glam::DVec2;

use super::{Kernel, PolarKernel, Segment, Turn};

/// What half a turn may be off by, in radians, but for rounding.
const HALF_TURN_TOLERANCE: f64 = 1e-12;

/// A part of a spiral: r = b·θ for θ >= 0 about a centre, where θ = 0 lies in the direction of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spiral {
    centre: DVec2,
    /// The direction from the centre in which θ is 0, in radians.
    axis: f64,
    /// Which way it turns as θ grows.
    winding: Turn,
    /// 1 where it is walked outward, −1 inward: θ is that times the parameter.
    sense: f64,
    pitch_m: f64,
    /// b, in metres: the pitch over 2π.
    radius_per_radian_m: f64,
    /// Its parameters at beginning and end.
    begin: f64,
    end: f64,
}

impl Spiral {
    /// The spiral of this pitch (2π·b, in metres) about the origin, counter-clockwise from +x as θ grows, walked from one θ to
    /// another: inward where it falls. Both are 0 or more; a spiral that begins at infinity has no beginning.
    ///
    /// # Panics
    /// Where one is below 0, or both are the same.
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

    /// The same spiral, placed so that it has a given point and tangent at its beginning, and wound this way as θ grows.
    ///
    /// # Panics
    /// Where it has no beginning.
    #[must_use]
    pub fn from_begin(self, position: DVec2, tangent: DVec2, winding: Turn) -> Self {
        assert!(self.begin.is_finite(), "a spiral without a beginning has no point there");
        let about_origin = self.about(DVec2::ZERO, 0.0, winding);
        let axis = Segment::Spiral(about_origin).point(self.begin).tangent.angle_to(tangent);
        let turned = self.about(DVec2::ZERO, axis, winding);
        self.about(position - Segment::Spiral(turned).point(self.begin).position, axis, winding)
    }

    /// The same spiral about another centre, turned about it so that θ = 0 lies in this direction, and wound this way as θ grows.
    #[must_use]
    pub fn about(self, centre: DVec2, axis: f64, winding: Turn) -> Self {
        Self { centre, axis, winding, ..self }
    }

    /// Its centre.
    pub fn centre(&self) -> DVec2 {
        self.centre
    }

    /// Distance between neighbouring turns, in metres.
    pub fn pitch_m(&self) -> f64 {
        self.pitch_m
    }

    /// b, in metres.
    pub fn radius_per_radian_m(&self) -> f64 {
        self.radius_per_radian_m
    }

    /// Whether it is walked towards its centre.
    #[inline]
    pub fn is_inward(&self) -> bool {
        self.sense < 0.0
    }

    /// θ at a parameter.
    #[inline]
    pub fn angle(&self, at: f64) -> f64 {
        self.sense * at
    }

    /// Whether this is the other spiral turned by half a turn.
    pub(super) fn is_half_turned(&self, other: &Self) -> bool {
        let (centre, pitch) = (self.centre == other.centre, self.radius_per_radian_m == other.radius_per_radian_m);
        centre && pitch && self.winding == other.winding && (self.axis - other.axis - PI).abs() <= HALF_TURN_TOLERANCE
    }

    /// Metres of arc per radian.
    #[inline]
    pub(super) fn speed_m_per_unit(&self, at: f64) -> f64 {
        self.radius_per_radian_m * unit_speed(self.angle(at))
    }

    pub(super) fn span(&self) -> (f64, f64) {
        (self.begin, self.end)
    }

    /// Arc length from the centre, below 0 on the way inward.
    #[inline]
    pub(super) fn arc_m(&self, at: f64) -> f64 {
        self.sense * (self.radius_per_radian_m * unit_length(self.angle(at)))
    }

    #[inline]
    pub(super) fn at_arc(&self, arc_m: f64) -> f64 {
        let sign = self.sense;
        sign * unit_angle((sign * arc_m / self.radius_per_radian_m).max(0.0))
    }

    #[inline]
    pub(super) fn at_arc_near(&self, arc_m: f64, guess: f64) -> f64 {
        let sign = self.sense;
        sign * unit_angle_near((sign * arc_m / self.radius_per_radian_m).max(0.0), sign * guess)
    }

    /// Radians that cover at most `arc_m` of arc behind, and at least 1/√8 of it, or all that there is behind a centre.
    ///
    /// 1. Outward the speed grows by at most b per radian, so a step of δ covers at most δ·(speed + b·δ) of arc; this is the δ
    ///    for which that bound equals `arc_m`. The speed also is at least (speed + b·x)/√2 after x radians, so the step covers
    ///    at least 1/√8 of the bound.
    /// 2. Inward the speed falls, and its mean over any stretch that ends here is at least half of what it is here.
    #[inline]
    pub(super) fn step_back(&self, at: f64, arc_m: f64) -> f64 {
        if !self.is_inward() {
            return arc_m / self.speed_m_per_unit(at);
        }
        let (unit_arc, angle) = (arc_m / self.radius_per_radian_m, self.angle(at));
        let unit_speed2 = 1.0 + angle * angle;
        2.0 * unit_arc / (unit_speed2.sqrt() + (unit_speed2 + 4.0 * unit_arc).sqrt())
    }

    /// The greatest |curvature| between two parameters: it falls all the way out.
    #[inline]
    pub(super) fn curvature_bound(&self, rear: f64, front: f64) -> f64 {
        self.curvature(if self.is_inward() { front } else { rear }).abs()
    }

    /// Signed curvature: |κ| = (2 + θ²) / (b·(1 + θ²)^(3/2)) in 1/m.
    #[inline]
    pub(super) fn curvature(&self, at: f64) -> f64 {
        let squared = self.angle(at) * self.angle(at);
        let size = (2.0 + squared) / (self.radius_per_radian_m * (1.0 + squared).sqrt() * (1.0 + squared));
        self.winding.sign() * self.sense * size
    }

    pub(super) fn kernel(&self, begin: f64, offset: f64) -> Kernel {
        let (turn, slope_m) = (self.winding.sign() * self.sense, self.winding.sign() * self.radius_per_radian_m);
        Kernel::Polar(PolarKernel {
            begin,
            centre: self.centre,
            angle: self.axis + turn * offset,
            turn,
            radius_m: -slope_m * self.axis,
            radius_per_radian_m: slope_m,
            axis: self.axis,
        })
    }
}

/// Arc per radian on r = θ.
fn unit_speed(angle: f64) -> f64 {
    (1.0 + angle * angle).sqrt()
}

/// Arc length of r = θ from the centre to `angle`: ½(θ·√(1 + θ²) + asinh θ).
fn unit_length(angle: f64) -> f64 {
    0.5 * (angle * unit_speed(angle) + angle.asinh())
}

/// The inverse of [`unit_length`] for `length >= 0`, to the last few units of rounding.
///
/// The length is convex in the angle and at least both θ and ½θ², so Newton's method from the lesser of the two upper
/// bounds that these give falls monotonically onto the root. It starts within a factor 1.31 and each step at least
/// squares the relative error, so six are enough; the loop ends when rounding stops the fall.
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

/// The same as [`unit_angle`] but for rounding.
///
/// Newton's method squares the error of a guess: half of its square, as the speed grows by at most 1 per radian and is at
/// least 1. So a step under 10⁻⁸ is the last. A guess that is not there after two steps was no good.
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
