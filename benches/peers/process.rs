//! A process from its start to its end.

use std::process::{Command, Stdio};
use std::time::Instant;

/// Seconds that a process takes, and what it prints meanwhile.
///
/// # Panics
/// If it cannot be started or fails.
pub fn timed_output(command: &mut Command) -> (f64, Vec<u8>) {
    let begun = Instant::now();
    let output = command
        .stdin(Stdio::null())
        .stderr(Stdio::inherit())
        .output()
        .unwrap_or_else(|error| panic!("{command:?} does not start: {error}"));
    let seconds = begun.elapsed().as_secs_f64();
    assert!(output.status.success(), "{command:?} ended with {}", output.status);
    (seconds, output.stdout)
}

/// `bench-dragon solve` with its arguments, the answer as JSON.
pub fn solve(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bench-dragon"));
    command.arg("solve").args(arguments).args(["--format", "json"]);
    command
}
