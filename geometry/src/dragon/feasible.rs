//! The feasible travel of a dragon: how far it can walk, and why not further.
//!
//! Feasible travel ends at the route's end, or where the chain rule would make a handle stop, reverse or jump. A link causes
//! this in three cases. It is perpendicular to the tangent at its front handle: the speed of the rear handle reaches 0. It is
//! perpendicular to the tangent at its rear handle: the speed of the rear handle is unbounded, because its crossing vanishes.
//! Or a nearer crossing appears.
//!
//! Whether a link walks depends only on the parameter of its front handle, and all body links are alike. So a *fault* is a
//! parameter of the route that a front handle cannot pass. The head's link and the body links have separate faults.

use std::fmt::{self, Display, Formatter};

use glam::DVec2;

use super::chain::Chain;
use super::dimensions::Dimensions;
use super::link::{Link, RearEnd};
use super::meter::Meter;
use crate::number::{Fixed, Place};
use crate::numerics::{crossing, peak, turning_point};
use crate::route::Route;

/// Samples per link length in an interval that the curvature bound does not clear.
const LOOKS_PER_LINK: f64 = 64.0;

/// Largest motion of a rear handle between two samples, as a share of the link's length. A longer motion is a jump: the
/// handle's speed would be 16 times that of the front handle.
const JUMP_PER_LINK: f64 = 0.25;

/// Speed of a rear handle, in speeds of its front handle, that counts as a jump between two samples.
const FASTEST: f64 = JUMP_PER_LINK * LOOKS_PER_LINK;

/// Tolerance of faults and of the end of the feasible travel, in metres and in units of the parameter.
const TOLERANCE: f64 = 1e-12;

/// Shortest jump, as a multiple of the longest way of a rear handle whose crossing is about to vanish.
const LEAST_JUMP: f64 = 8.0;

/// Tolerance of a dip's parameter, as a share of the interval between two samples. The error of its depth is the square of
/// that, so the depth is exact to rounding.
const DIP_TOLERANCE: f64 = 1e-7;

/// Reason why the feasible travel ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FeasibleEnd {
    /// The head reaches the route's end.
    RouteEnd,
    /// The speed of this handle reaches 0. Beyond, it would walk backwards.
    HandleStops {
        /// Index of the handle.
        handle: usize,
    },
    /// The next parameter of this handle by the chain rule is not adjacent to its last one.
    HandleJumps {
        /// Index of the handle.
        handle: usize,
    },
}

impl FeasibleEnd {
    /// The handle that would stop or jump.
    pub fn handle(self) -> Option<usize> {
        match self {
            Self::RouteEnd => None,
            Self::HandleStops { handle } | Self::HandleJumps { handle } => Some(handle),
        }
    }
}

/// A place on the route that a bench cannot follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TightSpot {
    /// Index of the bench.
    pub bench: usize,
    /// Travel of the bench's front handle along the route, in metres.
    pub travel_m: f64,
    /// Position of that handle, in metres.
    pub point: DVec2,
}

impl TightSpot {
    /// The place at which the front handle of a bench is at a parameter.
    pub(super) fn at(route: &Route, bench: usize, parameter: f64) -> Self {
        Self { bench, travel_m: route.travel(parameter), point: route.point(parameter).position }
    }
}

impl Display for TightSpot {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        let (travel_m, place) = (Fixed::<3>(self.travel_m), Place::<3>(self.point.to_array()));
        write!(formatter, "bench {} cannot follow at {travel_m} m of travel, at {place}", self.bench)
    }
}

impl Display for FeasibleEnd {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::RouteEnd => write!(formatter, "the route ends"),
            Self::HandleStops { handle } => write!(formatter, "handle {handle} would stop and walk backwards"),
            Self::HandleJumps { handle } => write!(formatter, "handle {handle} would jump"),
        }
    }
}

/// The end of a dragon's feasible travel, and its reason.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FeasibleTravel {
    pub(crate) end_travel_m: f64,
    pub(crate) end: FeasibleEnd,
}

