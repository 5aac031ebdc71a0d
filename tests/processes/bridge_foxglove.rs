//! `bridge foxglove`, seen by the published client of its protocol, `@foxglove/ws-protocol` of npm, which decodes messages as the
//! viewers do.

use std::collections::{BTreeSet, HashMap};
use std::env;
use std::fs;
use std::io::Write as _;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::{ChildStdin, Command};

use bench_dragon::recording::{Topic, cdr};
use bench_dragon_ipc::{BenchState, ShowState};
use serde_json::{Value, json};
use test_support::process::Process;
use test_support::skip::skip;

use crate::ctl_status::{lamp, status_with};
use crate::dragons::TWO_DRAGONS;
use crate::http::{Reply, ask};
use crate::reader::{Reader, Shot};
use crate::stage::Stage;

const NEW: &str = "foxglove.sdk.v1";
const OLD: &str = "foxglove.websocket.v1";
/// The topics that every run has.
const FIXED: [&str; 5] = ["/tf", "/dragon/boards", "/dragon/status", "/dragon/alerts", "/dragon/commands"];
const POSES: &str = "/dragon/poses";
/// Bytes of a message of poses before the number of poses: encoding, stamp, and frame of reference.
const POSES_HEAD: usize = 24;

/// A bridge that waits for viewers.
struct Bridge {
    process: Process,
    address: SocketAddr,
    /// The address with the token.
    url: String,
}

impl Bridge {
    fn start(stage: &Stage, args: &[&str]) -> Self {
        let listen = ["bridge", "foxglove", "--format", "json", "--listen", "127.0.0.1:0"];
        let mut process = stage.start(&[&listen[..], args].concat());
        let line = process.json();
        assert_eq!(line["type"], "listening", "{line}");
        let text = |key: &str| line[key].as_str().unwrap_or_else(|| panic!("{line}")).to_owned();
        Self { process, address: text("address").parse().expect("an address"), url: text("url") }
    }

    /// Starts a bridge without a server. Returns when it has reported that it waits for one.
    fn start_waiting(stage: &Stage, args: &[&str]) -> Self {
        let bridge = Self::start(stage, args);
        let waiting = format!("waiting for a server on instance {}", stage.domain().instance());
        assert_eq!(bridge.process.complaint(), waiting);
        bridge
    }

    /// The address without the token.
    fn plain_url(&self) -> String {
        format!("ws://{}", self.address)
    }

    /// Ends the bridge. Returns its totals.
    fn stop(self) -> Value {
        self.process.terminate().expect_clean().last_json()
    }
}

/// A viewer, which ends with the test.
struct Viewer {
    process: Process,
    orders: ChildStdin,
}

impl Viewer {
    /// Opens a viewer. `None`, and a skipped test, if its packages are not installed.
    fn start(url: &str, protocol: &str, origin: Option<&str>) -> Option<Self> {
        let node = env::var_os("BENCH_DRAGON_NODE").map(PathBuf::from);
        let Some(node) = node.filter(|folder| folder.join("node_modules/@foxglove/ws-protocol").exists()) else {
            skip("tests/run has not installed the packages of tests/node");
            return None;
        };
        let mut command = Command::new("node");
        command.args(["tests/node/foxglove_viewer.cjs", url, protocol]).args(origin);
        command.env("BENCH_DRAGON_NODE", node).current_dir(env!("CARGO_MANIFEST_DIR"));
        let (process, orders) = Process::start_with_stdin(command);
        Some(Self { process, orders })
    }

    /// Opens a viewer that knows the channels of a run.
    fn ready(url: &str, protocol: &str) -> Option<Self> {
        let mut viewer = Self::start(url, protocol, None)?;
        viewer.until("open");
        viewer.until_topics(&[POSES]);
        Some(viewer)
    }

    fn order(&mut self, order: &Value) {
        writeln!(self.orders, "{order}").expect("the viewer reads its orders");
    }

