//! A command and its outcome, or another event of the record of commands: as words, and as a line of JSON.

use bench_dragon_geometry::number::{Fixed, Number};
use bench_dragon_ipc::{CommandEvent, EventKind, Request, RunStart};
use jiff::tz::TimeZone;
use jiff::{Timestamp, Zoned};
use serde::{Deserialize, Serialize};

/// A command with its outcome, or the begin or end of a run, in words.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CommandWords {
    /// Wall-clock time of the event, `HH:MM:SS` in the time zone of this machine.
    pub clock: String,
    /// Kind of the sender, in lower case.
    pub sender: String,
    /// The request, such as `seek 300 s`.
    pub action: String,
    /// Whether the source accepted the command.
    pub accepted: bool,
    /// Reason of a refusal, else null.
    pub reason: Option<String>,
    /// The whole event without its time, in one line.
    pub text: String,
}

impl From<&CommandEvent> for CommandWords {
    /// ```
    /// use bench_dragon::output::command_words::CommandWords;
    /// use bench_dragon_ipc::{Command, CommandEvent, CommandReply, Request, Sender};
    ///
    /// let command = Command { sender: Sender::Page.to_wire(), ..Request::Speed { speed_mps: 0.8 }.to_wire() };
    /// let words = CommandWords::from(&CommandEvent::answered(&command, &CommandReply::accepted(7, 41)));
    /// assert_eq!(words.text, "page: speed 0.8 m/s, accepted from tick 41 on");
    /// ```
    fn from(event: &CommandEvent) -> Self {
        let sender = event.sent_by().map_or_else(|| format!("sender {}", event.sender), |sender| sender.to_string());
        let action = action(event);
        let refusal = event.outcome().err();
        let reason = refusal.map(|refusal| match event.request() {
            Some(request) => refusal.explain(&request),
            None => refusal.to_string(),
        });
        let outcome = match &reason {
            Some(reason) => format!(", refused at tick {}: {reason}", event.tick),
            None if matches!(event.event_kind(), Some(EventKind::Start)) => String::new(),
            None if event.request().is_none() => format!(", at tick {}", event.tick),
            None => format!(", accepted from tick {} on", event.tick),
        };
        let text = format!("{sender}: {action}{outcome}");
        Self {
            clock: zoned(event).strftime("%H:%M:%S").to_string(),
            sender,
            action,
            accepted: reason.is_none(),
            reason,
            text,
        }
    }
}

/// A request in a few words.
pub fn request_words(request: Request) -> String {
    match request {
        Request::Pause => "pause".to_owned(),
        Request::Resume => "resume".to_owned(),
        Request::Speed { speed_mps } => format!("speed {} m/s", Number(speed_mps)),
        Request::Seek { show_time_s } => format!("seek {} s", Number(show_time_s)),
        Request::Hold => "hold".to_owned(),
        Request::Release => "release".to_owned(),
        Request::Stop => "stop".to_owned(),
        Request::Grant { from_m, to_m, .. } => {
            format!("grant of {} to {} m", Fixed::<3>(from_m), Fixed::<3>(to_m))
        }
        Request::Pace { factor } => format!("pace {}", Number(factor)),
        Request::Go => "GO".to_owned(),
    }
}

fn action(event: &CommandEvent) -> String {
    match (event.request(), event.event_kind()) {
        (Some(request), _) => request_words(request),
        (None, Some(EventKind::Stand)) => "the show stands with the timecode".to_owned(),
        (None, Some(EventKind::Follow)) if event.values[0] == 0.0 => "the show goes on without timecode".to_owned(),
        (None, Some(EventKind::Follow)) => "the show follows the timecode".to_owned(),
        (None, Some(EventKind::Start)) => event.run_start().map_or_else(String::new, start),
        (None, Some(EventKind::End)) => "the run ends".to_owned(),
        (None, Some(EventKind::Cue)) => {
            format!("cue {} is reached, at plan time {} s", Number(event.values[0] + 1.0), Fixed::<3>(event.values[1]))
        }
        (None, _) => "a command of an unknown kind".to_owned(),
    }
}

fn start(start: RunStart) -> String {
    let mut words = format!("the run begins at {} s", Number((start.start_s * 1e3).round() / 1e3));
    let extras = [
        (start.is_ready, "ready"),
        (start.is_held, "held"),
        (start.is_restarted, "restarted"),
        (start.is_paused, "paused"),
        (start.is_guarded, "guarded"),
        (start.stays, "stays at its end"),
    ];
    for (_, extra) in extras.into_iter().filter(|(holds, _)| *holds) {
        words = format!("{words}, {extra}");
    }
    if start.follows_timecode { format!("{words}, follows timecode") } else { words }
}

/// A command to the source and its outcome, or another event of the record of commands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CommandLine {
    /// Name of the event's kind: `pause`, `seek`, `start` and so on.
    pub command: String,
    /// The whole event without its time, in one line.
    pub text: String,
    /// Whether the source accepted the command.
    pub accepted: bool,
    /// Reason of a refusal, else null.
    pub reason: Option<String>,
    /// Kind of the sender, in lower case.
    pub sender: String,
    /// Process id of the sender; null if unknown.
    pub pid: Option<u32>,
    /// Wall-clock time of the event, UTC, as ISO 8601.
    pub wall_time: String,
    /// First tick of an accepted command, or the tick at which the source refused it.
    pub tick: u64,
    /// Show time at which the source took the command, in seconds.
    pub time_s: f64,
    /// Identifier of the run.
    pub run_id: u64,
    /// Number of the event in its run, from 0.
    pub number: u64,
    /// Values of the event. `speed`: metres per show second. `seek`: show time in seconds. `grant`: two travels in
    /// metres. `cue`: its number, from 0, and plan time. A value that is not finite is null.
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
            wall_time: wall_time(event.wall_ns.into()),
            tick: event.tick,
            time_s: event.show_time_ns as f64 * 1e-9,
            run_id: event.run_id,
            number: event.number,
            values: values(event).iter().map(|&value| value.is_finite().then_some(value)).collect(),
        }
    }
}

/// Wall-clock time of an event in the time zone of this machine, to the millisecond.
pub fn local_time(event: &CommandEvent) -> String {
    zoned(event).strftime("%Y-%m-%d %H:%M:%S%.3f").to_string()
}

/// A Unix time in nanoseconds as UTC, RFC 3339.
pub(crate) fn wall_time(unix_ns: i128) -> String {
    Timestamp::from_nanosecond(unix_ns).unwrap_or_default().to_string()
}

fn zoned(event: &CommandEvent) -> Zoned {
    timestamp(event).to_zoned(TimeZone::system())
}

fn timestamp(event: &CommandEvent) -> Timestamp {
    // Cannot fail: nanoseconds in an i64 span 292 years, a timestamp spans thousands.
    Timestamp::from_nanosecond(event.wall_ns.into()).unwrap_or_default()
}

/// The values that this kind of event uses.
fn values(event: &CommandEvent) -> &[f64] {
    let count = match event.event_kind() {
        Some(EventKind::Speed | EventKind::Seek | EventKind::Pace) => 1,
        Some(EventKind::Grant | EventKind::Stand | EventKind::Follow | EventKind::Cue) => 2,
        Some(EventKind::Start) => 4,
        _ => 0,
    };
    &event.values[..count]
}
