//! Printing: every line to stdout and stderr passes through a bounded queue. Each file has a separate writer thread.
//!
//! A terminal that accepts no output (Ctrl-S, a stalled ssh) blocks `write(2)` for an unlimited time. So no working thread
//! writes. It adds whole lines to a queue. Stdout and stderr share one queue if both lead to the same file, so that lines keep
//! their order.
//!
//! | | a terminal | a pipe or a file |
//! |---|---|---|
//! | bound of the queue | 64 KiB | 8 MiB |
//! | lines over the bound | are dropped; one line reports their number, once output is accepted again | the same |
//! | longest wait without progress at the end of the process | 1 s | 5 s |
//!
//! A command whose only job is its output [waits for its reader](wait_for_reader) instead, and drops nothing.
//!
//! A reader that has ended, such as `head`, is not an error. Commands whose only job is output then end with status 0. Other
//! commands continue without the reader. Any other failure of stdout, such as a full disk, causes one error line and an exit
//! status other than 0.

use std::backtrace::{Backtrace, BacktraceStatus};
use std::io::{self, Write};
use std::panic::{self, PanicHookInfo};
use std::sync::{Arc, OnceLock};
use std::thread;

use rustix::fs::fstat;

use super::queue::Stream;
use super::writer::Writer;
use crate::system::stop::StopFlag;

/// Writers of the two streams; both may be the same writer.
#[derive(Debug)]
struct Output {
    stdout: Arc<Writer>,
    stderr: Arc<Writer>,
    /// Set if the process waits for its reader. The flag ends the wait.
    waiting: OnceLock<Option<StopFlag>>,
}

static OUTPUT: OnceLock<Output> = OnceLock::new();

/// Starts the writers. Call this first, so that their threads do not inherit the priority or the processor of a working thread.
pub(crate) fn start() {
    output();
    panic::set_hook(Box::new(report_panic));
}

/// From now on, the process waits for the reader of its stdout. For a command whose only job is output. `stop` ends the wait;
/// without it, signals end the process.
pub(crate) fn wait_for_reader(stop: Option<&StopFlag>) {
    // A second call has no effect.
    let _ = output().waiting.set(stop.cloned());
}

/// Prints whole lines to stdout.
///
/// # Errors
/// Only while the process waits for its reader: the first write error of stdout. Writing is asynchronous, so a later call or
/// [`finish_stdout`] returns the error.
pub(crate) fn print(lines: Vec<u8>) -> io::Result<()> {
    let Output { stdout, waiting, .. } = output();
    let Some(stop) = waiting.get() else {
        stdout.push(Stream::Stdout, lines);
        return Ok(());
    };
    stdout.push_waiting(Stream::Stdout, lines, || stop.as_ref().is_some_and(StopFlag::is_set));
    stdout.check()
}

/// Prints one line to stderr. Ignores a failed stderr.
pub(crate) fn print_to_stderr(line: &str) {
    output().stderr.push(Stream::Stderr, format!("{line}\n").into_bytes());
}

/// Replaces the live line, if stderr is a terminal. `None` removes it.
pub(crate) fn set_live_line(text: Option<String>) {
    let stderr = &output().stderr;
    if stderr.is_terminal {
        stderr.set_live(text);
    }
}

/// From now on, holds back lines to a terminal, while a screen is drawn on it. Does not hold back lines to other files.
pub(crate) fn hold_terminal() {
    output().terminals().for_each(|terminal| terminal.hold(true));
}

/// Writes the lines that were held back. Waits while the terminal makes progress, and then for its timeout.
pub(crate) fn release_terminal() {
    for terminal in output().terminals() {
        terminal.hold(false);
        terminal.flush(|| true);
    }
}

/// Writes whole lines or pieces to stdout, as [`print()`] does, and whole lines to stderr.
impl Write for Stream {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::Stdout => print(bytes.to_vec())?,
            Self::Stderr => output().stderr.push(Self::Stderr, bytes.to_vec()),
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A full-screen display on the terminal of stdout. Its frames overtake all lines in the queue. Each flush sends one frame and
/// waits until it is written. While the process ends, the flush waits only while the terminal makes progress, and then for its
/// timeout.
pub(crate) struct Screen {
    frame: Vec<u8>,
    is_ending: Box<dyn Fn() -> bool>,
}

impl Screen {
    /// A screen of a process that ends as soon as `is_ending` returns true.
    pub(crate) fn new(is_ending: impl Fn() -> bool + 'static) -> Self {
        Self { frame: Vec::new(), is_ending: Box::new(is_ending) }
    }
}

impl Write for Screen {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.frame.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        let stdout = &output().stdout;
        stdout.push_screen(&std::mem::take(&mut self.frame));
        stdout.flush(&self.is_ending);
        stdout.check()
    }
}

/// Writes the queued lines of stdout. Waits while stdout makes progress, and then for its timeout.
///
/// # Errors
/// The first write error of stdout, unless its reader has ended.
pub(crate) fn finish_stdout() -> io::Result<()> {
    let Output { stdout, stderr, waiting } = output();
    set_live_line(None);
    let is_stopped = || waiting.get().is_none_or(|stop| stop.as_ref().is_some_and(StopFlag::is_set));
    if !stdout.flush(is_stopped) && !Arc::ptr_eq(stdout, stderr) && !stdout.is_terminal {
        stderr.push(Stream::Stderr, stdout.report(stdout.unseen()));
    }
    let failure = stdout.failure(Stream::Stdout).filter(|failure| !failure.is_end_of_reader);
    failure.map_or(Ok(()), |failure| Err(failure.error()))
}

/// Writes the queued lines of stderr as the last action of the process. Waits while stderr makes progress, and then for its
/// timeout.
pub(crate) fn finish_stderr() {
    output().stderr.flush(|| true);
}

/// Prints the message of a panic through the queue, and waits until it is written: the process may end with the thread.
fn report_panic(panic: &PanicHookInfo<'_>) {
    let thread = thread::current();
    let message = format!("thread '{}' {panic}", thread.name().unwrap_or("unnamed"));
    let backtrace = Backtrace::capture();
    match backtrace.status() {
        BacktraceStatus::Captured => print_to_stderr(&format!("{message}\n{backtrace}")),
        _ => print_to_stderr(&message),
    }
    finish_stderr();
}

fn output() -> &'static Output {
    OUTPUT.get_or_init(|| {
        if is_one_file() {
            let both = Writer::start(Stream::Stdout, None);
            return Output { stdout: Arc::clone(&both), stderr: both, waiting: OnceLock::new() };
        }
        let stderr = Writer::start(Stream::Stderr, None);
        Output { stdout: Writer::start(Stream::Stdout, Some(Arc::clone(&stderr))), stderr, waiting: OnceLock::new() }
    })
}

impl Output {
    /// Writers to a terminal; both may be the same writer.
    fn terminals(&self) -> impl Iterator<Item = &Writer> {
        [&*self.stdout, &*self.stderr].into_iter().filter(|writer| writer.is_terminal)
    }
}

/// Whether both streams lead to the same file.
fn is_one_file() -> bool {
    let file = |fd| fstat(fd).map(|stat| (stat.st_dev, stat.st_ino));
    let [stdout, stderr] = [file(rustix::stdio::stdout()), file(rustix::stdio::stderr())];
    stdout.is_ok() && stdout == stderr
}
