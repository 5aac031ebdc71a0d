//! The arguments of this target: its own, and those that `cargo test` passes to every target.

use std::time::{SystemTime, UNIX_EPOCH};

/// Default number of kills.
const KILLS: u32 = 200;
/// Default number of rounds of endings.
const ENDS: u32 = 20;
/// Name of the storm as a test.
pub(crate) const STORM: &str = "anything_killed_at_any_time_starts_again_at_first_try";
/// Name of the endings as a test.
pub(crate) const ENDINGS: &str = "a_clean_end_leaves_nothing";

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
        seed: u64,
    },
}

impl Task {
    /// Reads the arguments. An error is one line. If only one of `--kills` and `--ends` is given, the other test does not run.
    pub(crate) fn of(arguments: impl Iterator<Item = String>) -> Result<Self, String> {
        let (mut kills, mut ends, mut seed) = (None, None, None);
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
            return Ok(Self::List([STORM, ENDINGS].into_iter().filter(|name| is_meant(name)).collect()));
        }
        let default = |number| (kills.is_none() && ends.is_none()).then_some(number);
        Ok(Self::Run {
            kills: kills.or(default(KILLS)).filter(|_| is_meant(STORM)),
            ends: ends.or(default(ENDS)).filter(|_| is_meant(ENDINGS)),
            seed: seed.unwrap_or_else(seed_of_now),
        })
    }
}

fn number<Number: std::str::FromStr>(name: &str, value: &str) -> Result<Number, String> {
    value.parse().map_err(|_| format!("{name} is {value}, must be a whole number"))
}

fn seed_of_now() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    since.as_nanos() as u64 % 1_000_000_000
}
