//! The text messages between the view and its page: JSON with a `type` to the page, acknowledgements and commands from it.

use std::net::IpAddr;

use bench_dragon_geometry::planner::ClosestApproach;
use bench_dragon_geometry::stage::Border;
use bench_dragon_ipc::{Alert, CommandEvent, ReplayStatus, Request, Status, Stop};
use glam::DVec2;
use jiff::Zoned;
use serde::Deserialize;
use serde_json::{Map, Value, json};

use crate::command_queue::Outcome;
use crate::config::{Config, Cue, FormationDocument, NamedBenches, NamedDragon};
use crate::display::observe::{
    Controls, CueList, DescribedRun, Numbered, PlannedClearance, Snapshot, SourcePresence, Standing, lamps,
};
use crate::output::command_words::{CommandWords, request_words};
use crate::output::dragon_colours;
use crate::output::histogram::Percentiles;

/// Name of a kind or a state that this version does not support.
pub(super) const UNKNOWN: &str = "unknown";

/// Encodes the constant properties of a run. The view sends it once per run. Units are metres and seconds.
pub(in crate::display) fn run_message(run: &DescribedRun) -> Value {
    let config = &run.config;
    let dimensions = config.lead().dimensions();
    let message = json!({
        "type": "run",
        "run_id": run.run_id,
        "benches": config.formation().layout().benches(),
        "head_length_m": dimensions.head_length_m(),
        "body_length_m": dimensions.body_length_m(),
        "width_m": dimensions.width_m(),
        "hole_offset_m": dimensions.hole_offset_m(),
        "start_s": config.start_s(),
        // The latest show time that a seek may have. With ramps, the run ends later.
        "end_s": config.last_seek_s(),
        "near_m": config.tables().monitor.near_m,
        "margin_m": config.tables().monitor.margin_m,
        "guarded": config.tables().monitor.guard,
        "planned_speed_mps": config.tables().head.speed_mps,
        "rate_hz": config.tables().serve.rate_hz,
        // Points as x, y, x, y, …, rounded to a millimetre. Low and high corner of the part of the plane to show at first.
        "route": in_a_row(&run.routes[0]),
        "view": in_a_row(&run.view),
        // Corners of the stage's outline, and points of the crowd's line; empty without one. Corners of each area to keep out of.
        "outline": in_a_row(config.stage().outline().map(Border::corners).unwrap_or_default()),
        "keep_out": config.stage().keep_out().iter().map(|area| in_a_row(area.corners())).collect::<Vec<_>>(),
        "crowd": in_a_row(config.stage().crowd().map(Border::corners).unwrap_or_default()),
    });
    match config.named() {
        // The values of the message are then those of the leading dragon, except `benches`.
        Some(named) => with(message, "dragons", dragons(named, &run.routes)),
        None => message,
    }
}

/// Encodes the dragons of a formation, the leading one first.
fn dragons(named: &FormationDocument, routes: &[Vec<DVec2>]) -> Value {
    let layout = named.formation().layout();
    let colours = dragon_colours(named);
    let dragon = |(number, dragon): (usize, &NamedDragon)| {
        let dimensions = dragon.config.lead().dimensions();
        let [red, green, blue] = colours[number];
        json!({
            "name": dragon.name,
            "colour": format!("#{red:02x}{green:02x}{blue:02x}"),
            "benches": dimensions.benches(),
            "first_bench": layout.benches_of(number).start,
            "first_handle": layout.handles_of(number).start,
            "head_length_m": dimensions.head_length_m(),
            "body_length_m": dimensions.body_length_m(),
            "width_m": dimensions.width_m(),
            "hole_offset_m": dimensions.hole_offset_m(),
            "route": in_a_row(&routes[number]),
        })
    };
    named.dragons().iter().enumerate().map(dragon).collect()
}

fn with(mut message: Value, key: &str, value: Value) -> Value {
    message[key] = value;
    message
}

