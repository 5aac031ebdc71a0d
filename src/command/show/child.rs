//! The show's child processes: started, read line by line, asked to end.

use std::io::{BufRead as _, BufReader};
use std::os::unix::process::CommandExt as _;
use std::process::{Child as Process, Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Context as _;
use crossbeam::channel::Sender;
use rustix::process::{Pid, Signal, kill_process};

/// How often a child that was asked to end is looked at.
const LOOK_PERIOD: Duration = Duration::from_millis(2);

/// What a child does in the show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    Serve,
    Monitor,
    Record,
    View,
}

impl Role {
    /// The command that it runs.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Serve => "serve",
            Self::Monitor => "monitor",
            Self::Record => "record",
            Self::View => "view",
        }
    }
}

/// What a child's environment has beside the show's own: what others may not read in its arguments.
pub(super) type Environment<'a> = &'a [(&'a str, &'a str)];

/// What a child's reader has to tell.
#[derive(Debug)]
pub(super) enum Event {
    /// It has printed a line.
    Line(Role, String),
    /// It has closed its stdout: it is ending.
    Closed(Role),
}

/// A running child. One that is dropped without having been waited for is killed.
#[derive(Debug)]
pub(super) struct Child {
    role: Role,
    process: Process,
}

impl Child {
    /// Starts this program again as a child, in a process group of its own, so that the terminal's Ctrl-C reaches it
    /// only through the show. Every line that it prints comes as an event.
    pub(super) fn start(
        role: Role,
        args: &[String],
        environment: Environment<'_>,
        events: Sender<Event>,
    ) -> anyhow::Result<Self> {
        let program = std::env::current_exe().context("cannot find this program")?;
        let mut process = Command::new(program)
            .arg(role.name())
            .args(args)
            .args(["--format", "json", "--parent", &std::process::id().to_string()])
            .envs(environment.iter().copied())
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .process_group(0)
            .spawn()
            .with_context(|| format!("cannot start {}", role.name()))?;
        let stdout = process.stdout.take().expect("stdout is piped");
        thread::spawn(move || {
            for line in BufReader::new(stdout).lines().map_while(Result::ok) {
                if events.send(Event::Line(role, line)).is_err() {
                    return;
                }
            }
            // The show may have ended meanwhile.
            let _ = events.send(Event::Closed(role));
        });
        Ok(Self { role, process })
    }

    /// Asks it to end.
    pub(super) fn terminate(&self) {
        self.send(Signal::TERM);
    }

    /// Ends it at once.
    pub(super) fn kill(&self) {
        self.send(Signal::KILL);
    }

    fn send(&self, signal: Signal) {
        // It may have ended by itself; the process id stays its own until it is waited for.
        let _ = kill_process(Pid::from_child(&self.process), signal);
    }

    /// Waits for its end; kills it after `patience`.
    pub(super) fn wait(mut self, patience: Duration) -> anyhow::Result<ExitStatus> {
        let deadline = Instant::now() + patience;
        while Instant::now() < deadline {
            if let Some(status) = self.process.try_wait()? {
                return Ok(status);
            }
            thread::sleep(LOOK_PERIOD);
        }
        tracing::warn!("{} does not end: killing it", self.role.name());
        self.process.kill()?;
        Ok(self.process.wait()?)
    }
}

impl Drop for Child {
    fn drop(&mut self) {
        if matches!(self.process.try_wait(), Ok(None)) {
            // Reaped here or, where even that fails, by init.
            let _ = self.process.kill();
            let _ = self.process.wait();
        }
    }
}
