//! Lines for stdout and stderr, on their way to [`crate::output`].

use std::fmt::Display;
use std::io;
use std::path::Path;

use serde::Serialize;

use crate::command::printable::Printable;
use crate::output::histogram::Percentiles;
use crate::output::print;
use crate::recording::Flaws;

pub(crate) use crate::output::complain;

/// Prints one line.
pub(crate) fn print_line(line: impl Display) -> io::Result<()> {
    print(format!("{line}\n").into_bytes())
}

/// Prints a value as one line of JSON.
pub(crate) fn print_json(value: &impl Serialize) -> anyhow::Result<()> {
    let mut line = serde_json::to_vec(value)?;
    line.push(b'\n');
    Ok(print(line)?)
}

/// Prints lines that have their ends.
pub(crate) fn print_bytes(lines: impl Into<Vec<u8>>) -> anyhow::Result<()> {
    Ok(print(lines.into())?)
}

/// Says what could not be read of a recording. `done` is what was done with the rest.
pub(crate) fn complain_of_flaws(recording: &Path, Flaws { cut, skipped_bytes }: Flaws, done: &str) {
    let file = Printable(recording);
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
