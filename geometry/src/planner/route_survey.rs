//! Survey of a route: its length, its end, its tightest bend and its crossings, whether or not a dragon can walk it.

use crate::dragon::Meter;
use crate::route::{Crossings, PathSpec, Route, RouteHeights, RoutePoint, RouteSpec, TightestBend};

/// Facts about a route.
#[derive(Clone, Debug)]
pub struct RouteSurvey {
    /// Length from the start of the head to the end of the route, in metres.
    pub length_m: f64,
    /// The end of the route.
    pub end: RoutePoint,
    /// The tightest bend that the head walks; `None` for a straight route.
    pub tightest: Option<TightestBend>,
    /// The heights of what the head walks; `None` without ground.
    pub heights: Option<RouteHeights>,
    /// The crossings of the route with itself: of the part on which the dragon stands at the start, and the part that the head
    /// walks. Of a closed path: the crossings of one lap.
    pub crossings: Crossings,
}

impl RouteSurvey {
    /// Surveys a planned route for a dragon that covers `standing_m` metres of it at the start. The meter counts the work for
    /// the crossings.
    ///
    /// ```
    /// use bench_dragon_geometry::{dragon::Meter, planner::RouteSurvey, route::{RouteSpec, SpiralSpec}};
    ///
    /// let plan = RouteSpec::from(SpiralSpec::default());
    /// let survey = RouteSurvey::of(&plan.build(1.0, 370.0)?, &plan, 370.0, &Meter::unlimited());
    /// assert!((survey.length_m - 442.590).abs() < 1e-3 && survey.crossings.found.is_empty());
    /// # Ok::<(), bench_dragon_geometry::route::RouteError>(())
    /// ```
    pub fn of(route: &Route, plan: &RouteSpec, standing_m: f64, meter: &Meter) -> Self {
        let (start_m, end_m) = (route.start_travel_m(), route.end_travel_m());
        let lap_m = plan.as_path().filter(|path| path.laps.is_some()).map(PathSpec::lap_m);
        let [from_m, to_m] = lap_m.map_or([start_m - standing_m, end_m], |lap_m| [0.0, route.in_space(lap_m)]);
        let crossings = route.crossings(from_m, to_m, lap_m.is_some(), meter.left());
        meter.add(crossings.steps);
        Self {
            length_m: end_m - start_m,
            end: route.point(route.parameter(end_m)),
            tightest: route.tightest_bend(start_m, end_m),
            heights: route.heights(start_m, end_m),
            crossings,
        }
    }
}
