//! A circular arc, walked clockwise or counter-clockwise.

use glam::DVec2;

use super::{Kernel, Placement, PolarKernel};

/// Direction in which an arc turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// To the right.
    Clockwise,
    /// To the left.
    CounterClockwise,
}

impl Turn {
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

    pub(super) fn placed(self, placement: &Placement) -> Self {
        Self { centre: placement.place(self.centre), begin: placement.turn(self.begin), ..self }
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

    /// Distance from a point to the furthest point of the arc, in metres. That point lies beyond the centre, or is an end of
    /// the arc.
    pub(super) fn furthest_m(&self, from: DVec2) -> f64 {
        let away = self.centre - from;
        let direction = away.normalize_or(self.begin);
        let passes = (0..2).any(|round| {
            let angle = f64::atan2(self.begin.perp_dot(direction), self.begin.dot(direction));
            let turned = self.turn.sign() * angle + f64::from(round) * std::f64::consts::TAU;
            (0.0..=self.angle).contains(&turned)
        });
        if passes {
            away.length() + self.radius_m
        } else {
            let kernel = self.kernel(0.0, 0.0);
            kernel.at(0.0).position.distance(from).max(kernel.at(self.length_m()).position.distance(from))
        }
    }

    /// Signed curvature in 1/m, above 0 for a left turn.
    #[inline]
    pub(super) fn curvature(&self) -> f64 {
        self.turn.sign() / self.radius_m
    }

    pub(super) fn kernel(&self, begin: f64, offset: f64) -> Kernel {
        let turn = self.curvature();
        Kernel::Polar(PolarKernel {
            begin,
            centre: self.centre,
            angle: self.begin.to_angle() + turn * offset,
            turn,
            radius_m: self.radius_m,
            radius_per_radian_m: 0.0,
            axis: 0.0,
        })
    }
}

/// Unit vector from the centre to the point of an arc that has this tangent.
fn outward(tangent: DVec2, turn: Turn) -> DVec2 {
    match turn {
        Turn::Clockwise => tangent.perp(),
        Turn::CounterClockwise => -tangent.perp(),
    }
}
