//! The show's children: registers and starts them, notes their signs of life, and plans their restarts.

use std::time::{Duration, Instant};

use crossbeam::channel::{self, Receiver, Sender};

use super::liveness::{LONGEST_DISK_SILENCE, LONGEST_LOOK, LONGEST_SILENCE, Liveness, Look, MAX_RESTARTS, Phase};
use super::process::{End, Launch, Process, ProcessEvent};
use super::wall_time::log;

/// Most lines that wait for the show. If the buffer is full, a child that prints waits until the show takes a line.
const MOST_EVENTS: usize = 256;
/// Period at which the show checks whether a child has ended.
const LOOK_PERIOD: Duration = Duration::from_millis(50);

pub(super) enum ChildNews {
    Line(ChildRole, String),
    Ended(ChildRole, End),
}

/// The registry of the children, one per role.
pub(super) struct Children {
    entries: Vec<Entry>,
    events: Receiver<ProcessEvent>,
    sender: Sender<ProcessEvent>,
    looked: Instant,
    /// Most restarts of a child in a row; `None` for any number.
    most_restarts: Option<u32>,
}

/// A registered child, running or not.
struct Entry {
    role: ChildRole,
    name: String,
    liveness: Liveness,
    process: Option<Process>,
}

impl Children {
    /// Children that a rehearsal gives up at some time, and a performance never.
    pub(super) fn new(is_performance: bool) -> Self {
        let (sender, events) = channel::bounded(MOST_EVENTS);
        let most_restarts = (!is_performance).then_some(MAX_RESTARTS);
        Self { entries: Vec::new(), events, sender, looked: Instant::now(), most_restarts }
    }

    /// Registers a child. Messages use `name`.
    pub(super) fn register(&mut self, role: ChildRole, name: impl Into<String>) {
        let longest_silence = if role == ChildRole::Record { LONGEST_DISK_SILENCE } else { LONGEST_SILENCE };
        let liveness = Liveness::new(longest_silence, self.most_restarts);
        self.entries.push(Entry { role, name: name.into(), liveness, process: None });
    }

    pub(super) fn start(&mut self, role: ChildRole, launch: Launch) -> anyhow::Result<()> {
        let process = Process::start(role, launch, self.sender.clone())?;
        let entry = self.entry_mut(role);
        entry.process = Some(process);
        entry.liveness.start();
        Ok(())
    }

    pub(super) fn name(&self, role: ChildRole) -> &str {
        &self.entry(role).name
    }

    /// Waits for the next line or end of a child, up to `timeout`.
    pub(super) fn next(&mut self, timeout: Duration) -> anyhow::Result<Option<ChildNews>> {
        match self.events.recv_timeout(timeout) {
            Ok((role, Some(line))) => return Ok(Some(ChildNews::Line(role, line))),
            Ok((role, None)) => self.entry_mut(role).process.iter_mut().for_each(Process::close),
            Err(_) => {}
        }
        self.entries.iter_mut().find_map(|entry| entry.poll_end().transpose()).transpose()
    }

    /// Writes the last line to the stdin of a child that runs and reads one.
    pub(super) fn write_last_line(&mut self, role: ChildRole, line: &str) {
        let entries = self.entries.iter_mut().filter(|entry| entry.role == role);
        entries.flat_map(|entry| &mut entry.process).for_each(|process| process.write_last_line(line));
    }

    pub(super) fn hear(&mut self, role: ChildRole) {
        self.entry_mut(role).liveness.hear();
    }

    /// Notes a sign of life of the child with this process id, if there is one.
    pub(super) fn hear_process(&mut self, pid: u32) {
        let is_meant = |entry: &&mut Entry| entry.process.as_ref().is_some_and(|process| process.pid() == pid);
        if let Some(entry) = self.entries.iter_mut().find(is_meant) {
            entry.liveness.hear();
        }
    }

    /// Kills the children that have given no sign of life for too long. Returns a message for each.
    pub(super) fn kill_silent(&mut self, now: Instant) -> Vec<String> {
        let elapsed = now.duration_since(self.looked).min(LONGEST_LOOK);
        self.looked = now;
        let has_frames = self.entry(ChildRole::Serve).liveness.sends_frames();
        self.entries.iter_mut().filter_map(|entry| entry.kill_if_silent(elapsed, has_frames)).collect()
    }

