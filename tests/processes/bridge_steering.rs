//! Desks that steer a show by Open Sound Control: `python-osc` of PyPI, and `osc` of npm.

use std::env;
use std::io::Write as _;
use std::net::UdpSocket;
use std::path::PathBuf;
use std::process::{ChildStdin, Command};

use bench_dragon_ipc::{FrameHeader, ShowState};
use serde_json::{Value, json};
use test_support::eventually::DEADLINE;
use test_support::process::Process;
use test_support::pytest::python;
use test_support::skip::skip;

use crate::reader::{Reader, Shot};
use crate::server::Server;
use crate::stage::Stage;

/// A desk, which ends with the test.
pub(crate) struct Desk {
    process: Process,
    orders: ChildStdin,
    /// Its port.
    pub(crate) port: String,
}

impl Desk {
    fn start(command: Command) -> Self {
        let (mut process, orders) = Process::start_with_stdin(command);
        let port = process.next_line().expect("a port");
        Self { process, orders, port }
    }

    /// Starts a desk of python-osc that sends to an address.
    pub(crate) fn python(to: &str, args: &[&str]) -> Self {
        let mut command = python();
        command.args(["tests/python/osc_desk.py", to]).args(args);
        Self::start(command)
    }

    /// Starts a desk of npm's osc. Skips the test if it is not installed.
    pub(crate) fn node(to: &str) -> Option<Self> {
        let node = env::var_os("BENCH_DRAGON_NODE").map(PathBuf::from);
        let Some(node) = node.filter(|folder| folder.join("node_modules/osc").exists()) else {
            skip("tests/run has not installed the packages of tests/node");
            return None;
        };
        let mut command = Command::new("node");
        command.args(["tests/node/osc_desk.cjs", to]).env("BENCH_DRAGON_NODE", node);
        command.current_dir(env!("CARGO_MANIFEST_DIR"));
        Some(Self::start(command))
    }

    /// Sends a message: its address and arguments, or another order of `osc_desk.py`.
    pub(crate) fn send(&mut self, message: &Value) {
        writeln!(self.orders, "{message}").expect("the desk reads its orders");
    }

    /// Returns the next message with this address, without the address.
    #[track_caller]
    pub(crate) fn next(&mut self, address: &str) -> Vec<Value> {
        let messages = self.process.json_until(&format!("{address} arrives"), |message| message[0] == address);
        messages.last().and_then(Value::as_array).expect("a message")[1..].to_vec()
    }

    /// Sends a message, and returns the reply to it.
    #[track_caller]
    pub(crate) fn ask(&mut self, message: &Value) -> Vec<Value> {
        self.send(message);
        self.next("/dragon/reply")
    }

    /// Sends a command that is accepted.
    #[track_caller]
    pub(crate) fn accept(&mut self, message: &Value) {
        let reply = self.ask(message);
        let name = message[0].as_str().and_then(|address| address.strip_prefix("/dragon/")).expect("our address");
        assert_eq!((&reply[0], &reply[1], &reply[3]), (&json!(name), &json!(1), &json!("")), "{message}: {reply:?}");
        assert!(reply[2].is_u64(), "{reply:?}");
    }

    /// Sends a message that is refused. Returns the reason.
    #[track_caller]
    pub(crate) fn refuse(&mut self, message: &Value) -> String {
        let reply = self.ask(message);
        assert_eq!((&reply[1], &reply[2]), (&json!(0), &json!(0)), "{message}: {reply:?}");
        reply[3].as_str().expect("a reason").to_owned()
    }

    /// Waits for a message with this state.
    #[track_caller]
    pub(crate) fn await_state(&mut self, state: &str) -> Vec<Value> {
        let what = format!("the state is {state}");
        let is_wanted = |message: &Value| message[0] == "/dragon/state" && message[1] == state;
        let messages = self.process.json_until(&what, is_wanted);
        messages.last().and_then(Value::as_array).expect("a message")[1..].to_vec()
    }
}

/// Starts a listener on a free port of loopback. Returns it with its address.
pub(crate) fn listen(stage: &Stage, args: &[&str]) -> (Process, String) {
    let listen = ["bridge", "osc", "--format", "json", "--listen", "127.0.0.1:0"];
    let mut bridge = stage.start(&[&listen[..], args].concat());
    let line = bridge.json();
    assert_eq!(line["type"], "listening", "{line}");
    let address = line["listen"].as_str().expect("an address").to_owned();
    (bridge, address)
}

