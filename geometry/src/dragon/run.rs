//! How far a dragon can walk.
//!
//! A run ends at the route's end, or where the chain rule would make a handle stop, reverse or jump. A link does so
//! where it stands square to the tangent at its front handle (the rear handle's speed reaches 0) or at its rear handle
//! (the rear handle's speed has no bound: the crossing that it stands on vanishes), or where a nearer crossing appears.
//!
//! Whether a link walks depends on the parameter of its front handle alone, and all body links are alike. So a *fault* is a
//! parameter of the route, one for the head's link and one for each parameter that a body link does not get past.

use std::fmt::{self, Display, Formatter};

use super::chain::Chain;
use super::dimensions::Dimensions;
use super::link::{Link, RearEnd};
use super::meter::Meter;
use crate::numerics::{peak, turning_point};
use crate::route::Route;

/// A stretch that the curvature bound does not clear is looked at this many times per link length.
const LOOKS_PER_LINK: f64 = 64.0;

/// A rear handle that walks this part of the link's length between two looks jumped: its speed would be 16 times the
/// front handle's.
const JUMP_PER_LINK: f64 = 0.25;

/// Width to which faults and the run's end are pinned down, in metres and units of parameter.
const TOLERANCE: f64 = 1e-12;

/// A rear handle that walks no more than this many times as far as the front handle between two looks does not jump.
const BRISK: f64 = 1.5;

/// What a rear handle could walk, at a speed without bound, while the front handle walks [`TOLERANCE`]: the root of that,
/// over a curvature of 1/100 m or more.
const LEAST_JUMP_M: f64 = 1e-5;

/// Part of the way between two looks to which the parameter of a dip is known: its depth is then, as a square of that, right
/// to rounding.
const DIP_TOLERANCE: f64 = 1e-7;

/// What ends a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RunEnd {
    /// The head arrives at the route's end.
    RouteEnd,
    /// The speed of this handle reaches 0; it would walk backwards.
    HandleStops {
        /// Index of the handle.
        handle: usize,
    },
    /// The chain rule's next parameter for this handle is not next to its last one.
    HandleJumps {
        /// Index of the handle.
        handle: usize,
    },
}

impl Display for RunEnd {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::RouteEnd => write!(formatter, "the route ends"),
            Self::HandleStops { handle } => write!(formatter, "handle {handle} would stop and walk backwards"),
            Self::HandleJumps { handle } => write!(formatter, "handle {handle} would jump"),
        }
    }
}

/// How far a dragon can walk, and why no further.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Run {
    pub(crate) end_travel_m: f64,
    pub(crate) end: RunEnd,
}

impl Run {
    /// The run of a dragon of these dimensions from the route's start, or the first handle that cannot stand there. Where
    /// the meter is spent after that, it is not known.
    pub(crate) fn of(route: &Route, dimensions: &Dimensions, meter: &Meter) -> Result<Self, usize> {
        let parameters = standing_parameters(route, dimensions, meter)?;
        let mut run = Self { end_travel_m: route.end_travel_m(), end: RunEnd::RouteEnd };
        for bench in 0..dimensions.benches() {
            let length_m = dimensions.link_m(bench);
            // A body link need not look where the one before it started: that one comes to the fault first.
            let limit = if bench < 2 { route.parameter(run.end_travel_m) } else { parameters[bench - 1] };
            if meter.is_spent() {
                break;
            }
            if let Some(fault) = (Faults { route, length_m, meter }).first(parameters[bench], limit) {
                run.shorten(route, dimensions, meter, bench, &fault);
            }
        }
        Ok(run)
    }

    /// Ends the run where the front handle of `bench` comes to the fault, if it does. All links before it walk that
    /// far.
    fn shorten(&mut self, route: &Route, dimensions: &Dimensions, meter: &Meter, bench: usize, fault: &Fault) {
        let arrived = |travel_m| {
            let handle = Chain::new(route, dimensions, meter, route.parameter(travel_m)).nth(bench);
            handle.is_none_or(|handle| handle.parameter >= fault.parameter)
        };
        if arrived(self.end_travel_m) {
            (self.end_travel_m, _) = turning_point(route.start_travel_m(), self.end_travel_m, TOLERANCE, arrived);
            let handle = bench + 1;
            self.end = if fault.jump { RunEnd::HandleJumps { handle } } else { RunEnd::HandleStops { handle } };
        }
    }
}

/// Parameters of all handles at the route's start, or the first handle that has none or would not move forward.
fn standing_parameters(route: &Route, dimensions: &Dimensions, meter: &Meter) -> Result<Vec<f64>, usize> {
    let parameters: Vec<f64> = Chain::new(route, dimensions, meter, route.parameter(route.start_travel_m()))
        .take_while(|handle| !meter.is_spent() && handle.speed_ratio > 0.0 && handle.speed_ratio.is_finite())
        .map(|handle| handle.parameter)
        .collect();
    if parameters.len() == dimensions.handles() { Ok(parameters) } else { Err(parameters.len()) }
}

/// The last parameter before one that a link's front handle cannot get past, and whether the rear handle would jump there.
struct Fault {
    parameter: f64,
    jump: bool,
}

/// The faults of a link of one length on a route.
struct Faults<'a> {
    route: &'a Route,
    length_m: f64,
    meter: &'a Meter,
}

