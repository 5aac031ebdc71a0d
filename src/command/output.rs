//! Writing to stdout and stderr, without the panic of `println!` where nobody reads any more.

use std::fmt::Display;
use std::io::{self, Write as _};
use std::path::Path;

use bench_dragon::histogram::Percentiles;
use bench_dragon::record::Flaws;
use serde::Serialize;

/// Prints one line.
pub(crate) fn print_line(line: impl Display) -> io::Result<()> {
    print(format!("{line}\n").as_bytes())
}

/// Prints a value as one line of JSON.
pub(crate) fn print_json(value: &impl Serialize) -> anyhow::Result<()> {
    Ok(print_line(serde_json::to_string(value)?)?)
}

/// Prints lines that have their ends.
pub(crate) fn print_bytes(lines: &[u8]) -> anyhow::Result<()> {
    Ok(print(lines)?)
}

/// An error says what could not be written, and keeps its kind: nobody reading any more is none for `head`.
fn print(bytes: &[u8]) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    let printed = stdout.write_all(bytes).and_then(|()| stdout.flush());
    printed.map_err(|error| io::Error::new(error.kind(), format!("cannot write to stdout: {error}")))
}

/// Prints one line to stderr.
pub(crate) fn complain(line: &str) {
    // Where stderr is gone too, there is nobody left to tell.
    let _ = writeln!(io::stderr().lock(), "{line}");
}

/// Says what could not be read of a recording. `done` is what was done with the rest.
pub(crate) fn complain_of_flaws(recording: &Path, Flaws { cut, skipped_bytes }: Flaws, done: &str) {
    let file = recording.display();
    if cut {
        complain(&format!("{file} stops in the middle: what is whole of it was {done}"));
    }
    if skipped_bytes > 0 {
        complain(&format!("{skipped_bytes} bytes of {file} are damaged and were passed over"));
    }
}

/// Percentiles as one line has them.
pub(crate) fn percentiles(Percentiles { p50, p99, p999, max }: Percentiles) -> String {
    format!("p50 {p50:.1} p99 {p99:.1} p99.9 {p999:.1} max {max:.1}")
}

/// How far a show was behind the clock, behind the count of its overruns; nothing where it kept time.
pub(crate) fn behind(behind_s: f64, most_behind_s: f64) -> String {
    if most_behind_s == 0.0 {
        return String::new();
    }
    format!(", at most {most_behind_s:.3} s behind, {behind_s:.3} s at the end")
}
