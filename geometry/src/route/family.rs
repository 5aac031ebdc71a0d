//! How a route changes with its pitch.
//!
//! Of all that a choreographer can vary, the pitch alone changes the curve. A point is followed at a fixed travel. Where
//! the formulas give it at a fixed parameter of its segment instead, which has the travel s there, it is taken back by ∂s/∂p
//! along the tangent, and turns by the curvature times as much.

use std::sync::Arc;

use glam::DVec2;

use super::{Route, Turnaround};

/// The route about one travel, to first order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RouteVariation {
    /// Signed curvature in 1/m, above 0 where the route turns left; at a seam that of either side.
    pub curvature: f64,
    /// Metres by which the point at this travel moves, per metre of pitch.
    pub position: DVec2,
    /// Radians by which the tangent at this travel turns counter-clockwise, per metre of pitch.
    pub turn: f64,
}

/// A route as one of a family over the pitch, its other measures being held.
#[derive(Clone, Debug)]
pub struct PitchFamily {
    route: Arc<Route>,
    shape: Shape,
}

/// What the route is one of.
#[derive(Clone, Debug)]
enum Shape {
    /// Spirals about the origin; held is the number of turns at the start.
    Spiral,
    /// Held are the turning circle, the ratio of the radii, and t = 0 at the entry into the circle.
    Turnaround(Box<Turnaround>),
}

impl PitchFamily {
    /// A spiral of any span, whose number of turns at the start is held.
    pub(crate) fn of_spiral(route: Route) -> Self {
        Self { route: Arc::new(route), shape: Shape::Spiral }
    }

    pub(crate) fn of_turnaround(turnaround: Turnaround) -> Self {
        Self { route: Arc::new(turnaround.route()), shape: Shape::Turnaround(Box::new(turnaround)) }
    }

    /// The route.
    pub fn route(&self) -> &Arc<Route> {
        &self.route
    }

    /// Whether the route ends at a given distance from its centre: then it ends there at any pitch.
    pub(crate) fn ends_on_circle(&self) -> bool {
        matches!(self.shape, Shape::Spiral)
    }

    /// The route about the travel of a parameter.
    pub fn variation(&self, parameter: f64) -> RouteVariation {
        let (point, travel_m) = (self.route.point(parameter), self.route.travel(parameter));
        let curvature = self.route.curvature(parameter);
        let SegmentVariation { position, turn, travel } = match &self.shape {
            // At a fixed angle everything grows as the pitch does.
            Shape::Spiral => {
                let pitch_m = self.route.pitch_m();
                SegmentVariation { position: point.position / pitch_m, turn: 0.0, travel: travel_m / pitch_m }
            }
            Shape::Turnaround(turnaround) => turnaround.variation(point.position, travel_m),
        };
        RouteVariation { curvature, position: position - travel * point.tangent, turn: turn - travel * curvature }
    }

    /// Metres by which the travel of each seam grows, per metre of pitch, in the order of the seams.
    pub fn seam_variations(&self) -> Vec<f64> {
        match &self.shape {
            Shape::Spiral => Vec::new(),
            Shape::Turnaround(turnaround) => turnaround.seam_variations(),
        }
    }
}

/// The route about one parameter of one of its segments, per metre of pitch.
#[derive(Clone, Copy, Debug)]
pub(super) struct SegmentVariation {
    pub(super) position: DVec2,
    pub(super) turn: f64,
    /// Of the travel to the parameter.
    pub(super) travel: f64,
}
