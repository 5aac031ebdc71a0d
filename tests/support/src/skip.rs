//! Skipped tests, which lack a program or a right on this machine. `tests/run` counts and names them at the end. If `CI` is
//! set, such a test fails.

use std::env;
use std::fs::File;
use std::io::Write as _;
use std::panic::Location;
use std::process::{Command, Stdio};
use std::thread;

/// Environment variable with the path of the list of skipped tests, one per line, for `tests/run`.
const LIST: &str = "BENCH_DRAGON_SKIPPED";

/// Notes that the running test is skipped, at least in part. `why` names the missing requirement.
///
/// # Panics
/// If `CI` is set: there, no requirement may be missing.
#[track_caller]
pub fn skip(why: &str) {
    let line = format!("{}: {why}\n", test());
    // The test runner hides the output of passing tests, and stderr may be closed.
    let _ = write!(std::io::stderr(), "\nskipped: {line}");
    if let Some(path) = env::var_os(LIST) {
        let list = File::options().append(true).create(true).open(&path);
        // One write per line keeps the lines of parallel tests whole.
        let noted = list.and_then(|mut list| list.write_all(line.as_bytes()));
        noted.unwrap_or_else(|error| panic!("{LIST} is {}: {error}", path.display()));
    }
    assert!(env::var_os("CI").is_none_or(|ci| ci.is_empty()), "skipped, and CI is set: {why}");
}

/// Whether these programs are installed. Skips the test if one is missing.
#[track_caller]
pub fn has_programs(programs: &[&str]) -> bool {
    let path = env::var_os("PATH").unwrap_or_default();
    let missing = programs.iter().find(|program| !env::split_paths(&path).any(|folder| folder.join(program).exists()));
    if let Some(program) = missing {
        skip(&format!("{program} is not installed (tests/run installs it on Debian as root)"));
    }
    missing.is_none()
}

/// Whether a launcher can start `true`. Skips the test if it cannot.
#[track_caller]
pub fn is_possible(launcher: &[&str]) -> bool {
    let possible = can_start(launcher);
    if !possible {
        skip(&format!("`{}` is not possible here", launcher.join(" ")));
    }
    possible
}

/// Whether a launcher can start `true`.
pub fn can_start(launcher: &[&str]) -> bool {
    let [program, args @ ..] = launcher else { panic!("a launcher has a name") };
    let tried = Command::new(program).args(args).arg("true").stdout(Stdio::null()).stderr(Stdio::null()).status();
    tried.is_ok_and(|status| status.success())
}

/// Returns the name of the running test: its program without cargo's hash, and its thread. With `--test-threads=1` the thread
/// has no name; then file and line are used.
#[track_caller]
fn test() -> String {
    let place = Location::caller();
    match thread::current().name() {
        Some(name) if name != "main" => format!("{}::{name}", target()),
        _ => format!("{}:{}", place.file(), place.line()),
    }
}

/// Returns the name of the running test program, as `tests/run --test` accepts it.
fn target() -> String {
    let program = env::current_exe().expect("a test knows its program");
    let name = program.file_stem().expect("a program has a name").to_string_lossy();
    name.rsplit_once('-').map_or_else(|| name.to_string(), |(target, _)| target.to_owned())
}
