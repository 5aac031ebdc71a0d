//! The chain from one tick to the next: the work of some fifty instructions a handle, where the reference solver searches.
//!
//! Between two ticks every handle moves little and smoothly. So each one is put where its last rates take it, and one
//! step of Newton's method on the whole chain makes good what is lacking, in vectors of four handles. The chain is
//! bidiagonal: a handle's correction is one of its own and a share of that of the handle ahead. The shares are the ratios
//! of the handles' rates too, so speeds come with it.
//!
//! The reference solver ([`ChainSolver`](super::ChainSolver)) is what the result is held against, and what takes over
//! where a step cannot be made: at the first pose, after a jump, and where a handle comes close to a stop.

#![allow(clippy::inline_always, reason = "what is not inlined is compiled for fewer instructions than its caller")]

mod instructions;
mod lanes;
mod pass;
mod scratch;
mod section;

use std::sync::Arc;

use glam::DVec2;

use super::Dragon;
use super::chain::TravelOutOfRange;
use super::dimensions::Dimensions;
use crate::route::{Kernel, Route};

pub use instructions::Instructions;

use lanes::{HANDLES, index};
use pass::{Pass, Way};
use scratch::{Ahead, Links, Scratch};
use section::{Section, Step};

/// Longest step, in shares of the shortest link, that is followed; a longer one is solved afresh.
///
/// Within such a step a handle moves by far less than what lies between two parameters at the same distance from the handle
/// ahead, so that what is followed is the chain, and not another solution.
const LONGEST_STEP: f64 = 1.0 / 16.0;
/// Longest step, in shares of the one before, over which the change of a rate is extrapolated: over a longer one its
/// rounding would be.
const LONGEST_EXTRAPOLATION: f64 = 8.0;
/// Share of the shortest link that the corrections of a section may come to, beyond rounding, for them to be the last:
/// their own error goes with their square, and that of the velocities is of their order.
const LAST_CORRECTION: f64 = 1e-10;
/// Corrections that rounding makes of a parameter, in units of the parameter's rounding.
const ROUNDINGS: f64 = 4.0;
/// The same for them to be followed by others.
const LARGEST_CORRECTION: f64 = 1.0 / 64.0;

/// Follows a dragon from travel to travel, in steps that are small against its links.
///
/// A pose differs from that of the reference solver by rounding alone: some 10⁻¹² m for the paper's dragon. Which way it
/// was come by may change its last bits; the same way gives the same bits on the same machine. No call allocates.
#[derive(Debug)]
pub struct ChainStepper {
    dragon: Arc<Dragon>,
    instructions: Instructions,
    kernels: Vec<Kernel>,
    /// With as many benches as fill whole sections: those past the tail are followed, and shown to nobody.
    dimensions: Dimensions,
    links: Box<[Links; 2]>,
    sections: Vec<Section>,
    scratch: Box<Scratch>,
    last: Option<Last>,
}

/// The route as a step sees it.
#[derive(Clone, Copy, Debug)]
struct Curve<'a> {
    route: &'a Route,
    kernels: &'a [Kernel],
}

impl Curve<'_> {
    /// The number of the segment on which a parameter lies; none where it is not a number.
    #[inline(always)]
    fn segment_at(&self, parameter: f64) -> Option<usize> {
        self.kernels.iter().rposition(|kernel| kernel.begin() <= parameter)
    }
}

/// Where the head stood last.
#[derive(Clone, Copy, Debug)]
struct Last {
    travel_m: f64,
    parameter: f64,
    rate: f64,
    /// How it came there, where by a step.
    step_m: Option<f64>,
}

impl ChainStepper {
    /// A stepper that uses the best instructions of this machine.
    pub fn new(dragon: Arc<Dragon>) -> Self {
        Self::with_instructions(dragon, Instructions::best())
    }

    /// A stepper that uses these instructions.
    pub fn with_instructions(dragon: Arc<Dragon>, instructions: Instructions) -> Self {
        let sections = dragon.dimensions().benches().div_ceil(HANDLES);
        let dimensions = dragon.dimensions().with_benches(sections * HANDLES);
        let rounding_m = rounding_m(&dragon, &dimensions);
        Self {
            instructions,
            kernels: dragon.route().kernels(),
            links: Box::new([0, HANDLES].map(|first| links(&dimensions, first, rounding_m))),
            dimensions,
            sections: vec![Section::new(); sections],
            scratch: Box::new(Scratch::new()),
            last: None,
            dragon,
        }
    }

