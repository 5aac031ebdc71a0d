//! `hand-over`: its files are whole, stock readers read them, and the page plays the poses of the planner in a browser.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};
use test_support::process::{Ended, Process};
use test_support::pytest;

use crate::browser::{Browser, View};
use crate::stage::{Stage, program};

/// Two dragons with a crowd, ramps, and cues of which one waits.
const SHOW: &str = "[[dragons]]\nname = \"gold\"\nbenches = 12\ncolour = \"#c8a04a\"\n[dragons.route]\nkind = \"path\"\n\
    segments = [{ kind = \"line\", length_m = 6 }, { kind = \"arc\", radius_m = 5, turn_deg = 200 }, { kind = \"line\", length_m = 9 }]\n\
    [dragons.head]\naccel_mps2 = 0.5\n\
    [[dragons]]\nname = \"silver\"\nbenches = 7\n[dragons.route]\nkind = \"path\"\nstart_y_m = 20\n\
    segments = [{ kind = \"line\", length_m = 12 }, { kind = \"arc\", radius_m = 3, turn_deg = -90 }, { kind = \"line\", length_m = 2 }]\n\
    [dragons.head]\nstart_s = 4\naccel_mps2 = 0.5\n\
    [stage]\noutline = [[-40, -20], [40, -20], [40, 40], [-40, 40]]\ncrowd = [[-40, -15], [40, -15]]\n\
    [[cues]]\nname = \"slow <b>\"\nat_s = 8\nspeed_mps = 0.5\nnote = \"lights & 14\"\n[[cues]]\nname = \"bow\"\nat_s = 15\nwait = true\n";

fn hand_over(stage: &Stage, args: &[&str]) -> Ended {
    let mut command = program(&[&["hand-over"], args].concat());
    command.current_dir(stage.path(""));
    Process::start(command).end()
}

/// The poses that the planner computes at these times.
fn poses(stage: &Stage, config: Option<&str>, times: &str) -> Value {
    let config = config.map_or(vec![], |config| vec!["--config", config]);
    let mut command = program(&[&["solve", "poses", "--format", "json", "--at", times], &config[..]].concat());
    command.current_dir(stage.path(""));
    Process::start(command).end().expect_clean().last_json()
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    let mut names: Vec<_> =
        entries.map(|entry| entry.expect("an entry").file_name().into_string().expect("UTF-8")).collect();
    names.sort();
    names
}

const ALL: [&str; 15] = [
    "benches.csv",
    "benches.html",
    "config.toml",
    "floor.csv",
    "floor.dxf",
    "floor.pdf",
    "floor.png",
    "floor.svg",
    "moments.pdf",
    "plan.pdf",
    "plan.png",
    "plan.svg",
    "poses.csv",
    "poses.xlsx",
    "show.html",
];

#[test]
fn stock_readers_read_the_files_of_a_show_with_two_dragons() {
    let stage = Stage::new();
    fs::write(stage.path("two.toml"), SHOW).expect("the folder is writable");
    let ended = hand_over(&stage, &["two.toml", "--out", "crew", "--at", "10", "--format", "json"]).expect_clean();
    let report = ended.last_json();
    assert_eq!(names(&stage.path("crew")), ALL);
    assert_eq!((&report["left_out"], &report["contact_s"]), (&json!([]), &Value::Null));
    for file in report["files"].as_array().expect("a list") {
        let path = stage.path("crew").join(file["file"].as_str().expect("a name"));
        assert_eq!(fs::metadata(&path).expect("the file").len(), file["bytes"].as_u64().expect("a size"), "{file}");
    }
    let rows = fs::read_to_string(stage.path("crew/floor.csv")).expect("text");
    let mut times: Vec<&str> = rows.lines().skip(1).map(|row| row.split(',').nth(2).expect("a time")).collect();
    times.dedup();
    assert_eq!(times.len(), 5, "start, two cues, --at, end: {times:?}");
    let solved = poses(&stage, Some("two.toml"), &times.join(","));
    fs::write(stage.path("crew/solved.json"), solved.to_string()).expect("the folder is writable");
    pytest::run("test_hand_over.py", &[("HAND_OVER", stage.path("crew").as_os_str())]);
    // The written configuration is the same show.
    let again = poses(&stage, Some("crew/config.toml"), &times.join(","));
    assert_eq!(again, solved);
}

