//! The chain followed in steps, compared with the chain solved at every travel.

use std::sync::Arc;

use bench_dragon_geometry::dragon::{ChainSolver, ChainStepper, Dimensions, Dragon, Instructions};
use bench_dragon_geometry::route::{Route, Turnaround};
use glam::DVec3;
use proptest::prelude::*;
use test_support::dragons::{paper_benches, paper_dragon, turning_dragon};
use test_support::property::random_cases;

/// A handle in the record of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Record {
    position_m: DVec3,
    velocity_mps: DVec3,
}

impl Record {
    fn new(position_m: DVec3, velocity_mps: DVec3) -> Self {
        Self { position_m, velocity_mps }
    }
}

/// A stepper, and the solver that checks it.
struct Comparison {
    dragon: Arc<Dragon>,
    stepper: ChainStepper,
    solver: ChainSolver,
    records: Vec<Record>,
    /// Bound on the displacement of a point by the route's own rounding, in metres.
    rounding_m: f64,
}

impl Comparison {
    fn new(dragon: Dragon, instructions: Instructions) -> Self {
        let dragon = Arc::new(dragon);
        let tail = ChainSolver::new(&dragon).solve(&dragon, dragon.start_travel_m()).expect("the start")
            [dragon.dimensions().benches()];
        let speed_m_per_unit = dragon.route().point(tail.parameter).speed_m_per_unit;
        Self {
            stepper: ChainStepper::with_instructions(Arc::clone(&dragon), instructions),
            solver: ChainSolver::new(&dragon),
            records: vec![Record::default(); dragon.dimensions().handles()],
            rounding_m: dragon.route().rounding_m(tail.parameter, speed_m_per_unit),
            dragon,
        }
    }

    fn step(&mut self, travel_m: f64) {
        self.stepper.step(travel_m, 1.0, &mut self.records, Record::new).expect("within the run");
    }

    /// Steps, and returns the largest errors of position and velocity.
    fn step_and_compare(&mut self, travel_m: f64) -> (f64, f64) {
        self.step(travel_m);
        let exact = self.solver.solve(&self.dragon, travel_m).expect("within the run");
        let errors = self.records.iter().zip(exact).map(|(record, handle)| {
            let velocity_mps = handle.tangent.extend(handle.climb) * handle.speed_ratio;
            (record.position_m.distance(handle.in_space()), record.velocity_mps.distance(velocity_mps))
        });
        errors.fold((0.0, 0.0), |worst, error| (worst.0.max(error.0), worst.1.max(error.1)))
    }

    /// # Panics
    /// Panics if a position differs by more than 10⁻¹⁰ m plus the rounding of all links, or a velocity by more than 10⁻⁸ of the
    /// head's speed.
    fn step_exactly(&mut self, travel_m: f64) {
        let (position_m, velocity_mps) = self.step_and_compare(travel_m);
        let benches = self.records.len() as f64;
        assert!(position_m <= 1e-10 + benches * self.rounding_m, "{travel_m} m: off by {position_m} m");
        assert!(velocity_mps <= 1e-8, "{travel_m} m: off by {velocity_mps} m/s");
    }
}

/// Steps through a whole run. Checks every `look`-th pose and the last hundred.
fn walk(dragon: Dragon, instructions: Instructions, step_m: f64, look: u32) {
    let mut comparison = Comparison::new(dragon, instructions);
    let (start_m, end_m) = (comparison.dragon.start_travel_m(), comparison.dragon.end_travel_m());
    let steps = ((end_m - start_m) / step_m) as u32;
    for step in 0..=steps {
        let travel_m = start_m + f64::from(step) * step_m;
        if step % look == 0 || step + 100 > steps {
            comparison.step_exactly(travel_m);
        } else {
            comparison.step(travel_m);
        }
    }
    comparison.step_exactly(end_m);
}

#[test]
fn the_papers_whole_run_equals_the_reference_solver() {
    walk(paper_dragon(), Instructions::best(), 1e-3, 211);
    walk(paper_dragon(), Instructions::portable(), 2e-2, 11);
}

#[test]
fn the_papers_whole_turnaround_equals_the_reference_solver() {
    walk(turning_dragon(), Instructions::best(), 1e-3, 101);
    walk(turning_dragon(), Instructions::portable(), 2e-2, 7);
}

/// Checks every pose while the head, and later each handle, passes from the spiral to an arc, to the other arc, and out.
#[test]
fn poses_stay_exact_while_handles_cross_the_seams_of_a_turnaround() {
    let mut comparison = Comparison::new(turning_dragon(), Instructions::best());
    let dragon = Arc::clone(&comparison.dragon);
    for seam_m in dragon.route().seams().iter().map(|&seam| dragon.route().travel(seam)) {
        for step in -300..3000 {
            comparison.step_exactly(seam_m + f64::from(step) * 1e-3);
        }
    }
}

