//! The machines from which the pages of this view sent their commands.
//!
//! On the bus, a command has the process id of the view. The view knows which of its pages sent it: it submits commands one
//! after another, and recognises each among the events of the bus by its request. So pages of another view have no machine.

use std::collections::VecDeque;
use std::net::IpAddr;
use std::process;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bench_dragon_ipc::{BusError, CommandEvent, Request, Sender};

use crate::command_queue::CommandQueueError;
use crate::display::observe::{CommandHistory, Numbered};

/// Greatest number of commands that wait for their event, and of named events.
const MAX_KEPT: usize = 100;

/// The senders of commands.
#[derive(Debug, Default)]
pub(super) struct PageSenders(Mutex<SenderState>);

#[derive(Debug, Default)]
struct SenderState {
    submitted: VecDeque<Submitted>,
    next_id: u64,
    /// Number of the first event that has not been named yet.
    next_event: u64,
    hosts: SenderHosts,
}

/// The machine of each sender, by the number of the command's event.
#[derive(Clone, Debug, Default)]
pub(super) struct SenderHosts(Arc<VecDeque<(u64, IpAddr)>>);

#[derive(Clone, Copy, Debug)]
struct Submitted {
    id: u64,
    request: Request,
    host: IpAddr,
    /// Whether an event of this command has been seen. A hold is sent twice if another command was in flight.
    is_seen: bool,
    /// Whether the server may not have received the command.
    is_doubtful: bool,
}

impl PageSenders {
    /// Records a command before it is submitted. Returns its number.
    pub(super) fn submit(&self, request: Request, host: IpAddr) -> u64 {
        let mut state = self.state();
        let id = state.next_id;
        state.next_id += 1;
        if state.submitted.len() == MAX_KEPT {
            state.submitted.pop_front();
        }
        state.submitted.push_back(Submitted { id, request, host, is_seen: false, is_doubtful: false });
        id
    }

    /// Records that a command has no reply. The server cannot have received it, unless the reply is only late.
    pub(super) fn fail(&self, id: u64, error: &CommandQueueError) {
        let mut state = self.state();
        if matches!(error, CommandQueueError::Bus(BusError::NoAnswer { .. })) {
            state.submitted.iter_mut().filter(|one| one.id == id).for_each(|one| one.is_doubtful = true);
        } else {
            state.submitted.retain(|one| one.id != id);
        }
    }

    /// Finds the senders of the new events of a history. Returns those of all its events.
    pub(super) fn name(&self, history: &CommandHistory) -> SenderHosts {
        let mut state = self.state();
        for Numbered { number, event } in history.log.since(state.next_event) {
            if let Some(host) = state.host_of(event) {
                let hosts = Arc::make_mut(&mut state.hosts.0);
                if hosts.len() == MAX_KEPT {
                    hosts.pop_front();
                }
                hosts.push_back((*number, host));
            }
        }
        state.next_event = history.log.total;
        state.hosts.clone()
    }

    /// Ignores a poisoned lock: the values are consistent even after a panic.
    fn state(&self) -> MutexGuard<'_, SenderState> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl SenderState {
    /// The sender of an event: the oldest command with this request that has no event yet, else the newest one that has.
    fn host_of(&mut self, event: &CommandEvent) -> Option<IpAddr> {
        if event.sent_by() != Some(Sender::Page) || event.pid != process::id() {
            return None;
        }
        let request = event.request()?;
        let position = |is_wanted: fn(&Submitted) -> bool| {
            self.submitted.iter().position(|one| one.request == request && is_wanted(one))
        };
        let unseen = position(|one| !one.is_seen && !one.is_doubtful).or_else(|| position(|one| !one.is_seen));
        let found = unseen.or_else(|| self.submitted.iter().rposition(|one| one.request == request))?;
        self.submitted[found].is_seen = true;
        Some(self.submitted[found].host)
    }
}

impl SenderHosts {
    /// The machine that sent the command of an event, if it was a page of this view.
    pub(super) fn host(&self, number: u64) -> Option<IpAddr> {
        self.0.iter().find(|(named, _)| *named == number).map(|(_, host)| *host)
    }
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::{Command, CommandReply};

    use super::*;

    fn host(last: u8) -> IpAddr {
        [10, 0, 0, last].into()
    }

    fn event(request: Request, sender: Sender, pid: u32, tick: u64) -> CommandEvent {
        let command = Command { sender: sender.to_wire(), pid, ..request.to_wire() };
        CommandEvent { number: tick, ..CommandEvent::answered(&command, &CommandReply::accepted(1, tick)) }
    }

    fn named(senders: &PageSenders, history: &mut CommandHistory, event: CommandEvent) -> Option<IpAddr> {
        history.push(event);
        senders.name(history).host(history.log.total - 1)
    }

    #[test]
    fn each_command_of_a_page_has_the_machine_of_its_page() {
        let (senders, mut history) = (PageSenders::default(), CommandHistory::default());
        let pid = process::id();
        senders.submit(Request::Pause, host(1));
        senders.submit(Request::Hold, host(2));
        senders.submit(Request::Pause, host(3));
        let mut next = |request, sender, pid, tick| named(&senders, &mut history, event(request, sender, pid, tick));
        assert_eq!(next(Request::Hold, Sender::Page, pid, 1), Some(host(2)));
        assert_eq!(next(Request::Pause, Sender::Page, pid, 2), Some(host(1)));
        assert_eq!(next(Request::Hold, Sender::Page, pid, 3), Some(host(2)), "a hold that is sent twice");
        assert_eq!(next(Request::Pause, Sender::Page, pid, 4), Some(host(3)));
        assert_eq!(next(Request::Resume, Sender::Page, pid, 5), None, "nobody asked for it");
        assert_eq!(next(Request::Pause, Sender::Ctl, pid, 6), None, "another sender");
        assert_eq!(next(Request::Pause, Sender::Page, pid + 1, 7), None, "another view");
    }

    #[test]
    fn a_command_that_was_never_sent_lends_its_machine_to_no_other() {
        let (senders, mut history) = (PageSenders::default(), CommandHistory::default());
        let overtaken = senders.submit(Request::Pause, host(1));
        senders.fail(overtaken, &CommandQueueError::Overtaken);
        senders.submit(Request::Pause, host(2));
        let pause = event(Request::Pause, Sender::Page, process::id(), 1);
        assert_eq!(named(&senders, &mut history, pause), Some(host(2)));
    }

    #[test]
    fn the_lists_are_bounded() {
        let (senders, mut history) = (PageSenders::default(), CommandHistory::default());
        for tick in 0..3 * MAX_KEPT as u64 {
            senders.submit(Request::Pause, host(1));
            let pause = event(Request::Pause, Sender::Page, process::id(), tick);
            assert_eq!(named(&senders, &mut history, pause), Some(host(1)));
        }
        let state = senders.state();
        assert_eq!((state.submitted.len(), state.hosts.0.len()), (MAX_KEPT, MAX_KEPT));
    }
}
