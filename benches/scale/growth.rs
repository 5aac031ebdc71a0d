//! Growth of the cost with the number of benches.

use std::time::Instant;

use bench_dragon::source::server::Simulation;
use bench_dragon::source::server::motion::{MotionPlan, MotionSettings};
use bench_dragon_ipc::HandleState;
use test_support::dragons::{paper_dragon_of, plain_formation};

use crate::shared::{median, nanoseconds_a_call};

/// Number of batches of steps. The result is their median.
const BATCHES: usize = 15;
/// Fewest handles that a batch solves, so that the cost of reading the clock is negligible.
const HANDLES_A_BATCH: usize = 100_000;

/// Returns the nanoseconds of one step of a dragon of `benches` benches, written into plain memory: no bus, no clock.
pub(crate) fn step_ns(benches: usize) -> f64 {
    let dragon = paper_dragon_of(benches);
    let plan =
        MotionPlan::new(MotionSettings::plain(0.001, 0.0, dragon.end_travel_m())).expect("the travels are in order");
    let mut simulation = Simulation::new(plain_formation(dragon), plan, 1000, 1.0);
    let mut frame = vec![HandleState::default(); benches + 1];
    let mut batch = || {
        nanoseconds_a_call(HANDLES_A_BATCH.div_ceil(benches), || {
            simulation.tick(0, &mut ());
            simulation.write(&mut frame);
        })
    };
    let mut batches: Vec<f64> = (0..BATCHES).map(|_| batch()).collect();
    batches.sort_by(f64::total_cmp);
    median(&batches)
}

/// Returns the seconds that it takes to make a dragon of `benches` benches from its dimensions.
pub(crate) fn start_s(benches: usize) -> f64 {
    let begun = Instant::now();
    let dragon = paper_dragon_of(benches);
    assert_eq!(dragon.dimensions().benches(), benches);
    begun.elapsed().as_secs_f64()
}

/// Returns the exponent p of the best power law `cost = c · size^p`, by least squares on logarithms.
pub(crate) fn exponent<const N: usize>(sizes: &[usize; N], costs: &[f64; N]) -> f64 {
    let mean = |values: [f64; N]| values.iter().sum::<f64>() / N as f64;
    let (x, y) = (sizes.map(|size| (size as f64).ln()), costs.map(f64::ln));
    let (x_mean, y_mean) = (mean(x), mean(y));
    let slope: f64 = x.iter().zip(y).map(|(x, y)| (x - x_mean) * (y - y_mean)).sum();
    slope / x.iter().map(|x| (x - x_mean).powi(2)).sum::<f64>()
}