    /// Returns the next event of this kind.
    #[track_caller]
    fn until(&mut self, event: &str) -> Value {
        let mut events = self.process.json_until(&format!("the event {event}"), |line| line["event"] == event);
        events.pop().expect("the wanted event")
    }

    /// Waits until these topics are advertised.
    #[track_caller]
    fn until_topics(&mut self, topics: &[&str]) -> Value {
        let is_wanted = |line: &Value| line["event"] == "advertise" && line["topics"] == json!(topics);
        self.process.json_until(&format!("{topics:?} are advertised"), is_wanted).pop().expect("the wanted event")
    }

    /// Returns the next decoded message of a topic with this property.
    #[track_caller]
    fn message(&mut self, topic: &str, what: &str, is_wanted: impl Fn(&Value) -> bool) -> Value {
        let is_it = |line: &Value| line["topic"] == topic && is_wanted(&line["message"]);
        self.process.json_until(&format!("{topic}: {what}"), is_it).pop().expect("the message")["message"].take()
    }

    /// Returns all events up to a number of messages of a topic.
    #[track_caller]
    fn messages(&mut self, topic: &str, count: usize) -> Vec<Value> {
        let mut messages = Vec::new();
        while messages.len() < count {
            let what = format!("message {} of {topic}", messages.len() + 1);
            messages.extend(self.process.json_until(&what, |line| line["topic"] == topic).pop());
        }
        messages
    }
}

fn number(line: &Value, key: &str) -> u64 {
    line[key].as_str().and_then(|text| text.parse().ok()).unwrap_or_else(|| panic!("{key} of {line}"))
}

/// The bytes of a message.
fn bytes(line: &Value) -> Vec<u8> {
    let hex = line["hex"].as_str().unwrap_or_else(|| panic!("{line}"));
    (0..hex.len()).step_by(2).map(|at| u8::from_str_radix(&hex[at..at + 2], 16).expect("hexadecimal digits")).collect()
}

#[test]
fn a_viewer_gets_every_pose_with_the_bits_and_the_times_of_the_bus() {
    let stage = Stage::new();
    let bridge = Bridge::start_waiting(&stage, &["--rate", "250"]);
    let server = stage.serve(&["--rate", "25", "--time-scale", "5", "--catch-up", "10"]);
    let mut reader = Reader::join(&stage);
    let Some(mut viewer) = Viewer::ready(&bridge.url, NEW) else { return };
    viewer.order(&json!(["subscribe", POSES, false]));
    viewer.order(&json!(["subscribe", "/tf", false]));
    let poses = viewer.messages(POSES, 100);
    let shots = reader.read_unread();
    assert_eq!(reader.lost(), 0);
    let known: HashMap<Vec<u8>, &Shot> = shots.iter().map(|shot| (poses_of(shot), shot)).collect();
    let mut offsets = Vec::new();
    let mut ticks = Vec::new();
    for line in &poses {
        let message = bytes(line);
        let shot = known.get(&message[POSES_HEAD..]).expect("its poses are those of a frame of the bus");
        assert_centres_are_those_of(&message, shot);
        let part = |at: usize| u64::from(u32::from_le_bytes(message[at..at + 4].try_into().expect("four bytes")));
        let stamp_ns = part(4) * 1_000_000_000 + part(8);
        offsets.extend([stamp_ns - shot.header.scheduled_ns, number(line, "ns") - shot.header.published_ns]);
        ticks.push(shot.header.tick);
    }
    offsets.dedup();
    assert_eq!(offsets.len(), 1, "all times are those of the bus, plus one difference");
    // The bridge looks ten times as often as the server sends. A busy machine may delay it.
    assert!(ticks.is_sorted() && ticks.len() >= 100, "{ticks:?}");
    server.stop();
    let totals = bridge.stop();
    assert_eq!((&totals["type"], &totals["viewers"]), (&"summary".into(), &1.into()), "{totals}");
    assert!(totals["messages"].as_u64() >= Some(200), "{totals}");
}