    /// Plans the restart of a child that has ended. Returns the delay before it; `None` if the child has ended too often.
    pub(super) fn plan_restart(&mut self, role: ChildRole, now: Instant) -> Option<Duration> {
        self.entry_mut(role).liveness.end(now)
    }

    pub(super) fn liveness(&mut self, role: ChildRole) -> &mut Liveness {
        &mut self.entry_mut(role).liveness
    }

    /// Returns the children whose restart is due.
    pub(super) fn due(&self, now: Instant) -> Vec<ChildRole> {
        self.entries.iter().filter(|entry| entry.liveness.is_due(now)).map(|entry| entry.role).collect()
    }

    /// Number of readers that a server finds if it starts now: monitor and recorder, unless the show goes on without them, and
    /// the other readers that run.
    pub(super) fn readers(&self) -> usize {
        let is_reader = |entry: &&Entry| match entry.role {
            ChildRole::Serve => false,
            ChildRole::View => entry.process.is_some(),
            // The server waits for them before it begins.
            ChildRole::Monitor | ChildRole::Record => !matches!(entry.liveness.phase, Phase::Over | Phase::Waiting),
            // A configured command needs some time to join the bus. One that has given a sign of life has joined.
            ChildRole::Also(_) => entry.liveness.has_lived,
        };
        self.entries.iter().filter(is_reader).count()
    }

    /// Requests the end of children, and passes their lines to `take_line` until they have ended. Kills those that take longer
    /// than `timeout`. Goes on after an error, and returns the first one.
    pub(super) fn end(
        &mut self,
        is_meant: impl Fn(ChildRole) -> bool,
        timeout: Duration,
        mut take_line: impl FnMut(ChildRole, &str) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        let of_meant = |entry: &Entry| entry.process.is_some() && is_meant(entry.role);
        self.entries
            .iter()
            .filter(|entry| of_meant(entry))
            .flat_map(|entry| &entry.process)
            .for_each(Process::terminate);
        let deadline = Instant::now() + timeout;
        let mut result = Ok(());
        while self.entries.iter().any(of_meant) && Instant::now() < deadline {
            let taken = match self.next(LOOK_PERIOD) {
                Ok(Some(ChildNews::Line(role, line))) => take_line(role, &line),
                Ok(Some(ChildNews::Ended(role, End { status, reason }))) if !status.success() => {
                    log(&format!("{} ended with {reason}", self.name(role)));
                    Ok(())
                }
                Ok(Some(ChildNews::Ended(..)) | None) => Ok(()),
                Err(error) => Err(error),
            };
            result = result.and(taken);
        }
        for entry in self.entries.iter_mut().filter(|entry| of_meant(entry)) {
            log(&format!("{} has not ended within {} s: killing it", entry.name, timeout.as_secs()));
            entry.process = None;
        }
        result
    }

    fn entry(&self, role: ChildRole) -> &Entry {
        self.entries.iter().find(|entry| entry.role == role).expect("every role of the show is registered")
    }

    fn entry_mut(&mut self, role: ChildRole) -> &mut Entry {
        self.entries.iter_mut().find(|entry| entry.role == role).expect("every role of the show is registered")
    }
}

impl Entry {
    fn poll_end(&mut self) -> anyhow::Result<Option<ChildNews>> {
        let Some(process) = &mut self.process else { return Ok(None) };
        let Some(end) = process.poll_end()? else { return Ok(None) };
        self.process = None;
        Ok(Some(ChildNews::Ended(self.role, end)))
    }

    fn kill_if_silent(&mut self, elapsed: Duration, has_frames: bool) -> Option<String> {
        let process = self.process.as_mut()?;
        let has_occasion = self.role == ChildRole::Serve || has_frames;
        let limit = self.liveness.look(Look { elapsed, is_stopped: process.is_stopped(), has_occasion })?;
        let seconds = limit.as_secs();
        process.kill(format!("no sign of life for {seconds} s"));
        Some(format!("{} has shown no sign of life for {seconds} s: killing it", self.name))
    }
}

/// The role of a child in the show, which identifies the child.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ChildRole {
    Serve,
    /// Measures clearances and, in a guarded show, is the guard.
    Monitor,
    Record,
    View,
    /// Runs the configuration's command of this number.
    Also(usize),
}
