//! A turn that a dragon is to pass: a turnaround, on level ground or on hills.

use std::sync::Arc;

use super::infeasible::Infeasible;
use crate::dragon::{Dimensions, Dragon, Meter};
use crate::ground::{Ground, MAX_SLOPE};
use crate::route::{Route, RouteError, Turnaround};

/// A turnaround, and the ground under it. On hills the S is as long as it is in the plan, and travel is along the ground.
#[derive(Clone, Debug)]
pub struct PlannedTurn {
    turnaround: Turnaround,
    ground: Option<Arc<Ground>>,
}

impl From<Turnaround> for PlannedTurn {
    /// The turn on level ground.
    fn from(turnaround: Turnaround) -> Self {
        Self { turnaround, ground: None }
    }
}

impl PlannedTurn {
    /// A turn on ground that is not flat; `None`: on level ground.
    pub fn on(turnaround: Turnaround, ground: Option<Arc<Ground>>) -> Self {
        Self { turnaround, ground }
    }

    /// The turn in the plan.
    pub fn turnaround(&self) -> &Turnaround {
        &self.turnaround
    }

    /// Another turn on the same ground.
    #[must_use]
    pub fn with(&self, turnaround: Turnaround) -> Self {
        Self { turnaround, ground: self.ground.clone() }
    }

    /// A dragon that walks the turn between two travels.
    ///
    /// # Errors
    /// The dragon cannot stand, the ground ends under it, or the meter is spent.
    pub(super) fn walked(
        &self,
        dimensions: Dimensions,
        meter: &Meter,
        from_m: f64,
        to_m: f64,
    ) -> Result<Dragon, Infeasible> {
        let route = self.route(dimensions, meter, from_m, to_m)?;
        Ok(Dragon::with_meter(dimensions, Arc::new(route), meter.clone())?)
    }

    /// The route from a travel up to one in the plan, of 0 or more, for a dragon of these dimensions. The meter counts the work for its
    /// heights.
    ///
    /// # Errors
    /// The ground ends where travel is measured from, or the route is too long for it.
    pub(super) fn route_in_plan(
        &self,
        dimensions: Dimensions,
        meter: &Meter,
        from_m: f64,
        plan_m: f64,
    ) -> Result<Route, RouteError> {
        let longest_m = if self.ground.is_some() { plan_m * MAX_SLOPE.hypot(1.0) } else { plan_m };
        let route = self.route(dimensions, meter, from_m, longest_m)?;
        let to_m = route.in_space(plan_m);
        route.between(from_m, to_m)
    }

    fn route(&self, dimensions: Dimensions, meter: &Meter, from_m: f64, to_m: f64) -> Result<Route, RouteError> {
        let turnaround = self.turnaround.between(from_m, to_m).expect("the travels are finite and in order");
        let Some(ground) = &self.ground else { return Ok(turnaround.route()) };
        let route = turnaround.route().on_ground(ground, from_m, Some(to_m), dimensions.links_m())?;
        meter.add(route.steps_of_heights());
        Ok(route)
    }
}
