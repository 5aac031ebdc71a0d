//! The newest alerts and commands that an observer has received.

use std::collections::VecDeque;

use bench_dragon_ipc::{Alert, AlertKind, CommandEvent, EventKind};

/// Greatest numbers of alerts and of commands that are kept.
const KEPT_ALERTS: usize = 200;
const KEPT_COMMANDS: usize = 100;

/// The newest events of one kind, each with its number.
#[derive(Clone, Debug)]
pub struct EventLog<Event> {
    latest: VecDeque<Numbered<Event>>,
    /// Greatest number of events that are kept.
    most: usize,
    /// Number of all events so far.
    pub total: u64,
}

/// An event and its number. Numbers count from 0 in the order of arrival, over all runs.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(missing_docs, reason = "the names of the fields describe them")]
pub struct Numbered<Event> {
    pub number: u64,
    pub event: Event,
}

/// The newest 200 alerts, and the number of all alerts of each kind.
#[derive(Clone, Debug)]
pub struct AlertLog {
    /// The alerts.
    pub log: EventLog<Alert>,
    counts: [u64; AlertKind::ALL.len()],
}

/// The newest commands, 100 by default. Accepted grants are left out, since a guard sends them automatically. Repeats of a
/// refused command are kept once; for example, a seek is repeated until the guard has proved it.
#[derive(Clone, Debug)]
pub struct CommandHistory {
    /// The commands, without the grants that were accepted.
    pub log: EventLog<CommandEvent>,
    /// The run and the number of the newest event.
    newest: Option<(u64, u64)>,
}

impl<Event> EventLog<Event> {
    /// An empty log that keeps the newest `most` events, at least 1.
    pub fn keeping(most: usize) -> Self {
        Self { latest: VecDeque::new(), most, total: 0 }
    }

    /// Records the next event. A full log drops its oldest minor event, or its oldest event if it has no minor one.
    pub fn push(&mut self, event: Event, is_minor: impl Fn(&Event) -> bool) {
        if self.latest.len() >= self.most {
            let oldest = self.latest.iter().position(|kept| is_minor(&kept.event));
            self.latest.remove(oldest.unwrap_or_default());
        }
        self.latest.push_back(Numbered { number: self.total, event });
        self.total += 1;
    }

    /// Number of events that were dropped.
    pub fn dropped(&self) -> u64 {
        self.total - self.latest.len() as u64
    }

    /// The kept events, oldest first.
    pub fn latest(&self) -> impl DoubleEndedIterator<Item = &Numbered<Event>> + ExactSizeIterator {
        self.latest.iter()
    }

    /// The kept events from this number on, oldest first.
    pub fn since(&self, number: u64) -> impl Iterator<Item = &Numbered<Event>> {
        self.latest.iter().filter(move |numbered| numbered.number >= number)
    }
}

impl Default for AlertLog {
    fn default() -> Self {
        Self { log: EventLog::keeping(KEPT_ALERTS), counts: Default::default() }
    }
}

impl AlertLog {
    /// Records the next alert. At 200 kept alerts, it drops the oldest alert of a near pair, so that these do not displace
    /// other kinds. Without one, it drops the oldest alert. It ignores a kept alert, as after the reader has opened the bus again.
    pub fn push(&mut self, alert: Alert) {
        if self.log.latest.iter().any(|kept| kept.event == alert) {
            return;
        }
        self.log.push(alert, |kept| kept.alert_kind() == Some(AlertKind::Near));
        if let Some(count) = self.counts.get_mut(alert.kind as usize) {
            *count += 1;
        }
    }

    /// Number of all alerts of each kind that this version supports.
    pub fn counts(&self) -> impl Iterator<Item = (AlertKind, u64)> {
        AlertKind::ALL.into_iter().zip(self.counts)
    }
}

impl Default for CommandHistory {
    fn default() -> Self {
        Self::keeping(KEPT_COMMANDS)
    }
}

impl CommandHistory {
    /// An empty history that keeps the newest `most` commands, at least 1.
    pub fn keeping(most: usize) -> Self {
        Self { log: EventLog::keeping(most), newest: None }
    }

    /// Records the next command. A full history drops the oldest. It ignores an event that it has already received,
    /// as after the reader has opened the bus again.
    pub fn push(&mut self, event: CommandEvent) {
        let newest = (event.run_id, event.number);
        if self.newest.is_some_and(|(run_id, number)| run_id == event.run_id && event.number <= number) {
            return;
        }
        self.newest = Some(newest);
        let is_plain_grant = event.event_kind() == Some(EventKind::Grant) && event.outcome().is_ok();
        if is_plain_grant || self.log.latest.back().is_some_and(|last| is_repeated(&last.event, &event)) {
            return;
        }
        self.log.push(event, |_| false);
    }
}

