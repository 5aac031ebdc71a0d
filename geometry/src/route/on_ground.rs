//! Routes on ground that is not flat: the plan of the route, lifted into space.

use std::sync::Arc;

use glam::DVec2;
use thiserror::Error;

use super::profile::{self, Profile, ProfileEnd, Walk};
use super::{Route, RouteError, RoutePoint};
use crate::ground::{Ground, HeightRun, MAX_SLOPE};
use crate::number::Number;

/// Room for a standing dragon behind the start, in lengths of the dragon. Where its links walk, the arc over a link is at most
/// π/2 times its length.
const ROOM_PER_LENGTH: f64 = 2.0;
/// Difference of slopes that counts as none.
const EQUALLY_STEEP: f64 = 1e-9;
/// Further room, in metres.
const ROOM_M: f64 = 20.0;
/// Work for the construction of a piece of the profile, in steps.
const STEPS_PER_PIECE: u64 = 40;

/// Error: the ground ends on the part of the route that a dragon would walk.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error("the ground {} at {} m of travel, at ({}, {}) m{}", fault(*is_steep), Number(rounded(*travel_m)), Number(rounded(*x_m)), Number(rounded(*y_m)), remedy(*is_steep))]
pub struct GroundGap {
    /// Travel in metres.
    pub travel_m: f64,
    /// Position in metres.
    pub x_m: f64,
    /// Position in metres.
    pub y_m: f64,
    /// Whether the ground is too steep there; otherwise it has no height.
    pub is_steep: bool,
}

/// The heights of a part of a route, at some places of each piece over a cell of the ground.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RouteHeights {
    /// Least height of a handle, in metres.
    pub lowest_m: f64,
    /// Greatest height of a handle, in metres.
    pub highest_m: f64,
    /// Steepest slope along the route, up or down, in metres per metre of the plan.
    pub slope: f64,
    /// Travel at the steepest slope.
    pub travel_m: f64,
    /// Position of the steepest slope in the plan, in metres.
    pub point: DVec2,
}

fn fault(is_steep: bool) -> &'static str {
    if is_steep { "is too steep" } else { "has no height" }
}

fn remedy(is_steep: bool) -> String {
    if is_steep { format!(": the slope along the route must be at most {MAX_SLOPE}") } else { String::new() }
}

/// To a millimetre, and without a sign of 0.
fn rounded(metres: f64) -> f64 {
    (metres * 1000.0).round() / 1000.0 + 0.0
}

/// A point of the plan at its height.
pub(super) fn lifted(profile: &Profile, parameter: f64, plan: RoutePoint, plan_m: impl FnOnce() -> f64) -> RoutePoint {
    let [height_m, grade] = profile.height(parameter, plan_m, plan.speed_m_per_unit);
    let length_per_plan = grade.hypot(1.0);
    RoutePoint {
        position: plan.position,
        tangent: plan.tangent / length_per_plan,
        speed_m_per_unit: plan.speed_m_per_unit * length_per_plan,
        height_m,
        climb: grade / length_per_plan,
    }
}

impl Route {
    /// The same plan on ground, walked from a travel to another one, or to the end of the curve. Travel is then the arc in
    /// space, 0 at the same place as before. Behind the start there is room for a dragon of this length.
    ///
    /// ```
    /// use bench_dragon_geometry::{ground::Ground, route::Route};
    /// use glam::DVec2;
    ///
    /// let slope = Ground::plane(DVec2::new(0.75, 0.0))?;
    /// let spiral = Route::spiral(0.55, 16.0)?.on_ground(&slope, 0.0, Some(400.0), 370.0)?;
    /// let start = spiral.point(spiral.parameter(0.0));
    /// assert!((start.height_m - 0.75 * 8.8).abs() < 1e-12);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// There is no ground at t = 0, the route is too long for its ground, or the travels are not valid.
    pub fn on_ground(
        mut self,
        ground: &Ground,
        start_m: f64,
        end_m: Option<f64>,
        dragon_m: f64,
    ) -> Result<Self, RouteError> {
        let from_m = start_m.min(0.0) - ROOM_PER_LENGTH * dragon_m - ROOM_M;
        let to_m = end_m.map_or(f64::INFINITY, |end_m| end_m + ROOM_M);
        let built = profile::build(&self, ground, Walk { from_m, to_m }).ok_or(RouteError::LongOnGround)?;
        match built {
            Ok(profile) => self.profile = Some(Arc::new(profile)),
            Err(reason) => return Err(self.gap(self.plan_parameter(0.0), reason).into()),
        }
        let end_m = end_m.unwrap_or(self.curve_end_m());
        self.between(start_m, end_m)
    }

    /// Travel in the plan of a travel in space.
    pub(super) fn in_plan(&self, travel_m: f64) -> f64 {
        if self.profile.is_some() { self.plan_travel(self.parameter(travel_m)) } else { travel_m }
    }

    /// Travel in space of a travel in the plan.
    pub fn in_space(&self, plan_m: f64) -> f64 {
        if self.profile.is_some() { self.travel(self.plan_parameter(plan_m)) } else { plan_m }
    }

