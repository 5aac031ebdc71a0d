//! What commands print: lines and JSON on their way to [`crate::output`], and the bar of a long answer.

use std::fmt::Display;
use std::io;
use std::path::Path;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use serde::Serialize;

use crate::command::flags::Format;
use crate::output::histogram::Percentiles;
use crate::output::terminal_text::Printable;
use crate::output::{bar, print, set_live_line};
use crate::recording::Flaws;

pub(crate) use crate::output::complain;

pub(crate) fn print_line(line: impl Display) -> io::Result<()> {
    print(format!("{line}\n").into_bytes())
}

/// Prints a value as one line of JSON.
pub(crate) fn print_json(value: &impl Serialize) -> anyhow::Result<()> {
    let mut line = serde_json::to_vec(value)?;
    line.push(b'\n');
    Ok(print(line)?)
}

/// Prints a value for machines, or its text for people.
pub(crate) fn print_report(format: Format, value: &impl Serialize, text: impl Display) -> anyhow::Result<()> {
    match format {
        Format::Json => print_json(value),
        Format::Text => Ok(print_line(text)?),
    }
}

/// Prints a value for machines on stdout, or its text for people on stderr.
pub(crate) fn print_notice(format: Format, value: &impl Serialize, text: &str) -> anyhow::Result<()> {
    match format {
        Format::Json => print_json(value),
        Format::Text => {
            complain(text);
            Ok(())
        }
    }
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

/// An answer that is there sooner shows no bar.
const PATIENCE: Duration = Duration::from_millis(500);
/// The bar is drawn anew this often at most.
const DRAW_PERIOD: Duration = Duration::from_millis(50);

/// The bar, taken away when it is dropped. Where stderr is no terminal it is not drawn.
pub(crate) struct Progress {
    what: &'static str,
    total: f64,
    state: Mutex<State>,
}

struct State {
    done: f64,
    due: Instant,
}

impl Progress {
    pub(crate) fn new(what: &'static str, total: f64) -> Self {
        Self { what, total, state: Mutex::new(State { done: 0.0, due: Instant::now() + PATIENCE }) }
    }

    /// So much more is done.
    pub(crate) fn add(&self, work: f64) {
        self.change(|done| done + work);
    }

    /// So much is done.
    pub(crate) fn set(&self, work: f64) {
        self.change(|_| work);
    }

    fn change(&self, change: impl FnOnce(f64) -> f64) {
        let mut state = self.state.lock().expect("nothing panics under the lock");
        state.done = change(state.done);
        let now = Instant::now();
        if now >= state.due {
            state.due = now + DRAW_PERIOD;
            let fraction = state.done / self.total;
            set_live_line(Some(format!("{} {:>3.0} %  {}", bar(fraction), fraction * 100.0, self.what)));
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        set_live_line(None);
    }
}
