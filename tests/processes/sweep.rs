//! `solve sweep`: the swept area, the distances from the borders of the stage, its files, and what is refused.

use std::ffi::OsStr;

use serde_json::{Value, json};
use test_support::process::{Ended, Process};
use test_support::pytest;

use crate::stage::{Stage, program};

/// A straight dragon of five benches: its boards sweep a rectangle. The board of its head reaches 0.275 m beyond the handle.
const STRAIGHT: &str = "[dragon]\nbenches = 5\n[route]\nkind = \"path\"\nsegments = [{ kind = \"line\", length_m = 30 }]\n\
    [stage]\noutline = [[-20, -5], [40, -5], [40, 5], [-20, 5]]\n\
    keep_out = [[[33, -1], [34, -1], [34, 1], [33, 1]], [[0, 4], [1, 4], [1, 5], [0, 4.5]]]\n\
    crowd = [[-20, 3], [60, 3]]\nclear_m = 3\n";
/// A dragon on bends, with a crowd beside it.
const BENDS: &str = "[dragon]\nbenches = 6\n[route]\nkind = \"path\"\nsegments = [{ kind = \"line\", length_m = 5 }, \
    { kind = \"arc\", radius_m = 4, turn_deg = 300 }, { kind = \"arc\", radius_m = 3, turn_deg = -150 }]\n\
    [stage]\ncrowd = [[-2, -6], [15, -3], [14, 9]]\nclear_m = 1\n";
const TWO: &str = "[[dragons]]\nname = \"gold\"\nbenches = 4\n[dragons.route]\nkind = \"path\"\n\
    segments = [{ kind = \"line\", length_m = 20 }]\n[[dragons]]\nname = \"silver\"\nbenches = 4\n[dragons.route]\nkind = \"path\"\n\
    start_y_m = 6\nsegments = [{ kind = \"line\", length_m = 20 }]\n[dragons.head]\nstart_s = 7\n\
    [stage]\ncrowd = [[25, -50], [25, 50]]\nclear_m = 5\n";

fn stage_with(text: &str) -> Stage {
    let stage = Stage::new();
    std::fs::write(stage.path("plan.toml"), text).expect("the folder is writable");
    stage
}

fn run(stage: &Stage, args: &[&str]) -> Ended {
    let mut command = program(&[&["solve", "sweep", "--config", "plan.toml"], args].concat());
    command.current_dir(stage.path(""));
    Process::start(command).end()
}

fn sweep(stage: &Stage, args: &[&str]) -> Value {
    run(stage, &[args, &["--format", "json"]].concat()).expect_clean().last_json()
}

#[track_caller]
fn assert_near(value: &Value, expected: f64) {
    let number = value.as_f64().unwrap_or_else(|| panic!("{value} is a number"));
    assert!((number - expected).abs() < 1e-6, "{number}, expected {expected}");
}

#[test]
fn a_straight_walk_sweeps_a_rectangle_and_comes_near_to_borders_in_closed_form() {
    let answer = sweep(&stage_with(STRAIGHT), &[]);
    let length_m = 30.0 + (3.41 - 0.55) + 4.0 * (2.20 - 0.55) + 2.0 * 0.275;
    assert_near(&answer["area_m2"], 0.3 * length_m);
    for (number, expected) in [30.275 - length_m, -0.15, 30.275, 0.15].into_iter().enumerate() {
        assert_near(&answer["box_m"][number], expected);
    }
    // The crowd is beside the boards all the time; the first that counts is the first bench.
    assert_near(&answer["crowd_m"], 2.85);
    let borders = answer["borders"].as_array().expect("a list");
    let names: Vec<&Value> = borders.iter().map(|near| &near["border"]).collect();
    assert_eq!(names, [&json!("outline"), &json!("keep_out area 1"), &json!("crowd")]);
    assert_near(&borders[0]["distance_m"], 4.85);
    assert_near(&borders[1]["distance_m"], 33.0 - 30.275);
    assert_near(&borders[1]["at_s"], 30.0);
    assert_eq!((&borders[1]["bench"], &answer["too_near"]["at_s"]), (&json!(0), &json!(0.0)));
    assert_eq!((&answer["too_near"]["border"], &answer["undecided"]), (&json!("crowd"), &Value::Null));
    let text = run(&stage_with(STRAIGHT), &[]).expect_clean().stdout;
    assert!(text.starts_with("boards sweep 12.003 m², from (-9.735, -0.150) m to (30.275, 0.150) m"), "{text}");
    assert!(text.contains("keep_out area 1: nearest 2.725000 m, bench 0 at 30.000000 s"), "{text}");
    assert!(text.contains("crowd: first nearer than clear_m 3, bench "), "{text}");
}

