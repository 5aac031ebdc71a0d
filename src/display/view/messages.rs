//! The messages between the view and its page, as text: JSON with a `type` to the page, acknowledgements and commands from it.

use bench_dragon_geometry::planner::ClosestApproach;
use bench_dragon_ipc::{Alert, CommandEvent, Request};
use glam::DVec2;
use serde::{Deserialize, Serialize};

use crate::display::observe::{DescribedRun, Numbered, PlannedClearance};
use crate::output::report::CommandWords;

/// What stays the same through a run. Metres, seconds.
#[derive(Debug, Serialize)]
#[serde(tag = "type", rename = "run")]
pub(super) struct RunMessage {
    run_id: u64,
    benches: usize,
    head_length_m: f64,
    body_length_m: f64,
    width_m: f64,
    hole_offset_m: f64,
    start_s: f64,
    /// The latest show time that may be sought: with ramps the run ends later.
    end_s: f64,
    near_m: f64,
    margin_m: f64,
    guarded: bool,
    planned_speed_mps: f64,
    rate_hz: u32,
    /// The route from point to point: x, y, x, y, …, to a millimetre.
    route: Vec<f64>,
}

impl From<&DescribedRun> for RunMessage {
    fn from(run: &DescribedRun) -> Self {
        let config = &run.config;
        let dimensions = config.dragon().dimensions();
        Self {
            run_id: run.run_id,
            benches: dimensions.benches(),
            head_length_m: dimensions.head_length_m(),
            body_length_m: dimensions.body_length_m(),
            width_m: dimensions.width_m(),
            hole_offset_m: dimensions.hole_offset_m(),
            start_s: config.start_s(),
            end_s: config.last_seek_s(),
            near_m: config.near_m(),
            margin_m: config.margin_m(),
            guarded: config.is_guarded(),
            planned_speed_mps: config.head_speed_mps(),
            rate_hz: config.rate_hz(),
            route: run.route.iter().flat_map(DVec2::to_array).map(to_millimetres).collect(),
        }
    }
}

fn to_millimetres(value_m: f64) -> f64 {
    (value_m * 1e3).round() / 1e3
}

/// What lies ahead in a whole run: some 15 kB, 40 at most. Metres.
#[derive(Debug, Serialize)]
#[serde(tag = "type", rename = "plan")]
pub(super) struct PlanMessage {
    run_id: u64,
    /// Whether everything that is to be found out has been.
    is_complete: bool,
    /// Travel and least clearance, travel and least clearance, …, in order of travel, to a micrometre.
    curve: Vec<f64>,
    near_misses: Vec<NearMissReport>,
    /// Near misses that are left out, none of them nearer than those that are here.
    near_misses_dropped: usize,
    contact: Option<ContactReport>,
}

#[derive(Debug, Serialize)]
struct NearMissReport {
    travel_m: f64,
    clearance_m: f64,
    benches: [usize; 2],
}

#[derive(Debug, Serialize)]
struct ContactReport {
    travel_m: f64,
    benches: [usize; 2],
}

impl PlanMessage {
    /// The plan of a run.
    pub(super) fn of(run_id: u64, plan: &PlannedClearance) -> Self {
        let near_miss = |&ClosestApproach { travel_m, pair }: &ClosestApproach| NearMissReport {
            travel_m,
            clearance_m: pair.clearance_m,
            benches: pair.benches,
        };
        Self {
            run_id,
            is_complete: plan.is_complete,
            curve: plan.curve().iter().flat_map(|point| [point.travel_m, point.pair.clearance_m]).map(round).collect(),
            near_misses: plan.near_misses.iter().map(near_miss).collect(),
            near_misses_dropped: plan.near_misses_dropped,
            contact: plan.contact.map(|contact| ContactReport { travel_m: contact.travel_m, benches: contact.benches }),
        }
    }
}

fn round(value_m: f64) -> f64 {
    (value_m * 1e6).round() / 1e6
}

/// An alert and its number. Metres, seconds of show time.
#[derive(Debug, Serialize)]
#[serde(tag = "type", rename = "alert")]
pub(super) struct AlertMessage {
    number: u64,
    run_id: u64,
    kind: &'static str,
    time_s: f64,
    benches: Option<[u32; 2]>,
    clearance_m: Option<f64>,
    point_m: Option<[f64; 2]>,
    forecast_s: Option<f64>,
}

