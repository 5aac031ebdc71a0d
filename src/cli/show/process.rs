//! The process of a child: starts it, reads its lines, requests its end and waits for it.

use std::fs::File;
use std::io::{BufRead as _, BufReader, Write as _};
use std::os::unix::process::CommandExt as _;
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Context as _;
use crossbeam::channel::Sender;
use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process, waitid};

use super::children::ChildRole;
use crate::cli::exit_status::DISK_FULL;
use crate::cli::parent::kill_with_parent;

/// The reason of a recorder that ended for want of room.
const FULL_DISK: &str = "its disk is full";

/// Longest time from the close of a child's stdout, or from the request to end, to the child's end.
pub(super) const END_TIMEOUT: Duration = Duration::from_secs(30);
/// Longest wait for a killed process, for which the kernel may still be busy.
const REAP_TIMEOUT: Duration = Duration::from_secs(1);
/// Period at which a killed process is checked.
const LOOK_PERIOD: Duration = Duration::from_millis(2);

/// Least size of a pipe's buffer, in bytes (`pipe(7)`).
const PIPE_BUFFER_BYTES: usize = 4096;

/// A line of a child's stdout; `None` once the child has closed its stdout, because it is ending.
pub(super) type ProcessEvent = (ChildRole, Option<String>);

/// The end of a child.
pub(super) struct End {
    pub(super) status: ExitStatus,
    /// The reason: the exit status, or the reason for which the show killed the child.
    pub(super) reason: String,
}

/// The command line, environment and output of a child.
pub(super) struct Launch {
    /// The command and its arguments.
    pub(super) args: Vec<String>,
    /// Environment variables besides the show's own. They hold secrets, because other users can read arguments.
    pub(super) environment: Vec<(&'static str, String)>,
    /// File for the child's output. Without a file, the child's lines are events.
    pub(super) output: Option<File>,
    /// Whether the child reads a last line from its stdin.
    pub(super) reads_last_line: bool,
}

/// A running process. It is killed if it is dropped before its end.
pub(super) struct Process {
    child: Child,
    stdout: Stdout,
    /// The pipe for the last line, while it is open.
    stdin: Option<ChildStdin>,
    /// The reason for which the show killed it.
    killed: Option<String>,
}

/// The state of a child's stdout.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stdout {
    /// The output goes to a file.
    File,
    /// Lines may arrive.
    Open,
    /// All lines have arrived.
    Closed(Instant),
}

impl Process {
    /// Starts this program as a child, in a separate process group, so that the terminal's Ctrl-C reaches it only through the
    /// show. Every line that the child prints is an event.
    ///
    /// The kernel signals the child when the *thread* that has started it ends. So only the main thread may call this, which
    /// ends with the show.
    pub(super) fn start(role: ChildRole, launch: Launch, events: Sender<ProcessEvent>) -> anyhow::Result<Self> {
        let Launch { args, environment, output, reads_last_line } = launch;
        let program = std::env::current_exe().context("cannot find this program")?;
        let is_read = output.is_none();
        let name = args.first().cloned().unwrap_or_default();
        let mut command = Command::new(program);
        command.args(args).args(["--parent", &std::process::id().to_string()]).envs(environment);
        let stdin = if reads_last_line { Stdio::piped() } else { Stdio::null() };
        command.stdin(stdin).stdout(output.map_or_else(Stdio::piped, Stdio::from)).process_group(0);
        let started = kill_with_parent(&mut command).spawn();
        let mut child = started.with_context(|| format!("cannot start {name}"))?;
        let (stdin, stdout) = (child.stdin.take(), child.stdout.take());
        let process = Self { child, stdin, stdout: if is_read { Stdout::Open } else { Stdout::File }, killed: None };
        if let Some(stdout) = stdout {
            // This thread ends when the child's stdout closes.
            let reader = thread::Builder::new().name(name.clone());
            reader.spawn(move || read(role, stdout, &events)).with_context(|| format!("cannot read from {name}"))?;
        }
        Ok(process)
    }

    pub(super) fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Writes the last line to the child's stdin and closes it, if the child reads one. The pipe is empty and has room for a
    /// line of this length, so this never waits.
    pub(super) fn write_last_line(&mut self, line: &str) {
        let line = format!("{line}\n");
        if let Some(mut stdin) = self.stdin.take().filter(|_| line.len() <= PIPE_BUFFER_BYTES) {
            // A child that has ended reads nothing.
            let _ = stdin.write_all(line.as_bytes());
        }
    }

    pub(super) fn close(&mut self) {
        self.stdout = Stdout::Closed(Instant::now());
    }

    /// Requests the end of the process, and continues it if it is stopped.
    pub(super) fn terminate(&self) {
        self.send(Signal::TERM);
        self.send(Signal::CONT);
    }

    pub(super) fn kill(&mut self, reason: String) {
        self.killed = Some(reason);
        self.send(Signal::KILL);
    }

    pub(super) fn is_stopped(&self) -> bool {
        let options = WaitIdOptions::STOPPED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        matches!(waitid(WaitId::Pid(Pid::from_child(&self.child)), options), Ok(Some(status)) if status.stopped())
    }

    /// Returns the end of the process, once all its lines have arrived. Never waits. Kills a process that has closed its stdout
    /// but does not end within [`END_TIMEOUT`].
    pub(super) fn poll_end(&mut self) -> anyhow::Result<Option<End>> {
        match self.stdout {
            Stdout::Open => return Ok(None),
            Stdout::Closed(at) if at.elapsed() > END_TIMEOUT && self.killed.is_none() => {
                self.kill(format!("no end within {} s", END_TIMEOUT.as_secs()));
            }
            Stdout::File | Stdout::Closed(_) => {}
        }
        let Some(status) = self.child.try_wait()? else { return Ok(None) };
        let exit = || if status.code() == Some(DISK_FULL.into()) { FULL_DISK.to_owned() } else { status.to_string() };
        Ok(Some(End { status, reason: self.killed.clone().unwrap_or_else(exit) }))
    }

    fn send(&self, signal: Signal) {
        // A failure is ignored: the process may have ended. Its process id is not reused before it is waited for.
        let _ = kill_process(Pid::from_child(&self.child), signal);
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let deadline = Instant::now() + REAP_TIMEOUT;
        while matches!(self.child.try_wait(), Ok(None)) && Instant::now() < deadline {
            // If this takes longer, init reaps the process.
            let _ = self.child.kill();
            thread::sleep(LOOK_PERIOD);
        }
    }
}

/// Reads lines until the child closes its stdout, or until the show has ended.
fn read(role: ChildRole, stdout: ChildStdout, events: &Sender<ProcessEvent>) {
    for line in BufReader::new(stdout).lines().map_while(Result::ok) {
        if events.send((role, Some(line))).is_err() {
            return;
        }
    }
    // The send fails if the show has ended.
    let _ = events.send((role, None));
}
