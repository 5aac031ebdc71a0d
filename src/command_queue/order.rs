//! The order of a queue's commands: which one is sent next, and which ones are cancelled. It has neither threads nor a clock.
//!
//! 1. Commands other than holds are sent one at a time, in the order of their submission.
//! 2. A hold is sent at once. It cancels all commands that were submitted before it and are not sent.
//! 3. A command in flight at that moment may reach the server after the hold. So the hold is sent again after the reply to
//!    that command, and the second reply is the hold's outcome.
//! 4. A command that was submitted after a hold waits for the hold's outcome. So a hold never undoes a later release.

use std::collections::VecDeque;

use bench_dragon_ipc::{CommandReply, Request};

use super::{CommandQueueError, MAX_WAITING};

/// A lane of a queue. Each lane has at most one command in flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LaneKind {
    /// All commands but holds.
    Others,
    /// Holds.
    Holds,
}

/// The next step of a lane.
#[derive(Debug)]
pub enum NextStep<A> {
    /// The lane sends this request now, and passes its reply to [`CommandOrder::take_reply`].
    Send(Request),
    /// This command is not sent. [`CommandOrder::forget`] takes its number after the answer.
    Answer(u64, A, CommandQueueError),
    /// The lane waits for the next change.
    Wait,
}

/// The outcome of a command that was sent.
pub type Outcome = Result<CommandReply, CommandQueueError>;

/// The commands of a queue, each with the address `A` of its answer.
#[derive(Debug)]
pub struct CommandOrder<A> {
    others: VecDeque<(Submitted, A)>,
    holds: VecDeque<(Submitted, A)>,
    other_in_flight: Option<(Submitted, A)>,
    hold_in_flight: Option<HoldInFlight<A>>,
    /// Number of commands, and of holds, submitted so far.
    given: u64,
    holds_given: u64,
    is_closed: bool,
    /// Commands without an answer, in the order of their submission.
    unanswered: Vec<Submitted>,
}

/// A submitted command.
#[derive(Clone, Copy, Debug)]
pub(super) struct Submitted {
    pub(super) request: Request,
    number: u64,
    /// Number of holds submitted before the command.
    holds_before: u64,
    /// Whether only holds waited when this command was submitted. Then closing the queue does not cancel it.
    is_first: bool,
    pub(super) is_sent: bool,
}

#[derive(Debug)]
struct HoldInFlight<A> {
    command: Submitted,
    answer: A,
    /// Whether a command was in flight when the hold was sent.
    has_company: bool,
    phase: HoldPhase,
}

#[derive(Debug)]
enum HoldPhase {
    /// The hold has been sent.
    Sent,
    /// The first reply is there, and the hold waits to be sent again.
    Waits(Outcome),
    /// The hold has been sent again.
    SentAgain(Outcome),
}

impl<A> Default for CommandOrder<A> {
    fn default() -> Self {
        Self {
            others: VecDeque::new(),
            holds: VecDeque::new(),
            other_in_flight: None,
            hold_in_flight: None,
            given: 0,
            holds_given: 0,
            is_closed: false,
            unanswered: Vec::new(),
        }
    }
}

impl<A> CommandOrder<A> {
    /// Submits a command. Returns its number, and `answer` again if the lane is full; the caller then reports
    /// [`CommandQueueError::Crowded`] and calls [`CommandOrder::forget`].
    pub fn submit(&mut self, request: Request, answer: A) -> (u64, Option<A>) {
        let is_hold = request == Request::Hold;
        let is_first = self.unanswered.iter().all(|one| one.request == Request::Hold);
        let (number, holds_before) = (self.given, self.holds_given);
        let command = Submitted { request, number, holds_before, is_first, is_sent: is_first };
        self.given += 1;
        self.holds_given += u64::from(is_hold);
        self.unanswered.push(command);
        let lane = if is_hold { &mut self.holds } else { &mut self.others };
        if lane.len() == MAX_WAITING {
            return (number, Some(answer));
        }
        lane.push_back((command, answer));
        (number, None)
    }

    /// The next step of a lane that has nothing in flight, or whose hold waits to be sent again.
    pub fn next(&mut self, lane: LaneKind) -> NextStep<A> {
        match lane {
            LaneKind::Others => self.next_other(),
            LaneKind::Holds => self.next_hold(),
        }
    }

    fn next_other(&mut self) -> NextStep<A> {
        if self.other_in_flight.is_some() {
            return NextStep::Wait;
        }
        let Some((command, answer)) = self.others.pop_front() else { return NextStep::Wait };
        if let Some(error) = self.cancels(command) {
            return NextStep::Answer(command.number, answer, error);
        }
        // A later hold would have cancelled the command, so these holds are earlier.
        if self.hold_in_flight.is_some() || !self.holds.is_empty() {
            self.others.push_front((command, answer));
            return NextStep::Wait;
        }
        self.note_sent(command);
        self.other_in_flight = Some((command, answer));
        NextStep::Send(command.request)
    }

    fn next_hold(&mut self) -> NextStep<A> {
        if let Some(hold) = &mut self.hold_in_flight {
            let is_alone = self.other_in_flight.is_none();
            hold.phase = match std::mem::replace(&mut hold.phase, HoldPhase::Sent) {
                HoldPhase::Waits(first) if is_alone => HoldPhase::SentAgain(first),
                phase => {
                    hold.phase = phase;
                    return NextStep::Wait;
                }
            };
            return NextStep::Send(Request::Hold);
        }
        let Some((command, answer)) = self.holds.pop_front() else { return NextStep::Wait };
        self.note_sent(command);
        let has_company = self.other_in_flight.is_some();
        self.hold_in_flight = Some(HoldInFlight { command, answer, has_company, phase: HoldPhase::Sent });
        NextStep::Send(Request::Hold)
    }

