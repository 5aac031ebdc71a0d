//! Lists that tests add lines to, for the scripts that run them.

use std::env;
use std::fs::File;
use std::io::Write as _;
use std::panic::Location;
use std::thread;

/// Adds a line to the list whose path is in this environment variable, if it is set.
pub(crate) fn note(variable: &str, line: &str) {
    let Some(path) = env::var_os(variable) else { return };
    let list = File::options().append(true).create(true).open(&path);
    // One write per line keeps the lines of parallel tests whole.
    let noted = list.and_then(|mut list| list.write_all(line.as_bytes()));
    noted.unwrap_or_else(|error| panic!("{variable} is {}: {error}", path.display()));
}

/// Returns the name of the running test: its program without cargo's hash, and its thread. A thread without a name has file and
/// line instead.
#[track_caller]
pub(crate) fn test() -> String {
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
