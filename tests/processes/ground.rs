//! Ground that is not flat: what the planner, a show, its recording and the clients make of it.

use std::fs;
use std::path::Path;

use bench_dragon_ipc::{BenchState, DescriptionReader};
use serde_json::Value;
use test_support::eventually::eventually;
use test_support::process::{Ended, Process};
use test_support::pytest;

use crate::reader::Reader;
use crate::stage::{Stage, program};

/// A street that turns by three quarters, on an inclined plane.
const INCLINE: &str = r#"
[dragon]
benches = 12
[ground]
rise_x = 0.3
rise_y = -0.2
carry_height_m = 1.25
[route]
kind = "path"
start_x_m = 2.0
start_heading_deg = 30.0
[[route.segments]]
kind = "line"
length_m = 5
[[route.segments]]
kind = "arc"
radius_m = 6
turn_deg = 270
"#;

/// The paper's dragon on the hill of the examples.
fn hill() -> Stage {
    let stage = Stage::new();
    for name in ["hill.toml", "hill.asc"] {
        let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples").join(name);
        fs::copy(example, stage.path(name)).expect("an example");
    }
    stage
}

fn with(text: &str) -> Stage {
    let stage = Stage::new();
    fs::write(stage.path("ground.toml"), text).expect("a configuration");
    stage
}

fn solve(stage: &Stage, args: &[&str]) -> Ended {
    let mut command = program(&[&["solve"], args].concat());
    command.current_dir(stage.path(""));
    Process::start(command).end()
}

