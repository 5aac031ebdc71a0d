//! The last command and what became of it.

use bench_dragon_ipc::{CommandEvent, CommandReply, Request};

use super::theme::Tone;
use crate::command_queue::CommandQueueError;
use crate::output::report::{CommandWords, request_words};

/// One line about a command.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reply {
    pub(super) text: String,
    pub(super) tone: Tone,
    /// Where the command was a speed: the tick from which it holds, or that it will not be walked at.
    pub(super) speed: Option<Result<u64, ()>>,
}

impl Reply {
    /// The command is on its way.
    pub fn sent(request: Request) -> Self {
        Self::new(format!("{}: sent", request_words(request)), Tone::Calm)
    }

    /// Nothing was sent, for it would be refused.
    pub(super) fn not_sent(request: Request, reason: &str) -> Self {
        Self::new(format!("{}: not sent: {reason}", request_words(request)), Tone::Caution)
    }

    /// A command that somebody else has given.
    pub(super) fn of_others(event: &CommandEvent) -> Self {
        let words = CommandWords::from(event);
        Self::new(format!("{} {}", words.clock, words.text), Tone::Calm)
    }

    /// Nothing was sent.
    pub(super) fn mistaken(why: String) -> Self {
        Self::new(why, Tone::Caution)
    }

    /// What the server said, or why it said nothing.
    pub fn to(request: Request, answer: Result<CommandReply, CommandQueueError>) -> Self {
        let name = request_words(request);
        let outcome = answer.map(|reply| reply.outcome());
        let from_tick = match &outcome {
            Ok(Ok(tick)) => Ok(*tick),
            _ => Err(()),
        };
        let reply = match outcome {
            Ok(Ok(tick)) => Self::new(format!("{name}: accepted, from tick {tick} on"), Tone::Good),
            Ok(Err(refusal)) => Self::new(format!("{name}: refused: {}", refusal.explain(&request)), Tone::Danger),
            Err(CommandQueueError::Bus(error)) => Self::new(format!("{name}: {error}"), Tone::Danger),
            Err(error) => Self::new(format!("{name}: not sent: {error}"), Tone::Caution),
        };
        Self { speed: is_speed(request).then_some(from_tick), ..reply }
    }

    /// The line.
    pub fn text(&self) -> &str {
        &self.text
    }

    fn new(text: String, tone: Tone) -> Self {
        Self { text, tone, speed: None }
    }
}

fn is_speed(request: Request) -> bool {
    matches!(request, Request::Speed { .. })
}
