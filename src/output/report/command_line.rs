//! An event of the record of commands as a line of JSON.

use bench_dragon_ipc::{CommandEvent, EventKind};
use jiff::tz::TimeZone;
use jiff::{Timestamp, Zoned};
use serde::{Deserialize, Serialize};

use super::CommandWords;

/// A command to the source and its outcome, or another event of the record of commands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CommandLine {
    /// The name of its kind: `pause`, `seek`, `start` and so on.
    pub command: String,
    /// All of it but the time, in one line.
    pub text: String,
    /// Whether the source took it.
    pub accepted: bool,
    /// The reason of a refusal, or null.
    pub reason: Option<String>,
    /// The kind of program that sent it, in lower case.
    pub sender: String,
    /// Process id of the sender; null where it is not known.
    pub pid: Option<u32>,
    /// Wall-clock time of the event, UTC, as ISO 8601.
    pub wall_time: String,
    /// Tick from which an accepted command holds; the tick at which it was refused otherwise.
    pub tick: u64,
    /// Show time at which the source took it, in seconds.
    pub time_s: f64,
    /// The run's number.
    pub run_id: u64,
    /// The event's number in its run, from 0.
    pub number: u64,
    /// Its values as they came: of `speed` metres per show second, of `seek` show time in seconds, of `grant` two travels in
    /// metres. A value that is no finite number is null.
    pub values: Vec<Option<f64>>,
}

impl From<&CommandEvent> for CommandLine {
    fn from(event: &CommandEvent) -> Self {
        let CommandWords { sender, accepted, reason, text, .. } = CommandWords::from(event);
        Self {
            command: event.event_kind().map_or("unknown", EventKind::name).to_owned(),
            text,
            accepted,
            reason,
            sender,
            pid: (event.pid != 0).then_some(event.pid),
            wall_time: timestamp(event).to_string(),
            tick: event.tick,
            time_s: event.sim_time_ns as f64 * 1e-9,
            run_id: event.run_id,
            number: event.number,
            values: values(event).iter().map(|&value| value.is_finite().then_some(value)).collect(),
        }
    }
}

/// Wall-clock time of an event in this machine's time zone, to the millisecond.
pub fn local_time(event: &CommandEvent) -> String {
    Zoned::new(timestamp(event), TimeZone::system()).strftime("%Y-%m-%d %H:%M:%S%.3f").to_string()
}

fn timestamp(event: &CommandEvent) -> Timestamp {
    // The nanoseconds of an i64 span 292 years, a timestamp thousands.
    Timestamp::from_nanosecond(event.wall_ns.into()).unwrap_or_default()
}

/// The values that an event of its kind has.
fn values(event: &CommandEvent) -> &[f64] {
    let count = match event.event_kind() {
        Some(EventKind::Speed | EventKind::Seek) => 1,
        Some(EventKind::Grant | EventKind::Stand | EventKind::Follow) => 2,
        Some(EventKind::Start) => 4,
        _ => 0,
    };
    &event.values[..count]
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::{Command, CommandReply, Request, Sender};

    use super::*;

    #[test]
    fn a_line_has_the_sender_the_wall_time_and_the_values_of_its_kind() {
        let command =
            Command { sender: Sender::Page.to_wire(), pid: 12, ..Request::Seek { sim_time_s: 12.5 }.to_wire() };
        let event = CommandEvent::answered(&command, &CommandReply::accepted(7, 41));
        let line = CommandLine::from(&CommandEvent { wall_ns: 1_700_000_000_123_456_789, ..event });
        assert_eq!(line.wall_time, "2023-11-14T22:13:20.123456789Z");
        assert_eq!((line.command.as_str(), line.sender.as_str(), line.pid), ("seek", "page", Some(12)));
        assert_eq!((line.tick, line.values, line.accepted, line.reason), (41, vec![Some(12.5)], true, None));
    }

    #[test]
    fn an_unknown_command_and_a_time_before_1970_make_a_line_too() {
        let event = CommandEvent {
            kind: CommandEvent::UNKNOWN_KIND,
            sender: 99,
            refusal: 1,
            wall_ns: i64::MIN,
            ..Default::default()
        };
        let line = CommandLine::from(&event);
        assert_eq!((line.command.as_str(), line.sender.as_str(), line.pid), ("unknown", "sender 99", None));
        assert!(line.wall_time.starts_with("1677-09-21T") && !line.accepted && line.values.is_empty(), "{line:?}");
    }
}