/// Starts a listener as [`listen`] does, before there is a server.
fn listen_before_a_server(stage: &Stage, args: &[&str]) -> (Process, String) {
    let (bridge, address) = listen(stage, args);
    assert_eq!(bridge.complaint(), format!("waiting for a server on instance {}", stage.domain().instance()));
    (bridge, address)
}

const LOCAL: [&str; 2] = ["--allow", "127.0.0.1"];

/// A server at its start, with a reader.
fn ready(stage: &Stage, args: &[&str]) -> (Server, Reader) {
    let server = stage.serve(&[&["--rate", "50", "--held"], args].concat());
    let reader = Reader::join(stage);
    (server, reader)
}

fn await_state(reader: &mut Reader, state: ShowState) -> FrameHeader {
    let what = format!("the show is {}", state.name());
    reader.read_until(&what, |header| header.show_state() == Some(state)).pop().expect("the wanted frame").header
}

/// Steers a whole show from a desk.
fn steer(stage: &Stage, desk: impl FnOnce(&str) -> Option<Desk>) {
    let (bridge, address) = listen_before_a_server(stage, &[&LOCAL[..], &["--full"]].concat());
    let Some(mut desk) = desk(&address) else { return };
    let (server, mut reader) = ready(stage, &[]);
    desk.send(&json!(["/dragon/state"]));
    desk.await_state("ready");
    desk.accept(&json!(["/dragon/release"]));
    await_state(&mut reader, ShowState::Running);
    desk.await_state("running");
    desk.accept(&json!(["/dragon/hold", 1.5]));
    await_state(&mut reader, ShowState::Held);
    assert_eq!(desk.await_state("held")[2], 0.0, "a held head has no speed");
    // The button is released: this does nothing, and has no reply.
    desk.send(&json!(["/dragon/hold", 0]));
    assert_eq!(desk.refuse(&json!(["/dragon/resume"])), "the show is held: release it first");
    desk.accept(&json!(["/dragon/seek", 30]));
    desk.accept(&json!(["/dragon/release", 1]));
    desk.accept(&json!(["/dragon/speed", 0.8]));
    let what = "the head walks at the speed that the desk has set";
    reader.read_until(what, |header| header.show_time_s() >= 30.0 && header.head_speed_mps == 0.8);
    desk.send(&json!(["bundle", ["/dragon/pause"], ["/dragon/speed", 1]]));
    let mut replies = [desk.next("/dragon/reply"), desk.next("/dragon/reply")].map(|reply| reply[0].clone());
    replies.sort_by_key(Value::to_string);
    assert_eq!(replies, ["pause", "speed"]);
    await_state(&mut reader, ShowState::Paused);
    desk.accept(&json!(["/dragon/resume"]));
    await_state(&mut reader, ShowState::Running);
    desk.accept(&json!(["/dragon/pace", 2.5]));
    reader.read_until("the head walks at the pace", |header| header.head_speed_mps == 2.5);
    desk.accept(&json!(["/dragon/stop"]));
    server.summary();
    desk.await_state("silent");
    let counts = bridge.terminate().expect_clean().last_json();
    let expected = json!({ "type": "steered", "accepted": 10, "refused": 1, "replaced": 0, "strangers": 0, "malformed": 0, "floods": 0 });
    assert_eq!(counts, expected);
}

#[test]
fn a_desk_of_python_osc_steers_a_show_and_sees_its_state() {
    steer(&Stage::new(), |address| Some(Desk::python(address, &[])));
}

#[test]
fn a_desk_of_npm_osc_steers_a_show_and_sees_its_state() {
    steer(&Stage::new(), Desk::node);
}

