//! Sends commands of this host's clients to the other host, and returns the answers to the clients.
//!
//! The relay never waits. It sends a command and stores it. The answer, or the notice that it is missing, arrives in the inbox.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use bench_dragon_ipc::{CommandReply, IntoBytes as _, Refusal, Request};
use zenoh::handlers::CallbackDrop;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::Reply;
use zenoh::{Session, Wait as _};

use super::inbox::Inbox;
use super::key_prefix::KeyPrefix;
use super::received_run::ReceivedRun;
use super::wire::{COMMAND_ENCODING, REPLY_BYTES, Seen, decode_reply, encode_seen};
use crate::source::AskedCommand;

/// Most commands in flight at a time.
pub(super) const MAX_ASKED: usize = 16;
/// Longest wait for the other host's answer. It is shorter than a client's timeout, so the client receives a reason.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(3);
/// Extra wait after that, for zenoh to report the timeout.
const GRACE_NS: u64 = 500_000_000;

#[derive(Clone, Copy, Debug)]
pub(super) struct CommandAnswer {
    number: u64,
    outcome: Outcome,
}

#[derive(Clone, Copy, Debug)]
enum Outcome {
    Reply(CommandReply),
    /// The query ended without a reply: no bridge accepts commands.
    Nobody,
    /// The reply was an error, such as a timeout, or was malformed.
    None,
}

/// The commands in flight.
#[derive(Debug)]
pub(super) struct CommandRelay {
    key: String,
    asked: Vec<InFlight>,
    next_number: u64,
    /// Commands sent to the other host.
    pub(super) sent: u64,
}

#[derive(Debug)]
struct InFlight {
    number: u64,
    deadline_ns: u64,
    command: AskedCommand,
}

impl CommandRelay {
    pub(super) fn new(prefix: &KeyPrefix) -> Self {
        Self { key: prefix.commands(), asked: Vec::with_capacity(MAX_ASKED), next_number: 0, sent: 0 }
    }

    /// Sends a command to the other host, or refuses it here if it cannot be sent. An attachment contains the position in the
    /// show that this host has seen. With it the other host rejects a command for which this host no longer waits.
    pub(super) fn pass_on(
        &mut self,
        command: AskedCommand,
        session: &Session,
        inbox: &Arc<Inbox>,
        run: &ReceivedRun,
        now_ns: u64,
    ) {
        let refusal = match command.request() {
            None => Refusal::Unknown,
            // A guard runs on the server's machine: its grants must reach the server even if the link is cut.
            Some(Request::Grant { .. }) => Refusal::NotGuarded,
            Some(_) if self.asked.len() == MAX_ASKED => Refusal::TooMany,
            Some(request) => {
                let number = self.next_number;
                self.next_number += 1;
                if self.ask(session, inbox, number, request, run.seen(now_ns)).is_ok() {
                    self.sent += 1;
                    let deadline_ns = now_ns + ANSWER_TIMEOUT.as_nanos() as u64 + GRACE_NS;
                    self.asked.push(InFlight { number, deadline_ns, command });
                    return;
                }
                Refusal::Unreachable
            }
        };
        command.answer(run.refused(refusal));
    }

    /// Returns arrived answers to the clients, with the run id and the tick of the local run. Refuses commands whose deadline
    /// has passed.
    pub(super) fn give_back(&mut self, inbox: &Inbox, run: &ReceivedRun, now_ns: u64) {
        while let Some(answer) = inbox.answers.pop() {
            let Some(index) = self.asked.iter().position(|asked| asked.number == answer.number) else { continue };
            let reply = match answer.outcome {
                Outcome::Reply(reply) => {
                    CommandReply { run_id: run.run_id(), tick: run.remote.tick_here(reply.tick), ..reply }
                }
                // A source exists, but its bridge accepts no commands.
                Outcome::Nobody if inbox.has_source() => run.refused(Refusal::NotTaken),
                Outcome::Nobody | Outcome::None => run.refused(Refusal::Unreachable),
            };
            self.asked.swap_remove(index).command.answer(reply);
        }
        for late in self.asked.extract_if(.., |asked| asked.deadline_ns <= now_ns) {
            late.command.answer(run.refused(Refusal::Unreachable));
        }
    }

    /// Refuses all commands in flight, because their run is over.
    pub(super) fn give_up(&mut self, run: &ReceivedRun) {
        for asked in self.asked.drain(..) {
            asked.command.answer(run.refused(Refusal::Unreachable));
        }
    }

    fn ask(
        &self,
        session: &Session,
        inbox: &Arc<Inbox>,
        number: u64,
        request: Request,
        seen: Seen,
    ) -> zenoh::Result<()> {
        let is_answered = Arc::new(AtomicBool::new(false));
        let answer = {
            let (is_answered, inbox) = (Arc::clone(&is_answered), Arc::clone(inbox));
            move |outcome| {
                if !is_answered.swap(true, Ordering::Relaxed) {
                    inbox.put_answer(CommandAnswer { number, outcome });
                }
            }
        };
        let at_end = answer.clone();
        session
            .get(&self.key)
            .payload(request.to_wire().as_bytes())
            .encoding(COMMAND_ENCODING)
            .attachment(encode_seen(seen))
            .congestion_control(CongestionControl::Drop)
            .priority(Priority::RealTime)
            .express(true)
            .timeout(ANSWER_TIMEOUT)
            .with(CallbackDrop {
                callback: move |reply: Reply| answer(read(&reply)),
                drop: move || at_end(Outcome::Nobody),
            })
            .wait()
    }
}

fn read(reply: &Reply) -> Outcome {
    let sample = reply.result().ok().filter(|sample| sample.payload().len() == REPLY_BYTES);
    let reply = sample.and_then(|sample| decode_reply(&sample.payload().to_bytes()));
    reply.map_or(Outcome::None, Outcome::Reply)
}
