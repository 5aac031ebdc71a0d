//! `solve profile`: the quickest show under limits, and the configuration that plays it.

use std::ffi::OsStr;
use std::fs;

use bench_dragon::config::Config;
use bench_dragon_geometry::dragon::ChainSolver;
use serde_json::Value;
use test_support::process::{Ended, Process};
use test_support::pytest;

use crate::stage::{Stage, program};

/// A short dragon on the paper's turnaround.
const SHORT: &str = "[dragon]\nbenches = 20\n[route]\nkind = \"turnaround\"\nend_s = 60\n[head]\naccel_mps2 = 0.4\n";

fn run(stage: &Stage, args: &[&str]) -> Ended {
    let mut command = program(&[&["solve", "profile"], args].concat());
    command.current_dir(stage.path(""));
    Process::start(command).end()
}

fn answer(stage: &Stage, args: &[&str]) -> Value {
    run(stage, &[args, &["--format", "json"]].concat()).expect_clean().last_json()
}

fn stage_with(text: &str) -> Stage {
    let stage = Stage::new();
    fs::write(stage.path("asked.toml"), text).expect("a configuration");
    stage
}

#[track_caller]
fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn the_papers_turnaround_is_a_third_quicker_than_at_the_best_constant_speed() {
    let stage = Stage::new();
    let asked = ["--limit", "2", "--accel", "0.5"];
    let found = answer(&stage, &asked);
    assert!((number(&found["constant_speed_mps"]) - 1.246_266).abs() <= 5.001e-7, "{found}");
    let [duration_s, optimum_s, least_s, constant_s] =
        ["duration_s", "optimum_s", "least_s", "constant_s"].map(|key| number(&found[key]));
    assert!(duration_s >= optimum_s && duration_s <= 1.01 * optimum_s, "{duration_s} {optimum_s}");
    assert!(least_s <= optimum_s && optimum_s <= 1.0002 * least_s, "{least_s} {optimum_s}");
    assert!((1.0 - duration_s / constant_s - number(&found["gain"])).abs() < 1e-12 && number(&found["gain"]) > 0.32);
    let largest_mps = number(&found["largest_speed_mps"]);
    assert!(largest_mps > 1.99 && largest_mps <= 2.0 * (1.0 + 1e-9), "{largest_mps}");
    let cues = |found: &Value| found["cues"].as_array().expect("cues").len();
    let few = answer(&stage, &[&asked[..], &["--within", "8%"]].concat());
    assert!(cues(&few) < 10 && cues(&found) > 100, "{few}");
    assert!(number(&few["duration_s"]) <= 1.08 * optimum_s && number(&few["gain"]) > 0.25, "{few}");
    let text = run(&stage, &[&asked[..], &["--within", "8"]].concat()).expect_clean().stdout;
    assert!(text.contains("at the best constant speed, 1.246266 m/s, it takes 390.281 s: the cues save"), "{text}");
}

