//! `replay --verify` of recordings of running servers: each equals its simulation to the last bit.

use std::fs;

use bench_dragon::recording::{FrameReader, Recorded, Recorder, RecorderSettings};
use bench_dragon_ipc::ShowState;
use serde_json::{Value, json};
use test_support::process::{Ended, Process};

use crate::reader::Reader;
use crate::record::{await_commands, await_frames};
use crate::server::Server;
use crate::stage::{Stage, program};
use crate::suspended::suspend;
use crate::timecode::{self, Desk, event, read_following};

/// Runs a verification in the stage's folder.
fn verify(stage: &Stage, files: &[&str], more: &[&str]) -> Ended {
    let mut command = program(&[&["replay", "--verify"], files, more].concat());
    command.current_dir(stage.path(""));
    Process::start(command).end()
}

/// Returns the runs of a recording. Fails unless all are as simulated.
#[track_caller]
fn verified(stage: &Stage, files: &[&str]) -> Vec<Value> {
    let ended = verify(stage, files, &["--format", "json"]);
    let mut lines = ended.json_lines();
    assert_eq!((ended.code(), ended.stderr.as_str()), (Some(0), ""), "{lines:#?}");
    let summary = lines.pop().expect("a summary");
    assert_eq!((&summary["verified"], &summary["frames"]), (&json!(true), &summary["frames_verified"]), "{lines:#?}");
    for run in &lines {
        assert_eq!((&run["verdict"], &run["frames"]), (&json!("verified"), &run["verified"]), "{run}");
    }
    lines
}

/// Ends a recorder and checks that it has lost nothing. The bus keeps 167 frames for it, so a show of more frames has a low rate.
fn end(recorder: Process) -> Value {
    let summary = recorder.terminate().expect_clean().last_json();
    assert_eq!((&summary["lost"], &summary["commands_lost"]), (&json!(0), &json!(0)), "{summary}");
    summary
}

/// Starts a server, and a recorder that has recorded a frame.
fn record(stage: &Stage, args: &[&str]) -> (Server, Process) {
    let server = stage.serve(&[&["--readers", "1"], args].concat());
    let recorder = stage.start(&["record", "a.mcap", "--format", "json"]);
    await_frames(&stage.path("a.mcap"));
    (server, recorder)
}

fn ctl(stage: &Stage, order: &[&str]) -> u64 {
    let reply = stage.run(&[&["ctl", "--format", "json"], order].concat()).last_json();
    reply["tick"].as_u64().expect("a tick")
}

#[test]
fn a_show_that_was_commanded_is_as_simulated() {
    let stage = Stage::new();
    fs::write(stage.path("stage.toml"), "[head]\naccel_mps2 = 0.5\n").expect("a file");
    let (server, recorder) = record(&stage, &["--config", "stage.toml", "--rate", "50"]);
    let mut reader = Reader::join(&stage);
    let orders: [&[&str]; 9] = [
        &["speed", "2.5"],
        &["pause"],
        &["resume"],
        &["seek", "100"],
        &["seek", "1e6"],
        &["hold"],
        &["resume"],
        &["release"],
        &["speed", "0.5"],
    ];
    for order in orders {
        let tick = ctl(&stage, order);
        reader.read_to_tick(tick + 10);
    }
    ctl(&stage, &["stop"]);
    let served = server.summary();
    let summary = end(recorder);
    // The events are ten orders, the start and the end.
    assert_eq!((&summary["frames"], &summary["commands"]), (&served["frames"], &json!(12)));
    let runs = verified(&stage, &["a.mcap"]);
    assert_eq!((&runs[0]["frames"], &runs[0]["overruns"]), (&served["frames"], &served["overruns"]));
    assert_eq!(
        (&runs[0]["commands"], &runs[0]["missing"]),
        (&json!(8), &json!(0)),
        "eight commands are accepted, a seek and a resume are refused"
    );
}

#[test]
fn a_show_that_missed_periods_is_as_simulated() {
    let stage = Stage::new();
    let (server, recorder) = record(&stage, &["--rate", "100"]);
    let mut reader = Reader::join(&stage);
    for suspended_ns in [100_000_000, 700_000_000, 50_000_000] {
        suspend(&server.process, suspended_ns);
        let tick = ctl(&stage, &["speed", "1.5"]);
        reader.read_to_tick(tick + 30);
    }
    let served = server.stop();
    end(recorder);
    let runs = verified(&stage, &["a.mcap"]);
    assert_eq!((&runs[0]["frames"], &runs[0]["overruns"]), (&served["frames"], &served["overruns"]));
    assert!(runs[0]["overruns"].as_u64() >= Some(80), "{runs:?}");
    assert_eq!(runs[0]["commands"], 4, "three speeds, and the final signal");
}