#[test]
fn the_record_of_commands_names_desks() {
    let stage = Stage::new();
    let (server, _reader) = ready(&stage, &[]);
    let mut monitor = stage.start(&["monitor", "--format", "json"]);
    let (mut bridge, address) = listen(&stage, &LOCAL);
    let mut desk = Desk::python(&address, &[]);
    desk.accept(&json!(["/dragon/hold"]));
    let lines = monitor.json_until("the hold is recorded", |line| line["command"] == "hold");
    assert_eq!(lines.last().expect("a line")["sender"], "osc");
    let line = bridge.json();
    assert_eq!(
        (&line["type"], &line["command"], &line["accepted"]),
        (&json!("answered"), &json!("hold"), &json!(true))
    );
    assert_eq!(line["from"], format!("127.0.0.1:{}", desk.port));
    bridge.terminate().expect_clean();
    monitor.terminate().expect_clean();
    server.stop();
}

#[test]
fn strangers_are_counted_and_never_answered() {
    let stage = Stage::new();
    let (server, mut reader) = ready(&stage, &[]);
    let (mut bridge, address) = listen(&stage, &["--allow", "127.0.0.1,10.0.0.0/24", "--full"]);
    // An address of this machine that is not listed.
    let stranger = UdpSocket::bind("127.0.0.66:0").expect("a port");
    stranger.connect(&address).expect("an address");
    let release = b"/dragon/release\0,\0\0\0";
    for _ in 0..200 {
        stranger.send(release).expect("the socket takes a packet");
    }
    let line = bridge.json();
    assert_eq!(
        (&line["type"], &line["from"], &line["why"]),
        (&json!("refused"), &json!("127.0.0.66"), &json!("not_allowed"))
    );
    // The packets of strangers precede this one in the socket, so they have been read when it is answered.
    let mut desk = Desk::python(&address, &[]);
    desk.accept(&json!(["/dragon/hold"]));
    stranger.set_nonblocking(true).expect("a socket");
    assert!(stranger.recv(&mut [0; 100]).is_err(), "a stranger gets neither replies nor the state");
    let shots = reader.read_until("the show is held", |header| header.show_state() == Some(ShowState::Held));
    let stands = |shot: &Shot| [ShowState::Ready, ShowState::Held].contains(&shot.state());
    assert!(shots.iter().all(stands), "a stranger released it");
    let ended = bridge.terminate().expect_clean();
    assert_eq!(ended.last_json()["strangers"], 200);
    assert_eq!(ended.stdout.matches(r#""type":"refused""#).count(), 0, "one line for all of them: {}", ended.stdout);
    server.stop();
}

#[test]
fn without_the_secret_a_message_has_no_effect() {
    let stage = Stage::new();
    let (server, mut reader) = ready(&stage, &[]);
    let (mut bridge, address) = listen(&stage, &[&LOCAL[..], &["--secret", "night-of-dragons", "--full"]].concat());
    let mut desk = Desk::python(&address, &[]);
    for wrong in [json!(["/dragon/release"]), json!(["/dragon/release", "night-of-dragonS"]), json!(["/dragon/state"])]
    {
        desk.send(&wrong);
    }
    let line = bridge.json();
    assert_eq!((&line["type"], &line["why"]), (&json!("refused"), &json!("wrong_secret")));
    // A reply to an earlier message would come first.
    let reply = desk.ask(&json!(["/dragon/hold", "night-of-dragons"]));
    assert_eq!((&reply[0], &reply[1]), (&json!("hold"), &json!(1)));
    await_state(&mut reader, ShowState::Held);
    assert_eq!(desk.ask(&json!(["/dragon/release", "night-of-dragons", 1]))[1], 1);
    await_state(&mut reader, ShowState::Running);
    let counts = bridge.terminate().expect_clean().last_json();
    assert_eq!((&counts["strangers"], &counts["accepted"]), (&json!(3), &json!(2)));
    server.stop();
}

#[test]
fn release_seek_and_stop_need_full_rights() {
    let stage = Stage::new();
    let (server, mut reader) = ready(&stage, &[]);
    let (bridge, address) = listen(&stage, &LOCAL);
    let mut desk = Desk::python(&address, &[]);
    for message in [json!(["/dragon/release"]), json!(["/dragon/seek", 30.5]), json!(["/dragon/stop"])] {
        assert_eq!(desk.refuse(&message), "needs bridge osc --full");
    }
    assert_eq!(reader.next().state(), ShowState::Ready);
    desk.accept(&json!(["/dragon/hold"]));
    bridge.terminate().expect_clean();
    server.stop();
}

#[test]
fn a_hold_overtakes_commands_that_wait() {
    let stage = Stage::new();
    // A slow server: each command waits for its tick.
    let server = stage.serve(&["--rate", "2"]);
    let mut reader = Reader::join(&stage);
    let (bridge, address) = listen(&stage, &LOCAL);
    let mut desk = Desk::python(&address, &[]);
    let fader = |value: u32| json!(["/dragon/speed", f64::from(value) / 64.0]);
    let waiting = (0..4).map(|_| json!(["/dragon/pause"])).chain((1..20).map(fader));
    let bundles: Vec<Value> = waiting.chain([json!(["/dragon/hold"])]).collect();
    for message in &bundles {
        desk.send(message);
    }
    let mut replies = Vec::new();
    while replies.last().is_none_or(|reply: &Vec<Value>| reply[0] != "hold") {
        replies.push(desk.next("/dragon/reply"));
    }
    assert_eq!(replies.last().expect("the hold's")[1], 1, "{replies:?}");
    let overtaken = replies.iter().filter(|reply| reply[3] == "a later hold cancelled it").count();
    assert!(overtaken >= 3, "at most one command was in flight: {replies:?}");
    await_state(&mut reader, ShowState::Held);
    let counts = bridge.terminate().expect_clean().last_json();
    assert_eq!(counts["replaced"], 17, "the newest value of a fader replaces those that wait: {counts}");
    server.stop();
}

#[test]
fn the_last_value_of_a_fader_counts() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "20"]);
    let mut reader = Reader::join(&stage);
    let (bridge, address) = listen(&stage, &LOCAL);
    let mut desk = Desk::python(&address, &[]);
    // So many fit into the socket of a busy machine.
    for value in 1..=100_u32 {
        desk.send(&json!(["/dragon/speed", f64::from(value) / 256.0]));
    }
    reader.read_until("the head walks at the last speed", |header| header.head_speed_mps == 100.0 / 256.0);
    // The reply to a later command follows those to the values.
    desk.send(&json!(["/dragon/pause"]));
    while desk.next("/dragon/reply")[0] != "pause" {}
    let counts = bridge.terminate().expect_clean().last_json();
    let [accepted, refused, replaced] =
        ["accepted", "refused", "replaced"].map(|key| counts[key].as_u64().expect("a count"));
    assert_eq!((accepted + replaced, refused), (101, 0), "{counts}");
    server.stop();
}

