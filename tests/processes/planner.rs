//! The planner's questions: the known answers as JSON, answers that are played, and questions without an answer.

use std::fs;

use serde_json::{Value, json};
use test_support::process::{Ended, Process};

use crate::stage::{Stage, program};

/// The paper's turnaround with an exit arc so tight that handle 1 stops.
const TOO_TIGHT: &str = "[route]\nkind = \"turnaround\"\nradius_ratio = 3.0\n";

fn solve(args: &[&str]) -> Ended {
    Process::start(program(&[&["solve"], args].concat())).end()
}

fn answer(args: &[&str]) -> Value {
    solve(&[args, &["--format", "json"]].concat()).expect_clean().last_json()
}

/// Fails unless a number equals the published value to six decimals.
fn assert_six(actual: &Value, expected: f64) {
    let number = actual.as_f64().unwrap_or_else(|| panic!("{actual} is no number"));
    assert!((number - expected).abs() <= 5.001e-7, "{number}, not {expected}");
}

/// Returns the one line of a refused question.
fn refusal(args: &[&str]) -> String {
    let ended = solve(args);
    assert_eq!((ended.code(), ended.stdout.as_str()), (Some(2), ""), "{args:?}: {}", ended.stderr);
    assert_eq!(ended.stderr.lines().count(), 1, "{}", ended.stderr);
    ended.stderr.trim_end().to_owned()
}

#[test]
fn contact_and_near_miss_have_the_published_values() {
    let contact = answer(&["contact", "--profile", "--step", "100"]);
    assert_six(&contact["time_s"], 412.473_838);
    assert_eq!(contact["benches"], json!([0, 8]));
    let profile = contact["profile"].as_array().expect("a profile");
    let clearances = [0.169_279, 0.157_908, 0.164_999, 0.120_694, 0.025_533];
    for (point, clearance_m) in profile.iter().zip(clearances) {
        assert_six(&point["clearance_m"], clearance_m);
    }
    assert_eq!((profile.len(), &profile[4]["time_s"], &profile[5]["time_s"]), (6, &json!(400.0), &contact["time_s"]));
    let misses = contact["near_misses"].as_array().expect("near misses");
    let last = misses.last().expect("a near miss");
    assert_eq!(last["benches"], json!([0, 11]));
    assert!((last["time_s"].as_f64().expect("a time") - 409.832).abs() <= 5.001e-4, "{last}");
    assert!((last["clearance_m"].as_f64().expect("a clearance") - 0.000_865).abs() <= 5.001e-7, "{last}");
}

/// The head starts from rest, so its ramp delays it everywhere by the same time: 2 s at 1 m/s and 0.25 m/s².
#[test]
fn with_an_acceleration_the_planned_contact_is_the_danced_one() {
    let stage = Stage::new();
    let short = "[dragon]\nbenches = 60\n[route]\nstart_turns = 5\n";
    let [planned, ramped] = [("plain", ""), ("ramped", "[head]\naccel_mps2 = 0.25\n")].map(|(name, head)| {
        let file = stage.path(&format!("{name}.toml"));
        fs::write(&file, format!("{short}{head}")).expect("a file");
        answer(&["contact", "--config", &file.display().to_string()])
    });
    let [planned_s, ramped_s] = [&planned, &ramped].map(|answer| answer["time_s"].as_f64().expect("a contact"));
    assert!((ramped_s - planned_s - 2.0).abs() < 1e-9, "{ramped_s} s, without a ramp {planned_s} s");
    assert_eq!((&ramped["benches"], &ramped["point_m"]), (&planned["benches"], &planned["point_m"]));

    let until = format!("{:.3}", ramped_s + 0.5);
    let pace = ["--time-scale", "20", "--rate", "100", "--until", &until];
    let ended = stage.run(&[&["show", "--config", "ramped.toml", "--format", "json"], &pace[..]].concat());
    let danced_s = ended.last_json()["contact"]["time_s"].as_f64().expect("a contact");
    assert!((danced_s - ramped_s).abs() < 1e-6, "danced at {danced_s} s, planned for {ramped_s} s");
}