#[test]
fn a_guarded_show_is_as_simulated_with_its_grants() {
    let stage = Stage::new();
    let server =
        stage.serve(&["--guarded", "--start-at", "405", "--time-scale", "20", "--rate", "50", "--readers", "2"]);
    let mut guard = stage.start(&["monitor", "--guard", "--format", "json"]);
    let recorder = stage.start(&["record", "a.mcap", "--format", "json"]);
    let lines = guard.json_until("the guard reports its hold", |line| line["type"] == "guard");
    assert!(lines.iter().all(|line| line["command"] != "grant"), "the guard reports its own grants: {lines:?}");
    let tick = ctl(&stage, &["seek", "60"]);
    Reader::join(&stage).read_to_tick(tick + 20);
    ctl(&stage, &["stop"]);
    let served = server.summary();
    guard.terminate().expect_clean();
    end(recorder);
    let runs = verified(&stage, &["a.mcap"]);
    assert_eq!(runs[0]["frames"], served["frames"]);
    assert!(runs[0]["grants"].as_u64() > Some(0), "{runs:?}");
}

#[test]
fn a_show_that_followed_timecode_is_as_simulated() {
    let stage = Stage::new();
    let (mut server, listen) = timecode::serve(&stage, "artnet:127.0.0.1:0", &["--readers", "2"]);
    let recorder = stage.start(&["record", "a.mcap", "--format", "json"]);
    let mut reader = Reader::join(&stage);
    let mut desk = Desk::start(&["artnet", &listen]);
    for order in ["play 60", "play 120"] {
        let clock = desk.order(order);
        read_following(&mut reader, clock, 0.0);
    }
    let tick = ctl(&stage, &["pause"]);
    reader.read_to_tick(tick + 20);
    let tick = ctl(&stage, &["resume"]);
    reader.read_to_tick(tick + 20);
    desk.order("silence");
    event(&mut server.process, "lost");
    suspend(&server.process, 600_000_000);
    let tick = ctl(&stage, &["speed", "1.2"]);
    reader.read_to_tick(tick + 20);
    desk.order("speak");
    event(&mut server.process, "follows");
    desk.order("stand");
    event(&mut server.process, "stands");
    reader.read_until("the show is paused", |header| header.show_state() == Some(ShowState::Paused));
    server.process.terminate().expect_clean();
    end(recorder);
    let runs = verified(&stage, &["a.mcap"]);
    assert!(runs[0]["timecode"].as_u64() >= Some(4), "{runs:?}");
}

#[test]
fn each_run_of_a_restarted_server_is_as_simulated() {
    let stage = Stage::new();
    let (server, recorder) = record(&stage, &["--rate", "50"]);
    ctl(&stage, &["seek", "30"]);
    await_commands(&stage.path("a.mcap"), 2);
    let first = server.run_id;
    server.process.kill();
    let server = stage.serve(&["--rate", "50", "--start-travel", "30", "--start-at", "31", "--start-speed", "0.5"]);
    Reader::join(&stage).read_to_tick(20);
    let second = server.run_id;
    server.stop();
    end(recorder);
    let runs = verified(&stage, &["a.mcap"]);
    assert_eq!(runs.iter().map(|run| run["run_id"].as_u64()).collect::<Vec<_>>(), [Some(first), Some(second)]);
}

#[test]
fn a_recording_that_ends_before_its_server_has_the_commands_of_its_last_frames() {
    let stage = Stage::new();
    let (server, recorder) = record(&stage, &["--rate", "50"]);
    for order in ["speed", "speed", "speed"] {
        ctl(&stage, &[order, "0.7"]);
    }
    let tick = ctl(&stage, &["speed", "0.9"]);
    Reader::join(&stage).read_to_tick(tick + 1);
    end(recorder);
    let runs = verified(&stage, &["a.mcap"]);
    assert_eq!(runs[0]["commands"], 4, "{runs:?}");
    server.stop();
}

/// Copies a recording with one bit of a position changed at a tick.
fn copy_with_a_changed_bit(stage: &Stage, tick: u64) {
    let mut reader = FrameReader::open(&stage.path("a.mcap")).expect("a recording");
    let mut recorder = Recorder::start(RecorderSettings::new(stage.path("b.mcap"), 0)).expect("a recorder");
    let mut is_described = false;
    while let Some(recorded) = reader.next_wanted(|_| true).expect("a readable recording") {
        let configuration = reader.configuration().cloned().filter(|_| !is_described);
        if let Some(configuration) = configuration {
            recorder.describe(configuration.run_id, &configuration.toml).expect("the configuration");
            is_described = true;
        }
        match recorded {
            Recorded::Frame(mut frame) => {
                let x_m = &mut frame.handles[100].position_m[0];
                let changed = f64::from_bits(x_m.to_bits() ^ 1);
                *x_m = if frame.header.tick == tick { changed } else { *x_m };
                recorder.frame(&frame.header, &frame.handles).expect("a frame");
            }
            Recorded::Command(event) => recorder.record(&event, 0).expect("an event"),
            _ => {}
        }
    }
    recorder.finish().expect("a finished recording");
}