/// The poses of a frame of the bus, as in a recording, without encoding, stamp and frame of reference.
fn poses_of(shot: &Shot) -> Vec<u8> {
    let mut message = Vec::new();
    cdr::encode_poses(&mut message, 0, &shot.handles);
    message.split_off(POSES_HEAD)
}

/// Fails unless the poses have the centres of the benches, bit for bit.
fn assert_centres_are_those_of(message: &[u8], shot: &Shot) {
    let poses = message[POSES_HEAD + 4..].chunks_exact(7 * 8);
    assert_eq!(poses.len(), shot.handles.len() - 1);
    for (pose, bench) in poses.zip(BenchState::all(&shot.handles)) {
        let centre: Vec<u8> = bench.centre_m.iter().flat_map(|part_m| part_m.to_le_bytes()).collect();
        assert_eq!(pose[..24], centre);
    }
}

#[test]
fn boards_status_alerts_commands_and_parameters_are_decoded_by_the_schemas_of_the_bridge() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "50", "--start-at", "409.8", "--held"]);
    let monitor = stage.start(&["monitor", "--format", "json"]);
    let bridge = Bridge::start(&stage, &["--rate", "10"]);
    let Some(mut viewer) = Viewer::start(&bridge.plain_url(), OLD, None) else { return };
    let info = viewer.until("serverInfo");
    assert_eq!(info["capabilities"], json!(["time", "parameters", "parametersSubscribe"]), "{info}");
    let advertised = viewer.until_topics(&FIXED);
    assert_eq!(advertised["schemas"][1], "foxglove_msgs/msg/SceneUpdate");
    viewer.until_topics(&[POSES]);
    viewer.order(&json!(["subscribe", "/dragon/boards", true]));
    let boards = viewer.message("/dragon/boards", "the first", |_| true);
    let entity = &boards["entities"][0];
    assert_eq!((&entity["frame_id"], &entity["id"]), (&"stage".into(), &"boards".into()), "{entity}");
    let cubes = entity["cubes"].as_array().expect("a list");
    assert_eq!(cubes.len(), 223);
    let size = |cube: &Value| [cube["size"]["x"].clone(), cube["size"]["y"].clone()];
    assert_eq!((size(&cubes[0]), size(&cubes[222])), ([json!(3.41), json!(0.3)], [json!(2.2), json!(0.3)]));
    let frame = Reader::join(&stage).next();
    let bench = &BenchState::all(&frame.handles).collect::<Vec<_>>()[222];
    assert_eq!(cubes[222]["pose"]["position"]["x"], json!(bench.centre_m[0]));
    viewer.order(&json!(["unsubscribe", "/dragon/boards"]));
    viewer.order(&json!(["subscribe", "/dragon/status", true]));
    let status = viewer.message("/dragon/status", "the clearance", |status| !status["clearance_m"].is_null());
    assert_eq!((&status["link"], &status["state"]), (&"live".into(), &"ready".into()), "{status}");
    assert_eq!((&status["show_time_s"], &status["tick"].is_u64()), (&json!(409.8), &true), "{status}");
    assert!(status["clearance_m"].as_f64().is_some_and(|clearance_m| clearance_m < 0.02), "{status}");
    viewer.order(&json!(["subscribe", "/dragon/alerts", true]));
    let alert = viewer.message("/dragon/alerts", "the near pair", |alert| alert["kind"] == 0);
    assert_eq!(alert["bench_a"], 0, "{alert}");
    viewer.order(&json!(["subscribe", "/dragon/commands", true]));
    stage.run(&["ctl", "speed", "0.5"]).expect_clean();
    let command = viewer.message("/dragon/commands", "the speed", |command| command["values"][0] == 0.5);
    assert_eq!(command["refusal"], 0, "{command}");
    viewer.order(&json!(["parameters", ["serve.rate_hz", "dragon.benches"], "ask"]));
    let parameters = viewer.until("parameters");
    let expected = json!([{ "name": "dragon.benches", "value": 223 }, { "name": "serve.rate_hz", "value": 50 }]);
    assert_eq!((&parameters["parameters"], &parameters["id"]), (&expected, &"ask".into()));
    viewer.order(&json!(["set", "serve.rate_hz", 60, "try"]));
    let note = viewer.until("status");
    assert!(note["message"].as_str().is_some_and(|note| note.ends_with("they cannot be set")), "{note}");
    let (_, _) = status_with(&stage, "the bridge's lamp", |json| lamp(json, "foxglove").0 == "good");
    bridge.stop();
    monitor.terminate().expect_clean();
    server.stop();
}