impl Faults<'_> {
    /// The first fault of a front handle that walks from `from` to `to`.
    ///
    /// Halves the stretch until each part is cleared by its curvature or shorter than the distance between two looks.
    fn first(&self, from: f64, to: f64) -> Option<Fault> {
        self.meter.add(1);
        if from >= to || self.meter.is_spent() || self.walks_throughout(from, to) {
            return None;
        }
        let middle = 0.5 * (from + to);
        let arc_m = self.route.travel(to) - self.route.travel(from);
        if arc_m * LOOKS_PER_LINK <= self.length_m || middle <= from || middle >= to {
            return self.between_looks(from, to);
        }
        self.first(from, middle).or_else(|| self.first(middle, to))
    }

    /// Whether curvature alone makes the link walk with its front handle anywhere from `from` to `to`.
    ///
    /// If |κ| ≤ K and K·d < 2, a chord of length d spans an arc of at most (2/K)·asin(K·d/2) ≤ π·d/2 (Schwarz's theorem
    /// on curves of bounded curvature), and makes an angle of at most asin(K·d/2) < 90° with the tangent at either end.
    fn walks_throughout(&self, from: f64, to: f64) -> bool {
        let rear = self.route.step_back(from, 1.5 * std::f64::consts::PI * self.length_m);
        self.route.curvature_bound(rear, to) * self.length_m < 2.0
    }

    /// The fault between two parameters that are so near to each other that there is one at most.
    fn between_looks(&self, from: f64, to: f64) -> Option<Fault> {
        let Some(start) = self.rear(from) else { return Some(Fault { parameter: from, jump: true }) };
        let end = self.rear(to);
        let is_fault = |rear: Option<RearEnd>| rear.is_none_or(|rear| !rear.walks() || self.jumps(&start, &rear));
        let fails = |parameter| is_fault(self.rear(parameter));
        if let Some(parameter) = end.and_then(|end| self.leap((from, &start), (to, &end))) {
            return Some(Fault { parameter, jump: true });
        }
        let failing = if is_fault(end) { to } else { self.dip((from, &start), (to, &end?))? };
        let (parameter, beyond) = turning_point(from, failing, TOLERANCE, fails);
        let jump = self.rear(beyond).is_none_or(|rear| self.jumps(&start, &rear));
        Some(Fault { parameter, jump })
    }

    /// A parameter between two looks from which the rear handle jumps.
    ///
    /// A crossing vanishes where the rear handle's speed has no bound, so a jump shows as a way longer than the front
    /// handle's. Whether it is one is told by halving, each time into the half with more of that way: what is walked,
    /// however fast, shrinks with the square root of the half at least, and a jump does not.
    fn leap(&self, (from, start): (f64, &RearEnd), (to, end): (f64, &RearEnd)) -> Option<f64> {
        let (mut low, mut high) = (from, to);
        let (mut low_m, mut high_m) = (self.route.travel(start.parameter), self.route.travel(end.parameter));
        if high_m - low_m <= BRISK * (self.route.travel(to) - self.route.travel(from)) {
            return None;
        }
        while high - low > TOLERANCE && high_m - low_m > LEAST_JUMP_M {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            let middle_m = self.route.travel(self.rear(middle)?.parameter);
            if high_m - middle_m > middle_m - low_m {
                (low, low_m) = (middle, middle_m);
            } else {
                (high, high_m) = (middle, middle_m);
            }
        }
        (high_m - low_m > LEAST_JUMP_M).then_some(low)
    }

    /// A parameter between two looks at which the rear handle stops, though it walks at both.
    ///
    /// The link's angle with the tangent at its front handle changes by at most |κ| + 2/d per metre as long as the rear
    /// handle is the slower one, as it is where it comes near to a stop. So its cosine dips under 0 only if at either
    /// look it is no more than that over half of the way; where it may, the least cosine is searched for.
    fn dip(&self, (from, start): (f64, &RearEnd), (to, end): (f64, &RearEnd)) -> Option<f64> {
        let cosine = |parameter| self.rear(parameter).map_or(f64::NEG_INFINITY, |rear| rear.cos_front);
        let arc_m = self.route.travel(to) - self.route.travel(from);
        let rear = self.route.step_back(from, 1.5 * std::f64::consts::PI * self.length_m);
        let rate = self.route.curvature_bound(rear, to) + 2.0 / self.length_m;
        if start.cos_front.min(end.cos_front) > 0.5 * rate * arc_m {
            return None;
        }
        let lowest = peak(from, to, DIP_TOLERANCE * (to - from), |parameter| -cosine(parameter));
        (lowest.value >= 0.0).then_some(lowest.at)
    }

    /// Whether a rear handle cannot have walked from one end to the other.
    fn jumps(&self, earlier: &RearEnd, later: &RearEnd) -> bool {
        let walked_m = self.route.travel(later.parameter) - self.route.travel(earlier.parameter);
        later.cos_front > 0.0 && !(-TOLERANCE..=JUMP_PER_LINK * self.length_m).contains(&walked_m)
    }

    fn rear(&self, front_parameter: f64) -> Option<RearEnd> {
        let &Self { route, length_m, meter } = self;
        Link { route, front: route.point(front_parameter), length_m, meter }.rear(front_parameter)
    }
}
