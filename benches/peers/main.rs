//! The paper's method as plain scripts, beside ours: how long they take, and how far the answers lie apart.
//!
//! Two tasks: where all 224 handles are and how fast, from 0 to 300 s by a second; and when two benches first touch,
//! which ours finds exactly and the scripts by steps of 0.1 s, then of 0.01 s. `benches/peers/install` gets what the
//! scripts run on.
#![allow(unreachable_pub, clippy::print_stdout, clippy::print_stderr, reason = "the parts of a bench, which prints")]

mod contact;
mod peer;
mod poses;
mod process;
mod race;
#[path = "../shared/mod.rs"]
mod shared;

use std::process::ExitCode;

use contact::FirstContact;
use peer::Peer;
use poses::Poses;
use race::Contestant;
use shared::Figures;

/// Where Octave begins to look for the contact. From 0 on it would take some twenty minutes.
const OCTAVE_FROM_S: &str = "400";

fn main() -> ExitCode {
    let mut octave_from_s = OCTAVE_FROM_S;
    for argument in std::env::args().skip(1) {
        match argument.as_str() {
            // Cargo says so to every bench.
            "--bench" => {}
            "--whole" => octave_from_s = "0",
            _ => {
                eprintln!("argument is {argument}, may be --whole: Octave looks for the contact from 0 s on, too");
                return ExitCode::from(2);
            }
        }
    }
    let contestants = [
        Contestant { name: "python", peer: Peer::python(), from_s: "0" },
        Contestant { name: "octave", peer: Peer::octave(), from_s: octave_from_s },
    ];
    println!(
        "NAME_TASK_s is the work alone, from the benches' dimensions to the answer in memory; NAME_TASK_process_s the
whole process: its start and its imports, the work, and printing the answer as JSON. A ratio is theirs to ours,
like to like. Medians, with runs of ours between those of the scripts, which take some minutes."
    );
    let mut figures = Figures::of("peers");
    for contestant in &contestants {
        introduce(contestant, &mut figures);
    }
    race::run::<Poses>(&contestants, &mut figures);
    race::run::<FirstContact>(&contestants, &mut figures);
    figures.write();
    ExitCode::SUCCESS
}

/// Says what a script runs on and where it begins, or that it is missing.
fn introduce(Contestant { name, peer, from_s }: &Contestant, figures: &mut Figures) {
    figures.set(&format!("{name}_version"), peer.as_ref().map(Peer::version));
    figures.set(&format!("{name}_contact_from_s"), peer.as_ref().map(|_| from_s.parse::<f64>().expect("a number")));
    if peer.is_none() {
        println!("{name} is missing, so its figures are null; benches/peers/install gets it");
    } else if *from_s != "0" {
        println!(
            "{name} looks for the contact from {from_s} s on, ours from 0: its ratio is too small (-- --whole: both)"
        );
    }
}
