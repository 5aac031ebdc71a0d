//! The supervision of a running show: handles the lines and the ends of its children, reads the bus, and restarts children.

use std::time::{Duration, Instant};

use anyhow::bail;
use bench_dragon_geometry::number::Fixed;
use bench_dragon_ipc::ReaderReport;

use super::auto_go::AutoGo;
use super::children::ChildRole;
use super::files::Repaired;
use super::liveness::{LONGEST_BACKOFF, MAX_RESTARTS, Phase};
use super::outcome::Ending;
use super::process::End;
use super::wall_time::{WallTime, log};
use super::{Show, ShowPorts};
use crate::cli::exit_status::DISK_FULL;
use crate::recording::Size;

/// Free bytes on the disk from which on the show is recorded again. They suffice for some seconds of a large dragon.
pub const LEAST_ROOM_BYTES: u64 = 256 << 20;
/// Period at which a show with a full disk checks for room.
const ROOM_PERIOD: Duration = Duration::from_secs(1);

impl Show<'_> {
    pub(super) fn take_line(&mut self, role: ChildRole, line: &str) -> anyhow::Result<()> {
        match role {
            ChildRole::Serve if self.bus.is_none() => self.join_bus()?,
            // The frames of a server are its signs of life, not its lines.
            ChildRole::Serve => {}
            ChildRole::View if !self.page.as_ref().is_some_and(|page| page.is_announced) => {
                self.announce_page(line)?;
                self.start(ChildRole::Serve)?;
            }
            _ => self.children.hear(role),
        }
        self.reports.take_line(role, line)
    }

    /// Handles the end of a child that ends before the show does.
    pub(super) fn take_end(&mut self, role: ChildRole, end: &End) -> anyhow::Result<()> {
        self.look_at_bus()?;
        let status = end.status;
        match role {
            // An operator stopped the server, or the server has reached its end.
            ChildRole::Serve if status.success() && !self.needs_server() => return self.end_with_server(),
            // The server has printed its reason on stderr. A killed server has no exit code, and is restarted.
            ChildRole::Serve if self.bus.is_none() && status.code().is_some() => {
                self.failure = Some(not_started("serve", end));
                bail!("the server did not start: it ended with {status}");
            }
            ChildRole::View if !self.page.as_ref().is_some_and(|page| page.is_announced) => {
                self.failure = Some(not_started("view", end));
                bail!("the page did not start: it ended with {status}");
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

    /// Requests to finish the recording of a recorder that did not finish it itself.
    pub(super) fn finish_recording(&mut self) {
        if let Some(recording) = self.reports.open_recording.take() {
            self.repairs.finish_own(recording);
        }
    }

    pub(super) fn supervise(&mut self) -> anyhow::Result<()> {
        let looked = self.look_at_bus();
        self.begin_others()?;
        let now = Instant::now();
        self.look_for_room(now);
        for line in self.children.kill_silent(now) {
            log(&line);
        }
        for role in self.children.due(now) {
            self.start_again(role)?;
        }
        for repaired in self.repairs.poll() {
            self.count_repaired(repaired);
        }
        looked
    }

    pub(super) fn look_at_bus(&mut self) -> anyhow::Result<()> {
        let Some(bus) = &mut self.bus else { return Ok(()) };
        let now = WallTime::now();
        if let Some(frame) = bus.frames.latest()? {
            let header = frame.header();
            self.children.hear(ChildRole::Serve);
            self.reports.totals.see_frame(header);
            self.reports.course.see_frame(header, now);
            self.reports.line.update(header, &self.reports.progress);
            if let Some(auto_go) = &mut self.auto_go {
                auto_go.see_frame(header, Instant::now());
            }
            if self.is_performance && self.seen.finishes_with(header) {
                log(&format!(
                    "{} s: finished; only `ctl stop` or Ctrl-C ends this show",
                    Fixed::<6>(header.show_time_s())
                ));
            }
            self.seen.see_frame(header);
        }
        let status = bus.status.poll()?;
        // A source publishes events before the status that shows their effect.
        let mut is_held_again = false;
        while let Some(event) = bus.next_command()? {
            self.seen.see_event(&event);
            is_held_again |= event.run_start().is_some_and(|start| start.is_restarted && start.is_held);
            if let Some(cue) = self.reports.course.take_command(event) {
                log(&cue);
            }
        }
        if let Some(status) = status {
            self.reports.totals.see_status(&status);
            self.reports.course.see_status(&status, now);
            self.seen.see_status(status);
        }
        for pid in bus.living_readers() {
            self.children.hear_process(pid);
        }
        if is_held_again {
            self.announce_hold();
        }
        Ok(())
    }

    pub(super) fn count_repaired(&mut self, Repaired { frames, line }: Repaired) {
        self.reports.totals.summary.frames.recorded += frames.unwrap_or_default();
        log(&line);
    }

    /// Joins the bus of the first server, for which its readers are started.
    fn join_bus(&mut self) -> anyhow::Result<()> {
        match ShowPorts::open(&self.domain) {
            // The server was killed directly after its start. Its end is handled next.
            Err(error) if error.is_absent() => Ok(()),
            Err(error) => Err(error.into()),
            Ok(bus) => {
                self.bus = Some(bus);
                // A subscriber is connected from its first look on. The frames of a server that is killed afterwards can still be read.
                self.look_at_bus()?;
                if let (Some(wait_s), None) = (self.args.manner.auto_go, &self.auto_go) {
                    self.auto_go = Some(AutoGo::open(&self.domain, Duration::from_secs_f64(wait_s))?);
                }
                self.start(ChildRole::Monitor)?;
                self.start(ChildRole::Record)
            }
        }
    }

    /// Starts the configured commands and the repair of earlier recordings, once frames arrive.
    fn begin_others(&mut self) -> anyhow::Result<()> {
        if self.has_begun || self.seen.header.is_none() {
            return Ok(());
        }
        self.has_begun = true;
        self.repairs.finish_earlier(self.folder.and_earlier());
        (0..self.also.len()).try_for_each(|number| self.start_again(ChildRole::Also(number)))
    }

    /// Starts a child. A failure leads to another try later, and does not end the show at once.
    fn start_again(&mut self, role: ChildRole) -> anyhow::Result<()> {
        match self.start(role) {
            Ok(()) => Ok(()),
            Err(error) => self.plan_restart(role, &format!("cannot be started: {error:#}"), &format!("{error:#}")),
        }
    }

    /// Plans the restart of a child that has ended or could not be started. After too many restarts, the show goes on without
    /// the child, or fails if the child is vital.
    fn plan_restart(&mut self, role: ChildRole, what: &str, reason: &str) -> anyhow::Result<()> {
        let name = self.children.name(role).to_owned();
        let wait = self.children.plan_restart(role, Instant::now());
        self.count_end(role, reason, wait.is_some());
        // Without its guard the head would never move again.
        let is_vital = role == ChildRole::Serve || role == ChildRole::Monitor && self.is_guarded();
        if wait.is_none() && is_vital {
            let (process, reason, restarts) = (name.clone(), what.to_owned(), MAX_RESTARTS);
            self.failure = Some(Ending::Failed { process, reason, restarts });
            bail!("{name} {what}, after {MAX_RESTARTS} restarts in a row: giving up");
        }
        self.reports.has_given_up |= wait.is_none();
        log(&format!("{name} {what}: {}", then(wait, self.is_performance)));
        Ok(())
    }

    fn count_end(&mut self, role: ChildRole, reason: &str, restarts: bool) {
        let show_time_s = self.seen.header.map(|header| header.show_time_s());
        self.reports.totals.add_end(role, self.children.name(role), reason, show_time_s, restarts);
    }

    /// Continues without a recorder until its disk has room again, and reports this once. If the disk is full too often, the
    /// show goes on without a recorder, as after too many restarts of any other child. A quota, for example, can cause this:
    /// the disk's free space does not show it.
    fn wait_for_room(&mut self, end: &End) {
        let wait = self.children.plan_restart(ChildRole::Record, Instant::now());
        self.count_end(ChildRole::Record, &end.reason, false);
        self.reports.has_given_up = true;
        self.report_room(0.0);
        if wait.is_some() {
            self.children.liveness(ChildRole::Record).wait();
            let room = Size(LEAST_ROOM_BYTES);
            log(&format!("the show is not recorded from here on, until its disk has {room} free"));
        } else {
            log("the disk is full again and again: the show goes on without a recording");
        }
    }

    /// Plans the start of a recorder that waits for room, once the disk has room.
    fn look_for_room(&mut self, now: Instant) {
        if self.children.liveness(ChildRole::Record).phase != Phase::Waiting || now < self.room_due {
            return;
        }
        self.room_due = now + ROOM_PERIOD;
        if self.folder.free_bytes().is_some_and(|free_bytes| free_bytes >= LEAST_ROOM_BYTES)
            && self.children.liveness(ChildRole::Record).end_wait(now)
        {
            self.report_room(ReaderReport::NO_ROOM);
            log("the disk has room again: the show is recorded from here on, in another file");
        }
    }

    /// Reports to the bus whether the show lacks room for its recording: the recorder that could report it has ended.
    fn report_room(&mut self, room_s: f64) {
        if let Some(bus) = &mut self.bus {
            bus.frames.set_room(room_s);
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

/// The show's reaction to the end of a child, which restarts after this delay or never.
fn then(wait: Option<Duration>, is_performance: bool) -> String {
    match wait {
        None => "the show goes on without it".to_owned(),
        Some(wait) if wait < Duration::from_secs(1) => "starting it again".to_owned(),
        Some(LONGEST_BACKOFF) if is_performance => {
            format!(
                "a performance does not give up: starting it again every {} s until it runs",
                LONGEST_BACKOFF.as_secs()
            )
        }
        Some(wait) => format!("starting it again in {:.1} s", wait.as_secs_f64()),
    }
}

/// The ending of a show of which a first process did not start.
fn not_started(process: &str, end: &End) -> Ending {
    Ending::Failed { process: process.to_owned(), reason: format!("did not start: {}", end.reason), restarts: 0 }
}