/// Adds the dragons of benches and their indices within them, if there are several dragons.
pub(super) fn with_names(mut message: Value, named: Option<NamedBenches>) -> Value {
    if let (Value::Object(message), Some(NamedBenches { dragons, indices })) = (&mut message, named) {
        message
            .extend(Map::from_iter([("dragons".to_owned(), json!(dragons)), ("indices".to_owned(), json!(indices))]));
    }
    message
}

/// The coordinates of points as x, y, x, y, …, in metres, rounded to a millimetre.
fn in_a_row(points: &[DVec2]) -> Vec<f64> {
    points.iter().flat_map(DVec2::to_array).map(|value_m| (value_m * 1e3).round() / 1e3).collect()
}

/// Encodes the planned clearance of a whole run: some 15 kB, at most 40 kB. Units are metres.
pub(super) fn plan_message(run_id: u64, plan: &PlannedClearance) -> Value {
    let near_miss = |ClosestApproach { travel_m, pair }: &ClosestApproach| json!({ "travel_m": travel_m, "clearance_m": pair.clearance_m, "benches": pair.benches });
    let curve = plan.curve().into_iter().flat_map(|point| [point.travel_m, point.pair.clearance_m]);
    json!({
        "type": "plan",
        "run_id": run_id,
        "is_complete": plan.is_complete,
        // Travel and least clearance in turn, in order of travel, rounded to a micrometre.
        "curve": curve.map(|value_m| (value_m * 1e6).round() / 1e6).collect::<Vec<_>>(),
        "near_misses": plan.near_misses.iter().map(near_miss).collect::<Vec<_>>(),
        // Number of omitted near misses. None of them is nearer than the listed ones.
        "near_misses_dropped": plan.near_misses_dropped,
        "contact": plan.contact.map(|contact| json!({ "travel_m": contact.travel_m, "benches": contact.benches })),
    })
}

/// Encodes an alert and its number. Units are metres and seconds of show time.
pub(super) fn alert_message(Numbered { number, event: alert }: &Numbered<Alert>, config: Option<&Config>) -> Value {
    let (benches, bench) = (alert.pair(), alert.bench());
    let message = json!({
        "type": "alert",
        "number": number,
        "run_id": alert.run_id,
        "kind": alert.alert_kind().map_or(UNKNOWN, |kind| kind.name()),
        "time_s": alert.show_time_ns as f64 * 1e-9,
        "benches": benches,
        "bench": bench,
        "clearance_m": benches.map(|_| alert.clearance_m),
        "point_m": (benches.is_some() || bench.is_some()).then_some(alert.point_m),
        "forecast_s": alert.forecast(),
    });
    with_names(message, config.and_then(|config| config.named_benches_of(alert)))
}

/// Encodes a command with its sender, time and outcome. `host`: the machine of the page that sent it, if it was one of this view.
pub(super) fn command_message(Numbered { number, event }: &Numbered<CommandEvent>, host: Option<IpAddr>) -> Value {
    let mut message = json!(CommandWords::from(event));
    if let Some(host) = host {
        message["sender"] = sender_name(host).into();
    }
    for (key, value) in [
        ("type", json!("command")),
        ("number", json!(number)),
        ("run_id", json!(event.run_id)),
        // The tick from which an accepted command holds, or at which a refused command arrived.
        ("tick", json!(event.tick)),
        ("time_s", json!(event.show_time_ns as f64 * 1e-9)),
        // Process id of the sender; 0 if it is unknown.
        ("pid", json!(event.pid)),
    ] {
        message[key] = value;
    }
    message
}

/// The name of a page's sender: `page@192.168.1.5`.
fn sender_name(host: IpAddr) -> String {
    let host = host.to_canonical();
    if host.is_loopback() { "page@localhost".to_owned() } else { format!("page@{host}") }
}

/// An acknowledgement: the number of the frame, and when it arrived, in nanoseconds of `CLOCK_MONOTONIC`.
#[derive(Clone, Copy, Debug)]
pub(super) struct HeardAck {
    pub(super) sequence: u32,
    pub(super) at_ns: u64,
}