impl FeasibleTravel {
    /// Finds the feasible travel of a dragon of these dimensions from the route's start.
    ///
    /// # Errors
    /// The first bench whose rear handle has no valid position at the start. The result is valid only if the meter's limit is
    /// not reached.
    pub(crate) fn of(route: &Route, dimensions: &Dimensions, meter: &Meter) -> Result<Self, TightSpot> {
        let benches = if walks_on_coil(route, dimensions) { dimensions.benches().min(2) } else { dimensions.benches() };
        let parameters = standing_parameters(route, &dimensions.with_benches(benches), meter)?;
        let mut feasible = Self { end_travel_m: route.end_travel_m(), end: FeasibleEnd::RouteEnd };
        for bench in 0..benches {
            let length_m = dimensions.link_m(bench);
            // A body link is sampled only up to the start of the link before it, which reaches a fault beyond that first.
            let limit = if bench < 2 { route.parameter(feasible.end_travel_m) } else { parameters[bench - 1] };
            if meter.is_spent() {
                break;
            }
            if let Some(fault) = (Faults { route, length_m, meter }).first(parameters[bench], limit) {
                feasible.shorten(route, dimensions, meter, bench, &fault);
            }
        }
        Ok(feasible)
    }

    /// Ends the feasible travel where the front handle of `bench` reaches the fault, if it reaches it. All links before it walk
    /// that far.
    fn shorten(&mut self, route: &Route, dimensions: &Dimensions, meter: &Meter, bench: usize, fault: &Fault) {
        let arrived = |travel_m| {
            let handle = Chain::new(route, dimensions, meter, route.parameter(travel_m)).nth(bench);
            handle.is_none_or(|handle| handle.parameter >= fault.parameter)
        };
        if arrived(self.end_travel_m) {
            (self.end_travel_m, _) = turning_point(route.start_travel_m(), self.end_travel_m, TOLERANCE, arrived);
            let handle = bench + 1;
            self.end =
                if fault.jump { FeasibleEnd::HandleJumps { handle } } else { FeasibleEnd::HandleStops { handle } };
        }
    }
}

/// Whether the curvature bound proves that body links walk everywhere behind the route's start: on a coil, whose curvature falls outward
/// without end. Then only benches 0 and 1 have to be examined, because no other one comes to ground that bench 1 has not passed.
fn walks_on_coil(route: &Route, dimensions: &Dimensions) -> bool {
    let start = route.parameter(route.start_travel_m());
    let is_coil = route.coil().is_some_and(|coil| start < coil.end) && route.standing_begin() == f64::NEG_INFINITY;
    is_coil && route.curvature_bound(start, start) * dimensions.link_m(1) < 2.0
}

/// The parameters of all handles at the route's start.
///
/// # Errors
/// The first bench whose rear handle has no parameter there, or could not move forward.
fn standing_parameters(route: &Route, dimensions: &Dimensions, meter: &Meter) -> Result<Vec<f64>, TightSpot> {
    let parameters: Vec<f64> = Chain::new(route, dimensions, meter, route.parameter(route.start_travel_m()))
        .take_while(|handle| !meter.is_spent() && handle.speed_ratio > 0.0 && handle.speed_ratio.is_finite())
        .take_while(|handle| handle.parameter >= route.standing_begin())
        .map(|handle| handle.parameter)
        .collect();
    if parameters.len() == dimensions.handles() {
        return Ok(parameters);
    }
    let bench = parameters.len().saturating_sub(1);
    Err(TightSpot::at(route, bench, parameters.last().copied().unwrap_or(route.parameter(route.start_travel_m()))))
}

/// A fault of a link: the last parameter that the front handle can reach, and whether the rear handle would jump there.
struct Fault {
    parameter: f64,
    jump: bool,
}

/// The first parameter from `from` to `to` that the front handle of a link cannot pass.
pub(super) fn first_fault(route: &Route, length_m: f64, from: f64, to: f64, meter: &Meter) -> Option<f64> {
    Faults { route, length_m, meter }.first(from, to).map(|fault| fault.parameter)
}

/// A parameter of a front handle, and the rear end of its link; `None` if the link has none.
type Sample = (f64, Option<RearEnd>);

/// Search for the faults of a link of one length on a route.
struct Faults<'a> {
    route: &'a Route,
    length_m: f64,
    meter: &'a Meter,
}

