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
//! The scenarios: seeds of the simulator on the real bus (`scenario.rs`).
//!
//!     cargo test --release --test storm -- --scenarios 200 --seed 7
//!
//! The printed seed determines the kills and their instants. The state of the processes at these instants depends on the
//! machine.

mod arguments;
mod books;
mod endings;
mod lies;
mod outside;
mod player;
mod random;
mod role;
mod scenario;
#[path = "../processes/stage.rs"]
mod stage;
mod supervised;
mod troupe;
mod witness;

use std::io::{IsTerminal as _, Write as _};
use std::process::ExitCode;
use std::thread;

use arguments::{ENDINGS, SCENARIOS, STORM, Scenarios, Task};
use books::Books;
use endings::end_sets;
use random::Random;
use scenario::{Account, play_scenario};
use stage::Stage;
use supervised::play_shows;
use troupe::Troupe;

/// Percentage of the kills in shows.
const SHOWS_PERCENT: u32 = 25;

/// Number of scenarios that play at the same time.
const SIDE_BY_SIDE: usize = 4;

#[allow(clippy::print_stdout, clippy::print_stderr, reason = "a test target without libtest prints its results")]
fn main() -> ExitCode {
    let (kills, ends, scenarios, seed) = match Task::of(std::env::args().skip(1)) {
        Ok(Task::Run { kills, ends, scenarios, seed }) => (kills, ends, scenarios, seed),
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
    if let Some(scenarios) = scenarios {
        println!("\nscenarios of seeds {:?}", scenarios.seeds);
        outcomes.push(run(SCENARIOS, move || play_scenarios(&scenarios)));
    }
    let passed = outcomes.iter().filter(|&&is_well| is_well).count();
    let (failed, left_out) = (outcomes.len() - passed, 3 - outcomes.len());
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

/// Plays the scenarios of some seeds, several side by side. Panics with the seed of the first one that breaks a promise.
#[allow(clippy::print_stdout, reason = "a test target without libtest prints its results")]
fn play_scenarios(scenarios: &Scenarios) {
    let Scenarios { seeds, seconds, only } = scenarios;
    let mut untold: Vec<_> = lies::claims().collect();
    for together in seeds.chunks(SIDE_BY_SIDE) {
        let played = thread::scope(|scope| {
            let play =
                |&seed: &u64| (seed, scope.spawn(move || play_scenario(seed, f64::from(*seconds), only.as_deref())));
            let playing: Vec<_> = together.iter().map(play).collect();
            playing.into_iter().map(|(seed, thread)| (seed, thread.join())).collect::<Vec<_>>()
        });
        for (seed, outcome) in played {
            let outcome = outcome.unwrap_or_else(|_| panic!("seed {seed}, {seconds} s: a panic"));
            match outcome.unwrap_or_else(|failure| panic!("seed {seed}, {seconds} s: {failure}")) {
                Some(Account { told, lies }) => {
                    println!("{told}");
                    untold.retain(|lie| !lies.contains(lie));
                }
                None => println!("seed {seed}: a show with timecode, left out"),
            }
        }
    }
    if !untold.is_empty() {
        println!("no show allowed the lies: {}", untold.join("; "));
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
