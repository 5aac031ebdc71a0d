//! Commands of this side's clients on their way to the other side, and the answers on theirs back.
//!
//! Nothing waits: a command is asked for and put aside; its answer, or that there is none, comes by the inbox.

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

/// Commands that are on their way at a time.
pub(super) const MAX_ASKED: usize = 16;
/// How long the other side may take: less than a client waits, so that it gets a reason.
const PATIENCE: Duration = Duration::from_secs(3);
/// What is waited beyond that for zenoh to say that the time is up.
const GRACE_NS: u64 = 500_000_000;

#[derive(Clone, Copy, Debug)]
pub(super) struct CommandAnswer {
    number: u64,
    outcome: Outcome,
}

#[derive(Clone, Copy, Debug)]
enum Outcome {
    Reply(CommandReply),
    /// There is nobody to ask.
    Nobody,
    /// No answer came, or none that could be understood.
    None,
}

/// The commands that are on their way.
#[derive(Debug)]
pub(super) struct CommandRelay {
    key: String,
    asked: Vec<InFlight>,
    next_number: u64,
    /// Commands passed on.
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

    /// Passes a command on, or answers it where that makes no sense. With it goes what has been seen of the show, so that it
    /// is not carried out after it has been answered here as one that had no answer.
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
            // A guard stands where the server is: what it grants has to reach it, whatever happens to the link.
            Some(Request::Grant { .. }) => Refusal::NotGuarded,
            Some(_) if self.asked.len() == MAX_ASKED => Refusal::TooMany,
            Some(request) => {
                let number = self.next_number;
                self.next_number += 1;
                if self.ask(session, inbox, number, request, run.seen(now_ns)).is_ok() {
                    self.sent += 1;
                    let deadline_ns = now_ns + PATIENCE.as_nanos() as u64 + GRACE_NS;
                    self.asked.push(InFlight { number, deadline_ns, command });
                    return;
                }
                Refusal::Unreachable
            }
        };
        command.answer(run.refused(refusal));
    }

    /// Gives clients the answers that have come, in the words of the run here, and those up whose time is over.
    pub(super) fn give_back(&mut self, inbox: &Inbox, run: &ReceivedRun, now_ns: u64) {
        while let Some(answer) = inbox.answers.pop() {
            let Some(index) = self.asked.iter().position(|asked| asked.number == answer.number) else { continue };
            let reply = match answer.outcome {
                Outcome::Reply(reply) => {
                    CommandReply { run_id: run.run_id(), tick: run.remote.tick_here(reply.tick), ..reply }
                }
                // A source is there, and its bridge takes no commands.
                Outcome::Nobody if inbox.has_source() => run.refused(Refusal::NotTaken),
                Outcome::Nobody | Outcome::None => run.refused(Refusal::Unreachable),
            };
            self.asked.swap_remove(index).command.answer(reply);
        }
        for late in self.asked.extract_if(.., |asked| asked.deadline_ns <= now_ns) {
            late.command.answer(run.refused(Refusal::Unreachable));
        }
    }

    /// Gives all of them up: their run is over.
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
            .timeout(PATIENCE)
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
