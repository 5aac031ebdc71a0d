//! A show on the turnaround. The head enters the turning circle at t = 0, so the show times begin below 0.

use std::fs;

use bench_dragon::config::Config;
use bench_dragon_geometry::dragon::ChainSolver;
use bench_dragon_ipc::FrameHeader;
use serde_json::{Value, json};
use test_support::process::Process;

use crate::periods::{assert_no_frame_missing, period};
use crate::poses::assert_near;
use crate::reader::{Reader, assert_whole};
use crate::record;
use crate::stage::{Stage, program};

/// One show second a tick, slow enough for a reader's buffer to hold the whole show.
const RATE_HZ: u64 = 50;
const PACE: [&str; 6] = ["--rate", "50", "--time-scale", "50", "--catch-up", "10"];

/// Returns a stage with a turnaround's configuration, with these additional lines in its route.
fn stage_with(route: &str) -> Stage {
    let stage = Stage::new();
    fs::write(stage.path("turn.toml"), format!("[route]\nkind = \"turnaround\"\n{route}\n")).expect("a file");
    stage
}

#[test]
fn a_show_plays_the_turnaround_from_its_start_to_its_end() {
    let stage = stage_with("");
    let show = ["show", "--config", "turn.toml", "--out", "out", "--format", "json"];
    let summary = stage.run(&[&show[..], &PACE].concat()).expect_clean().last_json();
    assert_eq!(summary["contact"], Value::Null);
    let frames = &summary["frames"];
    assert_eq!((&frames["missed_by_monitor"], &frames["missed_by_recorder"]), (&json!(0), &json!(0)));
    let (recorded, was_cut) = record::read(&stage.path("out/recording.mcap"));
    assert!(!was_cut);
    assert!(recorded.iter().enumerate().all(|(tick, header)| header.tick == tick as u64));
    let planned_s = |header: &FrameHeader| (period(&recorded[0], header, RATE_HZ) as i64 - 100).min(100);
    let is_planned = |header: &&FrameHeader| header.show_time_ns == planned_s(header) * 1_000_000_000;
    assert_eq!(
        recorded.iter().find(|header| !is_planned(header)),
        None,
        "one second per period, and the last frame at the end"
    );
    assert!(recorded.last().is_some_and(|header| header.show_time_ns == 100_000_000_000));
}

#[test]
fn every_handle_on_the_turn_equals_the_solution() {
    let stage = stage_with("");
    let serve = ["--config", "turn.toml", "--start-at=-20", "--until", "60", "--readers", "1"];
    let server = stage.serve(&[&serve[..], &PACE].concat());
    let shots = Reader::join(&stage).read_to_end();
    assert_whole(&shots, server.run_id);
    let served = server.summary();
    assert_no_frame_missing(&served, 81);
    assert_eq!(served["frames"], shots.len());
    let text = fs::read_to_string(stage.path("turn.toml")).expect("the configuration");
    let dragon = Config::from_toml(&text).expect("a turnaround").lead().clone();
    let mut solver = ChainSolver::new(&dragon);
    for shot in &shots {
        let chain = solver.solve(&dragon, shot.header.head_travel_m).expect("the travel is in the run");
        for (live, solved) in shot.handles.iter().zip(chain) {
            assert_near(live.position_m, solved.position);
        }
    }
}

#[test]
fn a_contact_on_the_turn_is_the_planned_one() {
    let stage = stage_with("pitch_m = 0.5");
    let mut solve = program(&["solve", "contact", "--format", "json", "--config"]);
    solve.arg(stage.path("turn.toml"));
    let planned = Process::start(solve).end().expect_clean().last_json();
    let show = ["show", "--config", "turn.toml", "--start-at=5", "--out", "out", "--format", "json"];
    let summary = stage.run(&[&show[..], &["--rate", "50", "--time-scale", "5"]].concat()).last_json();
    assert_eq!(summary["contact"]["benches"], planned["benches"]);
    let [live_s, planned_s] =
        [&summary["contact"]["time_s"], &planned["time_s"]].map(|time| time.as_f64().expect("a time"));
    assert!((live_s - planned_s).abs() < 2e-9, "{live_s} s live, {planned_s} s planned");
}

#[test]
fn a_server_on_a_turn_that_is_too_tight_reports_where_and_why_the_run_ends() {
    let stage = stage_with("radius_ratio = 3.0");
    let ended = stage.run(&["serve", "--config", "turn.toml", "--start-at", "12", "--until", "12.5", "--rate", "100"]);
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    let warning = "the run ends at 12.961438 s, not at end_s 100: there handle 1 would stop and walk backwards";
    assert!(ended.stderr.contains(warning), "{}", ended.stderr);
    let refused = stage.run(&["serve", "--config", "turn.toml", "--until", "15"]);
    assert_eq!(refused.code(), Some(2));
    assert!(refused.stderr.contains("--until is 15, must be from -100 to 12.96143"), "{}", refused.stderr);
}

#[test]
fn a_seek_may_go_below_zero_but_not_before_the_start() {
    let stage = stage_with("");
    let server = stage.serve(&["--config", "turn.toml", "--held"]);
    assert_eq!(stage.run(&["ctl", "seek", "-50"]).code(), Some(0));
    let frame = stage.run(&["echo", "--count", "1", "--format", "json"]).expect_clean().last_json();
    assert_eq!((&frame["sim_time_ns"], &frame["head_travel_m"]), (&json!(-50_000_000_000_i64), &json!(-50.0)));
    let refused = stage.run(&["ctl", "seek", "-100.5"]);
    assert_eq!(refused.code(), Some(1));
    let reply = format!("{}{}", refused.stdout, refused.stderr);
    assert_eq!(reply.trim(), "refused: the show time is -100.5 s, must be from -100 to 100 s");
    server.process.terminate().expect_clean();
}