#[test]
fn with_an_acceleration_poses_profiles_and_ends_follow_the_ramps() {
    let stage = Stage::new();
    let file = stage.path("ramped.toml").display().to_string();
    fs::write(&file, "[head]\naccel_mps2 = 0.25\n").expect("a file");
    let poses = answer(&["poses", "--config", &file, "--at", "0,2,62"]);
    let head = |i: usize, key: &str| poses["poses"][i]["handles"][0][key].as_f64().expect("a number");
    assert_eq!((head(0, "speed_mps"), head(1, "speed_mps"), head(2, "speed_mps")), (0.0, 0.5, 1.0));
    assert_six(&poses["poses"][2]["handles"][0]["x_m"], 5.799_209);
    assert_six(&poses["poses"][2]["handles"][0]["y_m"], -5.771_092);
    let contact = answer(&["contact", "--config", &file, "--profile", "--step", "102"]);
    assert_six(&contact["time_s"], 414.473_838);
    assert_six(&contact["profile"][1]["clearance_m"], 0.157_908);
    let last = &contact["profile"].as_array().expect("a profile").last().expect("a last point")["time_s"];
    assert_eq!(last, &contact["time_s"]);
    let misses = contact["near_misses"].as_array().expect("near misses");
    let miss_s = misses.last().expect("a near miss")["time_s"].as_f64().expect("a time");
    assert!((miss_s - 411.832).abs() <= 5.001e-4, "{miss_s}");
    let sensitivity = answer(&["sensitivity", "--config", &file, "--parameter", "speed", "--steps", "1"]);
    assert_six(&sensitivity["quantities"][0]["value"], 414.473_838);
    let ramp = answer(&["sensitivity", "--config", &file, "--parameter", "acceleration", "--steps", "1"]);
    let accel = &ramp["quantities"][0]["parameters"][0];
    let value = accel["value"].as_f64().expect("an acceleration");
    assert_eq!(
        (&accel["parameter"], accel["derivative"].as_f64()),
        (&Value::from("accel_mps2"), Some(-0.5 / (value * value)))
    );
    let refused = refusal(&["sensitivity", "--parameter", "acceleration"]);
    assert!(
        refused.contains("--parameter is acceleration, which a [head] without accel_mps2 does not have"),
        "{refused}"
    );
    let late = refusal(&["poses", "--config", &file, "--at", "1000"]);
    let plain = refusal(&["poses", "--at", "1000"]);
    let end_s = |told: &str| -> f64 {
        told.split(" to ").nth(1).and_then(|rest| rest.split(',').next()).expect("an end").parse().expect("a number")
    };
    assert!((end_s(&late) - end_s(&plain) - 4.0).abs() < 1e-9, "{late} {plain}");
}

#[test]
fn with_an_acceleration_the_fastest_moment_of_a_turn_follows_the_ramps() {
    let stage = Stage::new();
    let file = stage.path("turn.toml").display().to_string();
    fs::write(&file, "[head]\naccel_mps2 = 0.5\n[route]\nkind = \"turnaround\"\n").expect("a file");
    let limit = answer(&["speed-limit", "--limit", "2", "--config", &file]);
    assert!((limit["time_s"].as_f64().expect("a time") - 15.480).abs() <= 5.001e-4, "{limit}");
    let [plain, ramped] = [answer(&["turn"]), answer(&["turn", "--config", &file])];
    let time_s = |turn: &Value| turn["least_clearance"]["time_s"].as_f64().expect("a time");
    assert!((time_s(&ramped) - time_s(&plain) - 1.0).abs() < 1e-6, "{plain} {ramped}");
}

/// Fails unless the profile ends at the contact with this clearance.
fn assert_clearance_at_the_end(contact: &Value, clearance_m: f64) {
    let last = contact["profile"].as_array().expect("a profile").last().expect("a last point");
    assert_eq!((&last["time_s"], &last["benches"]), (&contact["time_s"], &contact["benches"]));
    let there_m = last["clearance_m"].as_f64().expect("a clearance");
    assert!((there_m - clearance_m).abs() < 1e-9, "{there_m} m in {last}");
}

