//! The clients of the server: operators and the guard, with their requests and replies.

use std::time::Duration;

use bench_dragon::command_queue::{PROOF_PERIOD, REPLY_TIMEOUT, is_sent_again};
use bench_dragon_ipc::{CommandReply, Request};

use super::desks::DeskCall;
use super::{Event, MS_NS, World};
use crate::scenario::SECOND_NS;

/// Longest wait of a guard for a reply.
const GUARD_PATIENCE_NS: u64 = 2 * SECOND_NS;
/// Longest time in which a desk's client joins the bus.
const JOIN_NS: u64 = 100 * MS_NS;
const OPERATOR_PATIENCE_NS: u64 = REPLY_TIMEOUT.as_nanos() as u64;
const PROOF_PERIOD_NS: u64 = PROOF_PERIOD.as_nanos() as u64;

/// The process that waits for a reply.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Caller {
    /// A guard's thread: its process and its question.
    Guard(u64, u64),
    /// An operator's client, by number.
    Operator(u64),
    /// A lane of a desk's queue.
    Desk(DeskCall),
}

/// A call of a client that waits for its reply.
#[derive(Clone, Copy, Debug)]
pub(super) struct Call {
    pub(super) caller: Caller,
    pub(super) request: Request,
    pub(super) begun_ns: u64,
    pub(super) is_captains: bool,
}

impl World<'_> {
    /// A client sends a request. Without a server it has its answer at once.
    pub(super) fn send(&mut self, caller: Caller, request: Request) {
        let now_ns = self.now_ns;
        if let Caller::Guard(life, number) = caller
            && self.guard_at(life, Event::GuardSends(life, number, request)).is_none()
        {
            return;
        }
        let patience_ns = match caller {
            Caller::Guard(..) => GUARD_PATIENCE_NS,
            Caller::Operator(_) | Caller::Desk(_) => OPERATOR_PATIENCE_NS,
        };
        let Some(server) = &self.server else {
            return self.after(MS_NS, Event::Replied(caller, None));
        };
        let server_life = server.life;
        self.after(patience_ns, Event::GivesUp(caller));
        if self.windows.requests_lost_until > now_ns {
            return;
        }
        let (late_until, later_ns) = self.windows.requests_late;
        let later_ns = if late_until > now_ns { later_ns } else { 0 };
        let delay_ns = self.message_ns(50) + later_ns;
        self.after(delay_ns, Event::Arrives(caller, request, server_life));
    }

    pub(super) fn arrive(&mut self, caller: Caller, request: Request, server_life: u64) {
        match self.server.as_mut().filter(|server| server.life == server_life) {
            Some(server) => server.requests.push_back((caller, request)),
            None => self.after(0, Event::Replied(caller, None)),
        }
    }

    pub(super) fn take_reply(&mut self, caller: Caller, reply: Option<CommandReply>) {
        match caller {
            Caller::Guard(life, number) => {
                let Some(guard) = self.guard_at(life, Event::Replied(caller, reply)) else { return };
                let outcome = reply.map(|reply| reply.outcome());
                // Without an answer the guard looks at the newest frame again.
                if guard.take_reply(number, outcome) && outcome.is_some_and(|outcome| outcome.is_ok()) {
                    self.work(life);
                }
            }
            Caller::Operator(_) | Caller::Desk(_) => self.answer(caller, reply),
        }
    }

    pub(super) fn answer(&mut self, caller: Caller, reply: Option<CommandReply>) {
        let Some(place) = self.calls.iter().position(|call| call.caller == caller) else { return };
        let call = self.calls.swap_remove(place);
        let is_sought =
            matches!(call.request, Request::Seek { .. }) && reply.is_some_and(|reply| reply.outcome().is_ok());
        self.has_sought |= call.is_captains && is_sought;
        let elapsed = Duration::from_nanos(self.now_ns - call.begun_ns);
        let has_guard = || self.guards.iter().any(|guard| guard.has_joined);
        let is_sent_again = reply.is_some_and(|reply| is_sent_again(&reply, elapsed, has_guard));
        match caller {
            Caller::Desk(of) if !is_sent_again || self.is_given_up(of) => self.end_call(of, reply),
            _ if is_sent_again => {
                let caller = self.next_call(caller);
                self.begin(Call { caller, ..call }, PROOF_PERIOD_NS);
            }
            _ => {}
        }
    }

    /// The call with which a client sends its request again.
    fn next_call(&mut self, caller: Caller) -> Caller {
        let call = self.life();
        match caller {
            Caller::Desk(of) => Caller::Desk(DeskCall { call, ..of }),
            _ => Caller::Operator(call),
        }
    }

    pub(super) fn give_up(&mut self, caller: Caller) {
        if let Caller::Desk(of) = caller
            && self.calls.iter().any(|call| call.caller == caller)
        {
            self.desks[of.desk].book.give_up(of.command);
        }
        self.take_reply(caller, None);
    }

    /// A person sends a command by a tool of its own, such as `ctl`.
    pub(super) fn begin_call(&mut self, request: Request, is_captains: bool) {
        let caller = Caller::Operator(self.life());
        self.begin(Call { caller, request, begun_ns: self.now_ns, is_captains }, 0);
    }

    /// Time until a client has sent its request: each call joins the bus anew.
    fn join_ns(&self, caller: Caller) -> u64 {
        match caller {
            Caller::Desk(DeskCall { call, .. }) => self.scenario.latency_ns(self.now_ns, 1000 + call, JOIN_NS),
            _ => self.message_ns(60),
        }
    }

    /// Sends the request of a call after a delay.
    pub(super) fn begin(&mut self, call: Call, delay_ns: u64) {
        let Call { caller, request, .. } = call;
        self.calls.push(call);
        let server_life = self.server.as_ref().map(|server| server.life);
        match server_life.filter(|_| self.windows.requests_lost_until <= self.now_ns) {
            Some(life) => {
                let (late_until, later_ns) = self.windows.requests_late;
                let later_ns = if late_until > self.now_ns { later_ns } else { 0 };
                let delay_ns = delay_ns + later_ns + self.join_ns(caller);
                self.after(delay_ns, Event::Arrives(caller, request, life));
                self.after(delay_ns + OPERATOR_PATIENCE_NS, Event::GivesUp(caller));
            }
            None => self.after(delay_ns + MS_NS, Event::GivesUp(caller)),
        }
    }
}
