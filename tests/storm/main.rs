//! The storm: processes of every role are killed at random instants, also during their start. Each killed process is restarted
//! with the same command, without any clean-up. It must start at the first try, and the others must continue. Shows restart
//! their children themselves, and are killed as well. At the end, no remains may be left.
//!
//!     cargo test --release --test storm -- --kills 2000 --seed 7
//!
//! The endings: any set of processes ends together and leaves no remains.
//!
//!     cargo test --release --test storm -- --ends 500 --seed 7
//!
//! The printed seed determines the kills and their instants. The state of the processes at these instants depends on the
//! machine.

#[path = "../processes/children.rs"]
#[allow(dead_code, reason = "the storm uses a part of it")]
mod children;
#[path = "../processes/stage.rs"]
#[allow(dead_code, reason = "the storm uses a part of it")]
mod stage;

mod arguments;
mod books;
mod endings;
mod player;
mod random;
mod role;
mod supervised;
mod troupe;

use std::io::{IsTerminal as _, Write as _};
use std::process::ExitCode;
use std::thread;

use arguments::{ENDINGS, STORM, Task};
use books::Books;
use endings::end_sets;
use random::Random;
use stage::Stage;
use supervised::play_shows;
use troupe::Troupe;

/// Percentage of the kills in shows.
const SHOWS_PERCENT: u32 = 25;

#[allow(clippy::print_stdout, clippy::print_stderr, reason = "a test target without libtest prints its results")]
fn main() -> ExitCode {
    let (kills, ends, seed) = match Task::of(std::env::args().skip(1)) {
        Ok(Task::Run { kills, ends, seed }) => (kills, ends, seed),
        Ok(Task::List(names)) => {
            for name in &names {
                println!("{name}: test");
            }
            println!("\n{} tests, 0 benchmarks", names.len());
            return ExitCode::SUCCESS;
        }
        Err(error) => {
            eprintln!("error: {error}");
            return ExitCode::from(2);
        }
    };
    let mut outcomes = vec![];
    if let Some(rounds) = ends {
        println!("\n{rounds} endings, seed {seed}");
        outcomes.push(run(ENDINGS, move || endings(rounds, seed)));
    }
    if let Some(kills) = kills {
        println!("\nstorm of {kills} kills, seed {seed}");
        outcomes.push(run(STORM, move || storm(kills, seed)));
    }
    let passed = outcomes.iter().filter(|&&is_well| is_well).count();
    let (failed, left_out) = (outcomes.len() - passed, 2 - outcomes.len());
    let word = if failed == 0 { "ok" } else { "FAILED" };
    println!("\ntest result: {word}. {passed} passed; {failed} failed; 0 ignored; 0 measured; {left_out} filtered out");
    if failed == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Runs a test on its own thread. Returns whether it passed.
#[allow(clippy::print_stdout, reason = "a test target without libtest prints its results")]
fn run(name: &str, test: impl FnOnce() + Send + 'static) -> bool {
    // Remains of the stage are a failure too, but not after another failure.
    let is_well = thread::spawn(test).join().is_ok();
    println!("test {name} ... {}", if is_well { "ok" } else { "FAILED" });
    is_well
}

/// Ends this many sets of processes. Panics if one leaves remains.
fn endings(rounds: u32, seed: u64) {
    let stage = Stage::new();
    if let Err(failure) = end_sets(&stage, &mut Random::new(seed), rounds) {
        panic!("seed {seed}, {failure}");
    }
}

/// Kills this many processes. Panics if a kill affects another process.
#[allow(clippy::print_stdout, reason = "a test target without libtest prints its results")]
fn storm(kills: u32, seed: u64) {
    let stage = Stage::new();
    let mut books = Books::new();
    let mut random = Random::new(seed);
    let of_troupe = kills - kills * SHOWS_PERCENT / 100;
    let mut troupe = Troupe::gather(&stage, random.clone());
    let mut outcome = Ok(());
    while outcome.is_ok() && books.kills() < of_troupe {
        outcome = troupe.play_round(of_troupe - books.kills(), &mut books);
        tell(books.kills(), kills);
    }
    let outcome = outcome
        .and_then(|()| troupe.end(&mut books))
        .and_then(|()| play_shows(&stage, &mut random, kills - of_troupe, &mut books));
    tell(books.kills(), kills);
    println!("{books}");
    if let Err(failure) = outcome {
        let remains = stage.remains();
        panic!("seed {seed}, after {} kills: {failure}\nleft: {remains:#?}", books.kills());
    }
}

/// Draws the progress of the storm on a terminal.
#[allow(clippy::print_stdout, reason = "a test target without libtest prints its results")]
fn tell(done: u32, of: u32) {
    let mut stdout = std::io::stdout();
    if stdout.is_terminal() {
        print!("\r{done} of {of} kills ");
        let _ = stdout.flush();
        if done >= of {
            println!();
        }
    }
}
