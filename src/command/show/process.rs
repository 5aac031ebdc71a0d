//! A child's process: started, read line by line, asked to end, waited for.

use std::fs::File;
use std::io::{BufRead as _, BufReader};
use std::os::unix::process::CommandExt as _;
use std::process::{Child, ChildStdout, Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Context as _;
use crossbeam::channel::Sender;
use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process, waitid};

use super::children::ChildRole;
use crate::command::parent::kill_with_parent;

/// How long a process that has closed its stdout may take to end, and one that was asked to.
pub(super) const PATIENCE: Duration = Duration::from_secs(30);
/// How long a process that was killed is waited for: the kernel may still be busy for it.
const REAP_PATIENCE: Duration = Duration::from_secs(1);
/// How often a killed process is looked at.
const LOOK_PERIOD: Duration = Duration::from_millis(2);

/// A line of a child's stdout; none once it has closed that, for it is ending.
pub(super) type ProcessEvent = (ChildRole, Option<String>);

/// How a child has ended.
pub(super) struct End {
    pub(super) status: ExitStatus,
    /// Why: the status, or why the show has killed it.
    pub(super) reason: String,
}

/// How a child is started.
pub(super) struct Launch {
    /// The command and its arguments.
    pub(super) args: Vec<String>,
    /// What its environment has beside the show's own: what others may not read in its arguments.
    pub(super) environment: Vec<(&'static str, String)>,
    /// The file that takes its output; without one, its lines are events.
    pub(super) output: Option<File>,
}

/// A running process. One that is dropped without having been waited for is killed.
pub(super) struct Process {
    child: Child,
    stdout: Stdout,
    /// Why it was killed.
    killed: Option<String>,
}

/// What has become of a child's stdout.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stdout {
    /// It is a file.
    File,
    /// Lines may come.
    Open,
    /// All lines have come.
    Closed(Instant),
}

impl Process {
    /// Starts this program again, in a process group of its own, so that the terminal's Ctrl-C reaches it only through the
    /// show. Every line that it prints comes as an event.
    ///
    /// The kernel signals the child when the *thread* ends that has started it. Only the main thread calls this, and it ends
    /// with the show.
    pub(super) fn start(role: ChildRole, launch: Launch, events: Sender<ProcessEvent>) -> anyhow::Result<Self> {
        let Launch { args, environment, output } = launch;
        let program = std::env::current_exe().context("cannot find this program")?;
        let is_read = output.is_none();
        let name = args.first().cloned().unwrap_or_default();
        let mut command = Command::new(program);
        command.args(args).args(["--parent", &std::process::id().to_string()]).envs(environment);
        command.stdin(Stdio::null()).stdout(output.map_or_else(Stdio::piped, Stdio::from)).process_group(0);
        let started = kill_with_parent(&mut command).spawn();
        let mut child = started.with_context(|| format!("cannot start {name}"))?;
        let stdout = child.stdout.take();
        let process = Self { child, stdout: if is_read { Stdout::Open } else { Stdout::File }, killed: None };
        if let Some(stdout) = stdout {
            // It ends with the child's stdout.
            let reader = thread::Builder::new().name(name.clone());
            reader.spawn(move || read(role, stdout, &events)).with_context(|| format!("cannot read from {name}"))?;
        }
        Ok(process)
    }

    pub(super) fn pid(&self) -> u32 {
        self.child.id()
    }

    pub(super) fn close(&mut self) {
        self.stdout = Stdout::Closed(Instant::now());
    }

    /// Asks it to end, also where it is stopped.
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

    /// How it has ended, once all its lines have come: never waits. Kills it where it has closed its stdout and does not end.
    pub(super) fn poll_end(&mut self) -> anyhow::Result<Option<End>> {
        match self.stdout {
            Stdout::Open => return Ok(None),
            Stdout::Closed(at) if at.elapsed() > PATIENCE && self.killed.is_none() => {
                self.kill(format!("no end within {} s", PATIENCE.as_secs()));
            }
            Stdout::File | Stdout::Closed(_) => {}
        }
        let Some(status) = self.child.try_wait()? else { return Ok(None) };
        Ok(Some(End { status, reason: self.killed.clone().unwrap_or_else(|| status.to_string()) }))
    }

    fn send(&self, signal: Signal) {
        // It may have ended by itself; the process id stays its own until it is waited for.
        let _ = kill_process(Pid::from_child(&self.child), signal);
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let deadline = Instant::now() + REAP_PATIENCE;
        while matches!(self.child.try_wait(), Ok(None)) && Instant::now() < deadline {
            // Init reaps it where that takes longer.
            let _ = self.child.kill();
            thread::sleep(LOOK_PERIOD);
        }
    }
}

/// Reads lines until the child closes its stdout, or the show has ended.
fn read(role: ChildRole, stdout: ChildStdout, events: &Sender<ProcessEvent>) {
    for line in BufReader::new(stdout).lines().map_while(Result::ok) {
        if events.send((role, Some(line))).is_err() {
            return;
        }
    }
    // The show may have ended meanwhile.
    let _ = events.send((role, None));
}
