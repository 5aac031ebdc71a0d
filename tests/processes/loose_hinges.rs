//! Loose hinges: what the planner guarantees, and what the monitor, the guard and the metrics report.

use std::fs;

use serde_json::{Value, json};
use test_support::process::{Ended, Process};

use crate::stage::{Stage, program};

fn stage_with(text: &str) -> Stage {
    let stage = Stage::new();
    fs::write(stage.path("loose.toml"), text).expect("a configuration");
    stage
}

const LOOSE: &str = "[dragon]\npole_diameter_m = 0.050\n";

fn solve(stage: &Stage, args: &[&str]) -> Ended {
    let mut command = program(&[&["solve"], args, &["--config", "loose.toml"]].concat());
    command.current_dir(stage.path(""));
    Process::start(command).end()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn a_contact_has_three_times_the_guaranteed_the_taut_and_the_nominal_one() {
    let answer = solve(&stage_with(LOOSE), &["contact", "--format", "json"]).expect_clean().last_json();
    assert!((number(&answer["time_s"]) - 412.473_838).abs() < 1e-6, "{answer}");
    assert!((number(&answer["taut"]["time_s"]) - 412.349_332).abs() < 1e-6, "{answer}");
    assert!((number(&answer["earliest_s"]) - 405.878).abs() < 2e-3, "{answer}");
    assert_eq!((&answer["earliest_benches"], &answer["play_m"]), (&json!([0, 9]), &json!(0.002_499_999_999_999_998_8)));
    let rigid = solve(&stage_with(""), &["contact", "--format", "json"]).expect_clean().last_json();
    assert!(rigid.get("earliest_s").is_none() && rigid.get("taut").is_none(), "{rigid}");
    let equal = solve(&stage_with("[dragon]\npole_diameter_m = 0.055\n"), &["contact", "--format", "json"]);
    assert_eq!(equal.expect_clean().last_json(), rigid, "a pole as thick as its hole has no play");
}

#[test]
fn the_sensitivity_has_the_diameters_and_the_contacts_that_the_play_allows() {
    let stage = stage_with(LOOSE);
    let contact = solve(&stage, &["contact", "--format", "json"]).expect_clean().last_json();
    let diameters = ["sensitivity", "--parameter", "hole-diameter,pole-diameter", "--steps", "1"];
    let answer = solve(&stage, &[&diameters[..], &["--format", "json"]].concat()).expect_clean().last_json();
    let of = |key: &str| {
        let quantities = answer["quantities"].as_array().expect("a list").iter();
        quantities.clone().find(|quantity| quantity["quantity"] == key).unwrap_or_else(|| panic!("no {key}: {answer}"))
    };
    assert_eq!(of("first_contact_s")["value"], contact["time_s"]);
    assert_eq!(of("earliest_s")["value"], contact["earliest_s"]);
    assert_eq!(of("taut_contact_s")["value"], contact["taut"]["time_s"]);
    let [hole, pole] = [0, 1].map(|index| &of("taut_contact_s")["parameters"][index]);
    assert_eq!((&hole["value"], &pole["value"]), (&json!(0.055), &json!(0.05)));
    assert!(
        number(&pole["derivative"]) > 20.0 && number(&pole["derivative"]) == -number(&hole["derivative"]),
        "{answer}"
    );
    let proven = &of("earliest_s")["parameters"][0];
    assert!(proven["derivative"].is_null() && proven["samples"][0]["value"].is_number(), "{answer}");
    // One line for both parameters.
    let text = solve(&stage, &diameters).expect_clean().stdout;
    let note = "– earliest possible contact over hole diameter, pole diameter: it is the end of a proof";
    assert!(text.contains(note), "{text}");
    // A pole does not fit into a hole that is thinner, and the other answers remain.
    let thin = [&diameters[..], &["--range", "20", "--format", "json"]].concat();
    let answer = solve(&stage, &thin).expect_clean().last_json();
    let sample = &answer["quantities"][2]["parameters"][0]["samples"][0];
    let reason = "pole_diameter_m is 0.05, must be above 0 and at most hole_diameter_m 0.044";
    assert!(
        sample["value"].is_null() && sample["reason"].as_str().is_some_and(|told| told.starts_with(reason)),
        "{sample}"
    );
    let ended = solve(&stage_with(""), &diameters);
    let line = "error: --parameter is hole diameter, which a [dragon] without play does not have\n";
    assert_eq!((ended.code(), ended.stderr.as_str()), (Some(2), line));
}

#[test]
fn a_pitch_is_wide_enough_for_every_pose_and_the_nominal_one_is_told_too() {
    let stage = stage_with(LOOSE);
    let args = ["pitch", "--format", "json", "--save-config", "wide.toml"];
    let answer = solve(&stage, &args).expect_clean().last_json();
    assert!((number(&answer["nominal_pitch_m"]) - 0.450_337).abs() < 1e-6, "{answer}");
    assert!(number(&answer["pitch_m"]) > 0.450_337 && number(&answer["pitch_m"]) < 0.465, "{answer}");
    // The number of docs/reference/planner.md, to the tolerance of the search.
    assert!((number(&answer["pitch_m"]) - 0.459_634).abs() < 1e-5, "{answer}");
    let mut contact = program(&["solve", "contact", "--config", "wide.toml", "--format", "json"]);
    contact.current_dir(stage.path(""));
    let contact = Process::start(contact).end().expect_clean().last_json();
    // The head is on the circle of 9 m at the radius 4.5 m.
    let earliest_s = number(&contact["earliest_s"]);
    let pitch_m = number(&answer["pitch_m"]);
    let arc = |angle: f64| pitch_m / (4.0 * std::f64::consts::PI) * (angle * angle.hypot(1.0) + angle.asinh());
    let turns = std::f64::consts::TAU;
    let on_circle_s = arc(16.0 * turns) - arc(4.5 * turns / pitch_m);
    assert!(earliest_s >= on_circle_s - 1e-6, "{earliest_s} {on_circle_s}");
}

#[test]
fn a_turn_tells_whether_a_pose_comes_too_near() {
    let stage = stage_with(&format!("{LOOSE}[route]\nkind = \"turnaround\"\n"));
    let answer = solve(&stage, &["turn", "--format", "json"]).expect_clean().last_json();
    assert_eq!(answer.get("earliest_s"), Some(&Value::Null), "{answer}");
    let tight = stage_with("[dragon]\npole_diameter_m = 0.030\n[route]\nkind = \"turnaround\"\npitch_m = 0.5\n");
    let answer = solve(&tight, &["turn", "--clearance", "0.1", "--format", "json"]).last_json();
    assert!(answer["earliest_s"].is_number(), "{answer}");
}

#[test]
fn a_clearance_under_the_play_is_told() {
    let stage = stage_with(LOOSE);
    let ended = solve(&stage, &["contact", "--clearance", "0.001"]);
    let warning = "warning: --clearance is 0.001, less than the play of the hinges, 0.0025 m: boards this far apart may touch as \
                   they move in their hinges\n";
    assert_eq!((ended.code(), ended.stderr.as_str()), (Some(0), warning));
    assert_eq!(solve(&stage, &["contact", "--clearance", "0.003"]).stderr, "");
}

#[test]
fn a_guarded_show_rests_before_any_pose_touches() {
    let stage = stage_with(LOOSE);
    let margin_s = {
        let answer = solve(&stage, &["contact", "--clearance", "0.0005", "--format", "json"]).last_json();
        number(&answer["earliest_s"])
    };
    let show = [
        "show",
        "--config",
        "loose.toml",
        "--guard",
        "--out",
        "out",
        "--rate",
        "50",
        "--time-scale",
        "20",
        "--start-at",
        "400",
        "--format",
        "json",
    ];
    let ended = stage.run(&show);
    let held_s = number(&ended.last_json()["guard"]["held_at_s"]);
    assert!(
        (held_s - margin_s).abs() < 0.05 && held_s < 412.0,
        "held at {held_s} s, a pose may come near at {margin_s} s"
    );
}

#[test]
fn a_monitor_reports_the_earliest_possible_contact_beside_the_forecast() {
    let stage = stage_with(LOOSE);
    let server = stage.serve(&["--config", "loose.toml", "--rate", "50", "--start-at", "403", "--readers", "1"]);
    let mut monitor = stage.start(&["monitor", "--format", "json", "--progress", "0.05"]);
    let lines =
        monitor.json_until("both forecasts", |line| line["earliest_s"].is_number() && line["forecast_s"].is_number());
    let line = lines.last().expect("a line");
    assert!((number(&line["forecast_s"]) - 412.473_838).abs() < 1e-4, "{line}");
    assert!((number(&line["earliest_s"]) - 405.878).abs() < 0.03, "{line}");
    let summary = monitor.terminate().expect_clean().last_json();
    assert!(summary["earliest_s"].is_number(), "{summary}");
    server.stop();
}

#[test]
fn bad_poles_and_holes_are_refused_in_one_line() {
    for (keys, reason) in [
        ("pole_diameter_m = 0.056", "pole_diameter_m is 0.056, must be above 0 and at most hole_diameter_m 0.055"),
        ("pole_diameter_m = 0", "pole_diameter_m is 0, must be above 0 and at most hole_diameter_m 0.055"),
        (
            "hole_diameter_m = 0.4",
            "hole_diameter_m is 0.4, must be above 0, and at most width_m 0.3 and twice hole_offset_m, 0.55",
        ),
    ] {
        let ended = solve(&stage_with(&format!("[dragon]\n{keys}\n")), &["contact"]);
        let expected = format!("error: loose.toml: [dragon] {reason}\n");
        assert_eq!((ended.code(), ended.stderr.as_str()), (Some(2), expected.as_str()));
    }
}

#[test]
fn a_pose_that_touches_is_found_between_the_bound_and_the_dragon_without_play() {
    let answer = solve(&stage_with(LOOSE), &["contact", "--format", "json"]).expect_clean().last_json();
    let [earliest_s, witness_s] = ["earliest_s", "witness_s"].map(|key| number(&answer[key]));
    // A search of another kind found a pose that touches 0.55 s after the bound.
    assert!(witness_s >= earliest_s && witness_s <= 406.3, "{answer}");
    assert!(answer["witness_benches"].is_array(), "{answer}");
    let early = "[dragon]\nbenches = 13\nhead_length_m = 2.17\nbody_length_m = 1.77\nwidth_m = 0.3\nhole_offset_m = 0.22\n\
                 hole_diameter_m = 0.06\npole_diameter_m = 0.05\n[route]\nkind = \"spiral\"\npitch_m = 0.501\nstart_turns = 4.58\n";
    let answer = solve(&stage_with(early), &["contact", "--format", "json"]).expect_clean().last_json();
    let [earliest_s, witness_s] = ["earliest_s", "witness_s"].map(|key| number(&answer[key]));
    // A search of another kind found a pose that touches at about 14.3 s.
    assert!((earliest_s - 14.093).abs() < 2e-3 && witness_s >= earliest_s && witness_s <= 14.6, "{answer}");
    let text = solve(&stage_with(early), &["contact"]).expect_clean().stdout;
    assert!(text.contains("\na pose with a contact was found at 1"), "{text}");
}

#[test]
fn an_answer_about_very_loose_hinges_is_whole_or_tells_how_far_it_came() {
    let stage = stage_with("[dragon]\npole_diameter_m = 1e-300\n");
    let answer = solve(&stage, &["contact", "--format", "json"]).expect_clean().last_json();
    assert!(answer["earliest_benches"].is_array() || answer["play_undecided"].is_string(), "{answer}");
    assert!(number(&answer["earliest_s"]) <= number(&answer["witness_s"]), "{answer}");
    let little = solve(&stage, &["contact", "--work", "1", "--format", "json"]).expect_clean().last_json();
    assert!(little["play_undecided"].is_string(), "{little}");
    assert!(number(&little["earliest_s"]) <= number(&answer["earliest_s"]), "{little}");
}
