//! Plays seeds, and reports simulated hours, faults and broken promises.

#![allow(clippy::print_stdout, reason = "the program's output")]

use std::fmt;
use std::process::ExitCode;

use clap::Parser;
use rustix::time::{ClockId, clock_gettime};
use simulator::{Outcome, Scenario, play, shortest};

/// Minutes of a core between two reports of progress.
const PROGRESS_MINUTES: f64 = 1.0;

/// Plays the whole show under a simulated clock, with faults from a seed. Exit status 1: a promise is broken.
#[derive(Debug, Parser)]
#[command(name = "simulator")]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag of its own")]
struct Args {
    /// The first seed.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Number of seeds.
    #[arg(long, default_value_t = 1)]
    seeds: u64,
    /// Hours of faults of each seed.
    #[arg(long, default_value_t = 1.0)]
    hours: f64,
    /// Play only the faults of these numbers, and print them.
    #[arg(long, value_delimiter = ',', num_args = 0..)]
    only: Option<Vec<usize>>,
    /// One dragon without cues in each seed.
    #[arg(long)]
    plain: bool,
    /// Print the configuration of each seed.
    #[arg(long)]
    show: bool,
    /// Do not reduce the faults of a broken promise.
    #[arg(long)]
    no_shrink: bool,
    /// Go on after a broken promise.
    #[arg(long)]
    keep_going: bool,
}

fn main() -> ExitCode {
    let args = Args::parse();
    let (mut totals, mut broken) = (Totals::default(), 0_u64);
    let mut printed_minutes = spent_minutes();
    for seed in args.seed..args.seed.saturating_add(args.seeds) {
        let whole = if args.plain { Scenario::plain(seed, args.hours) } else { Scenario::of(seed, args.hours) };
        if args.show {
            println!("# seed {seed}\n{}", whole.toml);
        }
        let scenario = args.only.as_ref().map_or_else(|| whole.clone(), |numbers| whole.only(numbers));
        let outcome = play(&scenario);
        totals.add(&outcome);
        if args.only.is_some() {
            for fault in &scenario.faults {
                println!("  {fault}");
            }
            println!("trace {:016x}", outcome.trace);
        }
        if outcome.broken.is_some() {
            broken += 1;
            report(&args, &scenario, &outcome);
            if !args.keep_going {
                break;
            }
        }
        if spent_minutes() >= printed_minutes + PROGRESS_MINUTES {
            printed_minutes = spent_minutes();
            println!("up to seed {seed}: {totals}, {broken} broken");
        }
    }
    println!("{totals}, {broken} broken");
    ExitCode::from(u8::from(broken > 0))
}

/// Minutes of a core that the process has spent.
fn spent_minutes() -> f64 {
    let spent = clock_gettime(ClockId::ProcessCPUTime);
    (spent.tv_sec as f64 + spent.tv_nsec as f64 * 1e-9) / 60.0
}

/// The sums of all plays so far.
#[derive(Default)]
struct Totals {
    seeds: u64,
    hours: f64,
    faults: u64,
    frames: u64,
    runs: u64,
    shows: u64,
    walked_m: f64,
    replies: u64,
    recorded: u64,
    verified: u64,
}

impl Totals {
    fn add(&mut self, outcome: &Outcome) {
        self.seeds += 1;
        self.hours += outcome.length_ns as f64 / 3600e9;
        self.faults += outcome.faults;
        self.frames += outcome.frames;
        self.runs += outcome.runs;
        self.shows += outcome.shows;
        self.walked_m += outcome.walked_m;
        self.replies += outcome.replies;
        self.recorded += outcome.recorded;
        self.verified += outcome.verified;
    }
}

impl fmt::Display for Totals {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { hours, faults, frames, runs, shows, walked_m, replies, recorded, verified, seeds } = self;
        write!(
            formatter,
            "{seeds} seeds, {hours:.1} simulated hours ({:.0} a minute of a core), {faults} faults and commands, {shows} shows, \
             {runs} runs, {frames} frames, {walked_m:.0} m walked, {replies} replies, {recorded} frames recorded, {verified} of them \
             verified",
            hours / spent_minutes()
        )
    }
}

/// Prints a broken promise, its shortest list of faults, and the command that plays it again.
fn report(args: &Args, scenario: &Scenario, outcome: &Outcome) {
    let Some(broken) = &outcome.broken else { return };
    let (page, sentence) = broken.promise.source();
    let at_s = broken.at_ns as f64 * 1e-9;
    println!("seed {}: promise {} {:?} broken at {at_s:.6} s", scenario.seed, broken.promise.number(), broken.promise);
    println!("  {page}: \"{sentence}\"\n  {}", broken.what);
    if args.no_shrink || args.only.is_some() {
        return;
    }
    let numbers = shortest(scenario, broken.promise);
    println!("the shortest list of faults, of {}:", scenario.faults.len());
    for &number in &numbers {
        println!("  {number:5} {}", scenario.faults[number]);
    }
    let list: Vec<String> = numbers.iter().map(usize::to_string).collect();
    let (seed, hours, list) = (scenario.seed, args.hours, list.join(","));
    let plain = if args.plain { " --plain" } else { "" };
    println!("again: cargo run --release -p simulator -- --seed {seed}{plain} --hours {hours} --only {list}");
}
