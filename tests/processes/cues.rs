//! A night with cues: its operator leads it to the end by GO, whatever is killed.

use std::fs;

use bench_dragon_ipc::{FrameHeader, ShowState};
use serde_json::{Value, json};
use test_support::children::{await_child, kill};
use test_support::process::Process;

use crate::browser::{Browser, View};
use crate::reader::Reader;
use crate::stage::{Stage, program};

/// Ten cues, of which the second and the seventh wait.
const NIGHT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/night.toml");

fn is_in(state: ShowState) -> impl Fn(&FrameHeader) -> bool {
    move |header| header.show_state() == Some(state)
}

fn accepted(stage: &Stage, args: &[&str]) {
    stage.run(&[&["ctl"], args].concat()).expect_clean();
}

/// The cues of the running show, and the name of the next one.
fn cues(stage: &Stage) -> (Value, String) {
    let list = stage.run(&["ctl", "cues", "--format", "json"]).expect_clean().last_json();
    let next = list["next"].as_u64().expect("a cue is ahead") as usize;
    let name = list["cues"][next]["name"].as_str().expect("a name").to_owned();
    (list, name)
}

fn summary_of(show: Process) -> Value {
    let ended = show.end();
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    ended.last_json()
}

#[test]
fn without_a_show_its_cues_are_refused_in_one_line() {
    let stage = Stage::new();
    let ended = stage.run(&["ctl", "cues"]);
    let line = format!("error: no show runs on instance {}\n", stage.domain().instance());
    assert_eq!((ended.code(), ended.stdout.as_str(), ended.stderr), (Some(1), "", line));
}

#[test]
fn a_night_is_led_to_its_end_by_go_with_a_kill_between() {
    let stage = Stage::new();
    let show =
        stage.start(&["show", "--config", NIGHT, "--stay", "--time-scale", "20", "--out", "out", "--format", "json"]);
    let mut reader = Reader::await_server(&stage);
    reader.read_until("the gate waits", is_in(ShowState::Waiting));
    let (list, next) = cues(&stage);
    assert_eq!((next.as_str(), &list["cues"][1]["state"]), ("the gate", &json!("waiting")));
    assert_eq!((&list["next_in_s"], list["cues"].as_array().map(Vec::len)), (&Value::Null, Some(10)));
    accepted(&stage, &["go"]);
    let second = reader.read_until("the eye waits", |header| {
        header.show_state() == Some(ShowState::Waiting) && header.head_travel_m > 0.0
    });
    let waiting = second.last().expect("a frame").header;
    assert!((waiting.head_travel_m - 6.8).abs() < 1e-6, "{} m", waiting.head_travel_m);

    // A killed server takes events of its last tenth of a second with it.
    show.complaint_with("reaches the cue “the eye”, and waits for GO");
    // The server is killed while the show waits: the next one stands before the same cue.
    kill(await_child(show.pid(), "serve", None));
    let held = reader.read_until("a restarted server is held", |header| {
        header.run_id != waiting.run_id && header.show_state() == Some(ShowState::Held)
    });
    assert_eq!(held.last().expect("a frame").header.course_m, waiting.course_m);
    let refused = stage.run(&["ctl", "go"]);
    assert_eq!((refused.code(), refused.stderr.contains("the show is held")), (Some(1), true), "{}", refused.stderr);
    accepted(&stage, &["release"]);
    reader.read_until("the eye waits again", is_in(ShowState::Waiting));
    accepted(&stage, &["go"]);
    reader.read_until("the end", is_in(ShowState::Finished));
    accepted(&stage, &["seek", "--cue", "the eye"]);
    reader.read_until("the eye waits after a seek", is_in(ShowState::Waiting));
    let line = show.complaint_with("reaches the cue “the eye”, and waits for GO");
    assert!(line.contains(" s: reaches"), "{line}");
    accepted(&stage, &["stop"]);
    let summary = summary_of(show);
    let counts = summary["cues"].as_array().expect("cues").iter();
    let counts: Vec<usize> = counts.map(|cue| cue["reached"].as_array().map_or(0, Vec::len)).collect();
    // The eye is reached by walking, by the restart there, and by the seek.
    assert_eq!(counts, [1, 1, 1, 1, 1, 1, 3, 1, 1, 1], "{}", summary["cues"]);
    let report = fs::read_to_string(stage.path("out/report.html")).expect("the report");
    assert!(report.contains("GO after the silence") && report.contains("the gate"));
    let alone = |args: &[&str]| {
        let mut command = program(args);
        command.current_dir(stage.path(""));
        Process::start(command).end()
    };
    let verified = alone(&["replay", "out", "--verify"]);
    assert_eq!(verified.code(), Some(0), "{}{}", verified.stdout, verified.stderr);
    // On a busy machine the recorder may join a restarted server after its first frame, which export reports.
    let ended = alone(&["export", "out", "night.csv", "--commands"]);
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    let exported = fs::read_to_string(stage.path("night.csv")).expect("the commands");
    assert_eq!(exported.lines().filter(|line| line.contains(",cue,")).count(), 12, "{exported}");
}

