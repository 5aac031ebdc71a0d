//! The chain rule: each handle is on the route, behind the handle before it.
//!
//! Handle i + 1 is the nearest point of the route *behind* handle i, along the route, at the distance of the link of bench i.
//! Links are rigid, so the two handles of a bench have equal velocity components along the link. All speeds follow from the
//! speed of the head.

use glam::{DVec2, DVec3};
use thiserror::Error;

use super::Dragon;
use super::dimensions::Dimensions;
use super::link::Link;
use super::meter::Meter;
use crate::route::{Route, RoutePoint};

/// A handle: the front hinge of the bench of the same index, or the tail's rear hinge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Handle {
    /// Parameter on the route.
    pub parameter: f64,
    /// Position in the plan, in metres.
    pub position: DVec2,
    /// The part in the plan of the unit vector in the direction of motion; the whole of it on level ground.
    pub tangent: DVec2,
    /// Speed of the handle divided by the speed of the head.
    pub speed_ratio: f64,
    /// Height in metres; 0 without ground.
    pub height_m: f64,
    /// The upward part of the unit vector in the direction of motion; 0 on level ground.
    pub climb: f64,
}

impl Handle {
    /// A handle at a point of the route.
    pub(crate) fn new(parameter: f64, point: RoutePoint, speed_ratio: f64) -> Self {
        let RoutePoint { position, tangent, height_m, climb, .. } = point;
        Self { parameter, position, tangent, speed_ratio, height_m, climb }
    }

    /// A handle whose parameter is not known. It has a position, and moves at a velocity relative to the head's speed.
    pub(crate) fn moving(position_m: DVec3, velocity: DVec3) -> Self {
        let speed_ratio = velocity.length();
        let direction = velocity / speed_ratio;
        Self {
            parameter: f64::NAN,
            position: position_m.truncate(),
            tangent: direction.truncate(),
            speed_ratio,
            height_m: position_m.z,
            climb: direction.z,
        }
    }

    /// Position in space, in metres.
    pub fn in_space(&self) -> DVec3 {
        self.position.extend(self.height_m)
    }
}

/// Error: the travel is not feasible.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error("travel_m is {travel_m}, must be from {start_travel_m} to {end_travel_m}, where the run ends")]
pub struct TravelOutOfRange {
    /// The requested travel.
    pub travel_m: f64,
    /// Beginning of the feasible travel.
    pub start_travel_m: f64,
    /// End of the feasible travel.
    pub end_travel_m: f64,
}

/// Iterator over the handles of a dragon at one travel, from the head backwards. It solves each handle on request and allocates
/// nothing.
#[derive(Clone, Debug)]
pub struct Chain<'a> {
    route: &'a Route,
    dimensions: &'a Dimensions,
    meter: &'a Meter,
    /// The last handle returned, or the head before the first call; `None` if the chain has ended early.
    last: Option<(f64, RoutePoint, f64)>,
    handed_out: usize,
}

impl<'a> Chain<'a> {
    /// A chain with its head at a parameter, whether or not a dragon can walk there. It ends before the first link that finds
    /// no rear handle on the route.
    pub(crate) fn new(route: &'a Route, dimensions: &'a Dimensions, meter: &'a Meter, parameter: f64) -> Self {
        Self { route, dimensions, meter, last: Some((parameter, route.point(parameter), 1.0)), handed_out: 0 }
    }

    /// The rest of a chain, behind the handle of this index.
    pub(crate) fn behind(
        route: &'a Route,
        dimensions: &'a Dimensions,
        meter: &'a Meter,
        index: usize,
        handle: &Handle,
    ) -> Self {
        let last = Some((handle.parameter, route.point(handle.parameter), handle.speed_ratio));
        Self { route, dimensions, meter, last, handed_out: index + 1 }
    }

    fn follow_link(&self) -> Option<(f64, RoutePoint, f64)> {
        let (parameter, front, speed_ratio) = self.last?;
        let length_m = self.dimensions.link_m(self.handed_out - 1);
        let rear = Link { route: self.route, front, length_m, meter: self.meter }.rear(parameter)?;
        Some((rear.parameter, rear.point, speed_ratio * rear.speed_ratio()))
    }
}

impl Iterator for Chain<'_> {
    type Item = Handle;

    fn next(&mut self) -> Option<Handle> {
        if self.handed_out == self.dimensions.handles() {
            return None;
        }
        if self.handed_out > 0 {
            self.last = self.follow_link();
        }
        let (parameter, point, speed_ratio) = self.last?;
        self.handed_out += 1;
        Some(Handle::new(parameter, point, speed_ratio))
    }
}

/// Solves the chain into a reused buffer.
///
/// A solution depends only on the travel, not on earlier solutions. Every link has its length to about 10⁻¹³ m. No call
/// allocates for dragons with no more benches than the dragon passed to [`new`](Self::new).
#[derive(Clone, Debug)]
pub struct ChainSolver {
    handles: Vec<Handle>,
}

impl ChainSolver {
    /// A solver with space for the handles of `dragon`.
    pub fn new(dragon: &Dragon) -> Self {
        Self { handles: Vec::with_capacity(dragon.dimensions().handles()) }
    }

    /// The handles with the head at `travel_m`, head first.
    ///
    /// # Errors
    /// The travel must be feasible.
    ///
    /// # Panics
    /// Panics if a link has no solution at a feasible travel, which [`Dragon::new`] rules out.
    pub fn solve(&mut self, dragon: &Dragon, travel_m: f64) -> Result<&[Handle], TravelOutOfRange> {
        let chain = dragon.chain(travel_m)?;
        self.handles.clear();
        self.handles.extend(chain);
        assert_eq!(self.handles.len(), dragon.dimensions().handles(), "every link meets the route at feasible travels");
        Ok(&self.handles)
    }
}