#[test]
fn a_slow_viewer_gets_the_newest_frame_and_delays_no_other() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "50", "--time-scale", "5"]);
    let mut bridge = Bridge::start(&stage, &["--rate", "50"]);
    let Some(mut slow) = Viewer::ready(&bridge.url, NEW) else { return };
    let Some(mut quick) = Viewer::ready(&bridge.url, OLD) else { return };
    for viewer in [&mut slow, &mut quick] {
        viewer.order(&json!(["subscribe", POSES, false]));
        viewer.messages(POSES, 5);
    }
    slow.order(&json!(["pause"]));
    let stopped_ns = number(quick.messages(POSES, 150).last().expect("messages"), "ns");
    slow.order(&json!(["resume"]));
    // Batches that were in flight, and then the newest: nothing that is older than the last message of the other viewer.
    let mut messages = 0;
    loop {
        messages += 1;
        if number(&slow.messages(POSES, 1)[0], "ns") >= stopped_ns {
            break;
        }
    }
    assert!(messages < 100, "{messages} messages of 150 frames were sent to a viewer that did not answer");
    slow.order(&json!(["close"]));
    slow.until("close");
    let left = bridge.process.json_until("the viewer has left", |line| line["type"] == "left").pop().expect("a line");
    assert!(left["dropped"].as_u64().is_some_and(|dropped| dropped > 50), "{left}");
    quick.messages(POSES, 5);
    server.stop();
    let totals = bridge.stop();
    assert!(totals["dropped"].as_u64() >= left["dropped"].as_u64(), "{totals}");
}

#[test]
fn viewers_keep_their_channels_over_a_restart_and_get_those_of_other_dragons() {
    let stage = Stage::new();
    let bridge = Bridge::start_waiting(&stage, &[]);
    let Some(mut viewer) = Viewer::start(&bridge.url, NEW, None) else { return };
    viewer.until_topics(&FIXED);
    let server = stage.serve(&["--rate", "50"]);
    viewer.until_topics(&[POSES]);
    viewer.order(&json!(["follow", ["dragon.benches", "run_id"]]));
    viewer.order(&json!(["subscribe", POSES, true]));
    viewer.order(&json!(["subscribe", "/dragon/status", true]));
    let first = server.run_id;
    viewer.message("/dragon/status", "the first run", |status| status["run_id"] == first);
    server.process.kill();
    viewer.message("/dragon/status", "the server is gone", |status| status["link"] == "gone");
    let server = stage.serve(&["--rate", "50"]);
    let second = server.run_id;
    let parameters = viewer.until("parameters")["parameters"].take();
    assert_eq!(parameters, json!([{ "name": "run_id", "value": second }, { "name": "dragon.benches", "value": 223 }]));
    viewer.message("/dragon/status", "the second run", |status| status["run_id"] == second);
    viewer.message(POSES, "the second run", |poses| poses["poses"].as_array().map(Vec::len) == Some(223));
    server.stop();
    let server = stage.serve(&["--rate", "50", "--config", TWO_DRAGONS]);
    assert_eq!(viewer.until("unadvertise")["topics"], json!([POSES]));
    viewer.until_topics(&["/dragon/gold/poses", "/dragon/silver/poses"]);
    viewer.order(&json!(["subscribe", "/dragon/silver/poses", true]));
    let poses = viewer.message("/dragon/silver/poses", "the first", |_| true);
    let frame = Reader::join(&stage).next();
    let silver = frame.header.dragons()[1].bench_count as usize;
    assert_eq!(poses["poses"].as_array().map(Vec::len), Some(silver));
    server.stop();
    bridge.stop();
}