    /// Takes the reply to the command in flight of a lane. Returns the command's number, the address of its answer and the
    /// outcome, unless the command is a hold that is sent again. [`CommandOrder::forget`] takes the number after the answer.
    pub fn take_reply(&mut self, lane: LaneKind, reply: Outcome) -> Option<(u64, A, Outcome)> {
        if lane == LaneKind::Others {
            let (command, answer) = self.other_in_flight.take()?;
            return Some((command.number, answer, reply));
        }
        let HoldInFlight { command, answer, has_company, phase } = self.hold_in_flight.take()?;
        let outcome = match phase {
            HoldPhase::Sent if has_company => {
                let phase = HoldPhase::Waits(reply);
                self.hold_in_flight = Some(HoldInFlight { command, answer, has_company, phase });
                return None;
            }
            HoldPhase::Sent => reply,
            // A server that has ended since then has stopped too, so the first reply counts.
            HoldPhase::SentAgain(first) => reply.or(first),
            HoldPhase::Waits(_) => unreachable!("a hold that waits is not in flight"),
        };
        Some((command.number, answer, outcome))
    }

    /// Removes a command that has been answered.
    pub fn forget(&mut self, number: u64) {
        self.unanswered.retain(|one| one.number != number);
    }

    /// Whether the command in flight of the lane of others is not to be sent again: a later hold was submitted, or the
    /// queue was closed.
    pub fn is_given_up(&self) -> bool {
        let in_flight = self.other_in_flight.as_ref();
        in_flight.is_some_and(|(command, _)| self.cancels(Submitted { is_first: false, ..*command }).is_some())
    }

    /// Cancels all commands that are not sent, except holds and a command that was submitted while no other one waited.
    pub fn close(&mut self) {
        self.is_closed = true;
    }

    /// Whether a lane has no commands.
    pub fn is_idle(&self, lane: LaneKind) -> bool {
        match lane {
            LaneKind::Others => self.others.is_empty() && self.other_in_flight.is_none(),
            LaneKind::Holds => self.holds.is_empty() && self.hold_in_flight.is_none(),
        }
    }

    /// The commands without an answer, in the order of their submission.
    pub(super) fn unanswered(&self) -> &[Submitted] {
        &self.unanswered
    }

    /// Returns why a command must not be sent: a later hold has cancelled it, or the queue has closed.
    fn cancels(&self, command: Submitted) -> Option<CommandQueueError> {
        let is_overtaken = self.holds_given > command.holds_before;
        let is_closed = self.is_closed && !command.is_first;
        is_overtaken.then_some(CommandQueueError::Overtaken).or(is_closed.then_some(CommandQueueError::Closed))
    }

    fn note_sent(&mut self, command: Submitted) {
        self.unanswered.iter_mut().filter(|one| one.number == command.number).for_each(|one| one.is_sent = true);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sends(order: &mut CommandOrder<()>, lane: LaneKind) -> Option<Request> {
        match order.next(lane) {
            NextStep::Send(request) => Some(request),
            NextStep::Wait => None,
            NextStep::Answer(_, (), error) => panic!("{error}"),
        }
    }

    const REPLY: Outcome = Ok(CommandReply { run_id: 1, tick: 0, lowest: 0.0, highest: 0.0, refusal: 0, reserved: 0 });

    #[test]
    fn a_release_after_a_hold_waits_until_the_hold_has_been_sent_again() {
        let mut order = CommandOrder::default();
        order.submit(Request::Pause, ());
        assert_eq!(sends(&mut order, LaneKind::Others), Some(Request::Pause));
        order.submit(Request::Hold, ());
        order.submit(Request::Release, ());
        assert_eq!(sends(&mut order, LaneKind::Holds), Some(Request::Hold));
        assert!(order.take_reply(LaneKind::Holds, REPLY).is_none(), "the pause may follow the hold");
        assert_eq!(sends(&mut order, LaneKind::Holds), None);
        assert!(order.take_reply(LaneKind::Others, REPLY).is_some(), "the pause's answer");
        assert_eq!(sends(&mut order, LaneKind::Others), None, "the release would be undone by the second hold");
        assert_eq!(sends(&mut order, LaneKind::Holds), Some(Request::Hold));
        assert!(order.take_reply(LaneKind::Holds, REPLY).is_some(), "the hold's answer");
        assert_eq!(sends(&mut order, LaneKind::Others), Some(Request::Release));
    }

    #[test]
    fn a_release_right_behind_a_hold_is_not_sent_before_it() {
        let mut order = CommandOrder::default();
        order.submit(Request::Hold, ());
        order.submit(Request::Release, ());
        assert_eq!(sends(&mut order, LaneKind::Others), None, "the lane of others wakes first");
        assert_eq!(sends(&mut order, LaneKind::Holds), Some(Request::Hold));
        assert_eq!(sends(&mut order, LaneKind::Others), None);
        assert!(order.take_reply(LaneKind::Holds, REPLY).is_some(), "the hold's answer");
        assert_eq!(sends(&mut order, LaneKind::Others), Some(Request::Release));
    }
}
