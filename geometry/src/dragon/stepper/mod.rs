//! Steps the chain from one tick to the next, or from one pose of a search to the next. It takes about fifty instructions a handle,
//! where the reference solver searches.
//!
//! Between two ticks every handle moves little and smoothly. So each handle is extrapolated by its last rates. One step of
//! Newton's method on the whole chain then corrects the rest, in vectors of four handles. The system of equations is
//! bidiagonal: a handle's correction is its own error plus a multiple of the correction of the handle ahead. The same multiples
//! are the ratios of the handles' rates, so the speeds follow without further work.
//!
//! The reference solver ([`ChainSolver`](super::ChainSolver)) is the standard for the result. It also takes over where a step
//! is impossible: at the first pose, after a jump, where a handle nearly stops, and on a segment without vector pieces.

#![allow(clippy::inline_always, reason = "a function that is not inlined loses the vector instructions of its caller")]

mod heights;
mod instructions;
mod lanes;
mod pass;
mod places;
mod scratch;
mod section;

use std::sync::Arc;

use glam::DVec3;

use super::Dragon;
use super::chain::{Handle, TravelOutOfRange};
use super::dimensions::Dimensions;
use crate::route::{Kernel, PlanPiece, Route};

pub use instructions::Instructions;

use lanes::{HANDLES, index};
use pass::{Pass, Way};
use scratch::{Ahead, Links, Scratch};
use section::{Section, Step};

/// Longest step, forward or back, as a share of the shortest link, that the stepper takes. After a longer one it solves the chain again.
///
/// In such a step a handle moves far less than the distance between two parameters at the same distance from the handle ahead.
/// So the stepper stays on the solution that is the chain.
const LONGEST_STEP: f64 = 1.0 / 16.0;
/// Rounding of a step, as a share of it.
const STEP_ROUNDING: f64 = 1e-9;
/// Most steps of a walk. As many take about as long as a chain that is solved.
const MOST_STEPS: f64 = 16.0;
/// Work for a handle of a chain that is solved, in steps of work.
const WORK_OF_CHAIN: usize = 4;
/// Steps of the stepper for a handle that take as long as its record.
const STEPS_OF_RECORD: usize = 4;
/// Steps of the stepper for a handle that take as long as a step of work.
const STEPS_PER_WORK: usize = 8;
/// Speed of a handle, as a share of the head's, up to which its direction is not taken from its velocity.
const LEAST_RATIO: f64 = 1e-6;
/// Longest step, as a multiple of the step before, over which the change of a rate is extrapolated. A longer step would amplify
/// the rounding of that change.
const LONGEST_EXTRAPOLATION: f64 = 8.0;
/// Largest corrections of a section, beyond rounding, after which no others follow, as a share of the shortest link. The
/// remaining error is of the order of their square. The error of the velocities is of the order of the corrections.
const LAST_CORRECTION: f64 = 1e-10;
/// Corrections caused by rounding, in units of a parameter's rounding.
const ROUNDINGS: f64 = 4.0;
/// Largest corrections of a section after which others follow, as a share of the shortest link.
const LARGEST_CORRECTION: f64 = 1.0 / 64.0;

/// Advances a dragon from travel to travel, in steps that are short compared to its links.
///
/// Stepped poses differ from those of the reference solver only by rounding: about 10⁻¹² m for the paper's dragon. The last
/// bits may depend on the sequence of travels. The same sequence gives the same bits on the same machine. No call allocates.
#[derive(Clone, Debug)]
pub struct ChainStepper {
    dragon: Arc<Dragon>,
    instructions: Instructions,
    kernels: Vec<Kernel>,
    /// The dragon's dimensions, with as many benches as fill whole sections. Benches past the tail are calculated but not
    /// returned.
    dimensions: Dimensions,
    links: Box<[Links; 2]>,
    sections: Vec<Section>,
    scratch: Box<Scratch>,
    last: Option<Last>,
}