#[test]
fn a_given_clearance_is_reached_before_the_contact() {
    let near = answer(&["contact", "--clearance", "0.05", "--profile", "--step", "1000"]);
    assert_eq!(near["clearance_m"], 0.05);
    assert!(near["time_s"].as_f64().expect("a time") < 400.0, "{near}");
    assert_clearance_at_the_end(&near, 0.05);
    // The near miss leaves 0.865 mm: half a millimetre is reached only at the contact, where the guard stops the head.
    let margin = answer(&["contact", "--clearance", "0.0005"]);
    assert_six(&margin["time_s"], 412.454_970);
    assert_eq!(margin["benches"], json!([0, 8]));
    let text = solve(&["contact", "--clearance", "0.05"]).expect_clean().stdout;
    assert!(text.starts_with("first clearance of 0.05 m at 383.867583 s, benches 0 and 14, at ("), "{text}");
}

#[test]
fn a_pitch_that_keeps_a_clearance_keeps_it_to_the_circle() {
    let stage = Stage::new();
    let file = stage.path("roomy.toml").display().to_string();
    let pitch = answer(&["pitch", "--turn-diameter", "9", "--clearance", "0.05", "--save-config", &file]);
    assert!(pitch["pitch_m"].as_f64().expect("a pitch") > 0.48, "{pitch}");
    assert_eq!((&pitch["clearance_m"], &pitch["limit"]["kind"]), (&json!(0.05), &json!("contact")));
    let near = answer(&["contact", "--clearance", "0.0499999", "--config", &file]);
    let poses = answer(&["poses", "--at", &near["time_s"].to_string(), "--config", &file]);
    let head = &poses["poses"][0]["handles"][0];
    let [x, y] = ["x_m", "y_m"].map(|key| head[key].as_f64().expect("a number"));
    assert!(x.hypot(y) < 4.5, "the benches first come nearer inside the circle, with the head at ({x}, {y})");
}

/// A dragon shorter than one turn has no benches beside it: the rule on pitches is the limit.
#[test]
fn the_pitch_of_a_short_dragon_is_limited_by_the_rule_on_pitches() {
    let stage = Stage::new();
    let file = stage.path("short.toml").display().to_string();
    fs::write(&file, "[dragon]\nbenches = 5\n").expect("a file");
    let text = solve(&["pitch", "--config", &file]).expect_clean().stdout;
    let rule =
        "with a smaller pitch, it would not exceed width_m, 0.3: this rule is the limit, not a pair of benches\n";
    assert!(text.starts_with("smallest pitch 0.300000 m") && text.ends_with(rule), "{text}");
}

#[test]
fn a_turn_that_exceeds_a_limit_is_reported_and_not_saved() {
    let stage = Stage::new();
    let file = stage.path("turn.toml").display().to_string();
    for (limit, reason) in [
        (["--clearance", "0.3"], "benches 0 and 16 come within --clearance 0.3 m"),
        (["--max-ratio", "1.5"], "handle 3 is 1.604793 times as fast as the head, over --max-ratio 1.5"),
    ] {
        let ended = solve(&[&["turn", "--format", "json", "--save-config", &file], &limit[..]].concat());
        assert_eq!(ended.code(), Some(1));
        assert_eq!(ended.stderr, format!("error: --save-config has nothing to save: {reason}\n"));
    }
    assert!(!stage.path("turn.toml").exists());
    let near = answer(&["turn", "--clearance", "0.3"]);
    assert_eq!((&near["contact"]["benches"], &near["least_clearance"]), (&json!([0, 16]), &Value::Null));
    let fast = answer(&["turn", "--max-ratio", "1.5"]);
    assert_eq!((&fast["too_fast"]["handle"], &fast["max_ratio"]), (&json!(3), &json!(1.5)));
    let kept = answer(&["turn", "--clearance", "0.25", "--max-ratio", "1.7", "--save-config", &file]);
    assert_eq!((&kept["contact"], kept.get("too_fast")), (&Value::Null, Some(&Value::Null)));
    assert!(stage.path("turn.toml").exists());
}

#[test]
fn a_line_between_the_arcs_is_planned_saved_and_played() {
    let stage = Stage::new();
    let saved = stage.path("line.toml").display().to_string();
    let turn = answer(&["turn", "--turn-line", "2", "--radius-ratio", "1", "--save-config", &saved]);
    assert_eq!((&turn["line_m"], &answer(&["turn"])["line_m"]), (&json!(2.0), &json!(0.0)));
    assert_eq!(answer(&["turn", "--config", &saved]), turn);
    assert!(fs::read_to_string(&saved).expect("a file").contains("turn_line_m = 2.0\n"));
    let text = solve(&["turn", "--turn-line", "2", "--radius-ratio", "1"]).expect_clean().stdout;
    assert!(text.contains("line             2.000000 m between the arcs\n"), "{text}");
}

