//! Endings: a random set of the program's processes is terminated together, or some are killed and the others terminated. After
//! all have ended, no remains of the instance may be left.
//!
//!     cargo test --release --test storm -- --ends 500 --seed 7

use std::thread;
use std::time::Duration;

use rustix::process::Signal;
use test_support::eventually::{DEADLINE, before_deadline};
use test_support::process::Process;

use crate::random::Random;
use crate::stage::Stage;
use crate::troupe::Failure;

/// Longest time from one start to the next, and from the last start to the end.
const BETWEEN: Duration = Duration::from_millis(80);
/// Longest time for which a started set continues.
const PLAYING: Duration = Duration::from_millis(300);
/// Percentage of rounds in which some processes are killed.
const KILLING_PERCENT: usize = 40;
/// Percentage of rounds in which all processes are terminated while some still start.
const STARTING_PERCENT: usize = 30;

/// Readers of the bus, with their arguments.
const READERS: [&[&str]; 9] = [
    &["view", "--listen", "127.0.0.1:0"],
    &["metrics", "--listen", "127.0.0.1:0"],
    &["monitor", "--format", "json"],
    &["hz", "--format", "json"],
    &["echo", "--format", "json"],
    &["latency", "--format", "json"],
    &["record", "ending.mcap"],
    &["bridge", "psn", "--to", "127.0.0.1:9"],
    &["bridge", "osc", "--to", "127.0.0.1:9"],
];
/// Sources of frames, with their arguments.
const SOURCES: [&[&str]; 2] = [
    &["serve", "--rate", "200", "--format", "json"],
    &["show", "--rate", "200", "--auto-resume", "--format", "json", "--out", "ending-show"],
];

/// One process of a round.
struct Player {
    name: &'static str,
    process: Process,
    is_killed: bool,
}

/// Ends this many random sets of processes.
pub(crate) fn end_sets(stage: &Stage, random: &mut Random, rounds: u32) -> Result<(), Failure> {
    (0..rounds).try_for_each(|round| {
        let ended = end_set(stage, random).map_err(|failure| format!("round {round}: {failure}"))?;
        let remains = stage.remains();
        if remains.is_empty() { Ok(()) } else { Err(format!("round {round}: {ended} left {remains:#?}")) }
    })
}

/// Starts one set and ends it. Returns a description of the round.
fn end_set(stage: &Stage, random: &mut Random) -> Result<String, Failure> {
    for name in ["ending.mcap", "ending-show"] {
        let path = stage.path(name);
        let _ = if path.is_dir() { std::fs::remove_dir_all(path) } else { std::fs::remove_file(path) };
    }
    let mut players: Vec<Player> = draw(random)
        .into_iter()
        .map(|args| {
            let process = stage.start(args);
            thread::sleep(random.up_to(BETWEEN));
            Player { name: args[0], process, is_killed: false }
        })
        .collect();
    if random.percent(STARTING_PERCENT) {
        thread::sleep(random.up_to(BETWEEN));
    } else {
        await_members(stage)?;
        thread::sleep(random.up_to(PLAYING));
        if random.percent(KILLING_PERCENT) {
            mark_victims(&mut players, random);
        }
    }
    // The kills come first: if the last member of a set is killed, no process removes the remains.
    for player in players.iter().filter(|player| player.is_killed) {
        player.process.signal(Signal::KILL);
    }
    for player in players.iter().filter(|player| !player.is_killed) {
        // SIGINT has the same effect, but a shell's background jobs ignore it until the program handles it.
        player.process.signal(Signal::TERM);
    }
    let told = players
        .iter()
        .map(|player| format!("{} {}", player.name, if player.is_killed { "killed" } else { "interrupted" }));
    let told = told.collect::<Vec<_>>().join(", ");
    for player in players {
        player.process.end();
    }
    Ok(told)
}

/// Returns a source and some readers. The source is not always the first to start.
fn draw(random: &mut Random) -> Vec<&'static [&'static str]> {
    let mut readers = READERS.to_vec();
    let mut set = vec![random.pick(&SOURCES)];
    for _ in 0..=random.below(4) {
        set.push(readers.swap_remove(random.below(readers.len())));
    }
    let (first, other) = (random.below(2), random.below(set.len()));
    set.swap(first, other);
    set
}

/// Waits until frames can be read. Then the processes have joined the bus.
fn await_members(stage: &Stage) -> Result<(), Failure> {
    before_deadline(|| {
        let read = stage.run(&["echo", "--count", "1", "--format", "json"]);
        if read.code() == Some(0) { Ok(()) } else { Err(format!("waited {DEADLINE:?} for a frame: {}", read.stderr)) }
    })
}

/// Marks some of the processes to be killed, not all.
fn mark_victims(players: &mut [Player], random: &mut Random) {
    let survivor = random.below(players.len());
    for (index, player) in players.iter_mut().enumerate() {
        // A killed show is tested by the storm: the kernel's SIGTERM ends its children one after another.
        player.is_killed = index != survivor && player.name != "show" && random.percent(60);
    }
}