#[test]
fn commands_need_a_bridge_with_steer_and_a_viewer_with_the_token() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "50", "--held"]);
    let mut reader = Reader::join(&stage);
    let watching = Bridge::start(&stage, &[]);
    let Some(mut viewer) = Viewer::ready(&watching.url, NEW) else { return };
    viewer.order(&json!(["call", 0, 1, {}]));
    assert_eq!(viewer.until("failure")["message"], "commands need a bridge that was started with --steer");
    watching.stop();

    let bridge = Bridge::start(&stage, &["--steer"]);
    let Some(mut stranger) = Viewer::ready(&bridge.plain_url(), NEW) else { return };
    stranger.order(&json!(["call", 1, 2, {}]));
    let failure = stranger.until("failure");
    let expected = json!({ "event": "failure", "callId": 2, "message": "commands need the address with the token" });
    assert_eq!(failure, expected);
    let Some(mut operator) = Viewer::start(&bridge.url, OLD, None) else { return };
    let services = operator.until("services")["names"].take();
    assert_eq!((&services[0], services.as_array().map(Vec::len)), (&json!("/dragon/hold"), Some(10)), "{services}");
    operator.order(&json!(["call", "/dragon/release", 3, {}]));
    let response = operator.until("response");
    assert_eq!((&response["callId"], &response["reply"]["accepted"]), (&3.into(), &true.into()), "{response}");
    reader.read_until("the show runs", |header| header.show_state() == Some(ShowState::Running));
    operator.order(&json!(["call", "/dragon/speed", 4, { "value": 0.5 }]));
    operator.until("response");
    reader.read_until("the head is slower", |header| header.head_speed_mps == 0.5);
    operator.order(&json!(["call", "/dragon/speed", 5, { "value": 1e9 }]));
    let refused = operator.until("response");
    assert!(!refused["reply"]["accepted"].as_bool().expect("a bool"), "{refused}");
    assert!(refused["reply"]["reason"].is_string(), "{refused}");
    operator.order(&json!(["call", "/dragon/speed", 6, { "speed": 1 }]));
    assert_eq!(operator.until("failure")["callId"], 6);
    let commands = stage.run(&["ctl", "status", "--format", "json"]).last_json();
    assert_eq!(commands["last_command"]["sender"], "foxglove", "{commands}");
    bridge.stop();
    server.stop();
}

