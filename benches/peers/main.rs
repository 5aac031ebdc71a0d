//! Compares our solvers with plain scripts of the paper's method: their times, and the differences of their answers.
//!
//! There are two tasks. The first is the positions and speeds of all 224 handles, from 0 to 300 s in steps of 1 s. The second
//! is the first contact of two benches. Our solver computes it exactly; the scripts search in steps of 0.1 s, then of 0.01 s.
//! `benches/peers/install` installs the requirements of the scripts.
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

/// Show time at which Octave begins its search for the contact. A search from 0 s takes about twenty minutes.
const OCTAVE_FROM_S: &str = "400";

fn main() -> ExitCode {
    let mut octave_from_s = OCTAVE_FROM_S;
    for argument in std::env::args().skip(1) {
        match argument.as_str() {
            // Cargo passes this argument to every bench.
            "--bench" => {}
            "--whole" => octave_from_s = "0",
            _ => {
                eprintln!(
                    "argument is {argument}, must be none or --whole, which makes Octave search for the contact from 0 s on"
                );
                return ExitCode::from(2);
            }
        }
    }
    let contestants = [
        Contestant { name: "python", peer: Peer::python(), from_s: "0" },
        Contestant { name: "octave", peer: Peer::octave(), from_s: octave_from_s },
    ];
    println!(
        "NAME_TASK_s is the time of the work alone, from the benches' dimensions to the answer in memory.
NAME_TASK_process_s is the time of the whole process: start, imports, the work, and printing the answer as JSON.
A ratio is the script's time to our time, of the same kind. Times are medians. Our runs alternate with those of the
scripts. The bench takes some minutes."
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

/// Sets the figures about a script's interpreter and its begin of the search. Prints a line if the interpreter is missing.
fn introduce(Contestant { name, peer, from_s }: &Contestant, figures: &mut Figures) {
    figures.set(&format!("{name}_version"), peer.as_ref().map(Peer::version));
    figures.set(&format!("{name}_contact_from_s"), peer.as_ref().map(|_| from_s.parse::<f64>().expect("a number")));
    if peer.is_none() {
        println!("{name} is missing, so its figures are null: benches/peers/install installs it");
    } else if *from_s != "0" {
        println!(
            "{name} searches for the contact from {from_s} s on, ours from 0: its ratio is too small (-- --whole: both)"
        );
    }
}
