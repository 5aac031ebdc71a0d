//! The course of a show, for its report: alerts, commands, holds, and the clearance over time. Its memory does not grow with the
//! length of the show: the newest events are kept, and the others counted.

use std::collections::BTreeMap;

use bench_dragon_geometry::number::Fixed;
use bench_dragon_ipc::{AlertKind, CommandEvent, EventKind, FrameHeader, Sender, ShowState, Status};
use serde::Serialize;

use super::cue_log::{CueLog, CueReport};
use super::holds::{HoldLog, HoldReport};
use super::timeline::Timeline;
use super::wall_time::WallTime;
use crate::cli::monitor::lines::{AlertLine, ClearanceReport, MonitorProgress};
use crate::display::observe::{CommandHistory, EventLog};
use crate::output::command_words::CommandLine;
use crate::output::figure::StateLook;

/// Most alerts that are kept. Of more, the oldest alerts of near pairs are dropped first.
const MOST_ALERTS: usize = 500;
/// Most commands that are kept. Of more, the oldest are dropped.
const MOST_COMMANDS: usize = 500;

/// The course of a show so far.
#[derive(Clone, Debug)]
pub(super) struct Course {
    begin: WallTime,
    timeline: Timeline,
    least: Option<LeastReport>,
    holds: HoldLog,
    cues: CueLog,
    alerts: EventLog<AlertReport>,
    alert_counts: BTreeMap<String, u64>,
    commands: CommandHistory,
    commands_lost: u64,
    /// Run and number of the newest command event.
    newest: Option<(u64, u64)>,
}

/// The course of a show, as `summary.json` has it.
#[derive(Clone, Debug, Default, Serialize)]
pub(super) struct CourseReport {
    /// Wall time at which the show began and ended.
    pub(super) begin: WallTime,
    pub(super) end: WallTime,
    /// Least clearance of all frames that a monitor has read; null without one.
    pub(super) least_clearance: Option<LeastReport>,
    /// The holds, oldest first, and the number of older ones.
    pub(super) holds: Vec<HoldReport>,
    pub(super) holds_left_out: u64,
    /// The cues, in the order of plan time.
    pub(super) cues: Vec<CueReport>,
    /// The alerts, oldest first; the number of all of each kind, and of those that are not in the list.
    pub(super) alerts: Vec<AlertReport>,
    pub(super) alert_counts: BTreeMap<String, u64>,
    pub(super) alerts_left_out: u64,
    /// The commands, oldest first, without a guard's grants; the number of older ones, and of those that never arrived.
    pub(super) commands: Vec<CommandLine>,
    pub(super) commands_left_out: u64,
    pub(super) commands_lost: u64,
    /// The clearance and the states over time, which only the picture shows.
    #[serde(skip)]
    pub(super) timeline: Timeline,
}

/// The least clearance.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct LeastReport {
    /// Wall time at which the show learned of it, at most a fifth of a second later.
    pub(super) at: WallTime,
    #[serde(flatten)]
    pub(super) pair: ClearanceReport,
}

/// An alert.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct AlertReport {
    /// Wall time at which the show learned of it.
    pub(super) at: WallTime,
    #[serde(flatten)]
    pub(super) alert: AlertLine,
}

impl Default for Course {
    fn default() -> Self {
        Self::begin(WallTime::now(), CueLog::default())
    }
}

impl Course {
    /// The course of a show that begins now.
    pub(super) fn begin(begin: WallTime, cues: CueLog) -> Self {
        Self {
            begin,
            timeline: Timeline::default(),
            least: None,
            holds: HoldLog::default(),
            cues,
            alerts: EventLog::keeping(MOST_ALERTS),
            alert_counts: BTreeMap::new(),
            commands: CommandHistory::keeping(MOST_COMMANDS),
            commands_lost: 0,
            newest: None,
        }
    }

    /// Notes a progress of the monitor.
    pub(super) fn see_progress(&mut self, progress: &MonitorProgress, at: WallTime) {
        let Some(pair) = &progress.least else { return };
        self.timeline.see_clearance(at.seconds_since(self.begin), pair.clearance_m);
        if self.least.as_ref().is_none_or(|least| pair.clearance_m < least.pair.clearance_m) {
            self.least = Some(LeastReport { at, pair: pair.clone() });
        }
    }

    pub(super) fn see_alert(&mut self, alert: &AlertLine, at: WallTime) {
        *self.alert_counts.entry(alert.kind.clone()).or_default() += 1;
        let report = AlertReport { at, alert: alert.clone() };
        self.alerts.push(report, |kept| kept.alert.kind == AlertKind::Near.name());
    }

    pub(super) fn see_frame(&mut self, header: &FrameHeader, at: WallTime) {
        self.holds.see_frame(header);
        let look = match header.show_state() {
            Some(ShowState::Ready | ShowState::Waiting) => StateLook::Ready,
            Some(ShowState::Running) => StateLook::Running,
            Some(ShowState::Paused | ShowState::Stopping) => StateLook::Paused,
            Some(ShowState::Held) => StateLook::Held,
            Some(ShowState::Finished | ShowState::Ended) => StateLook::Finished,
            None => return,
        };
        self.timeline.see_state(at.seconds_since(self.begin), look);
    }

    pub(super) fn see_status(&mut self, status: &Status, at: WallTime) {
        self.holds.see(status, at);
    }

