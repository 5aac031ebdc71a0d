//! A circular arc, walked either way round.

use glam::DVec2;

use super::{PolarStretch, RoutePoint};

/// Which way an arc turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Turn {
    Clockwise,
    CounterClockwise,
}

/// A circular arc of a route.
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
    /// The arc that turns by `angle` radians and has a given point and tangent at its beginning.
    pub(super) fn from_begin(position: DVec2, tangent: DVec2, radius_m: f64, angle: f64, turn: Turn) -> Self {
        let begin = outward(tangent, turn);
        Self { centre: position - radius_m * begin, radius_m, turn, begin, angle }
    }

    /// The arc that turns by `angle` radians and has a given point and tangent at its end.
    pub(super) fn to_end(position: DVec2, tangent: DVec2, radius_m: f64, angle: f64, turn: Turn) -> Self {
        let end = outward(tangent, turn);
        let begin = DVec2::from_angle(-signed(angle, turn)).rotate(end);
        Self { centre: position - radius_m * end, radius_m, turn, begin, angle }
    }

    /// The middle of its circle.
    pub fn centre(&self) -> DVec2 {
        self.centre
    }

    /// Metres.
    pub fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// By how much it turns, in radians.
    pub fn angle(&self) -> f64 {
        self.angle
    }

    /// Metres.
    pub fn length_m(&self) -> f64 {
        self.radius_m * self.angle
    }

    /// The arc after `turned` radians.
    pub(super) fn point(&self, turned: f64) -> RoutePoint {
        let spoke = DVec2::from_angle(signed(turned, self.turn)).rotate(self.begin);
        let tangent = match self.turn {
            Turn::Clockwise => -spoke.perp(),
            Turn::CounterClockwise => spoke.perp(),
        };
        RoutePoint { position: self.centre + self.radius_m * spoke, tangent, pace_m: self.radius_m }
    }

    /// The arc as a stretch of a route that comes to it at the place `begin` and walks it by its angle.
    pub(super) fn stretch(&self, begin: f64) -> PolarStretch {
        let turn = signed(1.0, self.turn);
        PolarStretch {
            begin,
            centre: self.centre,
            angle: self.begin.to_angle() - turn * begin,
            turn,
            radius_m: self.radius_m,
            radius_per_radian_m: 0.0,
        }
    }
}

/// The direction from the centre to a point of an arc with this tangent.
fn outward(tangent: DVec2, turn: Turn) -> DVec2 {
    match turn {
        Turn::Clockwise => tangent.perp(),
        Turn::CounterClockwise => -tangent.perp(),
    }
}

fn signed(angle: f64, turn: Turn) -> f64 {
    match turn {
        Turn::Clockwise => -angle,
        Turn::CounterClockwise => angle,
    }
}
