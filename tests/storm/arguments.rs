//! What the storm is called with: its own arguments, and those that `cargo test` gives to every target.

use std::time::{SystemTime, UNIX_EPOCH};

/// Kills where none are asked for.
const KILLS: u32 = 200;
/// The storm's name among the tests.
pub(crate) const NAME: &str = "anything_killed_at_any_time_starts_again_at_first_try";

/// What is to be done.
#[derive(Clone, Debug)]
pub(crate) enum Task {
    /// Print the name of the one test.
    List,
    /// Nothing: the filters leave it out.
    Skip,
    /// Kill so often, as this seed has it.
    Storm { kills: u32, seed: u64 },
}

impl Task {
    /// Reads the arguments; an error is one line.
    pub(crate) fn of(arguments: impl Iterator<Item = String>) -> Result<Self, String> {
        let (mut kills, mut seed) = (KILLS, None);
        let (mut filters, mut skipped, mut list, mut ignored, mut exact) = (vec![], vec![], false, false, false);
        let mut arguments = arguments.flat_map(|argument| match argument.split_once('=') {
            Some((name, value)) if name.starts_with("--") => vec![name.to_owned(), value.to_owned()],
            _ => vec![argument],
        });
        while let Some(argument) = arguments.next() {
            let mut value = || arguments.next().ok_or_else(|| format!("{argument} has no value, must have one"));
            match argument.as_str() {
                "--kills" => kills = number(&argument, &value()?)?,
                "--seed" => seed = Some(number(&argument, &value()?)?),
                "--skip" => skipped.push(value()?),
                "--test-threads" | "--color" | "--format" | "--logfile" | "-Z" => drop(value()?),
                "--list" => list = true,
                "--ignored" => ignored = true,
                "--exact" => exact = true,
                // How libtest is to print and run: there is one test, and it prints what there is.
                flag if flag.starts_with('-') => {}
                _ => filters.push(argument),
            }
        }
        let is_meant = |filter: &String| if exact { filter == NAME } else { NAME.contains(filter.as_str()) };
        let meant = (filters.is_empty() || filters.iter().any(is_meant)) && !skipped.iter().any(is_meant) && !ignored;
        Ok(match (meant, list) {
            (false, _) => Self::Skip,
            (true, true) => Self::List,
            (true, false) => Self::Storm { kills, seed: seed.unwrap_or_else(seed_of_now) },
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