fn answer(stage: &Stage, args: &[&str]) -> Value {
    solve(stage, &[args, &["--format", "json"]].concat()).expect_clean().last_json()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

#[track_caller]
fn assert_refused(text: &str, question: &[&str], reason: &str) {
    let stage = with(text);
    let ended = solve(&stage, &[question, &["--config", "ground.toml"]].concat());
    let expected = format!("error: ground.toml: {reason}\n");
    assert_eq!((ended.code(), ended.stderr.as_str()), (Some(2), expected.as_str()), "{}", ended.stdout);
}

#[test]
fn an_independent_chain_on_an_inclined_plane_has_the_same_poses() {
    let stage = with(INCLINE);
    let poses = answer(&stage, &["poses", "--config", "ground.toml", "--at", "0,4,9.5,15,20,25"]);
    let file = stage.path("poses.json");
    fs::write(&file, poses.to_string()).expect("a file");
    pytest::run("test_ground.py::test_an_inclined_plane", &[("POSES_JSON", file.as_os_str())]);
}

#[test]
fn an_independent_chain_on_a_map_of_heights_has_the_same_poses() {
    let stage = hill();
    let poses = answer(&stage, &["poses", "--config", "hill.toml", "--at", "0,150,400"]);
    let (file, map) = (stage.path("poses.json"), stage.path("hill.asc"));
    fs::write(&file, poses.to_string()).expect("a file");
    let files = [("POSES_JSON", file.as_os_str()), ("HILL_ASC", map.as_os_str())];
    pytest::run("test_ground.py::test_a_map_of_heights", &files);
}

#[test]
fn the_survey_of_a_route_has_its_heights_and_its_length_along_the_ground() {
    let stage = with(INCLINE);
    let survey = answer(&stage, &["route", "--config", "ground.toml"]);
    // The line climbs by 0.3·cos 30° − 0.2·sin 30° per metre.
    assert!(number(&survey["length_m"]) > 5.0 + 1.5 * 6.0 * std::f64::consts::PI);
    assert!((number(&survey["steepest_slope"]) - 0.3_f64.hypot(0.2)).abs() < 1e-4, "{survey}");
    assert!(number(&survey["lowest_m"]) < number(&survey["highest_m"]));
    let flat = with(&INCLINE.replace("rise_x = 0.3\nrise_y = -0.2\n", "").replace("carry_height_m = 1.25\n", ""));
    let level = answer(&flat, &["route", "--config", "ground.toml"]);
    assert_eq!(level.get("steepest_slope"), None);
    assert!((number(&level["length_m"]) - (5.0 + 9.0 * std::f64::consts::PI)).abs() < 1e-9);
}

#[test]
fn the_survey_tells_the_slope_of_a_plane_and_nothing_beyond_the_ground() {
    let turn = with("[ground]\nrise_x = 0.1\n[route]\nkind = \"turnaround\"\n");
    let survey = answer(&turn, &["route", "--config", "ground.toml"]);
    assert!(number(&survey["steepest_slope"]) <= 0.1 + 1e-9, "{survey}");
    let limit = answer(&turn, &["speed-limit", "--limit", "2", "--config", "ground.toml"]);
    assert!(number(&limit["largest_ratio"]) > 1.5, "{limit}");
    let steepest = with("[ground]\nrise_x = 1\n[dragon]\nbenches = 3\n");
    assert_eq!(answer(&steepest, &["route", "--config", "ground.toml"])["infeasible"], Value::Null);
    let short = with(
        "[dragon]\nbenches = 2\n[ground]\nheights = \"short.asc\"\n[route]\nkind = \"path\"\n\
        [[route.segments]]\nkind = \"line\"\nlength_m = 40\n",
    );
    let row = (0..31).map(|column| format!("{}", 0.25 * f64::from(column))).collect::<Vec<_>>().join(" ");
    let map = format!("ncols 31 nrows 3 xllcenter -15 yllcenter -1 cellsize 1\n{row}\n{row}\n{row}\n");
    fs::write(short.path("short.asc"), map).expect("a map");
    let survey = answer(&short, &["route", "--config", "ground.toml"]);
    let place = "the ground has no height at 15.462 m of travel, at (15, 0) m";
    assert!(survey["infeasible"].as_str().is_some_and(|reason| reason == place), "{survey}");
    assert!((number(&survey["highest_m"]) - 7.5).abs() < 1e-6, "{survey}");
}

#[test]
fn tables_show_heights_on_ground_and_json_always() {
    let (hilly, flat) = (hill(), Stage::new());
    let header = |ended: &Ended| ended.stdout.lines().next().map(str::to_owned);
    let csv = solve(&hilly, &["poses", "--config", "hill.toml", "--at", "10", "--format", "csv"]).expect_clean();
    assert_eq!(header(&csv).as_deref(), Some("time_s,handle,x_m,y_m,z_m,speed_mps"));
    let csv = solve(&flat, &["poses", "--at", "10", "--format", "csv"]).expect_clean();
    assert_eq!(header(&csv).as_deref(), Some("time_s,handle,x_m,y_m,speed_mps"));
    assert_eq!(answer(&flat, &["poses", "--at", "10"])["poses"][0]["handles"][5]["z_m"], 0.0);
}

#[test]
fn a_show_on_a_hill_is_as_planned_on_the_bus_and_in_its_recording() {
    let stage = hill();
    let contact = answer(&stage, &["contact", "--config", "hill.toml"]);
    assert_eq!(contact["benches"], serde_json::json!([0, 8]));
    let contact_s = number(&contact["time_s"]);
    let start = format!("{}", (contact_s - 3.0).floor());
    let show =
        ["show", "--config", "hill.toml", "--out", "out", "--rate", "50", "--format", "json", "--start-at", &start];
    let summary = stage.run(&show).last_json();
    assert!((number(&summary["contact"]["time_s"]) - contact_s).abs() < 1e-8, "{summary} {contact_s}");
    let mut verify = program(&["replay", "--verify", "out/recording.mcap", "--format", "json"]);
    verify.current_dir(stage.path(""));
    assert_eq!(Process::start(verify).end().expect_clean().last_json()["verified"], true);
}

#[test]
fn a_reader_needs_no_file_of_heights_and_has_height_pitch_and_vertical_velocity() {
    let stage = hill();
    let server = stage.serve(&["--config", "hill.toml", "--rate", "50", "--readers", "1"]);
    fs::remove_file(stage.path("hill.asc")).expect("the server has read it");
    let description = DescriptionReader::open(stage.domain(), "test").expect("a server has created it");
    let toml = eventually("the description has arrived", || description.poll().expect("the bus is readable")).toml;
    assert!(toml.contains("[[ground.runs]]") && !toml.contains("hill.asc"), "{}", &toml[..200]);
    let shots = Reader::join(&stage).read_to_tick(40);
    let shot = shots.last().expect("a frame");
    let time_s = format!("{}", shot.header.show_time_s());
    fs::write(stage.path("bus.toml"), toml).expect("a configuration");
    let planned = answer(&stage, &["poses", "--config", "bus.toml", "--at", &time_s]);
    let planned = planned["poses"][0]["handles"].as_array().expect("handles");
    assert_eq!(planned.len(), shot.handles.len());
    for (handle, planned) in shot.handles.iter().zip(planned) {
        for (axis, key) in ["x_m", "y_m", "z_m"].iter().enumerate() {
            assert!((handle.position_m[axis] - number(&planned[key])).abs() < 1e-9, "{key}: {handle:?} {planned}");
        }
        assert!((handle.speed_mps() - number(&planned["speed_mps"])).abs() < 1e-7);
    }
    let bench = BenchState::between(&shot.handles[30], &shot.handles[31]);
    let rise_m = shot.handles[30].position_m[2] - shot.handles[31].position_m[2];
    assert!(rise_m != 0.0 && (bench.pitch_rad.sin() - rise_m / 1.65).abs() < 1e-9, "{bench:?}");
    assert!(shot.handles.iter().any(|handle| handle.velocity_mps[2].abs() > 1e-3));
    server.stop();
}

/// The time of the first contact on an incline, over the pitch and the length of a bench, is that of contacts of other plans.
#[test]
fn sensitivity_on_ground_is_that_of_other_plans() {
    const STEP_M: f64 = 1e-5;
    let plan = |pitch_m: f64, body_m: f64| {
        with(&format!(
            "[dragon]\nbenches = 40\nbody_length_m = {body_m}\n[ground]\nrise_x = 0.3\nrise_y = -0.2\n\
            [route]\nkind = \"spiral\"\npitch_m = {pitch_m}\n"
        ))
    };
    let contact_s = |pitch_m: f64, body_m: f64| {
        number(&answer(&plan(pitch_m, body_m), &["contact", "--config", "ground.toml"])["time_s"])
    };
    let flags = ["--config", "ground.toml", "--parameter", "pitch,body-length", "--steps", "1"];
    let found = answer(&plan(0.55, 2.2), &[&["sensitivity"], &flags[..]].concat());
    let quantity = |index: usize| &found["quantities"][index];
    assert!((number(&quantity(0)["value"]) - contact_s(0.55, 2.2)).abs() < 1e-9, "{found}");
    for (index, [pitch_m, body_m]) in [[STEP_M, 0.0], [0.0, STEP_M]].into_iter().enumerate() {
        let times_s = [1.0, -1.0].map(|sign| contact_s(0.55 + sign * pitch_m, 2.2 + sign * body_m));
        let expected = (times_s[0] - times_s[1]) / (2.0 * STEP_M);
        let derivative = number(&quantity(0)["parameters"][index]["derivative"]);
        assert!((derivative - expected).abs() < 1e-4 * expected.abs(), "{index}: {derivative} {expected}");
    }
    let pitch = answer(&plan(0.55, 2.2), &["pitch", "--config", "ground.toml"]);
    assert_eq!(quantity(3)["value"], pitch["pitch_m"]);
}

/// The tightest spiral on the hill: the saved configuration has the heights under its own route, and plays up to the circle.
#[test]
fn the_smallest_pitch_on_a_hill_is_saved_with_the_heights_under_its_route() {
    let stage = hill();
    let asked = ["pitch", "--config", "hill.toml", "--turn-diameter", "9", "--save-config", "tightest.toml"];
    let pitch = answer(&stage, &asked);
    assert_eq!(pitch["limit"]["kind"], "contact", "{pitch}");
    let pitch_m = number(&pitch["pitch_m"]);
    assert!((0.4..0.55).contains(&pitch_m), "{pitch}");
    let least = |config: &str| {
        let found = answer(&stage, &["sensitivity", "--config", config, "--parameter", "pitch", "--steps", "1"]);
        number(&found["quantities"][1]["value"])
    };
    assert!(least("tightest.toml").abs() < 1e-9, "{}", least("tightest.toml"));
    let saved = fs::read_to_string(stage.path("tightest.toml")).expect("a configuration");
    assert!(!saved.contains("hill.asc"), "{saved}");
    let tighter = saved.replace(&format!("pitch_m = {pitch_m}"), &format!("pitch_m = {}", pitch_m - 1e-6));
    assert_ne!(tighter, saved);
    fs::write(stage.path("tighter.toml"), tighter).expect("a configuration");
    assert!(least("tighter.toml") < 0.0);
}

#[test]
fn a_turn_on_a_hill_passes_along_the_ground_and_its_shortest_is_saved() {
    let stage = hill();
    let turn = ["[dragon]\nbenches = 24\n", "[route]\nkind = \"turnaround\"\nstart_s = -40\nend_s = 40\n"];
    let ground = fs::read_to_string(stage.path("hill.toml")).expect("an example");
    fs::write(stage.path("turn.toml"), format!("{}{}{ground}", turn[0], turn[1])).expect("a configuration");
    let found = answer(&stage, &["turn", "--config", "turn.toml"]);
    assert_eq!((&found["infeasible"], &found["contact"]), (&Value::Null, &Value::Null), "{found}");
    assert!(number(&found["length_on_ground_m"]) > number(&found["length_m"]), "{found}");
    let limit = answer(&stage, &["speed-limit", "--limit", "2", "--config", "turn.toml"]);
    assert_eq!(limit["largest_ratio"], found["largest_ratio"]);
    let asked = ["turn", "--config", "turn.toml", "--shortest", "--max-ratio", "1.7", "--save-config", "short.toml"];
    let shortest = answer(&stage, &asked);
    assert!(number(&shortest["length_m"]) < number(&found["length_m"]), "{shortest}");
    assert!(number(&shortest["largest_ratio"]) <= 1.7, "{shortest}");
    let saved = answer(&stage, &["turn", "--config", "short.toml"]);
    for key in ["length_m", "length_on_ground_m", "largest_ratio"] {
        assert!((number(&saved[key]) - number(&shortest[key])).abs() < 1e-9, "{key}: {saved}, {shortest}");
    }
}

/// This dragon stands on the hill and walks its plan there, but the way of its last bench out of the turn leads beyond the heights.
#[test]
fn a_turn_beyond_the_heights_names_the_place() {
    let stage = hill();
    let ground = fs::read_to_string(stage.path("hill.toml")).expect("an example");
    let turn = "[dragon]\nbenches = 212\n[route]\nkind = \"turnaround\"\npitch_m = 1.9\nstart_x_m = -0.6\nstart_s = -5\nend_s = 5\n";
    fs::write(stage.path("turn.toml"), format!("{turn}{ground}")).expect("a configuration");
    let found = answer(&stage, &["turn", "--config", "turn.toml"]);
    let reason = found["infeasible"].as_str().expect("the ground ends");
    assert!(
        reason.starts_with("the ground has no height at ") && reason.ends_with(" m of travel, at (-15, 4.568) m"),
        "{reason}"
    );
}

#[test]
fn the_quickest_show_is_answered_on_level_ground_only_and_says_so() {
    let plane = "[ground]\nrise_x = 0.1\n";
    for flags in [
        &["profile", "--limit", "2", "--accel", "0.5"][..],
        &["profile", "--limit", "2", "--accel", "0.5", "--pitch", "1.7"],
    ] {
        assert_refused(plane, flags, "[ground] is present, must be absent for solve profile");
    }
}

#[test]
fn bad_ground_is_refused_in_one_line() {
    let refused = |text: &str, reason: &str| assert_refused(text, &["contact"], reason);
    refused(
        "[ground]\nrise_x = 0.9\nrise_y = 0.6\n",
        "[ground] rise_x 0.9 and rise_y 0.6 are a slope of 1.0816653826391966, must be at most 1",
    );
    refused("[ground]\ncarry_height_m = 200\n", "[ground] carry_height_m is 200, must be from -100 to 100");
    refused(
        "[ground]\nheights = \"hill.png\"\nmetres_per_unit = 1e300\n",
        "[ground] metres_per_unit is 1e300, must be from 0.000001 to 1000000",
    );
    refused("[ground]\nx_m = 5\n", "[ground] x_m is 5, only allowed with heights");
    refused(
        "[ground]\nheights = \"none.asc\"\n",
        "[ground] heights \"none.asc\": cannot be read: No such file or directory (os error 2)",
    );
    let stage = Stage::new();
    fs::write(stage.path("small.asc"), "ncols 3 nrows 3 xllcorner 8 yllcorner -1 cellsize 1 0 0 0 0 0 0 0 0 0")
        .expect("a map");
    fs::write(stage.path("ground.toml"), "[ground]\nheights = \"small.asc\"\n").expect("a configuration");
    let ended = solve(&stage, &["contact", "--config", "ground.toml"]);
    let expected = "error: ground.toml: [ground] the ground has no height at -1.506 m of travel, at (8.686, 1.5) m\n";
    assert_eq!((ended.code(), ended.stderr.as_str()), (Some(2), expected));
}

#[test]
fn a_map_in_the_coordinates_of_a_survey_asks_for_an_origin() {
    let stage = with("[ground]\nheights = \"utm.asc\"\n");
    let map = "ncols 3\nnrows 3\nxllcorner 500000\nyllcorner 5400000\ncellsize 50\n1 1 1\n1 1 1\n1 1 1\n";
    fs::write(stage.path("utm.asc"), map).expect("a map");
    let refused = solve(&stage, &["route", "--config", "ground.toml"]);
    assert_eq!((refused.code(), refused.stderr.lines().count()), (Some(2), 1), "{}", refused.stderr);
    let hint = "the map begins at (500025, 5400025) m: set [origin] to the point of it that is (0, 0) of the route";
    assert!(refused.stderr.contains(hint), "{}", refused.stderr);
}
