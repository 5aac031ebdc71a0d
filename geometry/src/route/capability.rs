//! The capabilities of every kind of segment. Each kind implements these traits in its own file.
//!
//! A segment's own parameter grows in walking direction. The defaults suit a curve whose parameter is arc length in metres.

use std::f64::consts::FRAC_PI_2;

use glam::DVec2;

use super::crossing::ClosedForm;
use super::{Kernel, Placement, Segment};

/// Largest angle by which the tangent turns over a step of [`ArcLength::chord_back`], in radians. Per metre walked back, the
/// distance to the front end grows by the cosine of the angle between the tangent there and the chord, whose direction is a mean
/// of the step's tangents. This angle is less than a right angle, so the distance grows all over the step.
pub(super) const CHORD_TURN: f64 = 1.5;

/// Bound on |curvature| over such a step, multiplied by the chord. The mean is at most [`CHORD_TURN`], since the arc is no shorter
/// than the chord. On an arc all are equal; on a spiral that turns by at most this angle, the least is over half of the largest.
pub(crate) const CHORD_BEND: f64 = 2.0 * CHORD_TURN;

/// Both bounds hold also for this share of the step behind its end.
pub(crate) const CHORD_MARGIN: f64 = 1e-6;

/// A curve in the plane: its ends, its points and their tangents.
pub(super) trait PlaneCurve {
    /// The own parameters at the beginning and at the end. The beginning is −∞ for a curve without one.
    fn span(&self) -> (f64, f64);

    /// Moves the curve somewhere else.
    fn place(&mut self, placement: &Placement);

    /// The curve as a function of the route's parameter. The segment begins at the route's parameter `begin`; its own
    /// parameter is greater by `offset`.
    fn kernel(&self, begin: f64, offset: f64) -> Kernel;

    /// The point from which positions are computed. Its distance from the origin adds to their rounding.
    fn reference(&self) -> DVec2;
}

/// Arc length along a curve, and its inverse.
pub(super) trait ArcLength {
    /// Arc length in metres, from an origin that depends on the kind of curve.
    #[inline]
    fn arc_m(&self, at: f64) -> f64 {
        at
    }

    /// The inverse of [`arc_m`](Self::arc_m).
    #[inline]
    fn at_arc(&self, arc_m: f64) -> f64 {
        arc_m
    }

    /// The same, faster if `guess` is near the result.
    #[inline]
    fn at_arc_near(&self, arc_m: f64, _guess: f64) -> f64 {
        self.at_arc(arc_m)
    }

    /// Step back, in units of the parameter, that covers at most `arc_m` of arc and at least a third of it.
    #[inline]
    fn step_back(&self, _at: f64, arc_m: f64) -> f64 {
        arc_m
    }

    /// Step back, in units of the parameter, to a point at a distance of about `chord_m`. Over the step, the tangent turns by
    /// at most [`CHORD_TURN`], and |curvature| is at most [`CHORD_BEND`] divided by `chord_m`; `None` where no such step is known.
    fn chord_back(&self, at: f64, chord_m: f64) -> Option<f64>;
}

/// Bounds on the bend and the extent of a curve. |Curvature| between two parameters is greatest at one of them.
pub(super) trait Bounds {
    /// Signed curvature in 1/m, above 0 where the curve turns left.
    fn curvature(&self, at: f64) -> f64;

    /// The greatest |curvature| in 1/m between two of the own parameters.
    #[inline]
    fn curvature_bound(&self, rear: f64, front: f64) -> f64 {
        self.curvature(rear).abs().max(self.curvature(front).abs())
    }

    /// The signed curvature of a line or an arc, which is the same everywhere; `None` for other curves.
    fn constant_curvature(&self) -> Option<f64> {
        None
    }

    /// A bound on the distance from a point to any point of the curve; infinite where none is known.
    fn furthest_m(&self, _from: DVec2) -> f64 {
        f64::INFINITY
    }

    /// Distance between neighbouring turns; `None` for a curve without a whole turn of a spiral.
    fn pitch_m(&self) -> Option<f64> {
        None
    }
}

/// Crossings of a curve with others. Without the knowledge of a closed form, curves are bisected.
pub(super) trait Crosses: Bounds + PlaneCurve {
    /// Length of parameter in which the curve turns by at most a right angle, anywhere on it.
    fn right_angle(&self) -> f64 {
        let (begin, end) = self.span();
        FRAC_PI_2 / self.curvature_bound(begin, end)
    }

    /// The straight line or the circle that contains the curve, if there is one.
    fn closed_form(&self) -> Option<ClosedForm<'_>> {
        None
    }

    /// Whether the curve never crosses another one, wherever the two begin and end.
    fn never_crosses(&self, _other: &Segment) -> bool {
        false
    }
}
