//! A command to the source and its outcome, as a page lists it.

use serde::Serialize;

use crate::display::observe::NumberedCommand;
use crate::output::report::CommandWords;

/// Who did what, when, and what became of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "type", rename = "command")]
pub struct CommandMessage {
    number: u64,
    run_id: u64,
    /// Tick from which an accepted command holds; at which it was refused otherwise.
    tick: u64,
    /// Show time then, in seconds.
    time_s: f64,
    /// Process id of the sender; 0 where it is not known.
    pid: u32,
    #[serde(flatten)]
    words: CommandWords,
}

impl From<&NumberedCommand> for CommandMessage {
    fn from(NumberedCommand { number, event }: &NumberedCommand) -> Self {
        Self {
            number: *number,
            run_id: event.run_id,
            tick: event.tick,
            time_s: event.sim_time_ns as f64 * 1e-9,
            pid: event.pid,
            words: event.into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::{Command, CommandEvent, CommandReply, Refusal, Request, Sender};

    use super::*;

    #[test]
    fn a_command_says_who_sent_it_and_why_it_was_refused() {
        let seek = Request::Seek { sim_time_s: 500.0 }.to_wire();
        let command = Command { sender: Sender::Ctl.to_wire(), pid: 12, ..seek };
        let refused = CommandReply::refused(3, 41, Refusal::OutOfRange { lowest: 0.0, highest: 442.5 });
        let event = CommandEvent { run_id: 3, ..CommandEvent::answered(&command, &refused) };
        let json = serde_json::to_value(CommandMessage::from(&NumberedCommand { number: 9, event })).expect("JSON");
        assert_eq!([&json["type"], &json["sender"], &json["action"]], ["command", "ctl", "seek 500 s"]);
        assert_eq!([&json["number"], &json["tick"], &json["pid"]], [9, 41, 12]);
        assert!(json["accepted"] == false && json["reason"].as_str().is_some_and(|reason| reason.contains("442.5")));
        let hold = CommandEvent::answered(&Request::Hold.to_wire(), &CommandReply::accepted(3, 42));
        let json =
            serde_json::to_value(CommandMessage::from(&NumberedCommand { number: 10, event: hold })).expect("JSON");
        assert!(json["action"] == "hold" && json["accepted"] == true && json["reason"].is_null(), "{json}");
    }
}
