//! The storm: every role is killed at random instants, start-up included. After each kill it is started again, with the same
//! command and nothing cleared up, and has to start at first try; the others have to carry on. Shows do so by themselves, and
//! are killed as well. At the end nothing may be left.
//!
//!     cargo test --release --test storm -- --kills 2000 --seed 7
//!
//! The endings: any set of processes ends together and leaves nothing.
//!
//!     cargo test --release --test storm -- --ends 500 --seed 7
//!
//! The seed that is printed tells whom the storm kills and when; what the processes are doing at that instant is the
//! machine's affair.

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

/// The part of all kills that shows are to cope with.
const SHOWS_PERCENT: u32 = 25;

#[allow(clippy::print_stdout, clippy::print_stderr, reason = "a test target of its own prints")]
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

/// Runs a test on a thread of its own. Whether it passed.
#[allow(clippy::print_stdout, reason = "a test target of its own prints")]
fn run(name: &str, test: impl FnOnce() + Send + 'static) -> bool {
    // What is left on the stage is a failure of its own, but not after another one.
    let is_well = thread::spawn(test).join().is_ok();
    println!("test {name} ... {}", if is_well { "ok" } else { "FAILED" });
    is_well
}

/// Ends this many sets of processes, and panics where one leaves anything.
fn endings(rounds: u32, seed: u64) {
    let stage = Stage::new();
    if let Err(failure) = end_sets(&stage, &mut Random::new(seed), rounds) {
        panic!("seed {seed}, {failure}");
    }
}

/// Kills so often, and panics where that is more than the affair of whoever was killed.
#[allow(clippy::print_stdout, reason = "a test target of its own prints")]
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

/// Draws how far the storm is, where somebody watches.
#[allow(clippy::print_stdout, reason = "a test target of its own prints")]
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
