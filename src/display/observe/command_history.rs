//! The newest commands that an observer has heard of.

use std::collections::VecDeque;

use bench_dragon_ipc::{CommandEvent, EventKind};

/// How many of the latest are kept.
const KEPT: usize = 100;

/// An event and its number, from 0 in the order in which they came, over all runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NumberedCommand {
    /// The number.
    pub number: u64,
    /// The event.
    pub event: CommandEvent,
}

/// The latest 100 events. Of grants, which come by themselves, only the refused ones are kept, and all are counted. A refused
/// command that is sent again at once, as a seek that its guard has still to prove, is kept once.
#[derive(Clone, Debug, Default)]
pub struct CommandHistory {
    latest: VecDeque<NumberedCommand>,
    total: u64,
    grants: u64,
    /// The run and the number of the event that came last.
    newest: Option<(u64, u64)>,
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
        if event.event_kind() == Some(EventKind::Grant) {
            self.grants += 1;
            if event.outcome().is_ok() {
                return;
            }
        }
        if self.latest.back().is_some_and(|last| is_repeated(&last.event, &event)) {
            return;
        }
        if self.latest.len() == KEPT {
            self.latest.pop_front();
        }
        self.latest.push_back(NumberedCommand { number: self.total, event });
        self.total += 1;
    }

    /// Those that are kept, oldest first.
    pub fn latest(&self) -> impl DoubleEndedIterator<Item = &NumberedCommand> + ExactSizeIterator {
        self.latest.iter()
    }

    /// Those that are kept and have at least this number, oldest first.
    pub fn since(&self, number: u64) -> impl Iterator<Item = &NumberedCommand> {
        self.latest.iter().filter(move |command| command.number >= number)
    }

    /// How many there were, without the grants that were accepted.
    pub fn total(&self) -> u64 {
        self.total
    }

    /// How many grants there were.
    pub fn grants(&self) -> u64 {
        self.grants
    }
}

/// Whether the same command of the same process was refused for the same reason.
fn is_repeated(last: &CommandEvent, event: &CommandEvent) -> bool {
    let what = |event: &CommandEvent| (event.run_id, event.kind, event.sender, event.pid, event.refusal, event.values);
    event.outcome().is_err() && what(last) == what(event)
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::{CommandReply, Refusal, Request, Sender};

    use super::*;

    #[test]
    fn the_latest_are_kept_and_grants_are_folded() {
        let mut history = CommandHistory::default();
        let grant = Request::Grant { run_id: 1, from_m: 0.0, to_m: 1.0, is_final: false }.to_wire();
        let mut numbers = 0..;
        let mut push = |event| {
            let number = numbers.next().expect("numbers go on");
            history.push(CommandEvent { number, ..event });
        };
        for tick in 0..KEPT as u64 {
            push(CommandEvent::plain(EventKind::Pause, Sender::Ctl, tick));
            push(CommandEvent::answered(&grant, &CommandReply::accepted(0, tick)));
        }
        push(CommandEvent::answered(&grant, &CommandReply::refused(0, 7, Refusal::OtherRun)));
        assert_eq!((history.total(), history.grants()), (KEPT as u64 + 1, KEPT as u64 + 1));
        assert_eq!((history.latest().len(), history.since(KEPT as u64).count()), (KEPT, 1));
        assert_eq!(history.latest().next().map(|command| command.number), Some(1));
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
        let numbers: Vec<u64> = history.latest().map(|command| command.event.number).collect();
        assert_eq!(numbers, [0, 50, 51]);
    }
}
