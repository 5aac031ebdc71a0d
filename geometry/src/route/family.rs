//! Changes of a route with its measures.
//!
//! The derivatives here follow a point at fixed travel. The formulas of a segment follow a point at a fixed parameter of the
//! segment, whose travel s depends on the measure p. The conversion moves that point back by ∂s/∂p along the tangent, and turns
//! the tangent back by the curvature times ∂s/∂p.
//!
//! *On ground* the curve of the plan is lifted, and travel is the arc in space (see `lifted_variation`).

use std::sync::{Arc, OnceLock};

use glam::DVec2;

use super::lifted_variation::{self, Lifted};
use super::{Route, Turnaround};
use crate::ground::Ground;

/// A measure of a planned route.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RouteMeasure {
    /// Distance between neighbouring turns of a spiral or a turnaround.
    Pitch,
    /// Diameter of a turnaround's circle.
    TurnDiameter,
    /// Radius of a turnaround's entry arc ÷ that of its exit arc.
    RadiusRatio,
    /// Length of the line between a turnaround's arcs, if it has one.
    TurnLine,
}

/// Number of measures.
const MEASURES: usize = 4;

/// Change of the route near one travel, to first order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RouteVariation {
    /// Radians by which the tangent turns counter-clockwise per metre of travel, seen from above. On level ground it is the signed
    /// curvature. At a seam: that on either side.
    pub curvature: f64,
    /// Radians by which the tangent pitches up per metre of travel; 0 on level ground.
    pub bend: f64,
    /// Metres by which the point at this travel moves in the plan, per unit of the measure.
    pub position: DVec2,
    /// Metres by which the point at this travel rises, per unit of the measure.
    pub rise: f64,
    /// Radians by which the tangent at this travel turns counter-clockwise, seen from above, per unit of the measure.
    pub turn: f64,
    /// Radians by which the tangent at this travel pitches up, per unit of the measure.
    pub lift: f64,
}

/// A route and its change with one of its measures. All others stay fixed.
#[derive(Clone, Debug)]
pub struct RouteFamily {
    route: Arc<Route>,
    shape: Shape,
    /// Ground that is not flat.
    ground: Option<Arc<Ground>>,
    /// What each measure changes on ground, once it is needed.
    lifted: [OnceLock<Lifted>; MEASURES],
}

/// Family of routes over their measures.
#[derive(Clone, Debug)]
enum Shape {
    /// Spirals about a centre with a fixed number of turns at the start.
    Spiral {
        /// The centre, in metres.
        centre: DVec2,
    },
    /// Turnarounds with t = 0 at the entry into the circle.
    Turnaround(Box<Turnaround>),
    /// A path, which has no measures and does not change.
    Path,
}

impl RouteFamily {
    /// The family of a spiral about a centre, walked between any travels. Its number of turns at the start stays fixed.
    pub(crate) fn of_spiral(route: Route, centre: DVec2) -> Self {
        Self::of(route, Shape::Spiral { centre })
    }

    pub(crate) fn of_path(route: Route) -> Self {
        Self::of(route, Shape::Path)
    }

    /// The family of a turnaround's route.
    pub(crate) fn of_turnaround(turnaround: Turnaround, route: Route) -> Self {
        Self::of(route, Shape::Turnaround(Box::new(turnaround)))
    }

    fn of(route: Route, shape: Shape) -> Self {
        Self { route: Arc::new(route), shape, ground: None, lifted: [const { OnceLock::new() }; MEASURES] }
    }

    /// The same family of a route that is on this ground already.
    #[must_use]
    pub(crate) fn on_ground(self, ground: Option<Arc<Ground>>) -> Self {
        Self { ground, ..self }
    }

    /// The route.
    pub fn route(&self) -> &Arc<Route> {
        &self.route
    }

    /// The centre of a spiral, which is the same at every pitch; `None` for another route.
    pub(crate) fn centre(&self) -> Option<DVec2> {
        if let Shape::Spiral { centre } = self.shape { Some(centre) } else { None }
    }

    /// Change of the route near a parameter with a measure, at fixed travel; with `None` it stays as it is.
    pub fn variation(&self, parameter: f64, measure: Option<RouteMeasure>) -> RouteVariation {
        let plan = self.plan_variation(parameter, measure);
        match &self.ground {
            Some(ground) => {
                let arc = measure.map_or(0.0, |measure| self.arc_variation(ground, parameter, measure));
                lifted_variation::at(self, ground, parameter, &plan, arc)
            }
            None => plan,
        }
    }

    /// Change of the curve in the plan near a parameter, at fixed travel in the plan.
    pub(super) fn plan_variation(&self, parameter: f64, measure: Option<RouteMeasure>) -> RouteVariation {
        let (point, travel_m) = (self.route.plan_point(parameter), self.route.plan_travel(parameter));
        let curvature = self.route.curvature(parameter);
        let SegmentVariation { position, turn, travel } = match (&self.shape, measure) {
            // At a fixed angle, all lengths are proportional to the pitch.
            (Shape::Spiral { centre }, Some(RouteMeasure::Pitch)) => {
                let (pitch_m, spoke) = (self.route.pitch_m(), point.position - centre);
                SegmentVariation { position: spoke / pitch_m, turn: 0.0, travel: travel_m / pitch_m }
            }
            (Shape::Turnaround(turnaround), Some(measure)) => turnaround.variation(measure, point.position, travel_m),
            _ => SegmentVariation { position: DVec2::ZERO, turn: 0.0, travel: 0.0 },
        };
        let position = position - travel * point.tangent;
        RouteVariation { curvature, bend: 0.0, position, rise: 0.0, turn: turn - travel * curvature, lift: 0.0 }
    }

    /// Change of the travel of each seam, in metres per unit of a measure, in the order of the seams.
    pub fn seam_variations(&self, measure: RouteMeasure) -> Vec<f64> {
        let plan = match &self.shape {
            Shape::Spiral { .. } => Vec::new(),
            Shape::Path => vec![0.0; self.route.seams().len()],
            Shape::Turnaround(turnaround) => turnaround.seam_variations(measure),
        };
        let Some(ground) = &self.ground else { return plan };
        let in_space = |(&seam, along): (&f64, f64)| {
            self.arc_variation(ground, seam, measure) + along / self.route.point(seam).tangent.length()
        };
        self.route.seams().iter().zip(plan).map(in_space).collect()
    }

    /// Change of the arc in space from t = 0 to the point at a parameter, at fixed travel in the plan.
    fn arc_variation(&self, ground: &Ground, parameter: f64, measure: RouteMeasure) -> f64 {
        let lifted = self.lifted[measure as usize].get_or_init(|| Lifted::of(self, ground, measure));
        lifted.arc_variation(self, ground, parameter)
    }

    /// Whether the curve of the plan has no measures, so that the route ends at a fixed travel.
    pub(crate) fn is_fixed(&self) -> bool {
        matches!(self.shape, Shape::Path)
    }
}

/// Change of the route at a fixed parameter of one of its segments, per unit of the measure.
#[derive(Clone, Copy, Debug)]
pub(super) struct SegmentVariation {
    pub(super) position: DVec2,
    pub(super) turn: f64,
    /// Change of the travel at that parameter.
    pub(super) travel: f64,
}