#[test]
fn a_changed_bit_is_reported_in_one_line_and_by_status_1() {
    let stage = Stage::new();
    let (server, recorder) = record(&stage, &["--rate", "100", "--until", "0.6"]);
    let run_id = server.run_id;
    let frames = server.summary()["frames"].as_u64().expect("a count");
    end(recorder);
    let told = verify(&stage, &["a.mcap"], &[]).expect_clean().stdout;
    let all =
        format!("run {run_id}: every frame is as simulated: {frames} frames, ticks 0 to {}; 0 commands, ", frames - 1);
    assert!(told.starts_with(&all) && told.lines().count() == 1, "{told}");

    copy_with_a_changed_bit(&stage, 17);
    let ended = verify(&stage, &["b.mcap"], &[]);
    assert_eq!((ended.code(), ended.stderr.as_str()), (Some(1), ""));
    let begins = format!("run {run_id}: differs at tick 17 (0.");
    assert!(ended.stdout.starts_with(&begins), "{}", ended.stdout);
    assert!(ended.stdout.contains(" s of show time), handle 100, position_m[0] is recorded as "), "{}", ended.stdout);
    assert!(ended.stdout.contains("; 17 frames before it are as simulated; "), "{}", ended.stdout);
    let lines = verify(&stage, &["b.mcap"], &["--format", "json"]).json_lines();
    assert_eq!((&lines[0]["verdict"], &lines[0]["difference"]["tick"]), (&json!("differs"), &json!(17)));
    assert_eq!((&lines[1]["type"], &lines[1]["verified"]), (&json!("verification"), &json!(false)));
}

#[test]
fn a_damaged_recording_is_not_verified_and_a_cut_one_up_to_the_cut() {
    let stage = Stage::new();
    let (server, recorder) = record(&stage, &["--rate", "100", "--until", "2"]);
    server.summary();
    end(recorder);
    let whole = fs::read(stage.path("a.mcap")).expect("the recording");
    let chunks = mcap::Summary::read(&whole).expect("a summary").expect("an index").chunk_indexes;
    let middle = &chunks[chunks.len() / 2];
    let inside = (middle.chunk_start_offset + middle.chunk_length / 2) as usize;
    let mut damaged = whole.clone();
    damaged[inside] ^= 1;
    fs::write(stage.path("damaged.mcap"), damaged).expect("a file");
    let ended = verify(&stage, &["damaged.mcap"], &[]);
    assert_eq!(ended.code(), Some(2), "{}", ended.stdout);
    assert!(ended.stderr.ends_with("bytes of damaged.mcap are damaged and were skipped\n"), "{}", ended.stderr);

    fs::write(stage.path("cut.mcap"), &whole[..inside]).expect("a file");
    let ended = verify(&stage, &["cut.mcap"], &[]);
    assert_eq!(ended.stderr, "cut.mcap stops in the middle: its complete part was verified\n");
    assert_eq!(ended.code(), Some(0), "{}", ended.stdout);

    fs::write(stage.path("short.mcap"), &whole[..100]).expect("a file");
    let ended = verify(&stage, &["short.mcap"], &[]);
    assert_eq!(ended.stderr, "error: short.mcap holds no frames: it stops in the middle\n");
    assert_eq!(ended.code(), Some(2), "{}", ended.stdout);
}

#[test]
fn files_that_cannot_be_verified_are_reported_in_one_line_with_status_2() {
    let stage = Stage::new();
    fs::write(stage.path("letter"), "not a recording").expect("a file");
    for (args, error) in [
        (&["none.mcap"][..], "cannot read none.mcap: No such file or directory (os error 2)"),
        (&["letter"], "letter is not an MCAP recording"),
    ] {
        let ended = verify(&stage, args, &[]);
        assert_eq!((ended.code(), ended.stderr), (Some(2), format!("error: {error}\n")));
    }
    let ended = verify(&stage, &["a.mcap"], &["--rate", "2"]);
    assert_eq!(ended.code(), Some(2));
    assert!(ended.stderr.contains("'--verify' cannot be used with '--rate <FACTOR>'"), "{}", ended.stderr);
}

#[test]
fn a_recording_of_a_replay_cannot_be_verified() {
    let stage = Stage::new();
    let (server, recorder) = record(&stage, &["--rate", "50", "--until", "0.2"]);
    server.summary();
    end(recorder);
    let recorder = stage.start_waiting(&["record", "b.mcap", "--format", "json"]);
    assert_eq!(stage.run(&["replay", "a.mcap", "--readers", "1"]).code(), Some(0));
    await_frames(&stage.path("b.mcap"));
    end(recorder);
    let ended = verify(&stage, &["b.mcap"], &[]);
    assert_eq!(ended.code(), Some(2));
    assert!(ended.stdout.contains(": cannot be verified from tick 0 on: "), "{}", ended.stdout);
    assert!(ended.stdout.contains("it has no record of commands"), "{}", ended.stdout);
}