    /// The dragon that is followed.
    pub fn dragon(&self) -> &Dragon {
        &self.dragon
    }

    /// Puts the head at `travel_m` and writes a record of each handle, head first, with the velocities that belong to a
    /// head of `speed_mps`. `record` makes one of a position in metres and a velocity in metres per second, in its place.
    ///
    /// # Errors
    /// The travel must lie within the dragon's run.
    ///
    /// # Panics
    /// If there is not one record for each handle.
    pub fn step<H>(
        &mut self,
        travel_m: f64,
        speed_mps: f64,
        records: &mut [H],
        record: impl Fn(DVec2, DVec2) -> H,
    ) -> Result<(), TravelOutOfRange> {
        assert_eq!(records.len(), self.dragon.dimensions().handles(), "one record for each handle");
        self.dragon.require_travel(travel_m)?;
        let route = self.dragon.route();
        let (way, parameter) = self.way_to(travel_m);
        let point = route.point(parameter);
        let rate = 1.0 / point.speed_m_per_unit;
        let head = Ahead {
            parameter,
            position_m: point.position.into(),
            tangent_m: (point.tangent * point.speed_m_per_unit).into(),
            rate,
        };
        self.instructions.run(Pass {
            curve: Curve { route, kernels: &self.kernels },
            dimensions: &self.dimensions,
            links: &self.links,
            sections: &mut self.sections,
            scratch: &mut self.scratch,
            way,
            head,
            speed_mps,
            records,
            record,
        });
        self.last = Some(self.next_last(travel_m, parameter, rate, way));
        Ok(())
    }

    /// How the head comes to a travel, and the parameter where it stands then.
    fn way_to(&self, travel_m: f64) -> (Way, f64) {
        let route = self.dragon.route();
        let Some(last) = self.last else { return (Way::Afresh, route.parameter(travel_m)) };
        let step_m = travel_m - last.travel_m;
        if step_m == 0.0 {
            return (Way::Stand, last.parameter);
        }
        if !(step_m > 0.0 && step_m <= LONGEST_STEP * shortest_link_m(&self.dimensions)) {
            return (Way::Afresh, route.parameter(travel_m));
        }
        let bend_m = last
            .step_m
            .filter(|&last_step_m| step_m <= LONGEST_EXTRAPOLATION * last_step_m)
            .map_or(0.0, |last_step_m| 0.5 * step_m * step_m / last_step_m);
        (Way::Walk(Step { step_m, bend_m }), route.parameter_near(travel_m, last.parameter + step_m * last.rate))
    }

    fn next_last(&self, travel_m: f64, parameter: f64, rate: f64, way: Way) -> Last {
        let step_m = match way {
            Way::Stand => self.last.and_then(|last| last.step_m),
            Way::Walk(step) => Some(step.step_m),
            Way::Afresh => None,
        };
        Last { travel_m, parameter, rate, step_m }
    }
}

fn shortest_link_m(dimensions: &Dimensions) -> f64 {
    dimensions.link_m(0).min(dimensions.link_m(1))
}

/// The links of the section behind the handle of this index.
fn links(dimensions: &Dimensions, first: usize, rounding_m: f64) -> Links {
    let shortest_m = shortest_link_m(dimensions);
    let mut squares = [0.0; HANDLES];
    for i in 0..HANDLES {
        squares[index(i)] = dimensions.link_m(first + i).powi(2);
    }
    Links {
        squares,
        exact_m2: (LAST_CORRECTION * shortest_m).powi(2) + HANDLES as f64 * (ROUNDINGS * rounding_m).powi(2),
        far_m2: (LARGEST_CORRECTION * shortest_m).powi(2),
    }
}

/// What rounding makes of a parameter at most: at the tail as the run begins, or at the head as it ends.
fn rounding_m(dragon: &Dragon, dimensions: &Dimensions) -> f64 {
    let route = dragon.route();
    let body_m: f64 = dimensions.link_m(0) + (dimensions.benches() - 1) as f64 * dimensions.link_m(1);
    let ends = [dragon.start_travel_m() - body_m, dragon.end_travel_m()].map(|travel_m| route.parameter(travel_m));
    ends.map(|parameter| route.rounding_m(parameter, route.point(parameter).speed_m_per_unit))
        .into_iter()
        .fold(0.0, f64::max)
}
