//! Tests that lack something on this machine. `tests/run` counts them and names them at the end; where `CI` is set, such a
//! test fails.

use std::env;
use std::fs::File;
use std::io::Write as _;
use std::panic::Location;
use std::process::{Command, Stdio};
use std::thread;

/// The file in which `tests/run` finds the tests that were skipped, a line each.
const LIST: &str = "BENCH_DRAGON_SKIPPED";

/// Notes that the running test does without something; `why` says what is lacking.
///
/// # Panics
/// Where `CI` is set: there, nothing may be lacking.
#[track_caller]
pub fn skip(why: &str) {
    let line = format!("{}: {why}\n", test());
    // The test runner keeps to itself what passing tests print; nobody may be there to read it.
    let _ = write!(std::io::stderr(), "\nskipped: {line}");
    if let Some(path) = env::var_os(LIST) {
        let list = File::options().append(true).create(true).open(&path);
        // One write, so that the lines of tests that run at the same time stay whole.
        let noted = list.and_then(|mut list| list.write_all(line.as_bytes()));
        noted.unwrap_or_else(|error| panic!("{LIST} is {}: {error}", path.display()));
    }
    assert!(env::var_os("CI").is_none_or(|ci| ci.is_empty()), "skipped, and CI is set: {why}");
}

/// Whether these programs are installed; skips where one is not.
#[track_caller]
pub fn has_programs(programs: &[&str]) -> bool {
    let path = env::var_os("PATH").unwrap_or_default();
    let missing = programs.iter().find(|program| !env::split_paths(&path).any(|folder| folder.join(program).exists()));
    if let Some(program) = missing {
        skip(&format!("{program} is not installed (tests/run installs it on Debian as root)"));
    }
    missing.is_none()
}

/// Whether a launcher starts a program that does nothing; skips where it does not.
#[track_caller]
pub fn is_possible(launcher: &[&str]) -> bool {
    let possible = can_start(launcher);
    if !possible {
        skip(&format!("`{}` is not possible here", launcher.join(" ")));
    }
    possible
}

/// Whether a launcher starts a program that does nothing.
pub fn can_start(launcher: &[&str]) -> bool {
    let [program, args @ ..] = launcher else { panic!("a launcher has a name") };
    let tried = Command::new(program).args(args).arg("true").stdout(Stdio::null()).stderr(Stdio::null()).status();
    tried.is_ok_and(|status| status.success())
}

/// The name of the running test: that of its program, without cargo's hash, and of its thread. With `--test-threads=1` the thread has
/// no name, and the place is named.
#[track_caller]
fn test() -> String {
    let place = Location::caller();
    match thread::current().name() {
        Some(name) if name != "main" => format!("{}::{name}", target()),
        _ => format!("{}:{}", place.file(), place.line()),
    }
}

/// The name of the running test program, as `tests/run --test` takes it.
fn target() -> String {
    let program = env::current_exe().expect("a test knows its program");
    let name = program.file_stem().expect("a program has a name").to_string_lossy();
    name.rsplit_once('-').map_or_else(|| name.to_string(), |(target, _)| target.to_owned())
}
