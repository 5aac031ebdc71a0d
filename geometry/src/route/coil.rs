//! The part of a route that is wound up as a spiral. More can be said of it than of any curve.

use glam::DVec2;

use super::Segment;
use super::segment::PlacedSegment;

/// The rear part of a route, up to `end`, where it is a spiral r = b·θ about some centre, walked inward.
///
/// Parameters grow by one per radian walked inward, and the route is wound outward without end. So the angle of a parameter is
/// `end_angle + end − parameter`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coil {
    /// Its centre.
    pub centre: DVec2,
    /// The last parameter of the coil.
    pub end: f64,
    /// θ there, 0 or more.
    pub end_angle: f64,
    /// b in metres: the pitch over 2π.
    pub radius_per_radian_m: f64,
    /// Where the route leaves on the same spiral, if it does.
    pub way_out: Option<WayOut>,
}

/// The last part of a route: its coil, turned by half a turn about the same centre and walked outward from the same angle on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WayOut {
    /// Where it begins. Parameters grow by one per radian here too.
    pub begin: f64,
    /// Distance from the centre that no point of the route between coil and way out exceeds: that of their ends at least.
    pub turn_radius_m: f64,
}

impl Coil {
    /// The coil of a route, if its first segment is one.
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
        let furthest_m = between.iter().map(|between| between.segment.furthest_m(self.centre));
        let turn_radius_m = furthest_m.fold(self.radius_per_radian_m * self.end_angle, f64::max);
        turn_radius_m.is_finite().then_some(WayOut { begin: last.begin, turn_radius_m })
    }

    /// θ at a parameter, or none if the coil ends before it.
    pub fn angle(&self, parameter: f64) -> Option<f64> {
        (parameter <= self.end).then_some(self.end_angle + (self.end - parameter))
    }

    /// θ at a parameter on the way out, or none before it.
    pub fn angle_out(&self, parameter: f64) -> Option<f64> {
        let way_out = self.way_out.filter(|way_out| parameter >= way_out.begin);
        way_out.map(|way_out| self.end_angle + (parameter - way_out.begin))
    }

    /// The parameter with this θ, which must be at least `end_angle`.
    pub fn parameter(&self, angle: f64) -> f64 {
        self.end - (angle - self.end_angle)
    }
}