#[test]
fn messages_that_are_not_supported_are_answered_and_end_only_the_stream_that_sends_too_many() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "50"]);
    let bridge = Bridge::start(&stage, &["--steer"]);
    let Some(mut viewer) = Viewer::ready(&bridge.url, NEW) else { return };
    let Some(mut other) = Viewer::ready(&bridge.url, NEW) else { return };
    for order in [
        json!(["text", "no JSON"]),
        json!(["text", "[1]"]),
        json!(["text", r#"{"op":"dance"}"#]),
        json!(["text", r#"{"op":"subscribe","subscriptions":[{"id":1,"channelId":77}]}"#]),
        json!(["text", r#"{"op":"advertise","channels":[]}"#]),
        json!(["binary", ""]),
        json!(["binary", "01"]),
        json!(["binary", "ff00ff00"]),
        json!(["binary", "0200000000000000ffffffff"]),
    ] {
        viewer.order(&order);
        let note = viewer.until("status");
        assert_eq!(note["level"], 2, "{order}: {note}");
    }
    viewer.order(&json!(["subscribe", POSES, true]));
    viewer.messages(POSES, 1);
    for _ in 0..100 {
        viewer.order(&json!(["text", "{}"]));
    }
    let close = viewer.until("close");
    assert_eq!((&close["code"], &close["reason"]), (&1008.into(), &"too many messages are not supported".into()));
    let Some(mut third) = Viewer::ready(&bridge.url, NEW) else { return };
    // A text that is longer than allowed, and one that is not UTF-8.
    for (viewer, order) in
        [(&mut other, json!(["text", "x".repeat(70_000)])), (&mut third, json!(["raw", "818200000000fffe"]))]
    {
        viewer.order(&order);
        let close = viewer.until("close");
        let reason = "a message must be as RFC 6455 has it, a text in UTF-8, and have at most 65536 bytes";
        assert_eq!((&close["code"], &close["reason"]), (&1008.into(), &reason.into()));
    }
    let Some(mut viewer) = Viewer::ready(&bridge.url, NEW) else { return };
    viewer.order(&json!(["subscribe", POSES, true]));
    viewer.messages(POSES, 1);
    server.stop();
    bridge.stop();
}

#[test]
fn pages_of_other_sites_need_the_token_and_every_request_needs_a_host_of_this_machine() {
    let stage = Stage::new();
    let mut bridge = Bridge::start_waiting(&stage, &[]);
    let token = bridge.url.split_once("token=").expect("the address has the token").1.to_owned();
    let upgrade = |path: &str, host: &str, more: &str| -> Reply {
        let headers = format!(
            "Host: {host}\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
             Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n{more}"
        );
        ask(bridge.address, "GET", path, &headers)
    };
    let here = bridge.address.to_string();
    let foreign = "Origin: https://viewer.example\r\nSec-WebSocket-Protocol: foxglove.sdk.v1\r\n";
    assert_eq!(upgrade("/", &here, foreign).status, 401);
    assert_eq!(upgrade("/?token=0123456789abcdef", &here, foreign).status, 401);
    assert!(bridge.process.complaint().contains("1 wrong token from 127.0.0.1"), "the wrong token is reported");
    assert_eq!(upgrade(&format!("/?token={token}"), "viewer.example", foreign).status, 403);
    let refused = bridge.process.json_until("a refusal", |line| line["type"] == "refused").pop().expect("a line");
    assert_eq!(refused["origin"], "https://viewer.example", "{refused}");
    let Some(mut viewer) = Viewer::start(&bridge.url, OLD, Some("https://viewer.example")) else { return };
    assert_eq!(viewer.until("open")["protocol"], OLD);
    let Some(mut viewer) = Viewer::start(&bridge.plain_url(), OLD, Some("https://viewer.example")) else { return };
    assert!(viewer.until("error")["message"].as_str().is_some_and(|error| error.contains("401")));
    let Some(mut viewer) = Viewer::start(&bridge.url, "other.protocol", None) else { return };
    assert!(viewer.until("error")["message"].as_str().is_some_and(|error| error.contains("400")));
    let mut joined = bridge.process.json_until("a viewer", |line| line["type"] == "joined");
    assert_eq!(joined.pop().expect("a line")["steers"], false);
    bridge.stop();
}

#[test]
fn the_layout_shows_topics_of_the_bridge_and_of_recordings() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/foxglove-layout.json");
    let layout: Value = serde_json::from_str(&fs::read_to_string(path).expect("the layout")).expect("JSON");
    let panels = layout["configById"].as_object().expect("panels");
    let text = layout.to_string();
    let named: BTreeSet<&str> = text.split('"').filter(|part| part.starts_with("/dragon/")).collect();
    let recorded = [Topic::Frames, Topic::Poses, Topic::Alerts, Topic::Boards, Topic::Markers].map(Topic::name);
    for name in &named {
        let topic = name.split('.').next().expect("a topic");
        assert!(recorded.contains(&topic) || FIXED.contains(&topic), "{name}");
    }
    assert!(named.contains("/dragon/boards") && named.contains("/dragon/status.clearance_m"), "{named:?}");
    let shown = layout["layout"].to_string();
    assert!(panels.keys().all(|panel| shown.contains(panel.as_str())), "{shown}");
}
