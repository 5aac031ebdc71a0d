//! The children together: what they say, and their end.

use std::time::{Duration, Instant};

use crossbeam::channel::{self, Receiver, Sender};

use super::child::{Child, Environment, Event, Role};
use crate::command::output::complain;

/// How long a child may take to end: a recorder has to write what is in flight.
const PATIENCE: Duration = Duration::from_secs(30);
/// How often the end of a child is looked for.
const LOOK_PERIOD: Duration = Duration::from_millis(50);

/// The running children, at most one of each role, and one queue of what they say.
#[derive(Debug)]
pub(super) struct Children {
    running: Vec<(Role, Child)>,
    events: Receiver<Event>,
    sender: Sender<Event>,
}

impl Children {
    /// None yet.
    pub(super) fn new() -> Self {
        let (sender, events) = channel::unbounded();
        Self { running: Vec::new(), events, sender }
    }

    /// Starts a child.
    pub(super) fn start(&mut self, role: Role, args: &[String]) -> anyhow::Result<()> {
        self.start_in(role, args, &[])
    }

    /// Starts a child with more in its environment.
    pub(super) fn start_in(&mut self, role: Role, args: &[String], environment: Environment<'_>) -> anyhow::Result<()> {
        self.running.push((role, Child::start(role, args, environment, self.sender.clone())?));
        Ok(())
    }

    /// Whether a child has been started and not been waited for.
    pub(super) fn is_running(&self, role: Role) -> bool {
        self.running.iter().any(|(other, _)| *other == role)
    }

    /// What a child says next, if it comes before `timeout`.
    pub(super) fn next_event(&self, timeout: Duration) -> Option<Event> {
        self.events.recv_timeout(timeout).ok()
    }

    /// Kills a child, which then closes its stdout.
    pub(super) fn kill(&self, role: Role) {
        self.running.iter().filter(|(other, _)| *other == role).for_each(|(_, child)| child.kill());
    }

    /// Waits for a child that has closed its stdout, and says how it ended; `None` where it was waited for before.
    pub(super) fn reap(&mut self, role: Role) -> anyhow::Result<Option<std::process::ExitStatus>> {
        let Some(index) = self.running.iter().position(|(other, _)| *other == role) else { return Ok(None) };
        let (_, child) = self.running.swap_remove(index);
        Ok(Some(child.wait(PATIENCE)?))
    }

    /// Asks children to end, and hands over what they still say until they have.
    pub(super) fn end(
        &mut self,
        roles: &[Role],
        mut take_line: impl FnMut(Role, &str) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        let is_meant = |(role, _): &(Role, Child)| roles.contains(role);
        self.running.iter().filter(|child| is_meant(child)).for_each(|(_, child)| child.terminate());
        let deadline = Instant::now() + PATIENCE;
        while self.running.iter().any(is_meant) && Instant::now() < deadline {
            match self.next_event(LOOK_PERIOD) {
                Some(Event::Line(role, line)) => take_line(role, &line)?,
                Some(Event::Closed(role)) => match self.reap(role)? {
                    Some(status) if !status.success() => complain(&format!("{} ended with {status}", role.name())),
                    _ => {}
                },
                None => {}
            }
        }
        // Dropping a child kills it.
        self.running.retain(|child| !is_meant(child));
        Ok(())
    }
}