#[test]
fn garbage_is_counted_and_the_listener_goes_on() {
    let stage = Stage::new();
    let (server, _reader) = ready(&stage, &[]);
    let (bridge, address) = listen(&stage, &LOCAL);
    let mut desk = Desk::python(&address, &[]);
    let nested = format!("{}{}", "2362756e646c650000000000000000010000ffff".repeat(90), "00");
    for bytes in ["", "00", "2f", "ffffffffffffffff", "2362756e646c6500", &nested, &"2f".repeat(3000)] {
        desk.send(&json!(["bytes", bytes]));
    }
    assert_eq!(desk.refuse(&json!(["/dragon/speed", "fast"])), "the argument is a text, must be one finite number");
    let reason = desk.refuse(&json!(["/dragon/dance"]));
    assert!(reason.starts_with("no such command, must be one of hold, pause,"), "{reason}");
    desk.send(&json!(["/eos/out/ping", 1]));
    desk.accept(&json!(["/dragon/hold"]));
    let counts = bridge.terminate().expect_clean().last_json();
    assert_eq!((&counts["malformed"], &counts["refused"], &counts["accepted"]), (&json!(7), &json!(2), &json!(1)));
    server.stop();
}

#[test]
fn a_listener_without_a_server_answers_and_finds_the_next_server() {
    let stage = Stage::new();
    let (bridge, address) = listen_before_a_server(&stage, &LOCAL);
    let mut desk = Desk::python(&address, &[]);
    let reason = desk.refuse(&json!(["/dragon/hold"]));
    assert!(reason.contains("no server"), "{reason}");
    assert_eq!(desk.await_state("none"), [json!("none"), json!(0.0), json!(0.0), json!(0)]);
    let (server, _reader) = ready(&stage, &[]);
    desk.await_state("ready");
    server.process.kill();
    desk.await_state("silent");
    let (server, _reader) = ready(&stage, &[]);
    desk.await_state("ready");
    desk.accept(&json!(["/dragon/hold"]));
    bridge.terminate().expect_clean();
    server.stop();
}