#[test]
fn a_rehearsal_gives_go_by_itself_and_ends() {
    let stage = Stage::new();
    let show = stage.start(&[
        "show",
        "--config",
        NIGHT,
        "--auto-go",
        "0.1",
        "--time-scale",
        "60",
        "--out",
        "out",
        "--format",
        "json",
    ]);
    let summary = summary_of(show);
    assert_eq!(summary["outcome"]["kind"], "end_of_run", "{summary}");
    assert!(summary["cues"].as_array().expect("cues").iter().all(|cue| cue["reached"] != json!([])), "{summary}");
    let goes = summary["commands"].as_array().expect("commands").iter().filter(|line| line["command"] == "go");
    assert!(goes.clone().all(|line| line["sender"] == "show") && goes.count() == 2, "{}", summary["commands"]);
}

#[test]
fn go_where_nothing_waits_and_an_unknown_cue_get_one_line() {
    let stage = Stage::new();
    let server = stage.serve(&["--config", NIGHT, "--start-at", "-45", "--rate", "50", "--guarded"]);
    let go = stage.run(&["ctl", "go"]);
    assert_eq!((go.code(), go.stderr.trim_end()), (Some(1), "refused: no cue waits for GO"));
    let seek = stage.run(&["ctl", "seek", "--cue", "the ear"]);
    assert_eq!(seek.code(), Some(2));
    assert!(
        seek.stderr.starts_with("error: --cue is \"the ear\": must be one of \"house lights\", \"the gate\""),
        "{}",
        seek.stderr
    );
    let both = stage.run(&["ctl", "seek", "3", "--cue", "the eye"]);
    assert_eq!(both.code(), Some(2), "{}", both.stderr);
    server.stop();
}

#[test]
fn the_page_lists_the_cues_and_gives_go_by_button_and_key() {
    let Some(browser) = Browser::find() else { return };
    let stage = Stage::new();
    fs::write(stage.path("night.toml"), fs::read_to_string(NIGHT).expect("the example").replace("guard = true", ""))
        .expect("a file");
    let server = stage.serve(&["--config", "night.toml", "--rate", "50", "--time-scale", "10"]);
    let mut reader = Reader::join(&stage);
    let view = View::of(&stage);
    let mut page = browser.play("page_goes.mjs", &[&view.url]);
    reader.read_until("the gate waits", is_in(ShowState::Waiting));
    assert_eq!(
        page.json(),
        json!({ "word": "WAITING FOR GO", "next": "GO for the gate · GO when the drums begin", "cues": 10 })
    );
    reader.read_until("GO by the key", is_in(ShowState::Running));
    reader.read_until("the eye waits", is_in(ShowState::Waiting));
    assert_eq!(page.json()["next"], "GO for the eye · GO after the silence");
    reader.read_until("GO by the button", is_in(ShowState::Running));
    page.end().expect_clean();
    view.process.terminate().expect_clean();
    server.stop();
}