    /// The heights between two travels, as far as there is ground; `None` for a route without ground.
    pub fn heights(&self, from_m: f64, to_m: f64) -> Option<RouteHeights> {
        let profile = self.profile.as_ref()?;
        let [(begin, _), (end, _)] = profile.ends();
        let [from, to] = [from_m, to_m].map(|travel_m| self.parameter(travel_m).clamp(begin, end));
        let at = |parameter: f64| {
            let point = self.point(parameter);
            (point.height_m, (point.climb / point.climb.mul_add(-point.climb, 1.0).sqrt()).abs())
        };
        let mut heights =
            RouteHeights { lowest_m: f64::INFINITY, highest_m: f64::NEG_INFINITY, ..RouteHeights::default() };
        let mut steepest = from;
        for parameter in profile.samples(from, to) {
            let (height_m, slope) = at(parameter);
            heights.lowest_m = heights.lowest_m.min(height_m);
            heights.highest_m = heights.highest_m.max(height_m);
            // The first of places that are equally steep up to rounding.
            if slope > heights.slope + EQUALLY_STEEP {
                (heights.slope, steepest) = (slope, parameter);
            }
        }
        heights.travel_m = self.travel(steepest);
        heights.point = self.plan_point(steepest).position;
        Some(heights)
    }

    /// Whether the route is on ground that is not flat.
    pub fn is_on_ground(&self) -> bool {
        self.profile.is_some()
    }

    /// Work for the construction of the heights along the route, in steps; 0 without ground.
    pub(crate) fn steps_of_heights(&self) -> u64 {
        self.profile.as_ref().map_or(0, |profile| STEPS_PER_PIECE * profile.pieces() as u64)
    }

    /// The heights along a route on ground.
    pub(super) fn profile(&self) -> &Profile {
        self.profile.as_ref().expect("the route is on ground")
    }

    /// The heights of the map under the route: those on which its heights depend. Empty on a plane.
    pub fn ground_runs(&self, ground: &Ground) -> Vec<HeightRun> {
        match (&self.profile, ground.height_map()) {
            (Some(profile), Some(map)) => map.runs(profile.cells().iter().copied()),
            _ => Vec::new(),
        }
    }

    /// Greatest arc in space per metre of the plan; 1 without ground.
    pub(crate) fn steepest(&self) -> f64 {
        self.profile.as_ref().map_or(1.0, |profile| profile.steepest())
    }

    /// The place where the ground ends between two parameters, if it does: the one nearer to the rear.
    pub(crate) fn ground_gap(&self, rear: f64, front: f64) -> Option<GroundGap> {
        let [(begin, behind), (end, ahead)] = self.profile.as_ref()?.ends();
        if rear < begin {
            return Some(self.gap(begin, behind));
        }
        (front > end).then(|| self.gap(end, ahead))
    }

    fn gap(&self, parameter: f64, reason: ProfileEnd) -> GroundGap {
        let point = self.plan_point(parameter).position;
        let is_steep = reason == ProfileEnd::TooSteep;
        GroundGap { travel_m: self.travel(parameter), x_m: point.x, y_m: point.y, is_steep }
    }

    /// The piece of the profile at a parameter, with its ends; `None` without ground.
    pub(crate) fn profile_piece(&self, parameter: f64) -> Option<(profile::Piece, [f64; 2])> {
        let profile = self.profile.as_ref()?;
        let plan = |parameter| [self.plan_travel(parameter), self.plan_point(parameter).speed_m_per_unit];
        Some(profile.piece(parameter).unwrap_or_else(|| profile.piece_beyond(parameter, plan)))
    }

    /// Travel at the end of the curve; infinite if it has none.
    pub(super) fn curve_end_m(&self) -> f64 {
        let last = self.segments.last().expect("a route has a segment");
        let end = last.end();
        if end.is_finite() { self.travel(end) } else { last.travel(end) }
    }

    /// The point of the plan at a parameter. Inlined into its callers it leaves less room there, and makes a search up to a sixth slower.
    #[inline(never)]
    pub(super) fn plan_point(&self, parameter: f64) -> RoutePoint {
        self.segment_at(parameter).kernel.at(parameter)
    }

    /// Bound on the displacement in the plan that rounding causes at a parameter, in metres.
    pub(super) fn plan_rounding_m(&self, parameter: f64) -> f64 {
        let speed_m_per_unit = self.plan_point(parameter).speed_m_per_unit;
        self.segment_at(parameter).rounding_m(parameter, speed_m_per_unit)
    }

    /// Travel in the plan at a parameter.
    #[inline]
    pub(super) fn plan_travel(&self, parameter: f64) -> f64 {
        self.segment_at(parameter).travel(parameter)
    }

    /// The parameter at a travel in the plan.
    #[inline]
    pub(super) fn plan_parameter(&self, travel_m: f64) -> f64 {
        self.segment_of_travel(travel_m).parameter(travel_m)
    }

    /// The parameter after a step along the plan, forward or backward: at most to the end of the segment.
    pub(super) fn plan_stride(&self, parameter: f64, stride_m: f64) -> f64 {
        let number = if stride_m > 0.0 { self.number_of_begin(parameter) } else { self.number_at(parameter) };
        let placed = &self.segments[number];
        let next = placed.parameter(placed.travel(parameter) + stride_m);
        let end = placed.end();
        // At the end of the curve there is no further segment.
        let next = if stride_m > 0.0 { next.max(parameter) } else { next.min(parameter) };
        next.clamp(placed.begin.min(end), end.max(placed.begin))
    }

    /// A bound on the change of the plan's speed per unit of the parameter, on the segment at a parameter.
    pub(super) fn plan_acceleration_bound(&self, parameter: f64) -> f64 {
        self.segment_at(parameter).kernel.acceleration_bound()
    }
}