/// Encodes a snapshot without its dragon, at an instant in nanoseconds of `CLOCK_MONOTONIC`. Of the chart, it contains the
/// changes since a revision. `heard`: the page's newest acknowledgement, from which the page derives the age of its picture.
pub(super) fn status_message(snapshot: &Snapshot, chart_revision: u64, heard: Option<HeardAck>, now_ns: u64) -> Value {
    let (presence, statistics) = (snapshot.presence_at(now_ns), &snapshot.statistics);
    let reason = if let SourcePresence::Failed { reason } = &presence { Some(reason) } else { None };
    let chart = snapshot.chart.as_ref().map(|chart| {
        json!({
            "start_s": chart.start_s,
            "step_s": chart.step_s,
            "bins": chart.least_m.len(),
            "changed": chart.since(chart_revision).collect::<Vec<_>>(),
        })
    });
    json!({
        "type": "status",
        "link": { "state": presence.name(), "age_s": presence.age_s(), "reason": reason },
        "traffic": {
            "rate_hz": statistics.rate_hz,
            "frames": statistics.frames,
            "lost": statistics.lost,
            "restarts": statistics.restarts,
            "latency_us": Percentiles::from(&*statistics.recent_latency),
        },
        "server": snapshot.status.as_deref().map(server_status),
        "replay": snapshot.replay.as_ref().map(replay_status),
        "outlook": with_names(json!(snapshot.forecast), snapshot.named_benches(snapshot.forecast.benches())),
        "possible_contact": snapshot.possible_contact,
        // How the show stands: level, word, cause and remedy.
        "standing": Standing::of(snapshot, now_ns),
        "guard": snapshot.guard,
        "lamps": lamps(snapshot, now_ns),
        // The reason for which each command would be refused.
        "refusals": Controls::of(snapshot),
        // The cues with the next one; null without cues.
        "cues": CueList::of(snapshot),
        "clock": snapshot.clock,
        "least": snapshot.least,
        "chart": chart,
        "day_ms": wall_time_ms(),
        "heard": heard.map(|ack| json!({ "sequence": ack.sequence, "at_ms": ack.at_ns as f64 * 1e-6 })),
    })
}

/// Time since midnight in the time zone of this machine, in milliseconds.
fn wall_time_ms() -> f64 {
    let midnight = jiff::civil::Time::midnight();
    Zoned::now().time().duration_since(midnight).as_millis_f64()
}

fn replay_status(replay: &ReplayStatus) -> Value {
    json!({
        // Wall time since the first frame of the recording, and up to its end.
        "position_s": replay.position_ns as f64 * 1e-9,
        "length_s": replay.length_ns as f64 * 1e-9,
        // Unix time at which the frame was recorded.
        "recorded_ms": replay.wall_ns / 1_000_000,
        "pace": replay.pace,
        "paused": replay.paused != 0,
        "at_end": replay.at_end != 0,
    })
}

