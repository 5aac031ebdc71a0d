//! Measures whether misbehaving readers delay the server: one that is stopped, one that keeps the frames that it has read, and
//! sixteen that start and end.
//!
//! One server runs at 1 kHz through all phases. Calm phases alternate with the others. A witness reads every frame and computes
//! the delay from its due instant to its sending. Sixteen processes that start and end use processor time, whichever server they
//! read. So they have a phase at another server as well. The difference between these two phases is due to the bus.

#[path = "../shared/mod.rs"]
mod shared;

mod crowd;
mod program;
mod witness;

use std::time::Duration;

use bench_dragon_ipc::FrameSubscriber;
use bench_dragon_ipc::service::MAX_BORROWED_FRAMES;
use rustix::process::Signal;

use shared::{Figures, median, quantile, seconds_or};

use crowd::Crowd;
use program::Program;
use witness::Witness;

/// Default length of a phase in seconds; `--seconds` overrides it. The phase of the stopped reader is three times as long.
const SECONDS: u32 = 10;
const STOPPED_PHASES: u32 = 3;
/// Repetitions of all phases. The median of the rounds reduces the effect of chance.
const ROUNDS: usize = 3;
/// Quantiles that the bench reports for each phase.
const QUANTILES: [(&str, f64); 3] = [("p50", 0.5), ("p99", 0.99), ("p999", 0.999)];

fn main() {
    measure(Duration::from_secs(seconds_or(SECONDS).into()));
}

/// Runs all rounds and writes the figures.
fn measure(phase: Duration) {
    let mut figures = Figures::of("readers");
    figures.set("seconds_per_phase", phase.as_secs());
    figures.set("rounds", ROUNDS as u64);
    let (server, elsewhere) = (Program::serve("bench-readers"), Program::serve("bench-readers-else"));
    let mut witness = Witness::join(&server);
    let mut came = 0;
    let rounds: Vec<Round> = (0..ROUNDS)
        .map(|_| {
            let calm_before = witness.watch(phase);
            let stopped = beside_a_stopped_reader(&server, &mut witness, phase * STOPPED_PHASES);
            let calm_between = witness.watch(phase);
            let holding = beside_a_holding_reader(&server, &mut witness, phase);
            let (coming_elsewhere, _) = beside_a_crowd(&elsewhere, &mut witness, phase);
            let (coming, readers) = beside_a_crowd(&server, &mut witness, phase);
            came += readers;
            Round { calm: [calm_before, calm_between], stopped, holding, coming, coming_elsewhere }
        })
        .collect();
    figures.set("readers_that_came_and_went", came);
    figures.set("frames_lost_by_witness", witness.lost());
    drop(witness);
    figures.set("overruns", server.stop());
    elsewhere.stop();
    report(&mut figures, &rounds);
    figures.write();
}

/// The delays of every frame of each phase, in microseconds.
struct Round {
    calm: [Vec<f64>; 2],
    stopped: Vec<f64>,
    holding: Vec<f64>,
    coming: Vec<f64>,
    coming_elsewhere: Vec<f64>,
}

impl Round {
    /// Returns the mean of the two calm phases' quantiles.
    fn calm_at(&self, share: f64) -> f64 {
        0.5 * (quantile(&self.calm[0], share) + quantile(&self.calm[1], share))
    }
}

fn beside_a_stopped_reader(server: &Program, witness: &mut Witness, phase: Duration) -> Vec<f64> {
    let reader = Program::read(server);
    reader.signal(Signal::STOP);
    let delays = witness.watch(phase);
    reader.signal(Signal::CONT);
    delays
}

fn beside_a_holding_reader(server: &Program, witness: &mut Witness, phase: Duration) -> Vec<f64> {
    let mut holder = FrameSubscriber::open(server.domain(), "holder").expect("the server is running");
    let mut held = Vec::new();
    while held.len() < MAX_BORROWED_FRAMES {
        held.extend(holder.wait(phase).expect("the bus is readable"));
    }
    witness.watch(phase)
}

/// Returns the delays, and the number of readers that were started.
fn beside_a_crowd(server: &Program, witness: &mut Witness, phase: Duration) -> (Vec<f64>, usize) {
    let mut crowd = Crowd::at(server);
    let delays = witness.watch_while(phase, || crowd.refill());
    (delays, crowd.came())
}

/// Sets the quantiles of each phase and their ratios, each as the median of the rounds. The ratio of the slowest to the fastest
/// calm phase shows the noise.
fn report(figures: &mut Figures, rounds: &[Round]) {
    let middle = |of: &dyn Fn(&Round) -> f64| {
        let mut values: Vec<f64> = rounds.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        median(&values)
    };
    for (name, share) in QUANTILES {
        let calm: Vec<f64> =
            rounds.iter().flat_map(|round| &round.calm).map(|delays| quantile(delays, share)).collect();
        let (least, most) = (calm.iter().copied().fold(f64::MAX, f64::min), calm.iter().copied().fold(0.0, f64::max));
        figures.set(&format!("calm_{name}_us"), middle(&|round| round.calm_at(share)));
        figures.set(&format!("noise_ratio_{name}"), most / least);
        let mut phase = |phase: &str, delays: &dyn Fn(&Round) -> f64| {
            figures.set(&format!("{phase}_{name}_us"), middle(delays));
            figures
                .set(&format!("{phase}_to_calm_ratio_{name}"), middle(&|round| delays(round) / round.calm_at(share)));
        };
        phase("stopped", &|round| quantile(&round.stopped, share));
        phase("holding", &|round| quantile(&round.holding, share));
        let here = |round: &Round| quantile(&round.coming, share);
        let elsewhere = |round: &Round| quantile(&round.coming_elsewhere, share);
        figures.set(&format!("coming_{name}_us"), middle(&here));
        figures.set(&format!("coming_elsewhere_{name}_us"), middle(&elsewhere));
        figures.set(&format!("coming_here_to_elsewhere_ratio_{name}"), middle(&|round| here(round) / elsewhere(round)));
    }
}