/// The route, with its segments as kernels.
#[derive(Clone, Copy, Debug)]
struct Curve<'a> {
    route: &'a Route,
    kernels: &'a [Kernel],
}

impl Curve<'_> {
    /// The piece of the route at a parameter, which is not NaN, within an interval. `None` on a segment without pieces.
    fn piece_at(&self, parameter: f64, [begin, end]: [f64; 2]) -> Option<PlanPiece> {
        let number = self.kernels.partition_point(|kernel| kernel.begin <= parameter).max(1);
        let end = self.kernels.get(number).map_or(end, |next| next.begin.min(end));
        self.kernels.get(number - 1)?.piece(parameter, [begin, end])
    }
}

/// State of the head at the last pose.
#[derive(Clone, Copy, Debug)]
struct Last {
    travel_m: f64,
    parameter: f64,
    rate: f64,
    /// Length of the step that led there; `None` if the pose was solved by the reference solver.
    step_m: Option<f64>,
}

impl ChainStepper {
    /// A stepper that uses the best instructions of this machine.
    pub fn new(dragon: Arc<Dragon>) -> Self {
        Self::with_instructions(dragon, Instructions::best())
    }

    /// A stepper that uses the given instructions.
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

    /// The dragon that the stepper advances.
    pub fn dragon(&self) -> &Dragon {
        &self.dragon
    }

