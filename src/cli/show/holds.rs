//! The holds of a show: when each began and ended, and who held and released the dragon.

use std::collections::VecDeque;

use bench_dragon_ipc::{CommandEvent, EventKind, FrameHeader, Sender, ShowState, Status, Stop};
use serde::Serialize;

use super::wall_time::WallTime;

/// Most holds that are kept. The oldest are dropped, and counted.
const MOST_HOLDS: usize = 200;
/// The holder of the show after a restart of the server.
const RESTART: &str = "restart of the server";

/// A hold.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct HoldReport {
    /// Wall time of the begin.
    pub(super) begin: WallTime,
    /// Show time of the begin, in seconds.
    pub(super) time_s: f64,
    /// Kind of the sender of the hold, `guard`, or `restart of the server`.
    pub(super) by: String,
    /// Process id of the sender; null if unknown.
    pub(super) by_pid: Option<u32>,
    /// Wall time of the end; null if the show ended held.
    pub(super) end: Option<WallTime>,
    /// Kind of the sender of the release; null for a hold that ended otherwise.
    pub(super) released_by: Option<String>,
    /// Process id of the sender of the release; null if unknown.
    pub(super) released_by_pid: Option<u32>,
}

/// The newest holds of a show.
#[derive(Clone, Debug, Default)]
pub(super) struct HoldLog {
    holds: VecDeque<HoldReport>,
    pub(super) left_out: u64,
    /// Whether the newest hold lasts, and whether it is a stop of the guard at the end of its grant.
    open: Option<HoldKind>,
    /// Whether the head has walked since the start of the run. Before, a guarded head stands until the first grant.
    has_walked: bool,
    /// Run and tick of the newest hold's command.
    began: (u64, u64),
    /// Whether the head has walked since that command: its release is still to come, or was lost with its server.
    walks_on: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum HoldKind {
    /// Only a release ends it.
    Safety,
    /// The next grant ends it.
    GrantEnd,
}

impl HoldLog {
    /// The kept holds, oldest first.
    pub(super) fn reports(&self) -> Vec<HoldReport> {
        self.holds.iter().cloned().collect()
    }

    /// Takes a command event.
    pub(super) fn take(&mut self, event: &CommandEvent) {
        if event.outcome().is_err() {
            return;
        }
        let at = WallTime::of(event);
        match event.event_kind() {
            Some(EventKind::Hold) if self.open != Some(HoldKind::Safety) => {
                self.close(at, None);
                self.begin(HoldKind::Safety, report(event, at, sender_name(event), pid(event)));
                self.began = (event.run_id, event.tick);
            }
            Some(EventKind::Release) => self.close(at, Some(event)),
            // It moves the head away from the guard's stop.
            Some(EventKind::Seek) if self.open == Some(HoldKind::GrantEnd) => {
                self.close(at, None);
                self.has_walked = false;
            }
            Some(EventKind::Start) => {
                self.has_walked = false;
                let is_held = event.run_start().is_some_and(|start| start.is_held && start.is_restarted);
                if !is_held {
                    self.close(at, None);
                } else if self.open != Some(HoldKind::Safety) || self.walks_on {
                    self.close(at, None);
                    self.begin(HoldKind::Safety, report(event, at, RESTART.to_owned(), None));
                    self.began = (event.run_id, event.tick);
                }
            }
            _ => {}
        }
    }

    /// Takes a frame. A server that is killed just after a release has published frames, but not the release.
    pub(super) fn see_frame(&mut self, header: &FrameHeader) {
        let (run_id, tick) = self.began;
        self.walks_on |=
            header.run_id == run_id && header.tick > tick && header.show_state() == Some(ShowState::Running);
    }

    /// Takes a status, read at a wall time: a guard's stop is no command.
    pub(super) fn see(&mut self, status: &Status, at: WallTime) {
        let stops = status.stops();
        match status.show_state() {
            Some(ShowState::Running) => {
                self.has_walked = true;
                if self.open == Some(HoldKind::GrantEnd) {
                    self.close(at, None);
                }
            }
            Some(ShowState::Held)
                if stops.has(Stop::GuardLimit) && !stops.has(Stop::Held) && self.has_walked && self.open.is_none() =>
            {
                let by = Sender::Guard.name().to_owned();
                let time_s = status.show_time_ns as f64 * 1e-9;
                self.begin(HoldKind::GrantEnd, HoldReport { time_s, ..of(at, by) });
            }
            _ => {}
        }
    }

    fn begin(&mut self, kind: HoldKind, hold: HoldReport) {
        if self.holds.len() == MOST_HOLDS {
            self.holds.pop_front();
            self.left_out += 1;
        }
        self.holds.push_back(hold);
        (self.open, self.walks_on) = (Some(kind), false);
    }

