//! Measures one tick: from the head's travel to the whole frame of positions and velocities. The dragons are the paper's, the
//! same on a turnaround, a path and a drawing, and one of 100,000 benches. First, the poses of the whole run are
//! compared with the reference solver.

mod shared;

use std::hint::black_box;
use std::sync::Arc;

use bench_dragon_geometry::dragon::{ChainSolver, ChainStepper, Dragon, Instructions};
use bench_dragon_geometry::route::Turnaround;
use test_support::dragons::{dragon_on, paper_benches, paper_dragon, paper_dragon_of};

use shared::{Figures, HandleState, interleaved, median, nanoseconds_a_call};

/// Step of the head in metres: 1 kHz at 1 m/s.
const STEP_M: f64 = 1e-3;
/// Largest allowed error of a position, in metres.
const TOLERANCE_M: f64 = 1e-9;
/// Ticks between two comparisons with the reference solver. The number makes the comparisons meet all phases of a link.
const LOOK: u32 = 37;

fn main() {
    shared::require_no_arguments();
    let mut figures = Figures::of("step");
    let paper = Arc::new(paper_dragon());
    let turn = Turnaround::new(1.7, 9.0, 2.0).expect("the paper's turnaround is valid");
    let turn = Arc::new(dragon_on(turn.route(), paper_benches(223)));
    let large = Arc::new(paper_dragon_of(100_000));
    figures.set("instructions", Instructions::best().name());

    let [path, drawing, hills] = [shared::mixed(), shared::winding(300), shared::on_hills()]
        .map(|route| Arc::new(dragon_on(route, paper_benches(223))));
    let errors = [&paper, &turn, &path, &drawing, &hills].map(whole_run);
    figures.set("max_error_m", errors[0].position_m);
    figures.set("max_velocity_error_mps", errors[0].velocity_mps);
    figures.set("max_error_turnaround_m", errors[1].position_m);
    figures.set("max_velocity_error_turnaround_mps", errors[1].velocity_mps);
    figures.set("max_error_path_m", errors[2].position_m);
    figures.set("max_error_drawing_m", errors[3].position_m);
    figures.set("max_error_hills_m", errors[4].position_m);
    figures.set("max_velocity_error_hills_mps", errors[4].velocity_mps);

    let mut best = Walk::new(&paper, Instructions::best(), 0.0);
    let mut portable = Walk::new(&paper, Instructions::portable(), 0.0);
    let mut turning = Walk::new(&turn, Instructions::best(), 40.0);
    // All but the first and the last segments are under the dragon.
    let mut on_path = Walk::new(&path, Instructions::best(), 480.0);
    let mut on_drawing = Walk::new(&drawing, Instructions::best(), 400.0);
    let mut on_hills = Walk::new(&hills, Instructions::best(), 100.0);
    let mut solver = ChainSolver::new(&paper);
    let mut travel_m = 0.0;
    let mut reference = || {
        nanoseconds_a_call(20, || {
            travel_m += STEP_M;
            black_box(solver.solve(&paper, travel_m).expect("within the run"));
        })
    };
    let [best_ns, portable_ns, turning_ns, path_ns, drawing_ns, hills_ns, reference_ns] = interleaved(
        200,
        [
            &mut || nanoseconds_a_call(1000, || best.tick()),
            &mut || nanoseconds_a_call(1000, || portable.tick()),
            &mut || nanoseconds_a_call(200, || turning.tick()),
            &mut || nanoseconds_a_call(200, || on_path.tick()),
            &mut || nanoseconds_a_call(200, || on_drawing.tick()),
            &mut || nanoseconds_a_call(200, || on_hills.tick()),
            &mut reference,
        ],
    );
    figures.set("ns_per_tick_223", median(&best_ns));
    figures.set("ns_per_tick_223_portable", median(&portable_ns));
    figures.set("ns_per_tick_223_turnaround", median(&turning_ns));
    figures.set("ns_per_tick_223_path", median(&path_ns));
    figures.set("ns_per_tick_223_drawing", median(&drawing_ns));
    figures.set("ns_per_tick_223_hills", median(&hills_ns));
    figures.set("path_vs_spiral", median(&path_ns) / median(&best_ns));
    figures.set("drawing_vs_spiral", median(&drawing_ns) / median(&best_ns));
    figures.set("hills_vs_spiral", median(&hills_ns) / median(&best_ns));
    figures.set("ns_per_tick_223_reference", median(&reference_ns));
    figures.set("speedup_vs_reference", median(&reference_ns) / median(&best_ns));

    let mut large = Walk::new(&large, Instructions::best(), 0.0);
    let [large_ns] = interleaved(40, [&mut || nanoseconds_a_call(20, || large.tick())]);
    figures.set("ns_per_handle_100k", median(&large_ns) / 100_001.0);
    figures.write();
}

/// A dragon that walks tick by tick.
struct Walk {
    stepper: ChainStepper,
    travel_m: f64,
    frame: Vec<HandleState>,
}

impl Walk {
    fn new(dragon: &Arc<Dragon>, instructions: Instructions, travel_m: f64) -> Self {
        let frame = vec![HandleState::default(); dragon.dimensions().handles()];
        let stepper = ChainStepper::with_instructions(Arc::clone(dragon), instructions);
        let mut walk = Self { stepper, travel_m, frame };
        walk.tick();
        walk
    }

    fn tick(&mut self) {
        self.travel_m += STEP_M;
        self.stepper.step(self.travel_m, 1.0, black_box(&mut self.frame), HandleState::new).expect("within the run");
    }
}

/// The largest errors of a run.
#[derive(Clone, Copy, Debug, Default)]
struct Errors {
    position_m: f64,
    velocity_mps: f64,
}

/// Walks a dragon's whole run tick by tick.
///
/// # Panics
/// Panics if a position differs by more than [`TOLERANCE_M`].
fn whole_run(dragon: &Arc<Dragon>) -> Errors {
    let mut walk = Walk::new(dragon, Instructions::best(), dragon.start_travel_m());
    let mut solver = ChainSolver::new(dragon);
    let mut errors = Errors::default();
    let ticks = ((dragon.end_travel_m() - dragon.start_travel_m()) / STEP_M) as u32 - 2;
    for tick in 0..ticks {
        walk.tick();
        if tick % LOOK == 0 {
            let exact = solver.solve(dragon, walk.travel_m).expect("within the run");
            for (ours, exact) in walk.frame.iter().zip(exact) {
                let (position, velocity) = (exact.in_space(), exact.tangent.extend(exact.climb) * exact.speed_ratio);
                for axis in 0..3 {
                    let off_m = (ours.position_m[axis] - position[axis]).abs();
                    let off_mps = (ours.velocity_mps[axis] - velocity[axis]).abs();
                    assert!(off_m <= TOLERANCE_M, "off by {off_m} m at {} m of travel", walk.travel_m);
                    errors.position_m = errors.position_m.max(off_m);
                    errors.velocity_mps = errors.velocity_mps.max(off_mps);
                }
            }
        }
    }
    errors
}
