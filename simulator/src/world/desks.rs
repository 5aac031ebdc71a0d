//! The desks: programs of operators, such as the page and `watch`, which send commands through a production queue.

use std::collections::VecDeque;

use bench_dragon::command_queue::{CommandOrder, CommandQueueError, LaneKind, NextStep, Outcome};
use bench_dragon_ipc::{BusError, CommandReply, Request};

use super::clients::{Call, Caller};
use super::{Event, MESSAGE_NS, World};
use crate::promises::{Promise, QueueBook};

/// Number of desks.
pub(super) const DESKS: usize = 2;

/// A call of a desk: a command that a lane sends, maybe not for the first time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct DeskCall {
    pub(crate) desk: usize,
    pub(crate) lane: Lane,
    /// Number of the command in its queue.
    pub(crate) command: u64,
    /// Number of the call.
    pub(crate) call: u64,
}

/// A lane, as a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Lane {
    Others,
    Holds,
}

/// A desk with its queue.
#[derive(Debug, Default)]
pub(super) struct Desk {
    order: CommandOrder<()>,
    pub(super) book: QueueBook,
    /// Numbers of the commands that each lane has still to send, in the order of their submission.
    lanes: [VecDeque<u64>; 2],
    /// The command in flight of each lane.
    in_flight: [Option<u64>; 2],
}

impl World<'_> {
    /// An operator submits a command at a desk.
    pub(super) fn submit(&mut self, desk: usize, request: Request) {
        let Desk { order, book, lanes, .. } = &mut self.desks[desk];
        let (number, refused) = order.submit(request, ());
        book.submit(number, request, self.now_ns);
        let answered = if refused.is_some() {
            let answered = book.answer(number, &Err(CommandQueueError::Crowded));
            order.forget(number);
            answered
        } else {
            lanes[usize::from(request == Request::Hold)].push_back(number);
            Ok(())
        };
        self.require_queue(answered);
        self.wake_lanes(desk);
    }

    /// The threads of both lanes wake, each in its own time.
    fn wake_lanes(&mut self, desk: usize) {
        for lane in [LaneKind::Others, LaneKind::Holds] {
            let purpose = 70 + 2 * desk as u64 + u64::from(lane == LaneKind::Holds);
            let wake_ns = self.scenario.latency_ns(self.now_ns, purpose, MESSAGE_NS);
            self.after(wake_ns, Event::Lane(desk, lane));
        }
    }

    /// Carries out the next steps of a lane.
    pub(super) fn wake_lane(&mut self, desk: usize, lane: LaneKind) {
        let call = self.life();
        let of = &mut self.desks[desk];
        let place = usize::from(lane == LaneKind::Holds);
        match of.order.next(lane) {
            NextStep::Wait => {}
            NextStep::Answer(number, (), error) => {
                of.lanes[place].retain(|waiting| *waiting != number);
                let answered = of.book.answer(number, &Err(error));
                of.order.forget(number);
                self.require_queue(answered);
                self.wake_lanes(desk);
            }
            NextStep::Send(request) => {
                // A hold that is sent again is in flight already.
                let command = of.in_flight[place].or_else(|| of.lanes[place].pop_front());
                of.in_flight[place] = command;
                let command = command.expect("a lane sends only what was submitted");
                let lane = if lane == LaneKind::Holds { Lane::Holds } else { Lane::Others };
                let caller = Caller::Desk(DeskCall { desk, lane, command, call });
                self.begin(Call { caller, request, begun_ns: self.now_ns, is_captains: false }, 0);
            }
        }
    }

    pub(super) fn is_given_up(&self, of: DeskCall) -> bool {
        of.lane == Lane::Others && self.desks[of.desk].order.is_given_up()
    }

    /// A lane has the reply of the server, or none.
    pub(super) fn end_call(&mut self, of: DeskCall, reply: Option<CommandReply>) {
        let no_answer = || BusError::NoServer { instance: "simulated".to_owned() };
        let reply: Outcome = reply.ok_or_else(|| CommandQueueError::Bus(no_answer()));
        let run_id = self.server.as_ref().map(|server| server.run_id);
        let Desk { order, book, in_flight, .. } = &mut self.desks[of.desk];
        let (lane, place) = match of.lane {
            Lane::Others => (LaneKind::Others, 0),
            Lane::Holds => (LaneKind::Holds, 1),
        };
        let answered = if let Some((number, (), outcome)) = order.take_reply(lane, reply) {
            in_flight[place] = None;
            let answered = book.check_hold(number, &outcome, run_id).and_then(|()| book.answer(number, &outcome));
            order.forget(number);
            answered
        } else {
            Ok(())
        };
        self.require_queue(answered);
        self.wake_lanes(of.desk);
    }

    pub(super) fn require_queue(&mut self, checked: Result<(), (Promise, String)>) {
        if let Err((promise, what)) = checked {
            self.promises.require(promise, self.now_ns, false, || what);
        }
    }

    /// Checks that no command waits for ever.
    pub(super) fn look_at_desks(&mut self) {
        for desk in 0..DESKS {
            let checked = self.desks[desk].book.look(self.now_ns);
            self.require_queue(checked);
        }
    }
}