/// A search that was not finished is no promise, and no file of an earlier plan stays beside a later one.
#[test]
fn what_was_not_searched_is_said_and_a_file_that_is_left_out_does_not_stay() {
    let stage = Stage::new();
    fs::write(stage.path("two.toml"), SHOW).expect("the folder is writable");
    hand_over(&stage, &["two.toml", "--out", "crew"]).expect_clean();
    // Ten dragons of 300 benches that all leave at once have more pairs than this work allows.
    let at_once = include_str!("../../examples/square.toml").lines().map(|line| match line.split(' ').next() {
        Some("start_s") => "start_s = 0",
        Some("benches") => "benches = 300",
        _ => line,
    });
    fs::write(stage.path("ten.toml"), at_once.collect::<Vec<_>>().join("\n")).expect("the folder is writable");
    let ended = hand_over(&stage, &["ten.toml", "--work", "1", "--step", "0.001", "--out", "crew"]).expect_clean();
    assert!(
        ended.stdout.contains("attention      no contact before 0.000 s; not searched further"),
        "{}",
        ended.stdout
    );
    assert!(ended.stdout.contains("left out"), "{}", ended.stdout);
    assert!(!stage.path("crew/poses.csv").exists(), "the poses of the earlier plan are still there");
    let sheets = fs::read_to_string(stage.path("crew/benches.html")).expect("text");
    assert!(sheets.contains("not searched further"), "the sheets promise that no benches touch");
}

#[test]
fn the_sheets_of_benches_have_the_speeds_of_the_planner_up_to_the_end() {
    let stage = Stage::new();
    hand_over(&stage, &["--out", "crew"]).expect_clean();
    let sheets = fs::read_to_string(stage.path("crew/benches.csv")).expect("text");
    let rows: Vec<Vec<&str>> = sheets.lines().map(|line| line.split(',').collect()).collect();
    let column = |name: &str| rows[0].iter().position(|column| *column == name).expect("a column");
    let (bench, time, speed) = (column("bench"), column("time_s"), column("speed_mps"));
    let of_head = rows.iter().filter(|row| row[bench] == "0");
    let times: Vec<&str> = of_head.map(|row| row[time]).collect();
    assert_eq!(times.len(), 3, "start, contact and end: {times:?}");
    let solved = poses(&stage, None, &times.join(","));
    for row in &rows[1..] {
        let at = times.iter().position(|other| *other == row[time]).expect("a moment");
        let index: usize = row[bench].parse().expect("a number");
        let exact = solved["poses"][at]["handles"][index]["speed_mps"].as_f64().expect("a speed");
        assert_eq!(row[speed].parse::<f64>().expect("a speed"), exact, "{row:?}");
    }
}

#[test]
fn the_page_draws_the_poses_of_the_planner_in_a_browser_from_a_file() {
    let Some(browser) = Browser::find() else { return };
    let stage = Stage::new();
    fs::write(stage.path("two.toml"), SHOW).expect("the folder is writable");
    for (config, times) in [(Some("two.toml"), "0,3.25,8,9.5,15,16.125"), (None, "0,0.3,123.456,300,412.5")] {
        let out = if config.is_some() { "two" } else { "paper" };
        let args = [config.as_slice(), &["--out", out, "--format", "json"]].concat();
        hand_over(&stage, &args).expect_clean();
        let solved = stage.path("solved.json");
        fs::write(&solved, poses(&stage, config, times).to_string()).expect("the folder is writable");
        let page = format!("file://{}", stage.path(out).join("show.html").display());
        let solved = solved.to_str().expect("UTF-8");
        let scenario =
            browser.play("hand_over_plays.mjs", &[&page, solved, if config.is_some() { "two" } else { "paper" }]);
        scenario.end().expect_clean();
    }
}

