//! A straight line.

use glam::DVec2;

use super::capability::{ArcLength, Bounds, Crosses, PlaneCurve};
use super::crossing::ClosedForm;
use super::kernel::{Formula, LineFormula};
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

    /// Point at parameter 0.
    pub(super) fn origin(&self) -> DVec2 {
        self.origin
    }

    /// Unit vector in walking direction.
    pub(super) fn direction(&self) -> DVec2 {
        self.direction
    }
}

impl PlaneCurve for Line {
    #[inline]
    fn span(&self) -> (f64, f64) {
        (self.begin, self.end)
    }

    fn place(&mut self, placement: &Placement) {
        (self.origin, self.direction) = (placement.place(self.origin), placement.turn(self.direction));
    }

    fn kernel(&self, begin: f64, offset: f64) -> Kernel {
        let origin = self.origin + offset * self.direction;
        Kernel { begin, formula: Formula::Line(LineFormula { origin, direction: self.direction }) }
    }

    fn reference(&self) -> DVec2 {
        self.origin
    }
}

impl ArcLength for Line {
    #[inline]
    fn chord_back(&self, _at: f64, chord_m: f64) -> Option<f64> {
        Some(chord_m)
    }
}

impl Bounds for Line {
    #[inline]
    fn curvature(&self, _at: f64) -> f64 {
        0.0
    }

    fn constant_curvature(&self) -> Option<f64> {
        Some(0.0)
    }

    fn furthest_m(&self, from: DVec2) -> f64 {
        let ends = [self.begin, self.end].map(|at| (self.origin + at * self.direction).distance(from));
        ends.into_iter().fold(0.0, f64::max)
    }
}

impl Crosses for Line {
    fn closed_form(&self) -> Option<ClosedForm<'_>> {
        Some(ClosedForm::Line(self))
    }
}