#[test]
fn the_first_handle_over_a_ratio_is_found_on_any_route() {
    let stage = Stage::new();
    let file = stage.path("turn.toml").display().to_string();
    fs::write(&file, "[route]\nkind = \"turnaround\"\n").expect("a file");
    let limits = ["--clearance", "0.05", "--max-ratio", "1.5"];
    let found = answer(&[&["contact", "--config", &file], &limits[..]].concat());
    assert_eq!((&found["time_s"], &found["max_ratio"]), (&Value::Null, &json!(1.5)));
    let [ratio, time_s] = ["ratio", "time_s"].map(|key| found["too_fast"][key].as_f64().expect("a number"));
    // The largest ratio is reached at 14.480 s.
    assert!((ratio - 1.5).abs() < 1e-6 && time_s > 10.0 && time_s < 14.48, "{found}");
    assert_eq!(answer(&["contact", "--config", &file, "--max-ratio", "1.605"])["too_fast"], Value::Null);
    assert_eq!(answer(&["contact", "--config", &file]).get("too_fast"), None);
}

#[test]
fn the_shortest_turn_leaves_room_and_plays_through_under_the_guard() {
    let stage = Stage::new();
    let (file, saved) = (stage.path("turn.toml").display().to_string(), stage.path("short.toml").display().to_string());
    let route = "[route]\nkind = \"turnaround\"\nstart_s = -10.0\nend_s = 60.0\n";
    fs::write(&file, format!("[dragon]\nbenches = 20\n{route}")).expect("a file");
    let turn = answer(&["turn", "--shortest", "--config", &file, "--save-config", &saved]);
    assert_eq!((&turn["clearance_m"], &turn["max_ratio"]), (&json!(0.05), &json!(2.0)));
    let ratio = turn["largest_ratio"].as_f64().expect("a ratio");
    assert!(ratio <= 2.0 && ratio > 1.99, "{ratio}");
    assert!(turn["least_clearance"]["clearance_m"].as_f64().expect("a clearance") >= 0.05, "{turn}");
    // A line makes the S shorter, and the answer has both.
    let length_m = |turn: &Value| turn["length_m"].as_f64().expect("a length");
    assert!(length_m(&turn["with_line"]) < length_m(&turn["arcs"]), "{turn}");
    assert_eq!((length_m(&turn), &turn["line_m"]), (length_m(&turn["with_line"]), &turn["with_line"]["line_m"]));

    let pace = ["--time-scale", "20", "--rate", "100", "--out", "out", "--format", "json"];
    let ended = stage.run(&[&["show", "--guard", "--config", "short.toml"], &pace[..]].concat());
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    let summary = ended.last_json();
    assert_eq!((&summary["contact"], &summary["guard"]), (&Value::Null, &Value::Null), "the head has not stopped");
    let (frames, _) = crate::record::read(&stage.path("out/recording.mcap"));
    let last = frames.last().expect("frames");
    assert_eq!((last.show_time_ns, last.head_travel_m), (60_000_000_000, 60.0));
}

#[test]
fn a_spiral_and_flags_for_a_turn_make_a_turnaround() {
    let stage = Stage::new();
    let file = stage.path("spiral.toml").display().to_string();
    fs::write(&file, "[route]\npitch_m = 1.7\n").expect("a file");
    let flags = ["--turn-diameter", "9", "--radius-ratio", "2"];
    let turn = answer(&[&["turn", "--config", &file], &flags[..]].concat());
    assert_eq!(turn, answer(&["turn"]));
    let wider = answer(&[&["turn", "--config", &file, "--pitch", "1.8"], &flags[..]].concat());
    assert_ne!(wider["length_m"], turn["length_m"]);
    let limit = answer(&[&["speed-limit", "--limit", "2", "--config", &file], &flags[..]].concat());
    assert_six(&limit["head_speed_mps"], 1.246_266);
    let text = solve(&["speed-limit", "--limit", "2", "--config", &file]).expect_clean().stdout;
    assert!(text.starts_with("infeasible on all of the planned run (--turn-diameter computes"), "{text}");
}

