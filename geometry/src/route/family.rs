//! Changes of a route with its pitch.
//!
//! Of the parameters that the planner varies, only the pitch changes the curve. The derivatives here follow a point at fixed
//! travel. The formulas of a segment follow a point at a fixed parameter of the segment, whose travel s depends on the pitch p.
//! The conversion moves that point back by ∂s/∂p along the tangent, and turns the tangent back by the curvature times ∂s/∂p.

use std::sync::Arc;

use glam::DVec2;

use super::{Route, Turnaround};

/// Change of the route near one travel, to first order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RouteVariation {
    /// Signed curvature in 1/m, above 0 where the route turns left. At a seam: the curvature on either side.
    pub curvature: f64,
    /// Metres by which the point at this travel moves, per metre of pitch.
    pub position: DVec2,
    /// Radians by which the tangent at this travel turns counter-clockwise, per metre of pitch.
    pub turn: f64,
}

/// A route and its change with the pitch. All other measures of the route stay fixed.
#[derive(Clone, Debug)]
pub struct PitchFamily {
    route: Arc<Route>,
    shape: Shape,
}

/// Family of routes over the pitch.
#[derive(Clone, Debug)]
enum Shape {
    /// Spirals about a centre with a fixed number of turns at the start.
    Spiral {
        /// The centre, in metres.
        centre: DVec2,
    },
    /// Turnarounds with a fixed turning circle, a fixed ratio of the radii, and t = 0 at the entry into the circle.
    Turnaround(Box<Turnaround>),
    /// A path, which has no pitch and does not change.
    Path,
}

impl PitchFamily {
    /// The family of a spiral about a centre, walked between any travels. Its number of turns at the start stays fixed.
    pub(crate) fn of_spiral(route: Route, centre: DVec2) -> Self {
        Self { route: Arc::new(route), shape: Shape::Spiral { centre } }
    }

    pub(crate) fn of_path(route: Route) -> Self {
        Self { route: Arc::new(route), shape: Shape::Path }
    }

    pub(crate) fn of_turnaround(turnaround: Turnaround) -> Self {
        Self { route: Arc::new(turnaround.route()), shape: Shape::Turnaround(Box::new(turnaround)) }
    }

    /// The route.
    pub fn route(&self) -> &Arc<Route> {
        &self.route
    }

    /// Whether the route ends at a fixed distance from its centre at every pitch.
    pub(crate) fn ends_on_circle(&self) -> bool {
        matches!(self.shape, Shape::Spiral { .. })
    }

    /// Whether the route and its end are the same at every pitch.
    pub(crate) fn is_fixed(&self) -> bool {
        matches!(self.shape, Shape::Path)
    }

    /// Change of the route near a parameter, at fixed travel.
    pub fn variation(&self, parameter: f64) -> RouteVariation {
        let (point, travel_m) = (self.route.point(parameter), self.route.travel(parameter));
        let curvature = self.route.curvature(parameter);
        let SegmentVariation { position, turn, travel } = match &self.shape {
            // At a fixed angle, all lengths are proportional to the pitch.
            Shape::Spiral { centre } => {
                let (pitch_m, spoke) = (self.route.pitch_m(), point.position - centre);
                SegmentVariation { position: spoke / pitch_m, turn: 0.0, travel: travel_m / pitch_m }
            }
            Shape::Path => SegmentVariation { position: DVec2::ZERO, turn: 0.0, travel: 0.0 },
            Shape::Turnaround(turnaround) => turnaround.variation(point.position, travel_m),
        };
        RouteVariation { curvature, position: position - travel * point.tangent, turn: turn - travel * curvature }
    }

    /// Change of the travel of each seam, in metres per metre of pitch, in the order of the seams.
    pub fn seam_variations(&self) -> Vec<f64> {
        match &self.shape {
            Shape::Spiral { .. } => Vec::new(),
            Shape::Path => vec![0.0; self.route.seams().len()],
            Shape::Turnaround(turnaround) => turnaround.seam_variations(),
        }
    }
}

/// Change of the route at a fixed parameter of one of its segments, per metre of pitch.
#[derive(Clone, Copy, Debug)]
pub(super) struct SegmentVariation {
    pub(super) position: DVec2,
    pub(super) turn: f64,
    /// Change of the travel at that parameter.
    pub(super) travel: f64,
}
