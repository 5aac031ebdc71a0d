//! Time and output of a whole process.

use std::process::{Command, Stdio};
use std::time::Instant;

/// Runs a process. Returns its time in seconds and its output.
///
/// # Panics
/// If the process cannot start, or fails.
pub fn timed_output(command: &mut Command) -> (f64, Vec<u8>) {
    let begun = Instant::now();
    let output = command
        .stdin(Stdio::null())
        .stderr(Stdio::inherit())
        .output()
        .unwrap_or_else(|error| panic!("cannot start {command:?}: {error}"));
    let seconds = begun.elapsed().as_secs_f64();
    assert!(output.status.success(), "{command:?} ended with {}", output.status);
    (seconds, output.stdout)
}

/// Returns the command `bench-dragon solve` with these arguments and JSON output.
pub fn solve(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bench-dragon"));
    command.arg("solve").args(arguments).args(["--format", "json"]);
    command
}