/// Whether the last event was the same command of the same process, refused for the same reason.
fn is_repeated(last: &CommandEvent, event: &CommandEvent) -> bool {
    let what = |event: &CommandEvent| (event.run_id, event.kind, event.sender, event.pid, event.refusal, event.values);
    event.outcome().is_err() && what(last) == what(event)
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::{CommandReply, FrameHeader, Refusal, Request, Sender};

    use super::*;
    use crate::safety::monitor::run_alert;

    /// Alerts of near pairs, one a tick.
    fn near_pairs(count: u64) -> impl Iterator<Item = Alert> {
        (0..count).map(|tick| run_alert(&FrameHeader { tick, ..FrameHeader::default() }, AlertKind::Near))
    }

    #[test]
    fn dropped_alerts_are_still_counted() {
        let (mut log, header) = (AlertLog::default(), FrameHeader::default());
        for alert in near_pairs(KEPT_ALERTS as u64) {
            log.push(alert);
            log.push(alert);
        }
        log.push(run_alert(&header, AlertKind::Restarted));
        let numbers: Vec<u64> = log.log.latest().map(|alert| alert.number).collect();
        assert_eq!(numbers, (1..=KEPT_ALERTS as u64).collect::<Vec<_>>());
        assert_eq!((log.log.total, log.log.since(KEPT_ALERTS as u64).count()), (KEPT_ALERTS as u64 + 1, 1));
        let counts: Vec<u64> = log.counts().map(|(_, count)| count).collect();
        assert_eq!(counts, [KEPT_ALERTS as u64, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0]);
    }

    #[test]
    fn many_near_pairs_do_not_displace_a_contact() {
        let (mut log, header) = (AlertLog::default(), FrameHeader::default());
        log.push(run_alert(&header, AlertKind::Contact));
        near_pairs(2 * KEPT_ALERTS as u64).for_each(|alert| log.push(alert));
        let first = log.log.latest().next().map(|kept| (kept.number, kept.event.alert_kind()));
        assert_eq!((first, log.log.latest().len()), (Some((0, Some(AlertKind::Contact))), KEPT_ALERTS));
    }

    #[test]
    fn an_alert_of_an_unknown_kind_is_kept_and_counted_in_the_total() {
        let mut log = AlertLog::default();
        log.push(Alert { kind: 77, ..run_alert(&FrameHeader::default(), AlertKind::Near) });
        assert_eq!((log.log.total, log.log.latest().len()), (1, 1));
        assert_eq!(log.counts().map(|(_, count)| count).sum::<u64>(), 0);
    }

    #[test]
    fn the_newest_commands_are_kept_without_accepted_grants() {
        let mut history = CommandHistory::default();
        let grant = Request::Grant { run_id: 1, from_m: 0.0, to_m: 1.0, is_final: false }.to_wire();
        let mut numbers = 0..;
        let mut push = |event| {
            let number = numbers.next().expect("the numbers are endless");
            history.push(CommandEvent { number, ..event });
        };
        for tick in 0..KEPT_COMMANDS as u64 {
            push(CommandEvent::plain(EventKind::Pause, Sender::Ctl, tick));
            push(CommandEvent::answered(&grant, &CommandReply::accepted(0, tick)));
        }
        push(CommandEvent::answered(&grant, &CommandReply::refused(0, 7, Refusal::OtherRun)));
        assert_eq!(history.log.total, KEPT_COMMANDS as u64 + 1);
        assert_eq!((history.log.latest().len(), history.log.since(KEPT_COMMANDS as u64).count()), (KEPT_COMMANDS, 1));
        assert_eq!(history.log.latest().next().map(|command| command.number), Some(1));
    }

    #[test]
    fn a_repeated_seek_and_a_repeated_event_are_kept_once() {
        let mut history = CommandHistory::default();
        let seek = |number, show_time_s, reply| {
            let event = CommandEvent::answered(&Request::Seek { show_time_s }.to_wire(), &reply);
            CommandEvent { number, ..event }
        };
        for number in 0..50 {
            history.push(seek(number, 30.0, CommandReply::refused(0, number, Refusal::NotProved)));
        }
        history.push(seek(50, 31.0, CommandReply::refused(0, 50, Refusal::NotProved)));
        for _ in 0..2 {
            history.push(seek(51, 31.0, CommandReply::accepted(0, 51)));
        }
        let numbers: Vec<u64> = history.log.latest().map(|command| command.event.number).collect();
        assert_eq!(numbers, [0, 50, 51]);
    }
}
