//! The arguments of this target: its own, and those that `cargo test` passes to every target.

use std::time::{SystemTime, UNIX_EPOCH};

/// Default number of kills.
const KILLS: u32 = 200;
/// Default number of rounds of endings.
const ENDS: u32 = 20;
/// Default seeds of the scenarios: killed and stopped parts, restarted servers, bursts of commands, cues, three dragons.
const SEEDS: [u64; 4] = [3, 9, 10, 13];
/// Default length of the faults of a scenario, in seconds.
const SECONDS: u32 = 10;
/// Name of the storm as a test.
pub(crate) const STORM: &str = "anything_killed_at_any_time_starts_again_at_first_try";
/// Name of the endings as a test.
pub(crate) const ENDINGS: &str = "a_clean_end_leaves_nothing";
/// Name of the scenarios as a test.
pub(crate) const SCENARIOS: &str = "seeds_of_the_simulator_keep_their_promises_on_the_real_bus";

/// Scenarios of the simulator to play.
#[derive(Clone, Debug)]
pub(crate) struct Scenarios {
    pub(crate) seeds: Vec<u64>,
    /// Length of the faults of each.
    pub(crate) seconds: u32,
    /// Numbers of the only faults; `None` for all.
    pub(crate) only: Option<Vec<usize>>,
}

/// The task of this run.
#[derive(Clone, Debug)]
pub(crate) enum Task {
    /// Prints the names of these tests.
    List(Vec<&'static str>),
    /// Runs tests with this seed.
    Run {
        /// Kills of the storm; `None` if the storm does not run.
        kills: Option<u32>,
        /// Rounds of endings; `None` if they do not run.
        ends: Option<u32>,
        /// Scenarios of the simulator; `None` if they do not run.
        scenarios: Option<Scenarios>,
        seed: u64,
    },
}

impl Task {
    /// Reads the arguments. An error is one line. If one of `--kills`, `--ends` and `--scenarios` is given, the other tests do not
    /// run.
    pub(crate) fn of(arguments: impl Iterator<Item = String>) -> Result<Self, String> {
        let (mut kills, mut ends, mut seed) = (None, None, None);
        let (mut scenarios, mut seconds, mut only) = (None, SECONDS, None);
        let (mut filters, mut skipped, mut list, mut ignored, mut exact) = (vec![], vec![], false, false, false);
        let mut arguments = arguments.flat_map(|argument| match argument.split_once('=') {
            Some((name, value)) if name.starts_with("--") => vec![name.to_owned(), value.to_owned()],
            _ => vec![argument],
        });
        while let Some(argument) = arguments.next() {
            let mut value = || arguments.next().ok_or_else(|| format!("{argument} has no value, must have one"));
            match argument.as_str() {
                "--kills" => kills = Some(number(&argument, &value()?)?),
                "--ends" => ends = Some(number(&argument, &value()?)?),
                "--scenarios" => scenarios = Some(number::<u64>(&argument, &value()?)?),
                "--seconds" => seconds = number(&argument, &value()?)?,
                "--only" => only = Some(numbers(&argument, &value()?)?),
                "--seed" => seed = Some(number(&argument, &value()?)?),
                "--skip" => skipped.push(value()?),
                "--test-threads" | "--color" | "--format" | "--logfile" | "-Z" => drop(value()?),
                "--list" => list = true,
                "--ignored" => ignored = true,
                "--exact" => exact = true,
                // Flags for libtest's output and threads have no effect: these tests run one after another.
                flag if flag.starts_with('-') => {}
                _ => filters.push(argument),
            }
        }
        let is_meant = |name: &str| {
            let matches = |filter: &String| if exact { filter == name } else { name.contains(filter.as_str()) };
            (filters.is_empty() || filters.iter().any(matches)) && !skipped.iter().any(matches) && !ignored
        };
        if list {
            return Ok(Self::List([STORM, ENDINGS, SCENARIOS].into_iter().filter(|name| is_meant(name)).collect()));
        }
        let is_default = kills.is_none() && ends.is_none() && scenarios.is_none();
        let default = |number| is_default.then_some(number);
        let first: u64 = seed.unwrap_or(1);
        let seeds: Option<Vec<u64>> = scenarios.map(|count| (first..first.saturating_add(count)).collect());
        let seeds = seeds.or_else(|| is_default.then(|| SEEDS.to_vec())).filter(|_| is_meant(SCENARIOS));
        Ok(Self::Run {
            kills: kills.or(default(KILLS)).filter(|_| is_meant(STORM)),
            ends: ends.or(default(ENDS)).filter(|_| is_meant(ENDINGS)),
            scenarios: seeds.map(|seeds| Scenarios { seeds, seconds, only }),
            seed: seed.unwrap_or_else(seed_of_now),
        })
    }
}

fn number<Number: std::str::FromStr>(name: &str, value: &str) -> Result<Number, String> {
    value.parse().map_err(|_| format!("{name} is {value}, must be a whole number"))
}

fn numbers(name: &str, values: &str) -> Result<Vec<usize>, String> {
    values.split(',').map(|value| number(name, value)).collect()
}

fn seed_of_now() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    since.as_nanos() as u64 % 1_000_000_000
}