    fn close(&mut self, at: WallTime, release: Option<&CommandEvent>) {
        if self.open.take().is_none() {
            return;
        }
        if let Some(hold) = self.holds.back_mut() {
            hold.end = Some(at);
            (hold.released_by, hold.released_by_pid) = (release.map(sender_name), release.and_then(pid));
        }
    }
}

fn of(begin: WallTime, by: String) -> HoldReport {
    HoldReport { begin, time_s: 0.0, by, by_pid: None, end: None, released_by: None, released_by_pid: None }
}

fn report(event: &CommandEvent, at: WallTime, by: String, by_pid: Option<u32>) -> HoldReport {
    HoldReport { time_s: event.show_time_ns as f64 * 1e-9, by_pid, ..of(at, by) }
}

fn sender_name(event: &CommandEvent) -> String {
    event.sent_by().map_or_else(|| format!("sender {}", event.sender), |sender| sender.to_string())
}

fn pid(event: &CommandEvent) -> Option<u32> {
    (event.pid != 0).then_some(event.pid)
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::{RunStart, Stops};

    use super::*;

    fn event(kind: EventKind, sender: Sender, second: i64) -> CommandEvent {
        let wall_ns = second * 1_000_000_000;
        CommandEvent { wall_ns, show_time_ns: wall_ns, pid: 7, ..CommandEvent::plain(kind, sender, 0) }
    }

    fn start(is_held: bool, is_restarted: bool) -> CommandEvent {
        let start = RunStart {
            start_s: 0.0,
            travel_m: 0.0,
            speed_mps: 1.0,
            until_s: None,
            is_held,
            is_paused: false,
            is_guarded: true,
            follows_timecode: false,
            is_ready: false,
            is_restarted,
            stays: false,
        };
        CommandEvent { wall_ns: 20_000_000_000, ..start.event(7) }
    }

    fn status(state: ShowState, stops: Stops) -> Status {
        Status { state: state as u32, stops: stops.to_wire(), ..Status::default() }
    }

    fn words(log: &HoldLog) -> Vec<String> {
        let released = |hold: &HoldReport| match (&hold.end, &hold.released_by) {
            (Some(_), Some(by)) => format!(", released by {by}"),
            (Some(_), None) => ", ended".to_owned(),
            (None, _) => String::new(),
        };
        log.holds.iter().map(|hold| format!("{}{}", hold.by, released(hold))).collect()
    }

    #[test]
    fn a_hold_has_who_held_and_who_released() {
        let mut log = HoldLog::default();
        log.take(&start(false, false));
        log.take(&event(EventKind::Hold, Sender::Ctl, 3));
        log.take(&event(EventKind::Hold, Sender::Page, 4));
        log.take(&event(EventKind::Release, Sender::Watch, 5));
        log.take(&event(EventKind::Release, Sender::Watch, 6));
        log.take(&CommandEvent { refusal: 3, ..event(EventKind::Hold, Sender::Ctl, 7) });
        assert_eq!(words(&log), ["ctl, released by watch"]);
        let hold = &log.reports()[0];
        assert_eq!((hold.time_s, hold.by_pid, hold.released_by_pid), (3.0, Some(7), Some(7)));
    }

    #[test]
    fn a_seek_ends_a_stop_of_the_guard_also_while_the_show_is_paused() {
        let mut log = HoldLog::default();
        log.take(&start(false, false));
        let guarded = Stops::from([Stop::GuardLimit]);
        let at = |second| WallTime::of(&event(EventKind::Stop, Sender::Server, second));
        log.see(&status(ShowState::Running, Stops::default()), at(21));
        log.see(&status(ShowState::Held, guarded), at(22));
        log.take(&event(EventKind::Pause, Sender::Ctl, 23));
        log.take(&event(EventKind::Seek, Sender::Ctl, 24));
        log.see(&status(ShowState::Held, guarded), at(25));
        assert_eq!(words(&log), ["guard, ended"]);
        assert_eq!(log.reports()[0].end, Some(at(24)));
    }

    #[test]
    fn a_restarted_server_holds_and_an_operators_hold_goes_on_over_its_restart() {
        let mut log = HoldLog::default();
        log.take(&start(true, true));
        log.take(&event(EventKind::Release, Sender::Page, 21));
        log.take(&event(EventKind::Hold, Sender::Ctl, 22));
        log.take(&start(true, true));
        assert_eq!(words(&log), ["restart of the server, released by page", "ctl"]);
        log.take(&start(false, true));
        assert_eq!(words(&log)[1], "ctl, ended", "a server that walks on at once is not held");
    }

    #[test]
    fn a_release_that_was_lost_with_its_server_ends_its_hold_at_the_restart() {
        let mut log = HoldLog::default();
        log.take(&start(false, false));
        log.take(&CommandEvent { run_id: 1, tick: 30, ..event(EventKind::Hold, Sender::Ctl, 3) });
        let walking =
            |tick| FrameHeader { run_id: 1, tick, state: ShowState::Running as u32, ..FrameHeader::default() };
        log.see_frame(&walking(29));
        log.take(&start(true, true));
        assert_eq!(words(&log), ["ctl"], "that frame was older than the hold");
        log.see_frame(&walking(31));
        log.take(&start(true, true));
        assert_eq!(words(&log), ["ctl, ended", "restart of the server"]);
    }

    #[test]
    fn a_guards_stop_counts_from_the_first_walk_on_until_the_next() {
        let (mut log, at) = (HoldLog::default(), WallTime::default());
        let stopped = status(ShowState::Held, Stops::from([Stop::GuardLimit]));
        log.see(&stopped, at);
        assert_eq!(words(&log), [""; 0], "it waits for its first grant");
        for _ in 0..2 {
            log.see(&status(ShowState::Running, Stops::default()), at);
            log.see(&stopped, at);
            log.see(&stopped, at);
        }
        assert_eq!(words(&log), ["guard, ended", "guard"]);
        let held = Stops::from([Stop::GuardLimit, Stop::Held]);
        log.take(&event(EventKind::Hold, Sender::Ctl, 9));
        log.see(&status(ShowState::Held, held), at);
        assert_eq!(words(&log), ["guard, ended", "guard, ended", "ctl"]);
    }

    #[test]
    fn the_oldest_of_very_many_holds_are_counted_only() {
        let mut log = HoldLog::default();
        for second in 0..250 {
            log.take(&event(EventKind::Hold, Sender::Ctl, second));
            log.take(&event(EventKind::Release, Sender::Ctl, second));
        }
        assert_eq!((log.holds.len(), log.left_out, log.reports()[0].time_s), (MOST_HOLDS, 50, 50.0));
    }
}