impl Faults<'_> {
    /// Finds the first fault of a front handle that walks from `from` to `to`.
    ///
    /// The interval is bisected until the curvature bound clears each part, or the part is at most as long as the link.
    fn first(&self, from: f64, to: f64) -> Option<Fault> {
        self.meter.add(1);
        if from >= to || self.meter.is_spent() || self.walks_throughout(from, to) {
            return None;
        }
        let middle = 0.5 * (from + to);
        if self.arc_m(from, to) <= self.length_m || middle <= from || middle >= to {
            return self.first_between((from, self.rear(from)), (to, self.rear(to)));
        }
        self.first(from, middle).or_else(|| self.first(middle, to))
    }

    /// Finds the first fault between two parameters, with the rear ends there.
    ///
    /// The interval is bisected until the curvature bound or the rear ends clear each part, or the part is shorter than the
    /// distance between two samples.
    fn first_between(&self, low: Sample, high: Sample) -> Option<Fault> {
        self.meter.add(1);
        let (from, to) = (low.0, high.0);
        if self.meter.is_spent() || self.walks_throughout(from, to) || self.walks_between(&low, &high) {
            return None;
        }
        let middle = 0.5 * (from + to);
        if self.arc_m(from, to) * LOOKS_PER_LINK <= self.length_m || middle <= from || middle >= to {
            return self.between_looks(&low, &high);
        }
        let middle = (middle, self.rear(middle));
        self.first_between(low, middle).or_else(|| self.first_between(middle, high))
    }

    /// Whether the curvature bound proves that the link walks with its front handle anywhere from `from` to `to`.
    ///
    /// If |κ| ≤ K and K·d < 2, a chord of length d spans an arc of at most (2/K)·asin(K·d/2) ≤ π·d/2 (Schwarz's theorem on
    /// curves of bounded curvature). It makes an angle of at most asin(K·d/2) < 90° with the tangent at either end.
    fn walks_throughout(&self, from: f64, to: f64) -> bool {
        let rear = self.reach_back(from);
        self.route.curvature_bound(rear, to) * self.length_m < 2.0
    }

    /// Whether the rear ends at two parameters prove that the link walks with its front handle anywhere between, and that its
    /// rear handle is less than [`FASTEST`] times as fast.
    ///
    /// The cosine at the rear handle stays above `least` (see [`least_crossing`](Self::least_crossing)). While the cosine at
    /// the front handle is below that, the rear handle is the slower one, and the cosine changes by at most |κ| + 2/d per
    /// metre. So it reaches 0 only if it is at most that rate times half of the interval at one end.
    fn walks_between(&self, low: &Sample, high: &Sample) -> bool {
        let ((from, Some(start)), (to, Some(end))) = (low, high) else { return false };
        let arc_m = self.arc_m(*from, *to);
        let Some(least) = self.least_crossing((*from, start), (*to, end), arc_m) else { return false };
        let falls = 0.5 * self.turn_rate(*from, *to) * arc_m;
        least * FASTEST > 1.0 && start.cos_front.min(end.cos_front).min(least) > falls
    }

    /// Finds the first fault between two adjacent samples. The samples are so close that at most one stop lies between them, or
    /// one jump, or a stop before a jump: a rear handle that walks backwards may come to where its crossing vanishes.
    fn between_looks(&self, &(from, start): &Sample, &(to, end): &Sample) -> Option<Fault> {
        let Some(start) = start else { return Some(Fault { parameter: from, jump: true }) };
        let leap = end.and_then(|end| self.leap((from, &start), (to, &end)));
        let Some(leap) = leap else { return self.stop((from, &start), (to, end)) };
        let stop = self.stop((from, &start), (leap, self.rear(leap))).filter(|stop| stop.parameter < leap - TOLERANCE);
        Some(stop.unwrap_or(Fault { parameter: leap, jump: true }))
    }

    /// Finds the fault between two parameters with no jump of [`leap`](Self::leap) between them.
    fn stop(&self, (from, start): (f64, &RearEnd), (to, end): (f64, Option<RearEnd>)) -> Option<Fault> {
        let value = |rear: Option<RearEnd>| match rear {
            Some(rear) if !self.jumps(start, &rear) => rear.cos_front.min(rear.cos_rear),
            _ => f64::NEG_INFINITY,
        };
        let at = |parameter| value(self.rear(parameter));
        let failing = if value(end) <= 0.0 { to } else { self.dip((from, start), (to, &end?))? };
        let values = [value(Some(*start)), if failing == to { value(end) } else { at(failing) }];
        let (parameter, beyond) = crossing([from, failing], values, TOLERANCE, at);
        let jump = self.rear(beyond).is_none_or(|rear| self.jumps(start, &rear));
        Some(Fault { parameter, jump })
    }

    /// Finds a parameter between two samples at which the rear handle jumps: its crossing vanishes, or a nearer one appears.
    ///
    /// The interval is bisected until each part is proved to have no jump, or is so short that a longer motion is one.
    fn leap(&self, low: (f64, &RearEnd), high: (f64, &RearEnd)) -> Option<f64> {
        let arc_m = self.arc_m(low.0, high.0);
        if self.meter.is_spent() || self.least_crossing(low, high, arc_m).is_some() {
            return None;
        }
        let middle = 0.5 * (low.0 + high.0);
        if high.0 - low.0 <= TOLERANCE || middle <= low.0 || middle >= high.0 {
            let walked_m = self.route.travel(high.1.parameter) - self.route.travel(low.1.parameter);
            return (walked_m.abs() > LEAST_JUMP * (arc_m * self.length_m).sqrt()).then_some(low.0);
        }
        let Some(rear) = self.rear(middle) else {
            return Some(turning_point(low.0, middle, TOLERANCE, |parameter| self.rear(parameter).is_none()).0);
        };
        self.leap(low, (middle, &rear)).or_else(|| self.leap((middle, &rear), high))
    }

    /// The least cosine of the link with the tangent at its rear handle between two parameters of the front handle, which walks
    /// `arc_m`, or less; `None` unless no crossing vanishes or appears between them.
    ///
    /// Let γ be the angle by which the link is away from being perpendicular to the tangent at its rear handle, and K = |κ| +
    /// 1/d. γ changes by at most K per metre of the rear handle and 1/d per metre of the front handle, and a crossing vanishes
    /// at γ = 0. The rear handle walks at most 1 / sin γ metres per metre. So γ falls from γ₀ to γ₁ only if the front handle
    /// walks at least (cos γ₁ − cos(γ₀ − arc/d)) / K. The same holds backwards, from the later crossing. If both crossings
    /// persist, they are the same one, because two crossings keep their order until they meet, at γ = 0.
    fn least_crossing(&self, low: (f64, &RearEnd), high: (f64, &RearEnd), arc_m: f64) -> Option<f64> {
        let bend = self.turn_rate(low.0, high.0) - 1.0 / self.length_m;
        let least_sine = low.1.cos_rear.min(high.1.cos_rear).clamp(-1.0, 1.0);
        let left = least_sine.asin() - arc_m / self.length_m;
        let cosine = left.cos() + bend * arc_m;
        (left > 0.0 && cosine < 1.0).then(|| (1.0 - cosine * cosine).sqrt())
    }

    /// Bound on |κ| + 2/d with the front handle between two parameters, in 1/m.
    fn turn_rate(&self, from: f64, to: f64) -> f64 {
        self.route.curvature_bound(self.reach_back(from), to) + 2.0 / self.length_m
    }

    /// Finds a parameter between two samples at which the rear handle stops, although it walks at both samples.
    ///
    /// The link's angle with the tangent at its front handle changes by at most |κ| + 2/d per metre while the rear handle is
    /// the slower one. Near a stop it is. To fall below 0 between the samples, the cosine must be at most that rate times half
    /// of the interval at one of them. In that case the smallest cosine is searched for.
    fn dip(&self, (from, start): (f64, &RearEnd), (to, end): (f64, &RearEnd)) -> Option<f64> {
        let cosine = |parameter| self.rear(parameter).map_or(f64::NEG_INFINITY, |rear| rear.cos_front);
        if start.cos_front.min(end.cos_front) > 0.5 * self.turn_rate(from, to) * self.arc_m(from, to) {
            return None;
        }
        let lowest = peak(from, to, DIP_TOLERANCE * (to - from), |parameter| -cosine(parameter));
        (lowest.value >= 0.0).then_some(lowest.at)
    }

    /// Whether the rear handle cannot have walked from one position to the other.
    fn jumps(&self, earlier: &RearEnd, later: &RearEnd) -> bool {
        let walked_m = self.route.travel(later.parameter) - self.route.travel(earlier.parameter);
        later.cos_front > 0.0 && !(-TOLERANCE..=JUMP_PER_LINK * self.length_m).contains(&walked_m)
    }

    /// A parameter behind every rear handle of a front handle where K·d < 2: the arc between is at most π·d/2, and a
    /// step back covers a third of its arc.
    fn reach_back(&self, front_parameter: f64) -> f64 {
        let arc_m = 1.5 * std::f64::consts::PI * self.length_m;
        self.route.step_back(front_parameter, arc_m * self.route.steepest())
    }

    /// Arc between two parameters, in metres.
    fn arc_m(&self, from: f64, to: f64) -> f64 {
        self.route.travel(to) - self.route.travel(from)
    }

    fn rear(&self, front_parameter: f64) -> Option<RearEnd> {
        let &Self { route, length_m, meter } = self;
        Link { route, front: route.point(front_parameter), length_m, meter }.rear(front_parameter)
    }
}