    /// Takes a command event. A guard's grants are left out. Returns a line about a cue that is reached.
    pub(super) fn take_command(&mut self, event: CommandEvent) -> Option<String> {
        let expected = match self.newest {
            Some((run_id, number)) if run_id == event.run_id && event.number <= number => return None,
            Some((run_id, number)) if run_id == event.run_id => number + 1,
            _ => 0,
        };
        self.commands_lost += event.number - expected;
        self.newest = Some((event.run_id, event.number));
        self.holds.take(&event);
        if event.event_kind() == Some(EventKind::Cue) {
            let time = Fixed::<3>(event.show_time_ns as f64 / 1e9);
            let waits = |cue: &CueReport| if cue.waits { ", and waits for GO" } else { "" };
            return self.cues.take(&event).map(|cue| format!("{time} s: reaches the cue “{}”{}", cue.name, waits(cue)));
        }
        let is_guards_grant = event.event_kind() == Some(EventKind::Grant) && event.sent_by() == Some(Sender::Guard);
        if !is_guards_grant {
            self.commands.push(event);
        }
        None
    }

    /// The report of a show that ends at this time.
    pub(super) fn report(&self, end: WallTime) -> CourseReport {
        CourseReport {
            begin: self.begin,
            end,
            least_clearance: self.least.clone(),
            holds: self.holds.reports(),
            holds_left_out: self.holds.left_out,
            cues: self.cues.reports(),
            alerts: self.alerts.latest().map(|alert| alert.event.clone()).collect(),
            alert_counts: self.alert_counts.clone(),
            alerts_left_out: self.alerts.dropped(),
            commands: self.commands.log.latest().map(|command| CommandLine::from(&command.event)).collect(),
            commands_left_out: self.commands.log.dropped(),
            commands_lost: self.commands_lost,
            timeline: self.timeline.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::{CommandReply, Refusal, Request};

    use super::*;
    use crate::safety::monitor::run_alert;

    fn alert(kind: AlertKind) -> AlertLine {
        AlertLine::of(&run_alert(&FrameHeader::default(), kind), None)
    }

    fn at(second: i64) -> WallTime {
        WallTime::of(&CommandEvent { wall_ns: second * 1_000_000_000, ..CommandEvent::default() })
    }

    #[test]
    fn thousands_of_near_pairs_leave_the_contact_and_are_counted() {
        let mut course = Course::begin(at(0), CueLog::default());
        course.see_alert(&alert(AlertKind::Contact), at(1));
        (0..5000).for_each(|second| course.see_alert(&alert(AlertKind::Near), at(second)));
        let report = course.report(at(9000));
        assert_eq!((report.alerts.len(), report.alerts_left_out), (MOST_ALERTS, 5001 - MOST_ALERTS as u64));
        assert_eq!(report.alerts[0].alert.kind, "contact");
        assert_eq!(report.alert_counts, BTreeMap::from([("contact".to_owned(), 1), ("near".to_owned(), 5000)]));
    }

    #[test]
    fn commands_have_their_senders_and_grants_of_the_guard_are_left_out() {
        let mut course = Course::begin(at(0), CueLog::default());
        let command = |sender: Sender, request: Request| bench_dragon_ipc::Command {
            sender: sender.to_wire(),
            pid: 12,
            ..request.to_wire()
        };
        let grant = command(Sender::Guard, Request::Grant { run_id: 1, from_m: 0.0, to_m: 1.0, is_final: false });
        let hold = command(Sender::Page, Request::Hold);
        let replies = [
            (hold, CommandReply::accepted(1, 0)),
            (grant, CommandReply::accepted(1, 1)),
            (grant, CommandReply::refused(1, 2, Refusal::OtherRun)),
        ];
        for (number, (command, reply)) in (0..).zip(&replies) {
            let event = CommandEvent { run_id: 1, number, ..CommandEvent::answered(command, reply) };
            course.take_command(event);
            course.take_command(event);
        }
        let report = course.report(at(1));
        let told: Vec<_> = report.commands.iter().map(|line| (&*line.command, &*line.sender, line.pid)).collect();
        assert_eq!(told, [("hold", "page", Some(12))]);
        assert_eq!((report.commands_lost, report.holds.len()), (0, 1));
    }

    #[test]
    fn commands_that_never_arrived_are_counted_in_each_run() {
        let mut course = Course::begin(at(0), CueLog::default());
        for (run_id, number) in [(1, 0), (1, 3), (2, 1)] {
            course.take_command(CommandEvent {
                run_id,
                number,
                ..CommandEvent::plain(EventKind::Pause, Sender::Ctl, 0)
            });
        }
        assert_eq!(course.report(at(1)).commands_lost, 3);
    }

    #[test]
    fn the_least_clearance_is_that_of_the_whole_show() {
        let mut course = Course::begin(at(0), CueLog::default());
        for (second, clearance_m) in [(1, 0.3), (2, 0.04), (3, 0.2)] {
            let pair = ClearanceReport {
                time_s: 0.0,
                benches: [1, 9],
                named: None,
                clearance_m,
                point_m: [0.0; 2],
                travel_m: 0.0,
            };
            course.see_progress(&MonitorProgress { least: Some(pair), ..MonitorProgress::default() }, at(second));
        }
        course.see_progress(&MonitorProgress::default(), at(4));
        let least = course.report(at(5)).least_clearance.expect("there were frames");
        assert_eq!((least.pair.clearance_m, least.at.to_string().as_str()), (0.04, "1970-01-01T00:00:02.000Z"));
    }
}
