//! Boards that overlap at the start: every command names the same pair, the deepest, and of equally deep ones the first.

use std::fs;
use std::process::Command;

use serde_json::{Value, json};
use test_support::process::Process;

use crate::ctl_status::status_with;
use crate::stage::{Stage, program};

/// A dragon on more than a lap of a circle: its boards overlap from the start, and each pair of body benches as deep as the next.
const CIRCLE: &str = "[dragon]\nbenches = 40\n[route]\nkind = \"path\"\nclosed = true\nlaps = 5\n\
    segments = [{ kind = \"arc\", radius_m = 6, turn_deg = 360 }]\n";

/// The first of the deepest pairs. The head is longer than the others, and overlaps less.
const FIRST: [u32; 2] = [1, 23];

fn circle() -> Stage {
    let stage = Stage::new();
    fs::write(stage.path("circle.toml"), CIRCLE).expect("a configuration");
    stage
}

fn answer(stage: &Stage, mut command: Command, args: &[&str]) -> Value {
    command.args(args).args(["--config", "circle.toml", "--format", "json"]).current_dir(stage.path(""));
    Process::start(command).end().expect_clean().last_json()
}

#[test]
fn every_question_names_the_first_of_the_deepest_pairs_on_one_core_and_on_all() {
    let stage = circle();
    let mut one_core = Command::new("taskset");
    one_core.args(["-c", "0", env!("CARGO_BIN_EXE_bench-dragon"), "solve"]).env_remove("RUST_LOG");
    let answers: Vec<Value> = [one_core, program(&["solve"])]
        .into_iter()
        .map(|command| answer(&stage, command, &["contact", "--profile", "--clearance", "0.01"]))
        .collect();
    assert_eq!(answers[0], answers[1]);
    let contact = answer(&stage, program(&["solve"]), &["contact"]);
    assert_eq!((&contact["time_s"], &contact["benches"]), (&json!(0.0), &json!(FIRST)), "{contact}");
    assert_eq!((&answers[0]["benches"], &answers[0]["profile"][0]["benches"]), (&json!(FIRST), &json!(FIRST)));
}

#[test]
fn a_show_its_monitor_and_the_status_name_the_pair_of_the_planner() {
    let stage = circle();
    for out in ["first", "second", "third"] {
        let show = ["show", "--config", "circle.toml", "--rate", "100", "--until", "0.2", "--out", out];
        let summary = stage.run(&[&show[..], &["--format", "json"]].concat()).last_json();
        assert_eq!(summary["contact"], json!({ "time_s": 0.0, "benches": FIRST }), "{summary}");
        assert_eq!(summary["alerts"][0]["benches"], json!(FIRST), "{summary}");
    }
    let server = stage.serve(&["--config", "circle.toml", "--rate", "100", "--held"]);
    let monitor = stage.start(&["monitor", "--format", "json"]);
    let wanted = |json: &Value| json["nearest"]["benches"] == json!(FIRST);
    let (status, _) = status_with(&stage, "the pair of the planner", wanted);
    assert!(status["nearest"]["clearance_m"].as_f64() < Some(-0.1), "{status}");
    assert!(status["standing"]["cause"].as_str().is_some_and(|cause| cause.contains("benches 1 and 23")), "{status}");
    server.stop();
    let summary = monitor.terminate().expect_clean().last_json();
    assert_eq!(summary["least_clearance"]["benches"], json!(FIRST), "{summary}");
}