#[test]
fn several_dragons_have_one_area_and_the_name_of_the_nearest() {
    let answer = sweep(&stage_with(TWO), &[]);
    let length_m = 20.0 + (3.41 - 0.55) + 3.0 * (2.20 - 0.55) + 2.0 * 0.275;
    assert_near(&answer["area_m2"], 2.0 * 0.3 * length_m);
    assert_eq!(
        (&answer["dragon"], &answer["bench"], &answer["too_near"]["dragon"]),
        (&json!("gold"), &json!(0), &json!("gold"))
    );
    assert_near(&answer["crowd_m"], 25.0 - 20.275);
    assert_near(&answer["at_s"], 20.0);
    assert_near(&answer["too_near"]["at_s"], 25.0 - 5.0 - 0.275);
}

#[test]
fn figures_have_the_borders_of_the_stage_and_every_format_is_written() {
    let stage = stage_with(STRAIGHT);
    let svg = |title: &[&str]| {
        run(&stage, &[&["--figure", "floor.svg"], title].concat()).expect_clean();
        std::fs::read_to_string(stage.path("floor.svg")).expect("a figure")
    };
    let labels = ["area that boards sweep", "stage", "area to keep out of", "line of the crowd", "nearest to a border"];
    let drawn = svg(&["--title", "North Gate"]);
    for label in labels.iter().chain(&["keep out", "North Gate"]) {
        assert!(drawn.contains(&format!("aria-label=\"{label}\"")), "{label}");
    }
    for (file, begins) in [("floor.png", &b"\x89PNG"[..]), ("floor.dxf", b"0\nSECTION\n"), ("floor.geojson", b"{\"")] {
        run(&stage, &["--figure", file]).expect_clean();
        assert!(std::fs::read(stage.path(file)).expect("a file").starts_with(begins), "{file}");
    }
}

/// Boards at many times, united by shapely, are the same area; stock readers find it in both files.
#[test]
fn stock_readers_find_the_area_that_boards_sweep() {
    let stage = stage_with(BENDS);
    let answer = run(&stage, &["--tolerance", "0.02", "--figure", "floor.dxf", "--format", "json"]).expect_clean();
    std::fs::write(stage.path("sweep.json"), answer.stdout).expect("a file");
    run(&stage, &["--tolerance", "0.02", "--figure", "floor.geojson"]).expect_clean();
    let mut poses = program(&[
        "solve",
        "poses",
        "--config",
        "plan.toml",
        "--from",
        "0",
        "--to",
        "33.78",
        "--step",
        "0.02",
        "--format",
        "json",
    ]);
    poses.current_dir(stage.path(""));
    let poses = Process::start(poses).end().expect_clean();
    std::fs::write(stage.path("poses.json"), poses.stdout).expect("a file");
    pytest::run("test_sweep.py", &[("SWEEP", OsStr::new(&stage.path("")))]);
}

#[test]
fn bad_arguments_are_refused_in_one_line() {
    for (args, reason) in [
        (&["--figure", "floor.tif"][..], "must end in .svg, .pdf, .png, .dxf or .geojson"),
        (&["--tolerance", "0"], "must be from 0.001 to 1"),
        (&["--tolerance", "nan"], "must be from 0.001 to 1"),
        (&["--title", "x"], "--figure"),
    ] {
        let ended = run(&stage_with(STRAIGHT), args);
        assert_eq!((ended.code(), &*ended.stdout), (Some(2), ""), "{args:?}: {}", ended.stderr);
        assert!(ended.stderr.contains(reason), "{args:?}: {}", ended.stderr);
    }
}

#[test]
fn too_little_work_is_an_answer_of_its_own() {
    let stage = stage_with("");
    let answer = sweep(&stage, &["--work", "1", "--tolerance", "0.001"]);
    assert_eq!((&answer["area_m2"], &answer["box_m"]), (&Value::Null, &Value::Null));
    let reason = answer["undecided"].as_str().expect("a reason");
    assert_eq!(reason, "the area: the limit of 1000000 steps of work is reached");
    let drawn = run(&stage, &["--work", "1", "--tolerance", "0.001", "--figure", "floor.svg"]);
    assert_eq!(drawn.code(), Some(1));
    assert!(drawn.stderr.contains("--figure has nothing to show: the area takes too much work"), "{}", drawn.stderr);
}

#[test]
fn a_server_does_not_start_with_a_board_in_an_area_to_keep_out_of() {
    let stage =
        stage_with(&TWO.replace("[stage]", "[stage]\nkeep_out = [[[-4.1, 5], [-3.5, 5], [-3.5, 7], [-4.1, 7]]]"));
    let ended = stage.run(&["serve", "--config", "plan.toml"]);
    assert_eq!(ended.code(), Some(2), "{}", ended.stderr);
    let line = "[stage] keep_out area 1 holds silver 1 at the start: begin its route elsewhere\n";
    assert!(ended.stderr.ends_with(line), "{}", ended.stderr);
}