#[test]
fn replies_and_the_state_go_to_the_ports_that_the_flags_name() {
    let stage = Stage::new();
    let (server, _reader) = ready(&stage, &[]);
    let [replies, states] = [(); 2].map(|()| {
        let socket = UdpSocket::bind("127.0.0.1:0").expect("a port");
        socket.set_read_timeout(Some(DEADLINE)).expect("a timeout");
        socket
    });
    let [reply_port, state_to] =
        [&replies, &states].map(|socket| socket.local_addr().expect("a bound socket has an address"));
    let (reply_port, state_to) = (reply_port.port().to_string(), state_to.to_string());
    let flags = ["--reply-port", &reply_port, "--state-to", &state_to];
    let (bridge, address) = listen(&stage, &[&LOCAL[..], &flags].concat());
    let mut packet = [0; 1500];
    let length = states.recv(&mut packet).expect("the state arrives without a message");
    assert!(packet[..length].starts_with(b"/dragon/state\0\0\0,sffi\0\0\0"), "{:?}", &packet[..length]);
    let mut desk = Desk::python(&address, &[]);
    desk.send(&json!(["/dragon/hold"]));
    let length = replies.recv(&mut packet).expect("the reply arrives");
    assert!(packet[..length].starts_with(b"/dragon/"), "{:?}", &packet[..length]);
    bridge.terminate().expect_clean();
    server.stop();
}

#[test]
fn poses_are_sent_beside_steering_if_there_is_a_receiver() {
    let stage = Stage::new();
    let receiver = UdpSocket::bind("127.0.0.1:0").expect("a port");
    receiver.set_read_timeout(Some(DEADLINE)).expect("a timeout");
    let to = receiver.local_addr().expect("a bound socket has an address").to_string();
    let (server, _reader) = ready(&stage, &[]);
    let (bridge, address) = listen(&stage, &[&LOCAL[..], &["--to", &to]].concat());
    receiver.recv(&mut [0; 1500]).expect("a pose arrives");
    Desk::python(&address, &[]).accept(&json!(["/dragon/hold"]));
    let summary = bridge.terminate().expect_clean().last_json();
    assert!(summary["type"] == "summary" && summary["frames"].as_u64() > Some(0), "{summary}");
    server.stop();
}

#[test]
fn a_desk_gives_go_seeks_a_cue_and_gets_each_cue() {
    let stage = Stage::new();
    let night = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/night.toml");
    let text = std::fs::read_to_string(night).expect("the example").replace("guard = true", "");
    std::fs::write(stage.path("night.toml"), text).expect("a file");
    let server = stage.serve(&[
        "--config",
        "night.toml",
        "--rate",
        "50",
        "--time-scale",
        "10",
        "--readers",
        "1",
        "--start-at",
        "-51",
    ]);
    let (bridge, address) = listen(&stage, &[&LOCAL[..], &["--full"]].concat());
    let mut desk = Desk::python(&address, &[]);
    desk.send(&json!(["/dragon/state"]));
    let mut reader = Reader::join(&stage);
    reader.read_until("the gate waits", |header| header.show_state() == Some(ShowState::Waiting));
    desk.await_state("waiting");
    desk.accept(&json!(["/dragon/go"]));
    assert_eq!(desk.next("/dragon/cue"), [json!("walk in"), json!(-48.0), json!("lights 2")]);
    let reason = desk.refuse(&json!(["/dragon/cue", "the ear"]));
    assert!(reason.starts_with("no such cue, must be one of \"house lights\", \"the gate\""), "{reason}");
    desk.accept(&json!(["/dragon/cue", "the eye"]));
    let mut reached = desk.next("/dragon/cue");
    while reached[0] != "the eye" {
        reached = desk.next("/dragon/cue");
    }
    assert_eq!(reached[2], "GO after the silence");
    desk.await_state("waiting");
    let waiting = reader.read_until("the eye waits", |header| {
        header.show_state() == Some(ShowState::Waiting) && header.head_travel_m > 0.0
    });
    assert!((waiting.last().expect("a frame").header.head_travel_m - 6.8).abs() < 1e-6);
    bridge.terminate().expect_clean();
    server.stop();
}
