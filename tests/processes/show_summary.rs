//! The summary of a show: it covers the whole show, in a folder without files of another show.

use std::fs;

use bench_dragon::system::clock::monotonic_ns;
use rustix::process::Signal;
use serde_json::{Value, json};
use test_support::children::{await_child, kill, send};
use test_support::eventually::eventually;

use crate::show::{CALM, Playing};
use crate::stage::Stage;

#[test]
fn the_summary_covers_the_lateness_and_latency_of_all_servers_and_monitors() {
    let playing = Playing::start(&["--auto-resume"]);
    let pid = playing.show.pid();
    let server = await_child(pid, "serve", None);
    // A suspended server is late by the suspension once, and so is the monitor's frame.
    playing.await_status(|status| status.tick >= 60);
    send(server, Signal::STOP).expect("the process runs");
    let until_ns = monotonic_ns() + 500_000_000;
    eventually("the server has been stopped for long enough", || (monotonic_ns() >= until_ns).then_some(()));
    send(server, Signal::CONT).expect("the process is stopped");
    let late = playing.await_status(|status| status.lateness_max_ns > 400_000_000);
    // The monitor reports five times a second.
    let late = playing.await_status(|status| status.tick > late.tick + 150);
    kill(server);
    kill(await_child(pid, "monitor", None));
    await_child(pid, "serve", Some(server));
    let again = playing.await_status(|status| status.run_id != late.run_id && status.tick >= 60);
    // A server counts one lateness per tick: those of the killed server are not included.
    let (counted, tick) = (again.lateness.count(), again.tick);
    assert!(counted < late.tick + tick, "{counted} ticks at tick {tick}: those of the killed server are included");

    let (summary, _) = playing.interrupt();
    let micros = |kind: &str, share: &str| summary[kind][share].as_f64().expect("a number");
    assert!(micros("lateness_us", "max") >= late.lateness_max_ns as f64 / 1e3, "{summary}");
    assert!(micros("latency_us", "max") >= 400_000.0, "{summary}");
    for kind in ["lateness_us", "latency_us"] {
        assert!(micros(kind, "p50") < micros(kind, "max"), "{summary}");
    }
    assert_eq!(summary["restarts"], json!({ "serve": 1, "monitor": 1, "record": 0, "view": 0 }));
    for entry in summary["restart_log"].as_array().expect("a list") {
        assert_eq!(entry["reason"], "signal: 9 (SIGKILL)", "{summary}");
        assert!(entry["show_time_s"].as_f64().is_some_and(|time_s| time_s > 101.0), "{summary}");
        let at = entry["at"].as_str().expect("a text");
        at.parse::<jiff::Timestamp>().unwrap_or_else(|error| panic!("{at}: {error}"));
    }
}

#[test]
fn the_report_has_a_line_for_each_restart() {
    let stage = Stage::new();
    let show = stage.start(&[&CALM[..], &["text", "--out", "out"]].concat());
    let recorder = await_child(show.pid(), "record", None);
    crate::record::await_frames(&stage.path("out/recording.mcap"));
    kill(recorder);
    await_child(show.pid(), "record", Some(recorder));
    show.signal(Signal::INT);
    let ended = show.end();
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    let lines: Vec<&str> = ended.stdout.lines().collect();
    let at = lines.iter().position(|line| line.starts_with("restarts        0 serve, 0 monitor, 1 record"));
    let line = lines[at.unwrap_or_else(|| panic!("{}", ended.stdout)) + 1].trim();
    assert!(line.starts_with("record at 10") && line.ends_with(": signal: 9 (SIGKILL)"), "{line}");
}

#[test]
fn a_folder_of_an_earlier_show_is_refused_and_keeps_its_files() {
    let stage = Stage::new();
    let show = [&CALM[..], &["json", "--until", "100.1", "--out", "out"]].concat();
    let refused = |file: &str| {
        let ended = stage.run(&show);
        let advice = "name another folder, or move that file away";
        assert_eq!(ended.stderr, format!("error: --out is out, which has {file} of an earlier show: {advice}\n"));
        assert_eq!(ended.code(), Some(2));
    };
    // An existing folder with other files is not a show's folder.
    fs::create_dir(stage.path("out")).expect("a folder");
    fs::write(stage.path("out/notes.txt"), "ours").expect("a file");
    assert_eq!(stage.run(&show).code(), Some(0));
    let files = ["config.toml", "summary.json"].map(|name| stage.path("out").join(name));
    let kept = files.each_ref().map(|file| fs::read(file).expect("a file of the show"));
    refused("config.toml");
    assert_eq!(files.each_ref().map(|file| fs::read(file).expect("the file still exists")), kept);
    fs::remove_file(&files[0]).expect("it is there");
    refused("summary.json");
    assert!(!files[0].exists());
    assert_eq!(fs::read(&files[1]).expect("the file still exists"), kept[1]);
}

#[test]
fn a_show_that_does_not_begin_leaves_its_folder_to_the_next() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "50"]);
    let show = [&CALM[..], &["json", "--until", "100.1", "--out", "out"]].concat();
    assert_eq!(stage.run(&show).code(), Some(1), "another server runs");
    assert!(!stage.path("out").exists());
    server.stop();
    let ended = stage.run(&show);
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    assert_eq!(ended.last_json()["contact"], Value::Null);
}