/// The answer is printed even if its figure cannot be written.
#[test]
fn the_answer_is_printed_even_if_its_figure_fails() {
    for (question, begins) in [
        (&["poses", "--at", "0"][..], "at 0 s\n"),
        (&["contact"], "first contact at 412.473838 s"),
        (&["turn"], "entry arc "),
        (&["speed-limit", "--limit", "2"], "the head may walk at 1.246266 m/s"),
    ] {
        let ended = solve(&[question, &["--figure", "/nowhere/figure.svg"]].concat());
        assert_eq!(ended.code(), Some(1), "{question:?}: {}", ended.stderr);
        assert!(ended.stdout.starts_with(begins), "{question:?}: {}", ended.stdout);
        let json = solve(&[question, &["--figure", "/nowhere/figure.svg", "--format", "json"]].concat());
        assert!(json.stdout.starts_with('{') && json.stdout.ends_with("}\n"), "{question:?}: {}", json.stdout);
    }
}

#[test]
fn the_smallest_pitch_has_the_published_value() {
    let pitch = answer(&["pitch", "--turn-diameter", "9"]);
    assert_six(&pitch["pitch_m"], 0.450_337);
    assert_eq!((&pitch["limit"]["kind"], &pitch["infeasible"]), (&json!("contact"), &Value::Null));
}

#[test]
fn the_turn_has_the_published_values() {
    let turn = answer(&["turn"]);
    assert_six(&turn["radii_m"][0], 3.005_418);
    assert_six(&turn["radii_m"][1], 1.502_709);
    assert_six(&turn["length_m"], 13.621_245);
    assert_six(&turn["entry_m"][0], -2.711_856);
    assert_six(&turn["entry_m"][1], -3.591_078);
    assert_six(&turn["exit_m"][1], 3.591_078);
    assert_eq!((&turn["contact"], &turn["infeasible"]), (&Value::Null, &Value::Null));
    assert!(turn["least_clearance"]["clearance_m"].as_f64().expect("a clearance") > 0.0);
}

#[test]
fn the_speed_limit_has_the_published_values() {
    let limit = answer(&["speed-limit", "--limit", "2"]);
    assert_six(&limit["head_speed_mps"], 1.246_266);
    assert_six(&limit["largest_ratio"], 1.604_793);
    assert!((limit["time_s"].as_f64().expect("a time") - 14.480).abs() <= 5.001e-4, "{limit}");
}

#[test]
fn a_saved_speed_limit_is_played_with_every_handle_under_it() {
    let stage = Stage::new();
    let file = stage.path("fast.toml").display().to_string();
    let planned = answer(&["speed-limit", "--limit", "2", "--save-config", &file]);
    // No step is missing, also not the fastest.
    let around = ["--start-at=11", "--until", "12", "--rate", "100", "--time-scale", "0.5", "--catch-up", "0"];
    let server = stage.serve(&[&["--config", "fast.toml", "--readers", "1"], &around[..]].concat());
    let shots = crate::reader::Reader::join(&stage).read_to_end();
    assert_eq!(server.summary()["frames"], shots.len());
    let fastest_mps = shots
        .iter()
        .flat_map(|shot| &shot.handles)
        .map(|handle| handle.velocity_mps[0].hypot(handle.velocity_mps[1]))
        .fold(0.0, f64::max);
    assert!(fastest_mps <= 2.0 + 1e-12 && fastest_mps > 1.999, "{fastest_mps} m/s, planned {planned}");
}

#[test]
fn a_saved_pitch_reaches_the_circle_without_a_contact() {
    let stage = Stage::new();
    let file = stage.path("tightest.toml").display().to_string();
    answer(&["pitch", "--turn-diameter", "9", "--save-config", &file]);
    let contact = answer(&["contact", "--config", &file]);
    let poses = answer(&["poses", "--at", &contact["time_s"].to_string(), "--config", &file]);
    let head = &poses["poses"][0]["handles"][0];
    let [x, y] = ["x_m", "y_m"].map(|key| head[key].as_f64().expect("a number"));
    assert!(x.hypot(y) < 4.5, "the first contact is inside the circle, with the head at ({x}, {y})");
}

