//! SIGINT and SIGTERM end every long-running command cleanly.

use std::fs;

use rustix::process::Signal;
use serde_json::json;
use test_support::process::Process;

use crate::reader::{Reader, assert_whole};
use crate::stage::{Stage, program};

const SIGNALS: [Signal; 2] = [Signal::INT, Signal::TERM];

#[test]
fn a_signal_ends_a_server_with_its_summary() {
    for signal in SIGNALS {
        let stage = Stage::new();
        let server = stage.serve(&["--rate", "100", "--readers", "1"]);
        let mut reader = Reader::join(&stage);
        let mut shots = reader.read_to_tick(3);
        server.process.signal(signal);
        let run_id = server.run_id;
        let summary = server.summary();
        shots.extend(reader.read_unread());
        assert_whole(&shots, run_id);
        let last = shots.last().expect("some frames").header;
        let expected = json!([run_id, last.tick + 1, last.show_time_s()]);
        assert_eq!(json!([summary["run_id"], summary["frames"], summary["sim_time_s"]]), expected, "{signal:?}");
    }
}

#[test]
fn a_signal_ends_a_server_that_waits_for_its_readers() {
    let stage = Stage::new();
    let server = stage.serve(&["--readers", "3"]);
    assert_eq!(server.stop()["frames"], 1, "the only frame is the last one of the run");
}

#[test]
fn a_signal_ends_a_monitor_with_its_summary() {
    for signal in SIGNALS {
        let stage = Stage::new();
        let server = stage.serve(&["--rate", "100"]);
        let mut monitor = stage.start(&["monitor", "--format", "json", "--progress", "0.01"]);
        monitor.json_until("the monitor has read a frame", |line| {
            line["type"] == "progress" && line["frames"].as_u64() >= Some(1)
        });
        monitor.signal(signal);
        let summary = monitor.end().expect_clean().last_json();
        assert_eq!((&summary["type"], &summary["contact"]), (&"summary".into(), &().into()), "{signal:?}");
        server.stop();
    }
}

#[test]
fn a_signal_ends_a_recorder_with_a_finished_file() {
    for signal in SIGNALS {
        let stage = Stage::new();
        let server = stage.serve(&["--rate", "1000", "--until", "0.1", "--readers", "1"]);
        let mut record = stage.start(&["record", "a.mcap", "--format", "json"]);
        assert_eq!(record.json()["type"], "started");
        let frames = &server.summary()["frames"];
        record.signal(signal);
        let summary = record.end().expect_clean().last_json();
        assert_eq!((&summary["frames"], &summary["lost"]), (frames, &0.into()), "{signal:?}");
        let repair = stage.run(&["record", "--repair", "a.mcap", "--format", "json"]).expect_clean().last_json();
        assert_eq!((&repair["repaired"], &repair["frames"]), (&false.into(), frames));
    }
}

#[test]
fn a_signal_ends_a_reader_that_waits_for_a_server() {
    for command in [&["echo"][..], &["hz"], &["latency"], &["monitor"], &["record", "a.mcap"]] {
        let stage = Stage::new();
        let waiting = stage.start_waiting(command);
        let ended = waiting.terminate();
        assert_eq!((ended.code(), ended.stderr.as_str()), (Some(0), ""), "{command:?}");
    }
}

#[test]
fn ctrl_c_ends_a_question_with_the_answers_that_are_known() {
    let stage = Stage::new();
    fs::write(stage.path("long.toml"), "[dragon]\nbenches = 2000\n").expect("the folder is writable");
    // This answer takes minutes.
    let question =
        "solve sensitivity --steps 100 --work 1000000 --config long.toml --format json --xlsx a.xlsx --report-progress";
    let mut command = program(&question.split(' ').collect::<Vec<_>>());
    // On one core, the first answer is known before any other.
    command.current_dir(stage.path("")).env("RAYON_NUM_THREADS", "1");
    let asked = Process::start(command);
    asked.complaint_with("progress");
    asked.signal(Signal::INT);
    let ended = asked.end();
    assert_eq!(ended.code(), Some(130), "{}", ended.stderr);
    let complaints: Vec<_> = ended.stderr.lines().filter(|line| !line.contains("progress")).collect();
    assert_eq!(complaints, ["error: cancelled: a.xlsx is not written"]);
    assert!(!stage.path("a.xlsx").exists());
    let answer = ended.last_json();
    let quantities = answer["quantities"].as_array().expect("the quantities");
    assert_eq!(quantities.len(), 4);
    let first = &quantities[0]["value"];
    assert!(first.is_f64(), "the first answer is known, not {first}");
    assert!(ended.stdout.contains("\"reason\":\"no answer: cancelled\""), "a later one is not");
}
