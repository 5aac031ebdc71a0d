//! Random properties: tests that check many random cases.
//!
//! A property states its own number of cases. `BENCH_DRAGON_CASES` multiplies the number of every property. `PROPTEST_CASES`
//! replaces the number of every property of proptest. `tests/properties` runs all properties with more cases; it finds them by
//! their calls of [`case_count`] and [`random_cases`].

use std::env;

use proptest::test_runner::Config;

use crate::list;

/// Environment variable with a factor for the number of cases of every property.
const FACTOR: &str = "BENCH_DRAGON_CASES";
/// Environment variable with the number of cases of every property of proptest, which reads it too.
const NUMBER: &str = "PROPTEST_CASES";
/// Environment variable with the path of the list of properties that ran, one per line with its number of cases.
const LIST: &str = "BENCH_DRAGON_PROPERTIES";

/// Rejected cases that proptest allows for each case, as in its default configuration of 256 cases.
const GLOBAL_REJECTS: u32 = 4;
const LOCAL_REJECTS: u32 = 256;

/// Returns the number of cases that the running property checks: `own`, times the factor of the environment.
///
/// # Panics
/// If the factor is not a whole number from 1.
#[track_caller]
pub fn case_count(own: u32) -> u32 {
    noted(own.saturating_mul(number(FACTOR).unwrap_or(1)))
}

/// Returns the settings of a property of proptest that checks `own` cases, times the factor of the environment, or its number
/// of cases. No failing case is written to a file: the failing test prints it.
///
/// # Panics
/// If a variable of the environment is not a whole number from 1.
#[track_caller]
pub fn random_cases(own: u32) -> Config {
    let cases = number(NUMBER).map_or_else(|| case_count(own), noted);
    let default = Config::default();
    Config {
        cases,
        // More cases reject more.
        max_global_rejects: default.max_global_rejects.max(cases.saturating_mul(GLOBAL_REJECTS)),
        max_local_rejects: default.max_local_rejects.max(cases.saturating_mul(LOCAL_REJECTS)),
        failure_persistence: None,
        ..default
    }
}

/// Adds the running property to the list, and returns its number of cases.
#[track_caller]
fn noted(cases: u32) -> u32 {
    list::note(LIST, &format!("{cases}\t{}\n", list::test()));
    cases
}

fn number(variable: &str) -> Option<u32> {
    let value = env::var_os(variable)?;
    let number = value.to_str().and_then(|value| value.parse().ok()).filter(|&number| number > 0);
    Some(number.unwrap_or_else(|| panic!("{variable} is {}, must be a whole number from 1", value.display())))
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::{Path, PathBuf};

    fn sources(folder: &Path) -> Vec<PathBuf> {
        let entries = fs::read_dir(folder).expect("a folder of sources").map(|entry| entry.expect("an entry").path());
        let of = |path: PathBuf| if path.is_dir() { sources(&path) } else { vec![path] };
        entries.flat_map(of).filter(|path| path.extension().is_some_and(|end| end == "rs")).collect()
    }

    #[test]
    fn every_property_of_proptest_takes_its_number_of_cases_from_here() {
        let project = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let files =
            ["geometry/src", "geometry/tests", "ipc/src", "src", "tests"].map(|folder| sources(&project.join(folder)));
        let mut properties = 0;
        for file in files.concat() {
            let text = fs::read_to_string(&file).expect("a source can be read");
            let lines: Vec<&str> = text.lines().map(str::trim).collect();
            for pair in lines.windows(2).filter(|pair| pair[0] == "proptest! {") {
                let is_configured = pair[1].starts_with("#![proptest_config(") && pair[1].contains("random_cases(");
                assert!(is_configured, "{}: {}", file.display(), pair[1]);
                properties += 1;
            }
        }
        assert!(properties > 0, "there are properties");
    }
}