#[test]
fn the_saved_show_has_the_cues_and_walks_the_same_part_of_the_route() {
    let stage = stage_with(SHORT);
    let asked = ["--limit", "1.5", "--config", "asked.toml", "--within", "3", "--save-config", "saved.toml"];
    let found = answer(&stage, &asked);
    let text = fs::read_to_string(stage.path("saved.toml")).expect("a configuration");
    let saved: toml::Table = text.parse().expect("TOML");
    let value = |table: &str, key: &str| saved[table][key].as_float().expect("a number");
    let [first, rest @ ..] = found["cues"].as_array().expect("cues").as_slice() else { panic!("{found}") };
    assert_eq!((value("head", "speed_mps"), value("head", "accel_mps2")), (number(&first["speed_mps"]), 0.4));
    assert_eq!(value("route", "start_s"), number(&first["at_s"]));
    let travel_m = |key: &str| value("route", key) * value("head", "speed_mps");
    assert!((travel_m("start_s") + 100.0).abs() < 1e-9 && (travel_m("end_s") - 60.0).abs() < 1e-9, "{text}");
    let cues = saved["cues"].as_array().expect("cues");
    assert_eq!((cues.len(), rest.is_empty()), (rest.len(), false));
    for (index, (cue, asked)) in cues.iter().zip(rest).enumerate() {
        assert_eq!(cue["name"].as_str(), Some(&*format!("profile {}", index + 1)));
        let pair = ["at_s", "speed_mps"].map(|key| cue[key].as_float().expect("a number"));
        assert_eq!(pair, ["at_s", "speed_mps"].map(|key| number(&asked[key])));
    }
    let config = Config::from_toml(&text).expect("a show that a server plays");
    let duration_s = config.end_s() - config.start_s();
    assert!((duration_s - number(&found["duration_s"])).abs() < 1e-6, "{duration_s} s, {found}");
    assert_eq!(config.timetable().travel_m(config.end_s()), config.lead().end_travel_m());
    for (cue, next) in config.cues().iter().zip(&config.cues()[1..]) {
        assert_eq!(
            Some(config.timetable().speed_mps(next.at_s)),
            cue.speed_mps,
            "the ramp of {cue:?} ends before the next"
        );
    }
}

/// The night of the example: two of its cues wait, and others change the speed.
#[test]
fn a_night_with_waits_rests_at_them_and_keeps_its_cues() {
    let stage = Stage::new();
    let night = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/night.toml");
    let asked = ["--limit", "1.6", "--within", "2", "--config", night, "--save-config", "saved.toml"];
    let found = answer(&stage, &asked);
    let waits = |cue: &&Value| cue["waits"] == true;
    assert_eq!(found["cues"].as_array().expect("cues").iter().filter(waits).count(), 2, "{found}");
    assert!(number(&found["duration_s"]) <= 1.02 * number(&found["optimum_s"]), "{found}");
    let text = run(&stage, &asked[..6]).expect_clean().stdout;
    assert_eq!(text.matches(", after GO").count(), 2, "{text}");

    let saved = fs::read_to_string(stage.path("saved.toml")).expect("a configuration");
    let [planned, quick] = [fs::read_to_string(night).expect("the example"), saved.clone()]
        .map(|text| Config::from_toml(&text).expect("a show that a server plays"));
    let duration_s = quick.end_s() - quick.start_s();
    assert!((duration_s - number(&found["duration_s"])).abs() < 1e-6, "{duration_s} s, {found}");
    for cue in planned.cues() {
        let kept = quick.cues().iter().find(|kept| kept.name == cue.name).expect("each cue is kept");
        assert_eq!((&kept.note, kept.waits), (&cue.note, cue.waits));
        let travels_m = [planned.timetable().travel_m(cue.at_s), quick.timetable().travel_m(kept.at_s)];
        assert!((travels_m[0] - travels_m[1]).abs() < 1e-6, "{}: {travels_m:?}", cue.name);
        assert!(!cue.waits || quick.timetable().speed_mps(kept.at_s) == 0.0, "{} rests", cue.name);
    }
    let (dragon, mut solver) = (quick.lead(), ChainSolver::new(quick.lead()));
    for step in 0..=20_000 {
        let time_s = quick.start_s() + duration_s * f64::from(step) / 20_000.0;
        let handles = solver.solve(dragon, quick.timetable().travel_m(time_s)).expect("within the run");
        let ratio = handles.iter().map(|handle| handle.speed_ratio).fold(0.0, f64::max);
        let fastest_mps = ratio * quick.timetable().speed_mps(time_s);
        assert!(fastest_mps <= 1.6 * (1.0 + 1e-9), "{fastest_mps} m/s at {time_s} s");
    }
    // An answer about the answer keeps the same cues.
    let again = ["--limit", "1.6", "--within", "2", "--config", "saved.toml", "--save-config", "again.toml"];
    let again_s = number(&answer(&stage, &again)["duration_s"]);
    assert!((again_s / duration_s - 1.0).abs() < 0.02, "{again_s} {duration_s}");
    let again = Config::from_toml(&fs::read_to_string(stage.path("again.toml")).expect("a file")).expect("a show");
    assert_eq!(again.cues().iter().filter(|cue| cue.waits).count(), 2);
}

