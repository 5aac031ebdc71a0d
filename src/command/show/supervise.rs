//! What a show does while it plays: it takes news of its children, looks at the bus, and starts again what has ended.

use std::time::{Duration, Instant};

use anyhow::bail;

use super::children::ChildRole;
use super::files::Repaired;
use super::liveness::{MAX_RESTARTS, Phase, WINDOW};
use super::process::End;
use super::{Show, ShowPorts};
use crate::command::exit_status::DISK_FULL;
use crate::command::print::complain;
use crate::recording::Size;

/// Room from which a show is recorded again, in bytes: some seconds of a large dragon at least.
const LEAST_ROOM_BYTES: u64 = 256 << 20;
/// How often a show whose disk is full looks for room.
const ROOM_PERIOD: Duration = Duration::from_secs(1);

impl Show<'_> {
    pub(super) fn take_line(&mut self, role: ChildRole, line: &str) -> anyhow::Result<()> {
        match role {
            ChildRole::Serve if self.bus.is_none() => self.join_bus()?,
            // A server's signs of life are its frames.
            ChildRole::Serve => {}
            ChildRole::View if !self.page.as_ref().is_some_and(|page| page.is_announced) => {
                self.announce_page(line)?;
                self.start(ChildRole::Serve)?;
            }
            _ => self.children.hear(role),
        }
        self.reports.take_line(role, line)
    }

    /// Takes the end of a child before that of the show.
    pub(super) fn take_end(&mut self, role: ChildRole, end: &End) -> anyhow::Result<()> {
        self.look_at_bus()?;
        let status = end.status;
        match role {
            // Somebody asked the server to stop, or it has reached the time asked for.
            ChildRole::Serve if status.success() => return self.end_with_server(),
            // It has given its reason on stderr. One that was killed has none.
            ChildRole::Serve if self.bus.is_none() && status.code().is_some() => {
                bail!("the server does not start: it ended with {status}");
            }
            ChildRole::View if !self.page.as_ref().is_some_and(|page| page.is_announced) => {
                bail!("the page does not start: it ended with {status}");
            }
            ChildRole::Monitor => self.reports.close_monitor(),
            ChildRole::Record => {
                self.finish_recording();
                if status.code() == Some(DISK_FULL.into()) {
                    self.wait_for_room(end);
                    return Ok(());
                }
            }
            ChildRole::Serve | ChildRole::View | ChildRole::Also(_) => {}
        }
        self.plan_restart(role, &format!("ended with {status}"), &end.reason)
    }

    /// Has the file finished of a recorder that did not do so itself.
    pub(super) fn finish_recording(&mut self) {
        if let Some(recording) = self.reports.open_recording.take() {
            self.repairs.finish_own(recording);
        }
    }

    pub(super) fn supervise(&mut self) -> anyhow::Result<()> {
        self.look_at_bus()?;
        self.begin_others()?;
        let now = Instant::now();
        self.look_for_room(now);
        for line in self.children.kill_silent(now) {
            complain(&line);
        }
        for role in self.children.due(now) {
            self.start_again(role)?;
        }
        for repaired in self.repairs.poll() {
            self.count_repaired(repaired);
        }
        Ok(())
    }

    pub(super) fn look_at_bus(&mut self) -> anyhow::Result<()> {
        let Some(bus) = &mut self.bus else { return Ok(()) };
        if let Some(frame) = bus.frames.latest()? {
            let header = frame.header();
            self.children.hear(ChildRole::Serve);
            self.reports.totals.see_frame(header);
            self.reports.line.update(header, &self.reports.progress);
            self.seen.see_frame(header);
        }
        if let Some(status) = bus.status.poll()? {
            self.reports.totals.see_status(&status);
            self.seen.status = Some(status);
        }
        for pid in bus.living_readers() {
            self.children.hear_process(pid);
        }
        Ok(())
    }

    pub(super) fn count_repaired(&mut self, Repaired { frames, line }: Repaired) {
        self.reports.totals.summary.frames.recorded += frames.unwrap_or_default();
        complain(&line);
    }

    /// Joins the bus of the first server, for which its readers are started.
    fn join_bus(&mut self) -> anyhow::Result<()> {
        match ShowPorts::open(&self.domain) {
            // It was killed as soon as it was there: its end comes next.
            Err(error) if error.is_absent() => Ok(()),
            Err(error) => Err(error.into()),
            Ok(bus) => {
                self.bus = Some(bus);
                self.start(ChildRole::Monitor)?;
                self.start(ChildRole::Record)
            }
        }
    }

    /// Starts, once frames come, what the first of them does not wait for.
    fn begin_others(&mut self) -> anyhow::Result<()> {
        if self.has_begun || self.seen.header.is_none() {
            return Ok(());
        }
        self.has_begun = true;
        self.repairs.finish_earlier(self.folder.and_earlier());
        (0..self.also.len()).try_for_each(|number| self.start_again(ChildRole::Also(number)))
    }

    /// Starts a child whose failure does not end the show at once.
    fn start_again(&mut self, role: ChildRole) -> anyhow::Result<()> {
        match self.start(role) {
            Ok(()) => Ok(()),
            Err(error) => self.plan_restart(role, &format!("is not started: {error:#}"), &format!("{error:#}")),
        }
    }

    /// Plans when a child is started again that has ended, or could not be started, or that the show goes on without it.
    fn plan_restart(&mut self, role: ChildRole, what: &str, reason: &str) -> anyhow::Result<()> {
        let name = self.children.name(role).to_owned();
        let restarts = self.children.plan_restart(role, Instant::now());
        self.count_end(role, reason, restarts);
        // Without its guard the dragon stands for good.
        let is_vital = role == ChildRole::Serve || role == ChildRole::Monitor && self.is_guarded;
        if !restarts && is_vital {
            let minutes = WINDOW.as_secs() / 60;
            bail!("{name} {what}, after {MAX_RESTARTS} restarts within {minutes} minutes: giving up");
        }
        self.reports.has_given_up |= !restarts;
        let then = if restarts { "starting it again" } else { "the show goes on without it" };
        complain(&format!("{name} {what}: {then}"));
        Ok(())
    }

    fn count_end(&mut self, role: ChildRole, reason: &str, restarts: bool) {
        let show_time_s = self.seen.header.map(|header| header.sim_time_s());
        self.reports.totals.add_end(role, self.children.name(role), reason, show_time_s, restarts);
    }

    /// Does without a recorder until its disk has room again, and says so once. A disk that is full again and again, such as
    /// one with a quota, which its free space does not show, is given up as any other child.
    fn wait_for_room(&mut self, end: &End) {
        let restarts = self.children.plan_restart(ChildRole::Record, Instant::now());
        self.count_end(ChildRole::Record, &end.reason, false);
        self.reports.has_given_up = true;
        if restarts {
            self.children.liveness(ChildRole::Record).phase = Phase::Waiting;
            let room = Size(LEAST_ROOM_BYTES);
            complain(&format!("the show is not recorded from here on, until {room} of its disk are free"));
        } else {
            complain("the disk is full again and again: the show goes on without a recording");
        }
    }

    /// Has a recorder that waits for room started again where there is some.
    fn look_for_room(&mut self, now: Instant) {
        if self.children.liveness(ChildRole::Record).phase != Phase::Waiting || now < self.room_due {
            return;
        }
        self.room_due = now + ROOM_PERIOD;
        if self.folder.free_bytes().is_some_and(|free_bytes| free_bytes >= LEAST_ROOM_BYTES) {
            self.children.liveness(ChildRole::Record).phase = Phase::Due(now);
            complain("the disk has room again: the show is recorded from here on, in another file");
        }
    }

    fn end_with_server(&mut self) -> anyhow::Result<()> {
        if self.seen.header.is_none() {
            bail!("the server ended before its first frame");
        }
        self.is_stopped = true;
        Ok(())
    }
}
