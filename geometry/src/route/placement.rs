//! Where a route lies in the plane.

use glam::DVec2;

/// A turn about the origin, and a move after it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Placement {
    /// Where the origin goes, in metres.
    pub position: DVec2,
    /// Angle by which directions turn, counter-clockwise, in radians.
    pub heading: f64,
}

impl Placement {
    /// Whether nothing moves.
    pub fn is_identity(&self) -> bool {
        *self == Self::default()
    }

    /// A direction, turned.
    pub fn turn(&self, direction: DVec2) -> DVec2 {
        if self.heading == 0.0 { direction } else { DVec2::from_angle(self.heading).rotate(direction) }
    }

    /// A point, turned and moved.
    pub fn place(&self, point: DVec2) -> DVec2 {
        self.position + self.turn(point)
    }

    /// The inverse of [`place`](Self::place).
    pub fn unplace(&self, point: DVec2) -> DVec2 {
        DVec2::from_angle(-self.heading).rotate(point - self.position)
    }

    /// This placement after another one.
    #[must_use]
    pub fn after(&self, first: &Self) -> Self {
        Self { position: self.place(first.position), heading: self.heading + first.heading }
    }

    /// The placement that takes this one back.
    #[must_use]
    pub fn inverse(&self) -> Self {
        Self { position: self.unplace(DVec2::ZERO), heading: -self.heading }
    }
}