#[test]
fn a_hundred_thousand_benches_differ_only_by_rounding() {
    let spiral = Route::spiral(0.55, 16.0).expect("the paper's spiral is valid");
    let dragon = Dragon::new(paper_benches(100_000), Arc::new(spiral)).expect("the dragon stands");
    let mut comparison = Comparison::new(dragon, Instructions::best());
    for step in 0..200 {
        comparison.step(f64::from(step) * 1e-3);
    }
    let (position_m, velocity_mps) = comparison.step_and_compare(0.2);
    // The rounding errors of the links are independent, in the stepper and in the solver.
    let rounding_m = 100_000.0_f64.sqrt() * comparison.rounding_m;
    assert!(position_m < 3.0 * rounding_m && velocity_mps < 1e-9, "off by {position_m} m, {velocity_mps} m/s");
}

#[test]
fn a_dragon_that_stands_does_not_move() {
    let mut comparison = Comparison::new(paper_dragon(), Instructions::best());
    (0..50).for_each(|step| comparison.step(100.0 + f64::from(step) * 1e-3));
    comparison.step_exactly(100.049);
    comparison.step_exactly(100.049);
    let stood = comparison.records.clone();
    (0..50).for_each(|_| comparison.step_exactly(100.049));
    assert_eq!(comparison.records, stood);
    comparison.step_exactly(200.0);
    let stood = comparison.records.clone();
    comparison.step_exactly(200.0);
    assert_eq!(comparison.records, stood);
    comparison.step_exactly(100.05);
    (0..50).for_each(|step| comparison.step_exactly(100.05 + f64::from(step) * 1e-3));
}

#[test]
fn a_travel_beyond_the_run_is_rejected_and_changes_nothing() {
    let mut comparison = Comparison::new(paper_dragon(), Instructions::best());
    comparison.step_exactly(400.0);
    let stood = comparison.records.clone();
    for travel_m in [-0.1, 1e6, f64::NAN] {
        assert!(comparison.stepper.step(travel_m, 1.0, &mut comparison.records, Record::new).is_err(), "{travel_m}");
    }
    assert_eq!(comparison.records, stood);
    comparison.step_exactly(400.001);
}

/// Dragons on spirals and turnarounds, with up to a few sections.
fn dragons() -> impl Strategy<Value = Dragon> {
    let benches = (1_usize..150, 0.5..4.0_f64, 0.5..4.0_f64, 0.05..0.5_f64, 0.0..0.4_f64);
    let routes = (any::<bool>(), 1.02..5.0_f64, 2.0..20.0_f64, 0.3..3.0_f64);
    (benches, routes).prop_filter_map("cannot stand", |((count, head_m, body_m, width_m, hole), route)| {
        let hole_offset_m = hole * head_m.min(body_m);
        let dimensions = Dimensions::new(count, head_m, body_m, width_m, hole_offset_m).ok()?;
        let (turns_round, pitch, size, ratio) = route;
        let route: Arc<Route> = if turns_round {
            Arc::new(Turnaround::new(4.0 * pitch * width_m, size, ratio).ok()?.route())
        } else {
            Arc::new(Route::spiral(pitch * width_m, size).ok()?)
        };
        Dragon::new(dimensions, route).ok()
    })
}

/// Move of the head from one pose to the next.
#[derive(Clone, Copy, Debug)]
enum Move {
    Walk { step_m: f64, steps: u32 },
    Stand,
    Jump { part: f64 },
}

fn moves() -> impl Strategy<Value = Move> {
    prop_oneof![
        4 => (-14.0..-0.7_f64, 1_u32..60).prop_map(|(power, steps)| Move::Walk { step_m: 10_f64.powf(power), steps }),
        4 => (1e-4..0.2_f64, 1_u32..60).prop_map(|(step_m, steps)| Move::Walk { step_m, steps }),
        1 => Just(Move::Stand),
        1 => (0.0..=1.0_f64).prop_map(|part| Move::Jump { part }),
    ]
}

proptest! {
    #![proptest_config(random_cases(96))]

    #[test]
    fn every_pose_of_every_dragon_equals_the_reference_solver(
        dragon in dragons(),
        start in 0.0..=1.0_f64,
        moves in prop::collection::vec(moves(), 1..12),
        portable in any::<bool>(),
    ) {
        let (start_m, end_m) = (dragon.start_travel_m(), dragon.end_travel_m());
        let instructions = if portable { Instructions::portable() } else { Instructions::best() };
        let mut comparison = Comparison::new(dragon, instructions);
        let mut travel_m = start_m + start * (end_m - start_m);
        comparison.step_exactly(travel_m);
        for next in moves {
            match next {
                Move::Walk { step_m, steps } => {
                    for _ in 0..steps {
                        travel_m = (travel_m + step_m).min(end_m);
                        comparison.step_exactly(travel_m);
                    }
                }
                Move::Stand => comparison.step_exactly(travel_m),
                Move::Jump { part } => {
                    travel_m = start_m + part * (end_m - start_m);
                    comparison.step_exactly(travel_m);
                }
            }
        }
    }
}
