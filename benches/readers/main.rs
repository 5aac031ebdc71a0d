//! Whether readers that misbehave make the server late: one that is stopped, one that holds what it has read, and sixteen
//! that come and go.
//!
//! One server at 1 kHz plays through all phases, and calm ones lie between the others. A witness reads every frame, and
//! takes from its stamps how long after its release it was sent. Sixteen processes that come and go take processor time wherever
//! they read, so they have a phase at another server, too: what differs between the two is the bus's.

#[path = "../shared/mod.rs"]
mod shared;

mod crowd;
mod program;
mod witness;

use std::process::ExitCode;
use std::time::Duration;

use bench_dragon_ipc::FrameSubscriber;
use bench_dragon_ipc::service::MAX_BORROWED_FRAMES;
use rustix::process::Signal;
use shared::{Figures, quantile};

use crowd::Crowd;
use program::Program;
use witness::Witness;

/// How long each phase lasts where `--seconds` does not say.
const SECONDS: u64 = 30;
/// Quantiles that are told of each phase.
const QUANTILES: [(&str, f64); 3] = [("p50", 0.5), ("p99", 0.99), ("p999", 0.999)];

#[allow(clippy::print_stderr, reason = "a bench prints")]
fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let seconds = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => Some(SECONDS),
        ["--seconds", seconds] => seconds.parse().ok().filter(|&seconds| seconds > 0),
        _ => None,
    };
    let Some(seconds) = seconds else {
        eprintln!("arguments are {arguments:?}, must be none or --seconds and a number above 0");
        return ExitCode::from(2);
    };
    measure(Duration::from_secs(seconds));
    ExitCode::SUCCESS
}

/// Plays all phases and writes the figures.
fn measure(phase: Duration) {
    let mut figures = Figures::of("readers");
    figures.set("seconds_per_phase", phase.as_secs());
    let (server, elsewhere) = (Program::serve("bench-readers"), Program::serve("bench-readers-else"));
    let mut witness = Witness::join(&server);

    let mut calm = vec![witness.watch(phase)];
    let stopped = {
        let reader = Program::read(&server);
        reader.signal(Signal::STOP);
        let delays = witness.watch(phase);
        reader.signal(Signal::CONT);
        delays
    };
    calm.push(witness.watch(phase));
    let holding = {
        let mut holder = FrameSubscriber::open(server.domain(), "holder").expect("the server is there");
        let mut held = Vec::new();
        while held.len() < MAX_BORROWED_FRAMES {
            held.extend(holder.wait(phase).expect("the bus is readable"));
        }
        witness.watch(phase)
    };
    calm.push(witness.watch(phase));
    let mut crowd_elsewhere = Crowd::at(&elsewhere);
    let coming_elsewhere = witness.watch_while(phase, || crowd_elsewhere.refill());
    drop(crowd_elsewhere);
    let mut crowd = Crowd::at(&server);
    let coming = witness.watch_while(phase, || crowd.refill());
    figures.set("readers_that_came_and_went", crowd.came());
    drop(crowd);
    calm.push(witness.watch(phase));

    let lost = witness.lost();
    drop(witness);
    let overruns = server.stop();
    elsewhere.stop();
    figures.set("frames_lost_by_witness", lost);
    figures.set("overruns", overruns);
    report(&mut figures, &calm, &stopped, &holding, [&coming, &coming_elsewhere]);
    figures.write();
}

/// Tells the quantiles of each phase, and the ratios that matter beside the ratio of equal phases, which is noise.
fn report(figures: &mut Figures, calm: &[Vec<f64>], stopped: &[f64], holding: &[f64], coming: [&[f64]; 2]) {
    for (name, share) in QUANTILES {
        let calm: Vec<f64> = calm.iter().map(|delays| quantile(delays, share)).collect();
        let mean = calm.iter().sum::<f64>() / calm.len() as f64;
        let (least, most) = (calm.iter().copied().fold(f64::MAX, f64::min), calm.iter().copied().fold(0.0, f64::max));
        figures.set(&format!("calm_{name}_us"), mean);
        figures.set(&format!("noise_ratio_{name}"), most / least);
        for (phase, delays) in [("stopped", stopped), ("holding", holding)] {
            figures.set(&format!("{phase}_{name}_us"), quantile(delays, share));
            figures.set(&format!("{phase}_to_calm_ratio_{name}"), quantile(delays, share) / mean);
        }
        let [here, elsewhere] = coming.map(|delays| quantile(delays, share));
        figures.set(&format!("coming_{name}_us"), here);
        figures.set(&format!("coming_elsewhere_{name}_us"), elsewhere);
        figures.set(&format!("coming_here_to_elsewhere_ratio_{name}"), here / elsewhere);
    }
}
