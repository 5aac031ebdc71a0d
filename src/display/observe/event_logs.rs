//! The newest alerts and commands that an observer has received.

use std::collections::VecDeque;

use bench_dragon_ipc::{Alert, AlertKind, CommandEvent, EventKind};

/// Most alerts and most commands that are kept.
const KEPT_ALERTS: usize = 200;
const KEPT_COMMANDS: usize = 100;
/// Kinds of alerts that this version knows.
const KINDS: [AlertKind; 6] =
    [AlertKind::Near, AlertKind::Contact, AlertKind::Parted, AlertKind::Held, AlertKind::Fault, AlertKind::Restarted];

/// The newest events of one kind, each with its number.
#[derive(Clone, Debug)]
pub struct EventLog<Event> {
    latest: VecDeque<Numbered<Event>>,
    /// How many there were.
    pub total: u64,
}

/// An event and its number, from 0 in the order in which they came, over all runs.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(missing_docs, reason = "each field is what its name says")]
pub struct Numbered<Event> {
    pub number: u64,
    pub event: Event,
}

/// The newest 200 alerts, and how many there were of each kind.
#[derive(Clone, Debug, Default)]
pub struct AlertLog {
    /// The alerts.
    pub log: EventLog<Alert>,
    counts: [u64; KINDS.len()],
}

/// The newest 100 commands. Of grants, which come by themselves, only the refused ones are kept. A refused
/// command that is sent again at once, as a seek that its guard has still to prove, is kept once.
#[derive(Clone, Debug, Default)]
pub struct CommandHistory {
    /// The commands, without the grants that were accepted.
    pub log: EventLog<CommandEvent>,
    /// The run and the number of the event that came last.
    newest: Option<(u64, u64)>,
}

impl<Event> Default for EventLog<Event> {
    fn default() -> Self {
        Self { latest: VecDeque::new(), total: 0 }
    }
}

impl<Event> EventLog<Event> {
    fn push(&mut self, event: Event) {
        self.latest.push_back(Numbered { number: self.total, event });
        self.total += 1;
    }

    /// The events that are kept, oldest first.
    pub fn latest(&self) -> impl DoubleEndedIterator<Item = &Numbered<Event>> + ExactSizeIterator {
        self.latest.iter()
    }

    /// The events that are kept and have at least this number, oldest first.
    pub fn since(&self, number: u64) -> impl Iterator<Item = &Numbered<Event>> {
        self.latest.iter().filter(move |numbered| numbered.number >= number)
    }
}

impl AlertLog {
    /// Takes the next one. Where 200 are kept already, the oldest of a near pair is dropped, so that many of these bury nothing
    /// else; without one, the oldest of all.
    pub fn push(&mut self, alert: Alert) {
        let latest = &mut self.log.latest;
        if latest.len() == KEPT_ALERTS {
            let oldest = latest.iter().position(|kept| kept.event.alert_kind() == Some(AlertKind::Near));
            latest.remove(oldest.unwrap_or_default());
        }
        self.log.push(alert);
        if let Some(count) = self.counts.get_mut(alert.kind as usize) {
            *count += 1;
        }
    }

    /// How many there were of each kind that this version knows.
    pub fn counts(&self) -> impl Iterator<Item = (AlertKind, u64)> {
        KINDS.into_iter().map(|kind| (kind, self.counts[kind as usize]))
    }
}

impl CommandHistory {
    /// Takes the next one; the oldest is dropped where 100 are kept already. An event that has come before, as to a reader that
    /// opens the bus anew, is left out.
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
        if self.log.latest.len() == KEPT_COMMANDS {
            self.log.latest.pop_front();
        }
        self.log.push(event);
    }
}

/// Whether the same command of the same process was refused for the same reason.
fn is_repeated(last: &CommandEvent, event: &CommandEvent) -> bool {
    let what = |event: &CommandEvent| (event.run_id, event.kind, event.sender, event.pid, event.refusal, event.values);
    event.outcome().is_err() && what(last) == what(event)
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::{CommandReply, FrameHeader, Refusal, Request, Sender};

    use super::*;
    use crate::safety::monitor::run_alert;

    #[test]
    fn the_oldest_alerts_are_forgotten_but_counted() {
        let (mut log, header) = (AlertLog::default(), FrameHeader::default());
        for _ in 0..KEPT_ALERTS {
            log.push(run_alert(&header, AlertKind::Near));
        }
        log.push(run_alert(&header, AlertKind::Restarted));
        let numbers: Vec<u64> = log.log.latest().map(|alert| alert.number).collect();
        assert_eq!(numbers, (1..=KEPT_ALERTS as u64).collect::<Vec<_>>());
        assert_eq!((log.log.total, log.log.since(KEPT_ALERTS as u64).count()), (KEPT_ALERTS as u64 + 1, 1));
        let counts: Vec<u64> = log.counts().map(|(_, count)| count).collect();
        assert_eq!(counts, [KEPT_ALERTS as u64, 0, 0, 0, 0, 1]);
    }

    #[test]
    fn many_near_pairs_bury_no_contact() {
        let (mut log, header) = (AlertLog::default(), FrameHeader::default());
        log.push(run_alert(&header, AlertKind::Contact));
        (0..2 * KEPT_ALERTS).for_each(|_| log.push(run_alert(&header, AlertKind::Near)));
        let first = log.log.latest().next().map(|kept| (kept.number, kept.event.alert_kind()));
        assert_eq!((first, log.log.latest().len()), (Some((0, Some(AlertKind::Contact))), KEPT_ALERTS));
    }

    #[test]
    fn a_kind_that_only_a_newer_monitor_knows_is_kept_and_counted_with_all() {
        let mut log = AlertLog::default();
        log.push(Alert { kind: 77, ..run_alert(&FrameHeader::default(), AlertKind::Near) });
        assert_eq!((log.log.total, log.log.latest().len()), (1, 1));
        assert_eq!(log.counts().map(|(_, count)| count).sum::<u64>(), 0);
    }

    #[test]
    fn the_latest_are_kept_and_grants_are_folded() {
        let mut history = CommandHistory::default();
        let grant = Request::Grant { run_id: 1, from_m: 0.0, to_m: 1.0, is_final: false }.to_wire();
        let mut numbers = 0..;
        let mut push = |event| {
            let number = numbers.next().expect("numbers go on");
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
    fn a_seek_that_is_tried_again_and_an_event_that_came_before_are_kept_once() {
        let mut history = CommandHistory::default();
        let seek = |number, sim_time_s, reply| {
            let event = CommandEvent::answered(&Request::Seek { sim_time_s }.to_wire(), &reply);
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
