//! Shows on paths: a guarded show that crosses its own tail, a seek, a recording that verifies, and questions to the planner.

use std::fs;

use serde_json::{Value, json};
use test_support::process::{Ended, Process};

use crate::record;
use crate::stage::{Stage, program};

/// A street, a loop to the left, and a street across the first one. Sixty benches meet their own tail.
const CROSSING: &str = r#"
[dragon]
benches = 60
[route]
kind = "path"
start_x_m = 5.0
start_heading_deg = 90.0
[[route.segments]]
kind = "line"
length_m = 10
[[route.segments]]
kind = "arc"
radius_m = 5
turn_deg = 270
[[route.segments]]
kind = "line"
length_m = 60
"#;

/// The rounding of show times on the bus, in seconds.
const NANOSECOND_S: f64 = 1e-9;

fn stage_with(text: &str) -> Stage {
    let stage = Stage::new();
    fs::write(stage.path("path.toml"), text).expect("a file");
    stage
}

/// Runs a command that needs no server, in the stage's folder.
fn offline(stage: &Stage, args: &[&str]) -> Ended {
    let mut command = program(args);
    command.current_dir(stage.path(""));
    Process::start(command).end()
}

fn solve(stage: &Stage, question: &[&str]) -> Value {
    let args = [&["solve"], question, &["--config", "path.toml", "--format", "json"]].concat();
    offline(stage, &args).expect_clean().last_json()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn a_guarded_show_rests_before_the_head_meets_its_own_tail() {
    let stage = stage_with(CROSSING);
    let contact = solve(&stage, &["contact"]);
    let contact_s = number(&contact["time_s"]);
    assert_eq!(contact["benches"][0], 0);
    let margin_s = number(&solve(&stage, &["contact", "--clearance", "0.0005"])["time_s"]);
    let show = ["show", "--config", "path.toml", "--guard", "--out", "out", "--time-scale", "40", "--format", "json"];
    let summary = stage.run(&show).last_json();
    let guard = &summary["guard"];
    assert_eq!(summary["contact"], Value::Null);
    assert!((number(&guard["forecast_contact_s"]) - contact_s).abs() < 1e-9, "{guard}");
    let held_s = number(&guard["held_at_s"]);
    assert!(
        (held_s - margin_s).abs() < 1e-6 && held_s <= margin_s + NANOSECOND_S,
        "held at {held_s} s, the margin is reached at {margin_s} s"
    );
    assert!(number(&guard["clearance_m"]) >= 0.0005, "{guard}");
}

#[test]
fn a_show_stops_at_the_contact_and_its_recording_equals_the_simulation() {
    let stage = stage_with(CROSSING);
    let contact_s = number(&solve(&stage, &["contact"])["time_s"]);
    let show =
        ["show", "--config", "path.toml", "--out", "out", "--rate", "50", "--start-at", "36", "--format", "json"];
    let summary = stage.run(&show).last_json();
    assert!((number(&summary["contact"]["time_s"]) - contact_s).abs() < 1e-9, "{summary}");
    let (recorded, was_cut) = record::read(&stage.path("out/recording.mcap"));
    assert!(!was_cut && recorded[0].show_time_ns == 36_000_000_000);
    let verify = offline(&stage, &["replay", "--verify", "out/recording.mcap", "--format", "json"]).expect_clean();
    assert_eq!(verify.last_json()["verified"], true);
}

#[test]
fn a_closed_path_is_walked_for_its_laps() {
    let stage = stage_with(
        "[dragon]\nbenches = 9\n[route]\nkind = \"path\"\nclosed = true\nlaps = 2\n\
         [[route.segments]]\nkind = \"line\"\nlength_m = 20\n[[route.segments]]\nkind = \"arc\"\nradius_m = 5\n\
         turn_deg = 180\n[[route.segments]]\nkind = \"line\"\nlength_m = 20\n[[route.segments]]\nkind = \"arc\"\n\
         radius_m = 5\nturn_deg = 180\n",
    );
    let lap_s = 40.0 + 10.0 * std::f64::consts::PI;
    let at = format!("0,{lap_s}");
    let poses = solve(&stage, &["poses", "--at", &at]);
    for (start, lap) in poses["poses"][0]["handles"]
        .as_array()
        .expect("handles")
        .iter()
        .zip(poses["poses"][1]["handles"].as_array().expect("handles"))
    {
        assert!((number(&start["x_m"]) - number(&lap["x_m"])).abs() < 1e-6, "{start} {lap}");
    }
    let beyond = offline(&stage, &["solve", "poses", "--at", "143", "--config", "path.toml"]);
    assert_eq!(beyond.code(), Some(2), "{}", beyond.stderr);
    assert!(beyond.stderr.contains("142.831853"), "{}", beyond.stderr);
}

#[test]
fn bad_paths_and_questions_without_sense_are_refused_in_one_line() {
    let segment = |text: &str| format!("[route]\nkind = \"path\"\n[[route.segments]]\n{text}\n");
    for (text, reason) in [
        ("[route]\nkind = \"path\"\n".to_owned(), "[route] a path needs at least one segment"),
        (segment("kind = \"line\"\nlength_m = 0"), "[route] segment 1: length_m is 0, must be from 0.000001 to 100000"),
        (segment("kind = \"arc\"\nradius_m = nan\nturn_deg = 90"), "[route] segment 1: radius_m is NaN, must be from"),
        (segment("kind = \"bow\""), "unknown variant `bow`, expected one of `line`, `arc`, `spiral`"),
        (segment("kind = \"line\""), "missing field `length_m`"),
        (segment("kind = \"line\"\nlength_m = 5\nradius_m = 3"), "radius_m is 3, only allowed with kind = \"arc\""),
        (segment("kind = \"line\"\nlength = 5"), "line 5, `length = 5`: unknown field `length`"),
        (
            segment("kind = \"line\"\nlength_m = \"40\""),
            "line 5, `length_m = \"40\"`: invalid type: string \"40\", expected a number",
        ),
        (
            segment("kind = \"line\"\nlength_m = 1234567890123456789012"),
            "invalid type: integer `1234567890123456789012`, which has too many digits, expected a number",
        ),
        (
            "[route]\nkind = \"path\"\npitch_m = 1".to_owned(),
            "[route] pitch_m is 1, only allowed with kind = \"spiral\" or",
        ),
        ("[route]\nlaps = 2".to_owned(), "[route] laps is 2, only allowed with kind = \"path\""),
        ("[route]\nkind = \"path\"\nlaps = 2".to_owned(), "[route] laps is 2, only allowed with closed = true"),
        ("[route]\nstart_x_m = inf".to_owned(), "[route] start_x_m is inf, must be from -100000 to 100000"),
    ] {
        let stage = stage_with(&text);
        let ended = offline(&stage, &["solve", "contact", "--config", "path.toml"]);
        assert_eq!(ended.code(), Some(2), "{text}: {}", ended.stderr);
        assert_eq!(ended.stderr.lines().count(), 1, "{}", ended.stderr);
        assert!(ended.stderr.contains(reason), "{text}: {}", ended.stderr);
    }
    let stage = stage_with(CROSSING);
    for (question, reason) in [
        (
            ["solve", "pitch"],
            "[route] kind is \"path\", must be \"spiral\" or \"turnaround\" for a question about the pitch",
        ),
        (
            ["solve", "turn"],
            "[route] kind is \"path\", must be \"turnaround\" or \"spiral\" for a question about a turn",
        ),
    ] {
        let ended = offline(&stage, &[&question[..], &["--config", "path.toml"]].concat());
        assert_eq!(ended.code(), Some(2), "{}", ended.stderr);
        assert!(ended.stderr.contains(reason), "{}", ended.stderr);
    }
}

#[test]
fn a_path_that_no_description_can_hold_is_refused() {
    let segments = vec!["{kind=\"arc\",radius_m=9,turn_deg=9}"; 6000].join(",");
    let text = format!("[route]\nkind = \"path\"\nsegments = [{segments}]\n");
    assert!(text.len() < 256 << 10, "the file itself is short enough");
    let stage = stage_with(&text);
    let ended = offline(&stage, &["solve", "route", "--config", "path.toml"]);
    assert_eq!((ended.code(), ended.stderr.lines().count()), (Some(2), 1), "{}", ended.stderr);
    let reason = "[route] the route has 6000 segments, which take ";
    assert!(ended.stderr.contains(reason) && ended.stderr.ends_with("allowed: use fewer\n"), "{}", ended.stderr);
}

#[test]
fn a_route_elsewhere_and_between_two_times_is_the_same_route() {
    let stage =
        stage_with("[route]\nstart_x_m = 30\nstart_y_m = -12\nstart_heading_deg = 90\nstart_s = -20\nend_s = 430\n");
    let contact = solve(&stage, &["contact"]);
    assert!((number(&contact["time_s"]) - 412.473_838).abs() <= 5.001e-7, "{contact}");
    let poses = solve(&stage, &["poses", "--at", "-20,0"]);
    let start = &poses["poses"][1]["handles"][0];
    assert!((number(&start["x_m"]) - 30.0).abs() < 1e-9 && (number(&start["y_m"]) + 3.2).abs() < 1e-9, "{start}");
    assert_eq!(poses["poses"][0]["time_s"], json!(-20.0));
}

#[test]
fn only_boards_that_can_be_beside_each_other_need_a_pitch_above_their_width() {
    let spiral = "[dragon]\nbenches = 3\n[route]\nkind = \"path\"\n[[route.segments]]\nkind = \"spiral\"\nstart_radius_m = 5.0\n\
                  end_radius_m = 5.3\nturn_deg = 378\n";
    let stage = stage_with(spiral);
    assert_eq!(solve(&stage, &["contact"])["time_s"], Value::Null);
    let end_m = number(&solve(&stage, &["route"])["run_end_m"]);
    assert!((end_m - 33.98).abs() < 0.01, "{end_m}");
    // A dragon of more than a turn meets itself there.
    let stage = stage_with(&spiral.replace("benches = 3", "benches = 20"));
    assert!(number(&solve(&stage, &["contact"])["time_s"]) > 0.0);
    // The same of a spiral, on which a short dragon stands on less than a turn.
    let stage = stage_with("[dragon]\nbenches = 3\n[route]\npitch_m = 0.2\nstart_turns = 16\n");
    let contact = solve(&stage, &["contact"]);
    assert!(contact["time_s"].is_null() || number(&contact["time_s"]) > 0.0, "{contact}");
}

#[test]
fn the_work_limits_the_search_for_the_end_of_the_run() {
    let tiny = "[route]\nkind = \"path\"\n[[route.segments]]\nkind = \"arc\"\nradius_m = 1e-6\nturn_deg = 90\n\
                [[route.segments]]\nkind = \"line\"\nlength_m = 10\n";
    let stage = stage_with(tiny);
    for question in [&["contact"][..], &["poses", "--at", "0"]] {
        let mut command = program(&[&["solve"], question, &["--work", "1", "--config", "path.toml"]].concat());
        command.current_dir(stage.path(""));
        let ended = Process::start(command).end();
        assert_eq!((ended.code(), ended.stdout.as_str()), (Some(2), ""), "{}", ended.stderr);
        assert!(ended.stderr.contains("the limit of 1000000 steps of work is reached"), "{}", ended.stderr);
    }
    let mut route = program(&["solve", "route", "--work", "1", "--config", "path.toml"]);
    route.current_dir(stage.path(""));
    let text = Process::start(route).end().expect_clean().stdout;
    assert!(text.contains("the limit of 1000000 steps of work is reached"), "{text}");
}

#[test]
fn a_run_that_takes_too_much_work_names_the_flag_that_allows_more() {
    let tiny = "[route]\nkind = \"path\"\n[[route.segments]]\nkind = \"arc\"\nradius_m = 1e-6\nturn_deg = 90\n\
                [[route.segments]]\nkind = \"line\"\nlength_m = 10\n";
    let stage = Stage::new();
    fs::write(stage.path("tiny.toml"), tiny).expect("a configuration");
    for question in [&["route"][..], &["contact"], &["poses", "--at", "0"]] {
        let mut command = program(&[&["solve"], question, &["--work", "1", "--config", "tiny.toml"]].concat());
        command.current_dir(stage.path(""));
        let ended = Process::start(command).end();
        let said = format!("{}{}", ended.stdout, ended.stderr);
        assert!(said.contains("steps of work is reached; --work of `bench-dragon solve` allows more"), "{said}");
    }
}