#[test]
fn the_profile_is_drawn_with_its_limit_and_its_optimum() {
    let stage = stage_with(SHORT);
    let asked = ["--limit", "1.5", "--speed", "1.4", "--config", "asked.toml", "--figure", "profile.svg"];
    let ended = run(&stage, &asked).expect_clean();
    assert!(ended.stdout.ends_with("drawn to profile.svg\n"), "{}", ended.stdout);
    let figure = fs::read_to_string(stage.path("profile.svg")).expect("the figure is text");
    for label in ["limit of the head, for handles at 1.5 m/s", "travel (m)", "speed (m/s)"] {
        assert!(figure.contains(&format!("aria-label=\"{label}\"")), "{label}");
    }
    // Once in the legend, and once in each plot.
    assert_eq!((figure.matches("aria-label=\"quickest, ").count(), figure.contains(" cues, ")), (3, true));
}

#[test]
fn questions_without_a_profile_get_the_reason() {
    let two = "[[dragons]]\nname = \"gold\"\n[[dragons]]\nname = \"silver\"\n[dragons.route]\nstart_x_m = 90\n";
    let stands = &format!(
        "{SHORT}[[cues]]\nname = \"stand\"\nat_s = 10\nspeed_mps = 0\n[[cues]]\nname = \"on\"\nat_s = 20\nspeed_mps = 1\n"
    );
    let hill = "[dragon]\nbenches = 3\n[ground]\nrise_x = 0.1\n";
    for (text, args, line) in [
        ("", &["--limit", "2"][..], "--accel is absent, must be present: [head] accel_mps2 is not configured either"),
        (SHORT, &["--limit", "2", "--within", "0"], "must be from 0.1% to 100%"),
        (SHORT, &["--limit", "2", "--speed", "11"], "must be from 0.001 to 10"),
        (two, &["--limit", "2", "--accel", "1"], "[[dragons]] has 2 dragons, must be absent for solve profile"),
        (
            stands,
            &["--limit", "2"],
            "[[cues]] \"stand\": speed_mps is 0, must be above 0 for solve profile; `wait = true` lets the show stand there",
        ),
        (hill, &["--limit", "2", "--accel", "1"], "[ground] is present, must be absent for solve profile"),
    ] {
        let ended = run(&stage_with(text), &[args, &["--config", "asked.toml"]].concat());
        assert_eq!((ended.code(), ended.stderr.lines().count()), (Some(2), 1), "{}", ended.stderr);
        assert!(ended.stderr.contains(line), "{}", ended.stderr);
    }
    let stage = stage_with("[route]\nkind = \"turnaround\"\nradius_ratio = 3\n[head]\naccel_mps2 = 1\n");
    let asked = ["--limit", "2", "--config", "asked.toml"];
    let found = answer(&stage, &asked);
    assert_eq!((&found["duration_s"], &found["cues"]), (&Value::Null, &serde_json::json!([])));
    assert!(found["infeasible"].as_str().expect("a reason").contains("handle 1 would stop"), "{found}");
    let ended = run(&stage, &[&asked[..], &["--save-config", "saved.toml"]].concat());
    assert_eq!(ended.code(), Some(1), "{}", ended.stderr);
    assert!(ended.stderr.contains("--save-config has nothing to save: handle 1 would stop"), "{}", ended.stderr);
    let asked = ["--limit", "2", "--accel", "1", "--work", "1"];
    let found = answer(&Stage::new(), &asked);
    assert!(found["undecided"].as_str().expect("a reason").contains("steps of work is reached"), "{found}");
}

#[test]
fn toppra_finds_the_same_optimum() {
    pytest::run("test_profile.py", &[("BENCH_DRAGON", OsStr::new(env!("CARGO_BIN_EXE_bench-dragon")))]);
}