fn server_status(status: &Status) -> Value {
    json!({
        // The tick of these values.
        "tick": status.tick,
        "rate_hz": status.rate_hz,
        "overruns": status.overruns,
        "behind_s": status.behind_ns as f64 * 1e-9,
        "lateness_us": Percentiles::from(&status.lateness),
        "tick_us": Percentiles::from(&status.tick_time),
        "source": status.source_kind().map_or(UNKNOWN, |kind| kind.name()),
        "timecode": status.timecode_state().map_or(UNKNOWN, |state| state.name()),
        "stops": status.stops().iter().map(Stop::name).collect::<Vec<_>>(),
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Ack {
    ack: u32,
}

/// The sequence number of the frame that a message acknowledges; `None` for any other message.
pub(super) fn read_ack(text: &str) -> Option<u32> {
    serde_json::from_str(text).ok().map(|Ack { ack }| ack)
}

/// The body of a request.
#[derive(Debug, Deserialize)]
#[serde(tag = "command", rename_all = "snake_case", deny_unknown_fields)]
enum PageCommand {
    // With braces, serde refuses further keys.
    Pause {},
    Resume {},
    Hold {},
    Release {},
    Speed { value: f64 },
    Seek { value: f64 },
    Pace { value: f64 },
    Stop {},
    Go {},
    Cue { name: String },
}

/// Decodes the request in a body, or returns the reason for which it is invalid. `cues` are those of the show.
pub(in crate::display) fn read_command(body: &[u8], cues: &[Cue]) -> Result<Request, String> {
    let command = serde_json::from_slice(body).map_err(|_| invalid_command(body))?;
    Ok(match command {
        PageCommand::Pause {} => Request::Pause,
        PageCommand::Resume {} => Request::Resume,
        PageCommand::Hold {} => Request::Hold,
        PageCommand::Release {} => Request::Release,
        PageCommand::Speed { value } => Request::Speed { speed_mps: value },
        PageCommand::Seek { value } => Request::Seek { show_time_s: value },
        PageCommand::Pace { value } => Request::Pace { factor: value },
        PageCommand::Stop {} => Request::Stop,
        PageCommand::Go {} => Request::Go,
        PageCommand::Cue { name } => {
            let cue = cues.iter().find(|cue| cue.name == name);
            let unknown = || {
                format!(
                    "the cue is {name:?}, must be one of {:?}",
                    cues.iter().map(|cue| &cue.name).collect::<Vec<_>>()
                )
            };
            Request::Seek { show_time_s: cue.ok_or_else(unknown)?.at_s }
        }
    })
}

/// Encodes the reply to a command of a stream.
pub(super) fn reply_message(request: Request, outcome: Outcome) -> Value {
    let (tick, reason) = match outcome {
        Ok(reply) => (Some(reply.tick), reply.outcome().err().map(|refusal| refusal.explain(&request))),
        Err(error) => (None, Some(error.to_string())),
    };
    json!({ "type": "reply", "action": request_words(request), "accepted": reason.is_none(), "tick": tick, "reason": reason })
}

/// Encodes the reply to a message that is no command.
pub(super) fn refusal_message(reason: &str) -> Value {
    json!({ "type": "reply", "action": null, "accepted": false, "tick": null, "reason": reason })
}

/// Longest part of a body that an error repeats, in characters.
const SHOWN_CHARS: usize = 80;

/// A body as an error shows it: its beginning.
pub(in crate::display) fn shown(body: &[u8]) -> String {
    let text = String::from_utf8_lossy(body);
    let plain = |char: char| if char.is_control() { ' ' } else { char };
    let shown: String = text.trim().chars().take(SHOWN_CHARS).map(plain).collect();
    match text.trim().chars().count() {
        0 => "empty".to_owned(),
        1..=SHOWN_CHARS => shown,
        _ => shown + "…",
    }
}

/// The reason for which a body is no command.
fn invalid_command(body: &[u8]) -> String {
    let what = shown(body);
    format!(
        r#"the body is {what}, must be {{"command":"pause"}}, resume, hold, release, go or stop alone, speed, seek or pace with a number as "value", or cue with a text as "name""#
    )
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::{Command, CommandEvent, CommandReply, Refusal, Request, Sender};

    use super::*;

    #[test]
    fn a_command_has_its_sender_and_the_reason_of_its_refusal() {
        let seek = Request::Seek { show_time_s: 500.0 }.to_wire();
        let command = Command { sender: Sender::Ctl.to_wire(), pid: 12, ..seek };
        let refused = CommandReply::refused(3, 41, Refusal::OutOfRange { lowest: 0.0, highest: 442.5 });
        let event = CommandEvent { run_id: 3, ..CommandEvent::answered(&command, &refused) };
        let json = command_message(&Numbered { number: 9, event }, None);
        assert_eq!([&json["type"], &json["sender"], &json["action"]], ["command", "ctl", "seek 500 s"]);
        assert_eq!([&json["number"], &json["tick"], &json["pid"]], [9, 41, 12]);
        assert!(json["accepted"] == false && json["reason"].as_str().is_some_and(|reason| reason.contains("442.5")));
        let hold = CommandEvent::answered(&Request::Hold.to_wire(), &CommandReply::accepted(3, 42));
        let json = command_message(
            &Numbered { number: 10, event: hold },
            Some("::ffff:10.0.0.7".parse().expect("an address")),
        );
        assert_eq!(json["sender"], "page@10.0.0.7");
        assert!(json["action"] == "hold" && json["accepted"] == true && json["reason"].is_null(), "{json}");
    }

    #[test]
    fn an_acknowledgement_has_only_a_sequence_number() {
        assert_eq!(read_ack(r#"{"ack":7}"#), Some(7));
        assert_eq!(read_ack(r#"{"ack":-7}"#), None);
        assert_eq!(read_ack(r#"{"ack":7,"more":1}"#), None);
    }

    #[test]
    fn a_request_can_send_nine_commands() {
        for (body, request) in [
            (r#"{"command":"pause"}"#, Request::Pause),
            (r#"{"command":"resume"}"#, Request::Resume),
            (r#"{"command":"hold"}"#, Request::Hold),
            (r#"{"command":"release"}"#, Request::Release),
            (r#"{"command":"speed","value":0.8}"#, Request::Speed { speed_mps: 0.8 }),
            (r#"{"command":"seek","value":-30}"#, Request::Seek { show_time_s: -30.0 }),
            (r#"{"command":"pace","value":2}"#, Request::Pace { factor: 2.0 }),
            (r#"{"command":"stop"}"#, Request::Stop),
            (r#"{"command":"go"}"#, Request::Go),
        ] {
            assert_eq!(read_command(body.as_bytes(), &[]), Ok(request), "{body}");
        }
        let eye = Cue { name: "eye".to_owned(), at_s: 8.5, dragon: None, speed_mps: None, waits: true, note: None };
        let of_cue = |name: &str| {
            read_command(format!(r#"{{"command":"cue","name":"{name}"}}"#).as_bytes(), std::slice::from_ref(&eye))
        };
        assert_eq!(of_cue("eye"), Ok(Request::Seek { show_time_s: 8.5 }));
        assert_eq!(of_cue("ear"), Err(r#"the cue is "ear", must be one of ["eye"]"#.to_owned()));
    }

    #[test]
    fn any_other_body_is_rejected() {
        for body in [
            "",
            "null",
            "[]",
            r#"{"command":"stop","value":1}"#,
            r#"{"command":"grant","value":1}"#,
            r#"{"command":"speed"}"#,
            r#"{"command":"speed","value":"1"}"#,
            r#"{"command":"speed","value":1e999}"#,
            r#"{"command":"seek","value":1,"more":2}"#,
            "\u{0}\u{1}",
        ] {
            let reason = read_command(body.as_bytes(), &[]).expect_err(body);
            assert!(reason.starts_with("the body is ") && reason.contains(", must be {"), "{reason}");
            assert!(!reason.contains("line 1 column"), "the words of a library: {reason}");
        }
        let long = read_command("x".repeat(1024).as_bytes(), &[]).expect_err("no command");
        assert!(long.starts_with(&format!("the body is {}…, must be ", "x".repeat(SHOWN_CHARS))), "{long}");
    }

    #[test]
    fn an_empty_snapshot_has_no_values() {
        let text = status_message(&Snapshot::default(), 0, None, 0);
        assert_eq!(text["type"], "status");
        assert_eq!(text["link"]["state"], "waiting");
        assert_eq!(text["outlook"]["kind"], "unknown");
        assert!(["server", "least", "chart"].iter().all(|key| text[key].is_null()), "{text}");
    }

    #[test]
    fn a_status_reports_an_observer_that_no_longer_reads() {
        let snapshot = Snapshot { presence: SourcePresence::Live, seen_ns: 5_000_000_000, ..Snapshot::default() };
        let presence_at = |now_ns| status_message(&snapshot, 0, None, now_ns)["link"].clone();
        assert_eq!(presence_at(5_900_000_000)["state"], "live");
        let stale = presence_at(6_100_000_000);
        assert_eq!(
            (&stale["state"], &stale["reason"]),
            (&"failed".into(), &"the observer no longer reads the bus".into())
        );
    }
}
