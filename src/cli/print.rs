//! Printing for the commands: lines and JSON for [`crate::output`], and the progress bar of a long answer.

use std::fmt::Display;
use std::io;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde::Serialize;

use crate::cli::flags::Format;
use crate::output::histogram::Percentiles;
use crate::output::terminal_text::Printable;
use crate::output::{bar, json, print, set_live_line};
use crate::recording::Flaws;

pub(crate) use crate::output::print_to_stderr;

pub(crate) fn print_line(line: impl Display) -> io::Result<()> {
    print(format!("{line}\n").into_bytes())
}

/// Prints a value as one line of JSON.
pub(crate) fn print_json(value: &impl Serialize) -> anyhow::Result<()> {
    Ok(print(json::line(value)?)?)
}

/// Prints a value as JSON, or its text for people, both on stdout.
pub(crate) fn print_report(format: Format, value: &impl Serialize, text: impl Display) -> anyhow::Result<()> {
    match format {
        Format::Json => print_json(value),
        Format::Text => Ok(print_line(text)?),
    }
}

/// Prints a value as JSON on stdout, or its text for people on stderr.
pub(crate) fn print_notice(format: Format, value: &impl Serialize, text: &str) -> anyhow::Result<()> {
    match format {
        Format::Json => print_json(value),
        Format::Text => {
            print_to_stderr(text);
            Ok(())
        }
    }
}

/// Prints lines that already end in line feeds.
pub(crate) fn print_bytes(lines: impl Into<Vec<u8>>) -> anyhow::Result<()> {
    Ok(print(lines.into())?)
}

/// Reports the parts of a recording that could not be read. `done` is the verb for the other parts, such as "exported".
pub(crate) fn warn_of_flaws(recording: &Path, Flaws { cut, skipped_bytes }: Flaws, done: &str) {
    let file = Printable(recording);
    if cut {
        print_to_stderr(&format!("{file} stops in the middle: its complete part was {done}"));
    }
    if skipped_bytes > 0 {
        print_to_stderr(&format!("{skipped_bytes} bytes of {file} are damaged and were skipped"));
    }
}

/// Percentiles in one line.
pub(crate) fn percentiles(Percentiles { p50, p99, p999, max }: Percentiles) -> String {
    format!("p50 {p50:.1} p99 {p99:.1} p99.9 {p999:.1} max {max:.1}")
}

/// Lag of a show behind the clock, to follow the count of its overruns. Empty if the show kept time.
pub(crate) fn behind(behind_s: f64, most_behind_s: f64) -> String {
    if most_behind_s == 0.0 {
        return String::new();
    }
    format!(", at most {most_behind_s:.3} s behind, {behind_s:.3} s at the end")
}

/// Delay before the bar appears. A faster answer shows no bar.
const BAR_DELAY: Duration = Duration::from_millis(500);
/// Shortest time between two drawings of the bar.
const DRAW_PERIOD: Duration = Duration::from_millis(50);

/// Whether progress is printed as lines, for a parent that reads them.
static IS_PRINTED: AtomicBool = AtomicBool::new(false);

/// From now on, progress is also printed as lines of stderr.
pub(crate) fn print_progress() {
    IS_PRINTED.store(true, Ordering::Relaxed);
}

/// A progress bar, removed when it is dropped. It is drawn only if stderr is a terminal.
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
        Self { what, total, state: Mutex::new(State { done: 0.0, due: Instant::now() + BAR_DELAY }) }
    }

    /// Adds completed work.
    pub(crate) fn add(&self, work: f64) {
        self.change(|done| done + work);
    }

    /// Sets the completed work.
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
            if IS_PRINTED.load(Ordering::Relaxed) {
                print_to_stderr(&format!("progress {fraction:.3}"));
            }
            set_live_line(Some(format!("{} {:>3.0} %  {}", bar(fraction), fraction * 100.0, self.what)));
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        set_live_line(None);
    }
}
