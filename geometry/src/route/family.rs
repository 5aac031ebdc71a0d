//! Changes of a route with its pitch.
//!
//! Of the parameters that the planner varies, only the pitch changes the curve. The derivatives here follow a point at fixed
//! travel. The formulas of a segment follow a point at a fixed parameter of the segment, whose travel s depends on the pitch p.
//! The conversion moves that point back by ∂s/∂p along the tangent, and turns the tangent back by the curvature times ∂s/∂p.
//!
//! *On ground* the curve of the plan is lifted, and travel is the arc in space (see `lifted_variation`).

use std::sync::{Arc, OnceLock};

use glam::DVec2;

use super::lifted_variation::Lifted;
use super::{Route, Turnaround};
use crate::ground::Ground;

/// Change of the route near one travel, to first order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RouteVariation {
    /// Radians by which the tangent turns counter-clockwise per metre of travel, seen from above. On level ground it is the signed
    /// curvature. At a seam: that on either side.
    pub curvature: f64,
    /// Radians by which the tangent pitches up per metre of travel; 0 on level ground.
    pub bend: f64,
    /// Metres by which the point at this travel moves in the plan, per metre of pitch.
    pub position: DVec2,
    /// Metres by which the point at this travel rises, per metre of pitch.
    pub rise: f64,
    /// Radians by which the tangent at this travel turns counter-clockwise, seen from above, per metre of pitch.
    pub turn: f64,
    /// Radians by which the tangent at this travel pitches up, per metre of pitch.
    pub lift: f64,
}

/// A route and its change with the pitch. All other measures of the route stay fixed.
#[derive(Clone, Debug)]
pub struct PitchFamily {
    route: Arc<Route>,
    shape: Shape,
    /// Ground that is not flat.
    ground: Option<Arc<Ground>>,
    /// What the pitch changes on ground, once it is needed.
    lifted: OnceLock<Lifted>,
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
        Self { route: Arc::new(route), shape, ground: None, lifted: OnceLock::new() }
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

    /// Whether the route is walked to the same travel at every pitch: a path, and on ground a turnaround as planned.
    pub(crate) fn ends_at_fixed_travel(&self) -> bool {
        match self.shape {
            Shape::Path => true,
            Shape::Turnaround(_) => self.ground.is_some(),
            Shape::Spiral { .. } => false,
        }
    }

    /// Change of the route near a parameter, at fixed travel.
    pub fn variation(&self, parameter: f64) -> RouteVariation {
        let plan = self.plan_variation(parameter);
        match &self.ground {
            Some(ground) => self.lifted(ground).variation(self, ground, parameter, &plan),
            None => plan,
        }
    }

    /// Change of the curve in the plan near a parameter, at fixed travel in the plan.
    pub(super) fn plan_variation(&self, parameter: f64) -> RouteVariation {
        let (point, travel_m) = (self.route.plan_point(parameter), self.route.plan_travel(parameter));
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
        let position = position - travel * point.tangent;
        RouteVariation { curvature, bend: 0.0, position, rise: 0.0, turn: turn - travel * curvature, lift: 0.0 }
    }

    /// Change of the travel of each seam, in metres per metre of pitch, in the order of the seams.
    pub fn seam_variations(&self) -> Vec<f64> {
        let plan = match &self.shape {
            Shape::Spiral { .. } => Vec::new(),
            Shape::Path => vec![0.0; self.route.seams().len()],
            Shape::Turnaround(turnaround) => turnaround.seam_variations(),
        };
        let Some(ground) = &self.ground else { return plan };
        let lifted = self.lifted(ground);
        let in_space = |(&seam, along): (&f64, f64)| {
            lifted.arc_variation(self, ground, seam) + along / self.route.point(seam).tangent.length()
        };
        self.route.seams().iter().zip(plan).map(in_space).collect()
    }

    fn lifted(&self, ground: &Ground) -> &Lifted {
        self.lifted.get_or_init(|| Lifted::of(self, ground))
    }

    /// Whether the curve of the plan is the same at every pitch.
    pub(super) fn is_fixed(&self) -> bool {
        matches!(self.shape, Shape::Path)
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
