//! A night that is steered from Companion's module, a desk, HTTP and a page's stream at once, with kills between.

use std::collections::BTreeMap;
use std::fs;
use std::net::{SocketAddr, UdpSocket};

use bench_dragon_ipc::{FrameHeader, ShowState};
use serde_json::{Value, json};
use test_support::children::{await_child, kill};
use test_support::process::Process;

use crate::bridge_steering::{Desk, listen};
use crate::browser::View;
use crate::companion::{self, Companion};
use crate::http::post;
use crate::page_socket::PageSocket;
use crate::reader::Reader;
use crate::stage::{Stage, program};

const SECRET: &str = "night-of-dragons";
/// The waits of the night, by the numbers of their cues.
const WAITS: [usize; 4] = [1, 4, 6, 9];

fn is_in(state: ShowState) -> impl Fn(&FrameHeader) -> bool {
    move |header| header.show_state() == Some(state)
}

/// The night of `examples/night.toml`, in which four cues wait.
fn night() -> String {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/night.toml");
    let text = fs::read_to_string(path).expect("the example");
    let waiting = |text: String, name: &str| {
        let name = format!("name = \"{name}\"");
        assert!(text.contains(&name), "{text}");
        text.replace(&name, &format!("{name}\nwait = true"))
    };
    ["slow", "last bow"].into_iter().fold(text, waiting)
}

/// The ways to steer the night, beside each other.
struct Surfaces {
    companion: Companion,
    desk: Desk,
    view: View,
    address: SocketAddr,
    token: String,
}

impl Surfaces {
    /// Sends a command by HTTP. Returns the reply.
    fn post(&self, command: &str) -> Value {
        let token = format!("X-Bench-Dragon-Token: {}\r\n", self.token);
        let reply = post(self.address, "/command", &token, &json!({ "command": command }));
        assert_eq!(reply.status, 200, "{reply:?}");
        serde_json::from_str(&reply.body).expect("JSON")
    }

    #[track_caller]
    fn post_accepted(&self, command: &str) {
        let reply = self.post(command);
        assert_eq!(reply["accepted"], true, "{command}: {reply}");
    }

    /// Sends a command by the stream of a page. Returns the reply.
    fn ask_page(&self, command: &str) -> Value {
        PageSocket::open_to_steer(&self.view.address, &self.token).ask(&json!({ "command": command }))
    }

    #[track_caller]
    fn page_accepted(&self, command: &str) {
        let reply = self.ask_page(command);
        assert_eq!(reply["accepted"], true, "{command}: {reply}");
    }

    /// Sets the pace by Companion. Its earlier commands have been answered then.
    fn set_pace(&mut self, factor: f64) {
        self.companion.press("pace", &json!({ "value": factor }));
        self.companion.expect(&json!(["variable", "reply", "pace: accepted"]));
    }
}

/// Sends GO from everywhere without the right to it. Nothing answers but refusals.
fn refuse_strangers(surfaces: &mut Surfaces, bridge: &str) {
    let go = b"/dragon/go\0\0,\0\0\0";
    let stranger = UdpSocket::bind("127.0.0.66:0").expect("an address that is not listed");
    let ignorant = UdpSocket::bind("127.0.0.1:0").expect("a listed address, without the secret");
    for socket in [&stranger, &ignorant] {
        socket.send_to(go, bridge).expect("the socket takes a packet");
    }
    let command = json!({ "command": "go" });
    for token in ["", "X-Bench-Dragon-Token: 00000000000000000000000000000000\r\n"] {
        let reply = post(surfaces.address, "/command", token, &command);
        assert_eq!(reply.status, 401, "{reply:?}");
    }
    let mut looker = PageSocket::open(&surfaces.view.address);
    looker.send(&command);
    assert!(looker.read_to_end().iter().all(|message| message["type"] != "reply"), "it is disconnected");
    // Earlier packets have been read when this one is answered.
    surfaces.desk.send(&json!(["/dragon/state", SECRET]));
    surfaces.desk.await_state("waiting");
    for socket in [&stranger, &ignorant] {
        socket.set_nonblocking(true).expect("a socket");
        assert!(socket.recv(&mut [0; 100]).is_err(), "a stranger gets no reply");
    }
}

