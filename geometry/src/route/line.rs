//! A straight line.

use glam::DVec2;

use super::kernel::LineKernel;
use super::{Kernel, Placement};

/// A straight line, with or without a beginning. Its parameter is in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Point at parameter 0.
    origin: DVec2,
    /// Unit vector.
    direction: DVec2,
    begin: f64,
    end: f64,
}

impl Line {
    /// The line of a given length, above 0, that begins at a point. `direction` is a unit vector.
    pub fn from_begin(position: DVec2, direction: DVec2, length_m: f64) -> Self {
        Self { origin: position, direction, begin: 0.0, end: length_m }
    }

    /// The line that ends at a point and has no beginning.
    pub fn up_to(position: DVec2, direction: DVec2) -> Self {
        Self { origin: position, direction, begin: f64::NEG_INFINITY, end: 0.0 }
    }

    pub(super) fn placed(self, placement: &Placement) -> Self {
        Self { origin: placement.place(self.origin), direction: placement.turn(self.direction), ..self }
    }

    /// Point at parameter 0.
    pub(super) fn origin(&self) -> DVec2 {
        self.origin
    }

    /// Unit vector in walking direction.
    pub(super) fn direction(&self) -> DVec2 {
        self.direction
    }

    pub(super) fn span(&self) -> (f64, f64) {
        (self.begin, self.end)
    }

    pub(super) fn kernel(&self, begin: f64, offset: f64) -> Kernel {
        Kernel::Line(LineKernel { begin, origin: self.origin + offset * self.direction, direction: self.direction })
    }
}
