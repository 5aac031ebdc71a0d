//! The rear part of a route that is an inward spiral. Contacts on it have tighter bounds than on a general curve.

use glam::DVec2;

use super::Segment;
use super::capability::PlaneCurve;
use super::segment::PlacedSegment;

/// The rear part of a route, up to the parameter `end`: a spiral r = b·θ about a centre, walked inward.
///
/// Parameters grow by one per radian walked inward. Behind its end, the coil is unbounded. So a parameter has the angle
/// `end_angle + end − parameter`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coil {
    /// Centre of the spiral.
    pub centre: DVec2,
    /// The last parameter of the coil.
    pub end: f64,
    /// θ at the end of the coil, 0 or more.
    pub end_angle: f64,
    /// b in metres: the pitch divided by 2π.
    pub radius_per_radian_m: f64,
    /// The outward spiral at the end of the route, if it matches the coil.
    pub way_out: Option<WayOut>,
}

/// The last segment of a route that matches its coil: the same spiral, turned by half a turn about the same centre. The head
/// walks it outward, from the angle at which the coil ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WayOut {
    /// Parameter at which the way out begins. Parameters grow by one per radian here too.
    pub begin: f64,
    /// Bound on the distance from the centre to the route between coil and way out. It is at least the radius at their ends.
    pub turn_radius_m: f64,
}

impl Coil {
    /// Returns the coil of a route whose first segment is an inward spiral.
    pub(super) fn of(placed: &[PlacedSegment]) -> Option<Self> {
        let [first, others @ ..] = placed else { return None };
        let Segment::Spiral(spiral) = first.segment else { return None };
        if !spiral.is_inward() {
            return None;
        }
        let coil = Self {
            centre: spiral.centre(),
            end: first.end(),
            end_angle: spiral.angle(spiral.span().1),
            radius_per_radian_m: spiral.radius_per_radian_m(),
            way_out: None,
        };
        Some(Self { way_out: coil.way_out_of(&spiral, others), ..coil })
    }

    fn way_out_of(&self, spiral: &super::Spiral, others: &[PlacedSegment]) -> Option<WayOut> {
        let [between @ .., last] = others else { return None };
        let Segment::Spiral(out) = last.segment else { return None };
        let is_way_out = !out.is_inward() && out.is_half_turned(spiral) && out.angle(out.span().0) == self.end_angle;
        if !is_way_out {
            return None;
        }
        let furthest_m = between.iter().map(|between| between.segment.curve().furthest_m(self.centre));
        let turn_radius_m = furthest_m.fold(self.radius_per_radian_m * self.end_angle, f64::max);
        turn_radius_m.is_finite().then_some(WayOut { begin: last.begin, turn_radius_m })
    }

    /// θ at a parameter of the coil; `None` beyond the end of the coil.
    pub fn angle(&self, parameter: f64) -> Option<f64> {
        (parameter <= self.end).then_some(self.end_angle + (self.end - parameter))
    }

    /// θ at a parameter of the way out; `None` before the way out.
    pub fn angle_out(&self, parameter: f64) -> Option<f64> {
        let way_out = self.way_out.filter(|way_out| parameter >= way_out.begin);
        way_out.map(|way_out| self.end_angle + (parameter - way_out.begin))
    }

    /// The parameter of an angle θ, which must be at least `end_angle`.
    pub fn parameter(&self, angle: f64) -> f64 {
        self.end - (angle - self.end_angle)
    }
}
