//! The promises of a command queue: a book of its commands, their answers, and what the server made of them.

use std::collections::BTreeMap;

use bench_dragon::command_queue::{CommandQueueError, MAX_WAITING, Outcome};
use bench_dragon_ipc::{CommandReply, Request};

use super::Promise;
use crate::scenario::SECOND_NS;
use crate::world::DeskCall;

/// Longest time from a command to its answer: those before it have ten seconds each, with the proof of a seek.
const LONGEST_WAIT_NS: u64 = 2 * (MAX_WAITING as u64 + 2) * 10 * SECOND_NS;
/// Answered commands that are kept for late arrivals at the server.
const MOST_KEPT: usize = 64;

type Checked = Result<(), (Promise, String)>;

/// The commands of a queue, by number.
#[derive(Debug, Default)]
pub(crate) struct QueueBook {
    commands: BTreeMap<u64, Entry>,
    /// The latest commands that a server has accepted.
    accepted: Vec<u64>,
}

#[derive(Debug)]
struct Entry {
    request: Request,
    submitted_ns: u64,
    is_answered: bool,
    /// Whether a client has ceased to wait for its reply.
    is_given_up: bool,
    /// Replies of servers.
    replies: Vec<CommandReply>,
}

impl QueueBook {
    pub(crate) fn submit(&mut self, number: u64, request: Request, now_ns: u64) {
        let replies = Vec::new();
        let entry = Entry { request, submitted_ns: now_ns, is_answered: false, is_given_up: false, replies };
        self.commands.insert(number, entry);
        while self.commands.len() > MOST_KEPT + 2 * (MAX_WAITING + 2) {
            let oldest = self.commands.iter().find(|(_, entry)| entry.is_answered).map(|(&number, _)| number);
            let Some(number) = oldest else { return };
            self.commands.remove(&number);
        }
    }

    pub(crate) fn give_up(&mut self, number: u64) {
        self.commands.entry(number).and_modify(|entry| entry.is_given_up = true);
    }

    /// A server takes a command, and replies.
    pub(crate) fn take(&mut self, DeskCall { command: number, .. }: DeskCall, reply: &CommandReply) -> Checked {
        let Some(entry) = self.commands.get_mut(&number) else { return Ok(()) };
        entry.replies.push(*reply);
        if reply.outcome().is_err() || entry.is_given_up {
            return Ok(());
        }
        let (is_hold, request) = (entry.request == Request::Hold, entry.request);
        let accepted = entry.replies.iter().filter(|reply| reply.outcome().is_ok()).count();
        require(Promise::CommandTakesEffectOnce, accepted <= 1 + usize::from(is_hold), || {
            format!("command {number} {request:?} takes effect {accepted} times")
        })?;
        // A command in flight may follow a hold, which is then sent again before it is answered.
        let is_open_hold = |other: &Entry| other.request == Request::Hold && !other.is_answered;
        let later = self.accepted.iter().filter(|&&other| other > number);
        let later = later.filter_map(|other| self.commands.get(other).map(|entry| (other, entry)));
        let undone =
            later.filter(|(_, entry)| !entry.is_given_up && !is_open_hold(entry)).map(|(other, _)| *other).next();
        self.accepted.retain(|&other| other != number && other + MOST_KEPT as u64 > number);
        self.accepted.push(number);
        require(Promise::CommandsKeepTheirOrder, undone.is_none(), || {
            let after = undone.and_then(|other| self.commands.get(&other)).map(|entry| entry.request);
            format!("command {number} {request:?} takes effect after command {undone:?} {after:?}")
        })
    }

    /// Checks that no command before an accepted hold has taken effect after it in this run of the server, when the queue answers
    /// the hold.
    pub(crate) fn check_hold(&self, number: u64, outcome: &Outcome, run_id: Option<u64>) -> Checked {
        let is_now = outcome.as_ref().is_ok_and(|reply| reply.outcome().is_ok() && Some(reply.run_id) == run_id);
        let hold = self.commands.get(&number).filter(|entry| entry.request == Request::Hold && !entry.is_given_up);
        let Some(place) = self.accepted.iter().position(|&one| one == number).filter(|_| is_now && hold.is_some())
        else {
            return Ok(());
        };
        let is_undoing = |&&one: &&u64| one < number && self.commands.get(&one).is_some_and(|entry| !entry.is_given_up);
        let undone = self.accepted[place..].iter().find(is_undoing);
        require(Promise::CommandsKeepTheirOrder, undone.is_none(), || {
            format!("command {undone:?} takes effect after the hold {number}, which is answered")
        })
    }

    /// The queue answers a command.
    pub(crate) fn answer(&mut self, number: u64, outcome: &Outcome) -> Checked {
        let waiting = self.commands.values().filter(|entry| !entry.is_answered).count();
        let is_overtaken = self.commands.range(number + 1..).any(|(_, later)| later.request == Request::Hold);
        let Some(entry) = self.commands.get_mut(&number) else {
            return Err((Promise::CommandIsAnsweredOnce, format!("command {number} is answered late or twice")));
        };
        let was_answered = std::mem::replace(&mut entry.is_answered, true);
        require(Promise::CommandIsAnsweredOnce, !was_answered, || format!("command {number} is answered twice"))?;
        let is_true = match outcome {
            Ok(reply) => entry.replies.contains(reply),
            Err(CommandQueueError::Overtaken) => is_overtaken && entry.replies.is_empty(),
            Err(CommandQueueError::Crowded) => waiting > MAX_WAITING && entry.replies.is_empty(),
            Err(CommandQueueError::Bus(_)) => true,
            Err(CommandQueueError::Closed) => false,
        };
        require(Promise::CommandIsAnsweredOnce, is_true, || {
            format!(
                "command {number} {:?} is answered with {outcome:?}, servers have replied {:?}",
                entry.request, entry.replies
            )
        })
    }

    /// Checks that the queue is bounded, and that each command is answered at last.
    pub(crate) fn look(&self, now_ns: u64) -> Checked {
        let waiting: Vec<&Entry> = self.commands.values().filter(|entry| !entry.is_answered).collect();
        require(Promise::QueueIsBounded, waiting.len() <= 2 * (MAX_WAITING + 1), || {
            format!("{} commands wait for their answers", waiting.len())
        })?;
        let oldest = waiting.iter().find(|entry| now_ns - entry.submitted_ns > LONGEST_WAIT_NS);
        require(Promise::CommandIsAnsweredOnce, oldest.is_none(), || format!("{oldest:?} has no answer"))
    }
}

fn require(promise: Promise, holds: bool, what: impl FnOnce() -> String) -> Checked {
    if holds { Ok(()) } else { Err((promise, what())) }
}