impl From<&Numbered<Alert>> for AlertMessage {
    fn from(Numbered { number, event: alert }: &Numbered<Alert>) -> Self {
        let benches = alert.pair();
        Self {
            number: *number,
            run_id: alert.run_id,
            kind: alert.alert_kind().map_or("unknown", |kind| kind.name()),
            time_s: alert.sim_time_ns as f64 * 1e-9,
            benches,
            clearance_m: benches.map(|_| alert.clearance_m),
            point_m: benches.map(|_| alert.point_m),
            forecast_s: alert.forecast(),
        }
    }
}

/// Who did what, when, and what became of it.
#[derive(Debug, Serialize)]
#[serde(tag = "type", rename = "command")]
pub(super) struct CommandMessage {
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

impl From<&Numbered<CommandEvent>> for CommandMessage {
    fn from(Numbered { number, event }: &Numbered<CommandEvent>) -> Self {
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
    Pause,
    Resume,
    Hold,
    Release,
    Speed { value: f64 },
    Seek { value: f64 },
}

/// The request in a body, or what is wrong with it.
pub(super) fn read_command(body: &[u8]) -> Result<Request, String> {
    let command = serde_json::from_slice(body).map_err(|error| {
        format!(
            r#"a command is {{"command":"pause"}}, resume, hold, release, or speed or seek with a "value": {error}"#
        )
    })?;
    Ok(match command {
        PageCommand::Pause => Request::Pause,
        PageCommand::Resume => Request::Resume,
        PageCommand::Hold => Request::Hold,
        PageCommand::Release => Request::Release,
        PageCommand::Speed { value } => Request::Speed { speed_mps: value },
        PageCommand::Seek { value } => Request::Seek { sim_time_s: value },
    })
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
        let json = serde_json::to_value(CommandMessage::from(&Numbered { number: 9, event })).expect("JSON");
        assert_eq!([&json["type"], &json["sender"], &json["action"]], ["command", "ctl", "seek 500 s"]);
        assert_eq!([&json["number"], &json["tick"], &json["pid"]], [9, 41, 12]);
        assert!(json["accepted"] == false && json["reason"].as_str().is_some_and(|reason| reason.contains("442.5")));
        let hold = CommandEvent::answered(&Request::Hold.to_wire(), &CommandReply::accepted(3, 42));
        let json = serde_json::to_value(CommandMessage::from(&Numbered { number: 10, event: hold })).expect("JSON");
        assert!(json["action"] == "hold" && json["accepted"] == true && json["reason"].is_null(), "{json}");
    }

    #[test]
    fn an_acknowledgement_is_a_sequence_number_and_nothing_else() {
        assert_eq!(read_ack(r#"{"ack":7}"#), Some(7));
        assert_eq!(read_ack(r#"{"ack":-7}"#), None);
        assert_eq!(read_ack(r#"{"ack":7,"more":1}"#), None);
    }

    #[test]
    fn a_page_can_give_six_commands() {
        for (body, request) in [
            (r#"{"command":"pause"}"#, Request::Pause),
            (r#"{"command":"resume"}"#, Request::Resume),
            (r#"{"command":"hold"}"#, Request::Hold),
            (r#"{"command":"release"}"#, Request::Release),
            (r#"{"command":"speed","value":0.8}"#, Request::Speed { speed_mps: 0.8 }),
            (r#"{"command":"seek","value":-30}"#, Request::Seek { sim_time_s: -30.0 }),
        ] {
            assert_eq!(read_command(body.as_bytes()), Ok(request), "{body}");
        }
    }

    #[test]
    fn anything_else_is_none() {
        for body in [
            "",
            "null",
            "[]",
            r#"{"command":"stop"}"#,
            r#"{"command":"grant","value":1}"#,
            r#"{"command":"speed"}"#,
            r#"{"command":"speed","value":"1"}"#,
            r#"{"command":"speed","value":1e999}"#,
            r#"{"command":"seek","value":1,"more":2}"#,
            "\u{0}\u{1}",
        ] {
            assert!(read_command(body.as_bytes()).is_err(), "{body}");
        }
    }
}