    /// Moves the head to `travel_m` and writes one record per handle, head first. The velocities are those for a head speed of
    /// `speed_mps`. `record` creates a record from a position in metres and a velocity in metres per second.
    ///
    /// # Errors
    /// The travel must be feasible.
    ///
    /// # Panics
    /// Panics if the number of records differs from the number of handles.
    pub fn step<H>(
        &mut self,
        travel_m: f64,
        speed_mps: f64,
        records: &mut [H],
        record: impl Fn(DVec3, DVec3) -> H,
    ) -> Result<(), TravelOutOfRange> {
        assert_eq!(records.len(), self.dragon.dimensions().handles(), "one record for each handle");
        self.dragon.require_travel(travel_m)?;
        let route = self.dragon.route();
        let (way, parameter) = self.way_to(travel_m);
        let point = route.point(parameter);
        let rate = 1.0 / point.speed_m_per_unit;
        let head = Ahead {
            parameter,
            position_m: point.position.extend(point.height_m).into(),
            tangent_m: (point.tangent.extend(point.climb) * point.speed_m_per_unit).into(),
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

    /// Moves the head to a feasible travel, forward or back, in as few steps as their longest length allows. If they were too many, it
    /// solves the chain there. Replaces `handles` by the handles there. The dragon's meter counts the work.
    pub(crate) fn place(&mut self, travel_m: f64, handles: &mut Vec<Handle>) {
        self.walk_near(travel_m);
        handles.clear();
        handles.resize(self.dragon.dimensions().handles(), Handle::moving(DVec3::ZERO, DVec3::ZERO));
        self.step(travel_m, 1.0, handles, Handle::moving).expect("the travel is feasible");
        let behind = self.sections.iter().flat_map(|section| section.places().map(|[parameter, _]| parameter));
        let parameters = self.last.iter().map(|last| last.parameter).chain(behind);
        for (handle, parameter) in handles.iter_mut().zip(parameters) {
            handle.parameter = parameter;
        }
        // The direction of a handle that stops is not that of its velocity.
        if handles.iter().any(|handle| handle.speed_ratio <= LEAST_RATIO) {
            handles.clear();
            handles.extend(self.dragon.chain(travel_m).expect("the travel is feasible"));
        }
    }

    /// The same, with the two handles of a bench as the result.
    pub(crate) fn bench_at(&mut self, travel_m: f64, bench: usize) -> [Handle; 2] {
        self.walk_near(travel_m);
        let count = self.dragon.dimensions().handles();
        self.step(travel_m, 1.0, &mut vec![(); count], |_, _| ()).expect("the travel is feasible");
        [bench, bench + 1].map(|number| self.handle(number))
    }

    /// Whether [`place`](Self::place) would step to a travel.
    pub(crate) fn is_near(&self, travel_m: f64) -> bool {
        self.steps_to(travel_m).is_some()
    }

    /// A handle at the last pose.
    fn handle(&self, number: usize) -> Handle {
        let head = self.last.expect("there is a last pose");
        let [parameter, rate] = match number.checked_sub(1) {
            None => [head.parameter, head.rate],
            Some(behind) => self.sections[behind / HANDLES].place_of(behind % HANDLES),
        };
        let point = self.dragon.route().point(parameter);
        Handle::new(parameter, point, rate * point.speed_m_per_unit)
    }

    /// Takes all but the last one of the steps to a travel, if they are not too many. Counts the work of all.
    fn walk_near(&mut self, travel_m: f64) {
        let count = self.dragon.dimensions().handles();
        let (Some(from), Some(steps)) = (self.last, self.steps_to(travel_m)) else {
            return self.dragon.meter().add((WORK_OF_CHAIN * count) as u64);
        };
        self.dragon.meter().add(((steps + STEPS_OF_RECORD) * count / STEPS_PER_WORK) as u64);
        for step in 1..steps {
            let between_m = from.travel_m + (travel_m - from.travel_m) * (step as f64 / steps as f64);
            self.step(between_m, 1.0, &mut vec![(); count], |_, _| ()).expect("it is between feasible travels");
        }
    }

    /// Number of steps of at most the longest length to a travel; `None` if they are too many, or if no pose is known.
    fn steps_to(&self, travel_m: f64) -> Option<usize> {
        let distance_m = (travel_m - self.last?.travel_m).abs();
        let steps = (distance_m / (LONGEST_STEP * shortest_link_m(&self.dimensions)) * (1.0 - STEP_ROUNDING)).ceil();
        (steps <= MOST_STEPS).then_some(steps as usize)
    }

    /// How the pass reaches a travel from the last pose, and the head's parameter at that travel.
    fn way_to(&self, travel_m: f64) -> (Way, f64) {
        let route = self.dragon.route();
        let Some(last) = self.last else { return (Way::Afresh, route.parameter(travel_m)) };
        let step_m = travel_m - last.travel_m;
        if step_m == 0.0 {
            return (Way::Stand, last.parameter);
        }
        if step_m.abs() > (1.0 + STEP_ROUNDING) * LONGEST_STEP * shortest_link_m(&self.dimensions) {
            return (Way::Afresh, route.parameter(travel_m));
        }
        let bend_m = last
            .step_m
            .filter(|&last_step_m| step_m.abs() <= LONGEST_EXTRAPOLATION * last_step_m.abs())
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

/// The constants of the links in the section behind the handle of this index.
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

/// Largest rounding of a parameter, in metres: at the tail at the beginning of the feasible travel, or at the head at its end.
fn rounding_m(dragon: &Dragon, dimensions: &Dimensions) -> f64 {
    let route = dragon.route();
    let body_m: f64 = dimensions.link_m(0) + (dimensions.benches() - 1) as f64 * dimensions.link_m(1);
    let ends = [dragon.start_travel_m() - body_m, dragon.end_travel_m()].map(|travel_m| route.parameter(travel_m));
    ends.map(|parameter| route.rounding_m(parameter, route.point(parameter).speed_m_per_unit))
        .into_iter()
        .fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use test_support::property::random_cases;

    use super::*;
    use crate::dragon::ChainSolver;
    use crate::route::Turnaround;

    /// A dragon of 70 benches, which fill more than a section, on a turnaround.
    fn dragons() -> impl Strategy<Value = Dragon> {
        let turnarounds = (0.6..2.0_f64, 5.0..10.0_f64, 0.5..2.0_f64);
        turnarounds.prop_filter_map("no dragon walks there", |(pitch_m, diameter_m, ratio)| {
            let turnaround = Turnaround::new(pitch_m, diameter_m, ratio).ok()?;
            let dimensions = Dimensions::new(70, 3.41, 2.20, 0.30, 0.275).ok()?;
            Dragon::new(dimensions, Arc::new(turnaround.between(-30.0, 100.0).ok()?.route())).ok()
        })
    }

    proptest! {
        #![proptest_config(random_cases(64))]

        /// Short and long ways, forward and back, and jumps.
        #[test]
        fn places_of_a_walk_are_those_of_the_reference_solver(
            dragon in dragons(), ways in prop::collection::vec((0..4_u32, -1.0..1.0_f64, 0..70_usize), 1..40),
        ) {
            let (start_m, end_m) = (dragon.start_travel_m(), dragon.end_travel_m());
            let mut stepper = ChainStepper::new(Arc::new(dragon.clone()));
            let mut travel_m = 0.5 * (start_m + end_m);
            let mut handles = Vec::new();
            for (kind, way, bench) in ways {
                let longest_m = [1e-6, 0.05, 2.5, end_m - start_m][kind as usize];
                travel_m = (travel_m + way * longest_m).clamp(start_m, end_m);
                let solved: Vec<Handle> = dragon.chain(travel_m).expect("within the run").collect();
                // The bounds are those of `tests/stepper.rs`, without the rounding of a spiral that is far out.
                let differs = |found: &Handle, solved: &Handle| {
                    let off_m = found.in_space().distance(solved.in_space());
                    let [one, other] = [found, solved].map(|handle| handle.tangent * handle.speed_ratio);
                    let off = one.distance(other).max((found.speed_ratio - solved.speed_ratio).abs());
                    let walked_m = (dragon.route().travel(found.parameter) - dragon.route().travel(solved.parameter)).abs();
                    off_m.max(walked_m) > 1e-10 || off > 1e-8
                };
                if bench % 2 == 0 {
                    stepper.place(travel_m, &mut handles);
                    prop_assert_eq!(handles.len(), solved.len());
                    let first = handles.iter().zip(&solved).find(|(found, solved)| differs(found, solved));
                    prop_assert!(first.is_none(), "at {travel_m} m: {first:?}");
                } else {
                    let found = stepper.bench_at(travel_m, bench);
                    let is_same = found.iter().zip(&solved[bench..]).all(|(found, solved)| !differs(found, solved));
                    prop_assert!(is_same, "bench {bench} at {travel_m} m: {found:?}, {:?}", &solved[bench..bench + 2]);
                }
            }
        }
    }

    /// A segment without pieces is a kind whose points need more than a centre and a radius.
    #[test]
    fn on_segments_without_pieces_the_stepper_has_the_poses_of_the_reference_solver() {
        let dimensions = Dimensions::new(40, 3.41, 2.20, 0.30, 0.275).expect("the paper's benches are valid");
        let route = Arc::new(Route::spiral(0.55, 16.0).expect("the paper's spiral is valid"));
        let dragon = Arc::new(Dragon::new(dimensions, route).expect("the dragon stands on the spiral"));
        let (mut stepper, mut solver) = (ChainStepper::new(Arc::clone(&dragon)), ChainSolver::new(&dragon));
        stepper.kernels.clear();
        let mut positions = vec![DVec3::ZERO; dragon.dimensions().handles()];
        for travel_m in [0.0, 0.01, 0.02, 0.02, 5.0] {
            stepper.step(travel_m, 1.0, &mut positions, |position, _| position).expect("within the run");
            let solved = solver.solve(&dragon, travel_m).expect("within the run");
            for (position, handle) in positions.iter().zip(solved) {
                assert!(
                    position.truncate().distance(handle.position) < 1e-12,
                    "at {travel_m} m: {position}, {handle:?}"
                );
            }
        }
    }
}