#[test]
fn an_infeasible_turn_has_null_answers_and_the_reason() {
    let stage = Stage::new();
    let file = stage.path("tight.toml").display().to_string();
    fs::write(&file, TOO_TIGHT).expect("a file");
    let turn = answer(&["turn", "--config", &file]);
    assert_eq!((&turn["least_clearance"], &turn["contact"]), (&Value::Null, &Value::Null));
    assert!(turn["infeasible"].as_str().expect("a reason").starts_with("handle 1 would stop"), "{turn}");
    let limit = answer(&["speed-limit", "--limit", "2", "--config", &file]);
    assert_eq!((&limit["head_speed_mps"], &limit["time_s"]), (&Value::Null, &Value::Null));
    assert_eq!(limit["infeasible"], turn["infeasible"]);
    let saved = stage.path("saved.toml").display().to_string();
    let ended = solve(&["speed-limit", "--limit", "2", "--config", &file, "--save-config", &saved]);
    assert_eq!(ended.code(), Some(1));
    assert!(ended.stderr.starts_with("error: --save-config has nothing to save: handle 1"), "{}", ended.stderr);
    assert!(!stage.path("saved.toml").exists());
}

#[test]
fn a_spiral_that_never_touches_has_no_contact() {
    let stage = Stage::new();
    let file = stage.path("wide.toml").display().to_string();
    fs::write(&file, "[dragon]\nbenches = 4\n[route]\npitch_m = 2.0\nstart_turns = 4\n").expect("a file");
    let contact = answer(&["contact", "--config", &file]);
    assert!(contact.as_object().expect("an object").values().all(Value::is_null), "{contact}");
}

#[test]
fn impossible_questions_are_refused_in_one_line() {
    let stage = Stage::new();
    let file = stage.path("spiral.toml").display().to_string();
    fs::write(&file, "").expect("a file");
    let told = "[route] kind is \"spiral\", must be \"turnaround\" for a question about a turn; \
                --turn-diameter, --radius-ratio or --pitch makes it one";
    assert_eq!(refusal(&["turn", "--config", &file]), format!("error: {file}: {told}"));
    for (args, start) in [
        (&["pitch", "--turn-diameter", "-1"][..], "error: turn_diameter_m is -1, must be above 0.0286"),
        (&["pitch", "--turn-diameter", "1e6"], "error: turn_diameter_m is 1000000, must be above 0.0286"),
        (&["turn", "--radius-ratio", "0"], "error: [route] radius_ratio is 0, must be from 0.01 to 100"),
        (&["turn", "--pitch", "0.1"], "error: pitch_m is 0.1, must be above width_m 0.3"),
        (&["speed-limit", "--limit", "0"], "error: invalid value '0' for '--limit <MPS>': must be from 0.001 to 1000"),
        (&["contact", "--step", "1"], "error: "),
        (
            &["contact", "--clearance", "-0.1"],
            "error: invalid value '-0.1' for '--clearance <METRES>': must be from 0 to 10",
        ),
        (
            &["pitch", "--clearance", "nan"],
            "error: invalid value 'nan' for '--clearance <METRES>': must be from 0 to 10",
        ),
        (
            &["turn", "--max-ratio", "0.9"],
            "error: invalid value '0.9' for '--max-ratio <RATIO>': must be from 1 to 1000",
        ),
        (&["contact", "--profile", "--step", "1e-9"], "error: --step is 0.000000001"),
        (
            &["contact", "--profile", "--step", "0.0001"],
            "error: --step is 0.0001, which makes 4124739 times, must make at most 1000000: try --step 0.0005",
        ),
        (
            &["poses", "--from", "0", "--to", "400", "--step", "0.01"],
            "error: --step is 0.01, which makes 40001 times from 0 to 400, must make at most 4464: try --step 0.1",
        ),
    ] {
        let told = refusal(args);
        assert!(told.starts_with(start), "{args:?}: {told}");
    }
}

#[test]
fn the_answer_is_printed_before_its_profile_with_the_singular_for_one_near_miss() {
    let text = solve(&["contact", "--profile", "--step", "100", "--near", "0.001"]).expect_clean().stdout;
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines[0].starts_with("first contact at 412.473838 s, benches 0 and 8"), "{text}");
    assert_eq!(lines[1], "1 near miss", "{text}");
    assert!(lines[2].contains("0.000865"), "{text}");
    assert_eq!(lines[4].split_whitespace().collect::<Vec<_>>(), ["s", "clearance", "m", "benches"], "{text}");
    assert_eq!(lines.len(), 5 + 6, "the profile has six times: {text}");
}
