//! How a route changes with its pitch.
//!
//! Of all that a choreographer can vary, the pitch alone changes the curve. A point is followed at a fixed travel. Where
//! the formulas give it at a fixed place of its piece of the curve instead, which has the travel s there, it is taken
//! back by ∂s/∂p along the tangent, and turns by the curvature times as much.

use glam::DVec2;

use super::{Route, RoutePoint};

/// The route about one travel, to first order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RouteVariation {
    /// Signed curvature in 1/m, above 0 where the route turns left; at a joint that of either side.
    pub curvature: f64,
    /// Metres by which the point at this travel moves, per metre of pitch.
    pub position: DVec2,
    /// Radians by which the tangent at this travel turns counter-clockwise, per metre of pitch.
    pub turn: f64,
}

/// A route that is one of a family over the pitch, its other measures being held.
pub trait PitchFamily: Route {
    /// The route about the travel of a place.
    fn variation(&self, place: f64) -> RouteVariation;

    /// Metres by which the travel of each joint grows, per metre of pitch, in the order of the joints.
    fn joint_variations(&self) -> Vec<f64> {
        Vec::new()
    }
}

/// The route about one place of one of its pieces, per metre of pitch.
#[derive(Clone, Copy, Debug)]
pub(super) struct PieceVariation {
    pub(super) position: DVec2,
    pub(super) turn: f64,
    /// Of the travel to the place.
    pub(super) travel: f64,
}

impl PieceVariation {
    /// The same at a fixed travel.
    pub(super) fn at_travel(self, point: &RoutePoint, curvature: f64) -> RouteVariation {
        RouteVariation {
            curvature,
            position: self.position - self.travel * point.tangent,
            turn: self.turn - self.travel * curvature,
        }
    }
}