#[test]
fn the_planners_page_offers_the_files_of_the_plan_as_it_is_drawn() {
    let Some(browser) = Browser::find() else { return };
    let stage = Stage::new();
    let text = "[route]\nkind = \"path\"\nsegments = [{ kind = \"line\", length_m = 12 }]\n";
    fs::write(stage.path("line.toml"), text).expect("the folder is writable");
    hand_over(&stage, &["line.toml", "--out", "crew"]).expect_clean();
    let config = stage.path("line.toml").display().to_string();
    let plan = Process::start(program(&["plan", &config, "--listen", "127.0.0.1:0", "--format", "json"]));
    let planner = View::announced_by(plan);
    let crew = stage.path("crew").display().to_string();
    browser.play("planner_hands_over.mjs", &[&planner.url, &crew]).end().expect_clean();
    planner.process.terminate().expect_clean();
}

#[test]
fn a_file_that_would_be_too_large_is_left_out_with_the_reason() {
    let stage = Stage::new();
    let long =
        "[dragon]\nbenches = 30000\n[route]\nkind = \"path\"\nsegments = [{ kind = \"line\", length_m = 400 }]\n";
    fs::write(stage.path("long.toml"), long).expect("the folder is writable");
    let report = hand_over(&stage, &["long.toml", "--out", "long", "--format", "json"]).expect_clean().last_json();
    let left_out = report["left_out"].as_array().expect("a list");
    let reason = |file: &str| {
        let found = left_out.iter().find(|left| left["file"] == file).unwrap_or_else(|| panic!("{file} in {report}"));
        found["because"].as_str().expect("a reason").to_owned()
    };
    assert!(reason("show.html").starts_with("it would need a key frame every 0.5 m"), "{report}");
    assert!(reason("benches.html").contains("at most 3000"), "{report}");
    assert!(reason("poses.xlsx").starts_with("--step is 1, which makes more than 33 times"), "{report}");
    assert!(names(&stage.path("long")).contains(&"plan.pdf".to_owned()));
    assert!(!stage.path("long/show.html").exists());
}

#[test]
fn bad_input_is_refused_in_one_line_before_anything_is_written() {
    let stage = Stage::new();
    fs::write(stage.path("config.toml"), SHOW).expect("the folder is writable");
    fs::write(stage.path("file"), "").expect("the folder is writable");
    let times = (1..=70).map(|time| time.to_string()).collect::<Vec<_>>().join(",");
    for (args, expected) in [
        (
            &["config.toml", "--out", "."][..],
            "--out would replace ./config.toml, the configuration: choose another folder",
        ),
        (&["--out", "new", "--at", "500"], "--at is 500, must be from 0 to 432.758134083"),
        (&["--out", "new", "--at", &times], "start, cues, --at and end are 73 moments, at most 60 are allowed"),
        (&["--out", "file/new"], "--out is file/new, must be a folder that can be created"),
        (&["--out", "new", "--step", "0"], "invalid value '0' for '--step <SECONDS>': must be from 0.001 to 1000"),
        (&["missing.toml", "--out", "new"], "missing.toml"),
    ] {
        let ended = hand_over(&stage, args);
        assert_eq!((ended.code(), ended.stdout.as_str()), (Some(2), ""), "{args:?}: {}", ended.stderr);
        assert!(ended.stderr.starts_with(&format!("error: {expected}")), "{}", ended.stderr);
        assert_eq!(ended.stderr.lines().count(), 1, "{}", ended.stderr);
    }
    assert_eq!(names(&stage.path("")), ["config.toml", "file"]);
}