/// Kills the server of a show that is in this state. Returns where the next one is held.
fn kill_server(show: &Process, reader: &mut Reader, state: ShowState) -> FrameHeader {
    let last = reader.read_until("the show goes on", is_in(state)).pop().expect("a frame").header;
    kill(await_child(show.pid(), "serve", None));
    let is_next = |header: &FrameHeader| header.run_id != last.run_id && header.show_state() == Some(ShowState::Held);
    reader.read_until("a restarted server is held", is_next).pop().expect("a frame").header
}

/// Runs a command on the show's folder, without an instance. Returns the lines of the table that it writes.
fn exported(stage: &Stage, subject: &[&str]) -> Vec<BTreeMap<String, String>> {
    let mut command = program(&[&["export", "out", "table.csv", "--force"], subject].concat());
    command.current_dir(stage.path(""));
    let ended = Process::start(command).end();
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    let text = fs::read_to_string(stage.path("table.csv")).expect("a table");
    let mut lines = text.lines();
    let titles: Vec<&str> = lines.next().expect("titles").split(',').collect();
    let rows = lines.map(|line| titles.iter().zip(line.split(',')));
    rows.map(|row| row.map(|(title, cell)| ((*title).to_owned(), cell.to_owned())).collect()).collect()
}

/// Fails unless after each GO that moved the show, the recording has a moving frame within two ticks of its acceptance.
fn assert_quick(goes: &[&BTreeMap<String, String>], frames: &[BTreeMap<String, String>]) {
    let number = |row: &BTreeMap<String, String>, title: &str| row[title].parse::<f64>().expect("a number");
    for go in goes {
        let tick = number(go, "tick");
        let of_run = frames.iter().filter(|frame| frame["run_id"] == go["run_id"]);
        let nearby: Vec<_> = of_run.filter(|frame| (-1.0..=2.0).contains(&(number(frame, "tick") - tick))).collect();
        let moved =
            |pair: &[&BTreeMap<String, String>]| number(pair[1], "head_travel_m") > number(pair[0], "head_travel_m");
        assert!(nearby.windows(2).any(moved), "GO from tick {tick} on moved nothing: {nearby:?}");
    }
}

