//! Printing: every line to stdout and stderr goes through a bounded queue, and a thread of its own for each file.
//!
//! A terminal that takes nothing (Ctrl-S, a hung ssh) blocks `write(2)` for as long as it likes. So no thread that works writes:
//! it puts whole lines into a queue. Stdout and stderr share one queue where both lead to one file, so that lines keep their order.
//!
//! | | a terminal | a pipe or a file |
//! |---|---|---|
//! | lines that wait at most | 64 KiB | 8 MiB |
//! | further ones | are dropped; one line reports how many, once output is taken again | the same |
//! | a process that ends waits without progress for at most | 1 s | 5 s |
//!
//! A command whose only job is its output [waits for its reader](wait_for_reader) instead, and drops nothing.
//!
//! A reader that has ended, as `head` does, is no failure. Commands whose only job is output end with it, with status 0; those
//! with duties go on without it. Another failure of stdout, such as a full disk, is one line and a status that is not 0.

use std::backtrace::{Backtrace, BacktraceStatus};
use std::io::{self, Write};
use std::panic::{self, PanicHookInfo};
use std::sync::{Arc, OnceLock};
use std::thread;

use rustix::fs::fstat;

use super::queue::Stream;
use super::writer::Writer;
use crate::system::stop::StopFlag;

/// The writers of the two streams, which may be one.
#[derive(Debug)]
struct Output {
    stdout: Arc<Writer>,
    stderr: Arc<Writer>,
    /// Set where the process waits for its reader; then until this flag is set.
    waiting: OnceLock<Option<StopFlag>>,
}

static OUTPUT: OnceLock<Output> = OnceLock::new();

/// Starts the writers. Called first, so that their threads inherit no priority and no processor of a thread that works.
pub(crate) fn start() {
    output();
    panic::set_hook(Box::new(report_panic));
}

/// Has the process wait for the reader of its stdout from now on: for a command whose only job is output. `stop` ends the wait;
/// without one, signals end the process itself.
pub(crate) fn wait_for_reader(stop: Option<&StopFlag>) {
    // A second call changes nothing.
    let _ = output().waiting.set(stop.cloned());
}

/// Prints whole lines to stdout.
///
/// # Errors
/// Where the process waits for its reader: an earlier line could not be written. The first error of a stream comes with the line
/// after the one that met it, or with [`finish_stdout`].
pub(crate) fn print(lines: Vec<u8>) -> io::Result<()> {
    let Output { stdout, waiting, .. } = output();
    let Some(stop) = waiting.get() else {
        stdout.push(Stream::Stdout, lines);
        return Ok(());
    };
    stdout.push_waiting(Stream::Stdout, lines, || stop.as_ref().is_some_and(StopFlag::is_set));
    stdout.check()
}

/// Prints one line to stderr. Where that is gone, nobody is left to read it.
pub(crate) fn complain(line: &str) {
    output().stderr.push(Stream::Stderr, format!("{line}\n").into_bytes());
}

/// Replaces the live line of the terminal that stderr leads to; `None` takes it away. Elsewhere nothing is drawn.
pub(crate) fn set_live_line(text: Option<String>) {
    let stderr = &output().stderr;
    if stderr.is_terminal {
        stderr.set_live(text);
    }
}

/// Holds back, from now on, the lines of a terminal that is drawn on. Lines that lead elsewhere do not wait.
pub(crate) fn hold_terminal() {
    output().terminals().for_each(|terminal| terminal.hold(true));
}

/// Writes the lines that were held back, for as long as there is progress or patience.
pub(crate) fn release_terminal() {
    for terminal in output().terminals() {
        terminal.hold(false);
        terminal.flush(|| true);
    }
}

/// Writes to stdout in whole lines or pieces, as [`print()`] does, and to stderr in whole lines.
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

/// Draws on the whole terminal that stdout leads to, past all lines. Each flush is a frame, and waits until that is written. Once
/// the process ends, it waits only as long as the terminal takes something, and its patience after that.
pub(crate) struct Screen {
    frame: Vec<u8>,
    is_ending: Box<dyn Fn() -> bool>,
}

impl Screen {
    /// A screen of a process that ends from the moment at which `is_ending`.
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

/// Writes what waits for stdout, for as long as there is progress or patience.
///
/// # Errors
/// Where stdout has failed, but for a reader that has ended.
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

/// Writes what waits for stderr, for as long as there is progress or patience: the last that a process does.
pub(crate) fn finish_stderr() {
    output().stderr.flush(|| true);
}

/// A panic's message goes the way of all lines, and has time to leave: the process may end with the thread.
fn report_panic(panic: &PanicHookInfo<'_>) {
    let thread = thread::current();
    let message = format!("thread '{}' {panic}", thread.name().unwrap_or("unnamed"));
    let backtrace = Backtrace::capture();
    match backtrace.status() {
        BacktraceStatus::Captured => complain(&format!("{message}\n{backtrace}")),
        _ => complain(&message),
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
    /// The writers to a terminal. They may be one.
    fn terminals(&self) -> impl Iterator<Item = &Writer> {
        [&*self.stdout, &*self.stderr].into_iter().filter(|writer| writer.is_terminal)
    }
}

/// Whether both streams lead to one file.
fn is_one_file() -> bool {
    let file = |fd| fstat(fd).map(|stat| (stat.st_dev, stat.st_ino));
    let [stdout, stderr] = [file(rustix::stdio::stdout()), file(rustix::stdio::stderr())];
    stdout.is_ok() && stdout == stderr
}