#[test]
fn a_night_is_steered_by_companion_a_desk_http_and_the_page_at_once_with_kills_between() {
    let stage = Stage::new();
    let Some(module) = companion::build(&stage) else { return };
    fs::write(stage.path("night.toml"), night()).expect("a configuration");
    let args = ["show", "--config", "night.toml", "--stay", "--time-scale", "10", "--rate", "50"];
    let show = stage.start(&[&args[..], &["--out", "out", "--format", "json"]].concat());
    let mut reader = Reader::await_server(&stage);
    let (bridge, osc) = listen(&stage, &["--allow", "127.0.0.1", "--full", "--secret", SECRET]);
    let view = View::of(&stage);
    let token = view.url.split_once("#token=").expect("a token").1.to_owned();
    let mut surfaces = Surfaces {
        companion: Companion::start(&module, &osc, SECRET),
        desk: Desk::python(&osc, &[]),
        address: view.address.parse().expect("an address"),
        view,
        token,
    };
    let go = json!(["/dragon/go", SECRET]);

    reader.read_until("the gate waits", is_in(ShowState::Waiting));
    surfaces.companion.expect(&json!(["light", "waiting", true]));
    refuse_strangers(&mut surfaces, &osc);
    surfaces.companion.press("go", &json!({}));
    surfaces.companion.expect(&json!(["variable", "cue", "walk in"]));
    assert_eq!(surfaces.desk.next("/dragon/cue")[0], "walk in");

    // The server is killed while the show waits: the next one waits there again.
    show.complaint_with("reaches the cue “slow”, and waits for GO");
    let held = kill_server(&show, &mut reader, ShowState::Waiting);
    assert!((held.head_travel_m + 12.0).abs() < 1e-6, "{} m", held.head_travel_m);
    surfaces.desk.await_state("held");
    assert!(surfaces.desk.refuse(&go).starts_with("the show is held"));
    surfaces.page_accepted("release");
    reader.read_until("the show waits again", is_in(ShowState::Waiting));
    surfaces.post_accepted("go");

    // The server is killed after GO: the next one goes on to the next wait.
    show.complaint_with("reaches the cue “into the S”");
    let held = kill_server(&show, &mut reader, ShowState::Running);
    assert!((0.0..6.8).contains(&held.head_travel_m), "{} m", held.head_travel_m);
    surfaces.desk.await_state("held");
    surfaces.post_accepted("release");
    let waiting = reader.read_until("the eye waits", is_in(ShowState::Waiting)).pop().expect("a frame").header;
    assert!((waiting.head_travel_m - 6.8).abs() < 1e-6, "{} m", waiting.head_travel_m);

    // GO from everywhere at once is one. The slow pace keeps the next wait out of its reach.
    surfaces.set_pace(0.1);
    surfaces.companion.press("go", &json!({}));
    surfaces.desk.send(&go);
    let (by_http, by_page) = (surfaces.post("go"), surfaces.ask_page("go"));
    let by_desk = surfaces.desk.next("/dragon/reply");
    surfaces.set_pace(1.0);
    let is_late = |reason: &Value| *reason == "no cue waits for GO";
    assert!(by_desk[1] == 1 || is_late(&by_desk[3]), "{by_desk:?}");
    for reply in [by_http, by_page] {
        assert!(reply["accepted"] == true || is_late(&reply["reason"]), "{reply}");
    }
    show.complaint_with("reaches the cue “last bow”, and waits for GO");
    surfaces.companion.expect(&json!(["variable", "cue", "last bow"]));
    surfaces.page_accepted("go");
    reader.read_until("the end", is_in(ShowState::Finished));
    surfaces.companion.press("stop", &json!({}));
    let ended = show.end();
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    surfaces.companion.end();
    let counts = bridge.terminate().expect_clean().last_json();
    assert_eq!(counts["strangers"], 2, "{counts}");
    let viewed = surfaces.view.process.terminate();
    assert!(viewed.code() == Some(0) && viewed.stderr.contains("1 wrong token from 127.0.0.1"), "{viewed:?}");

    let summary = ended.last_json();
    let cues = summary["cues"].as_array().expect("cues");
    let report = fs::read_to_string(stage.path("out/report.html")).expect("the report");
    for (number, cue) in cues.iter().enumerate() {
        let reached = cue["reached"].as_array().expect("times");
        // The restarted server reaches the wait before which it stands.
        assert_eq!(reached.len(), if number == 4 { 2 } else { 1 }, "{cue}");
        let planned_s = cue["at_s"].as_f64().expect("plan time");
        let is_later = |time: &Value| time["time_s"].as_f64().is_some_and(|time_s| time_s >= planned_s - 1e-6);
        assert!(reached.iter().all(is_later), "{cue}");
        assert_eq!(cue["waits"], WAITS.contains(&number), "{cue}");
        let name = format!("<td>{}</td>", cue["name"].as_str().expect("a name"));
        let row = report.split("<tr>").filter(|row| row.starts_with(&name)).collect::<Vec<_>>();
        let planned = format!(">{planned_s:.3}<");
        assert!(row.len() == 1 && row[0].contains(&planned) && !row[0].contains("not reached"), "{name}: {row:?}");
    }
    let verified = Process::start({
        let mut command = program(&["replay", "out", "--verify"]);
        command.current_dir(stage.path(""));
        command
    })
    .end();
    assert_eq!(verified.code(), Some(0), "{}{}", verified.stdout, verified.stderr);
    let commands = exported(&stage, &["--commands"]);
    let counted = |number: usize| {
        let is_it =
            |row: &&BTreeMap<String, String>| row["command"] == "cue" && row["value_1"].parse() == Ok(number as f64);
        commands.iter().filter(is_it).count()
    };
    assert_eq!((0..10).map(counted).collect::<Vec<_>>(), [1, 1, 1, 1, 2, 1, 1, 1, 1, 1], "{commands:?}");
    let goes: Vec<_> = commands.iter().filter(|row| row["command"] == "go" && row["outcome"] == "accepted").collect();
    let sent_by = |sender: &str| goes.iter().filter(|row| row["sender"] == sender).count();
    assert!(sent_by("osc") >= 1 && sent_by("page") >= 2, "{goes:?}");
    assert_quick(&goes, &exported(&stage, &["--frames", "--every", "0"]));
}
