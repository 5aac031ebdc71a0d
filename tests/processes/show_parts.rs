//! The folder of a show whose recorder and server were killed: one recording, whose gaps are named.

use std::collections::BTreeSet;
use std::fs;

use bench_dragon::recording::{FrameReader, Parts};
use serde_json::Value;
use test_support::children::{await_child, kill};
use test_support::process::{Ended, Process};

use crate::reader::Reader;
use crate::record::{await_commands, await_frames};
use crate::show::Playing;
use crate::stage::{Stage, program};

/// Runs a command that needs no bus, in the stage's folder.
fn run(stage: &Stage, args: &[&str]) -> Ended {
    let mut command = program(args);
    command.current_dir(stage.path(""));
    Process::start(command).end()
}

/// Runs and ticks of all frames of a folder, part by part.
fn frames_of_parts(stage: &Stage, folder: &str) -> Vec<(u64, u64)> {
    let parts = Parts::find(&stage.path(folder)).expect("a folder with recordings");
    let frames = parts.files.iter().flat_map(|path| FrameReader::open(path).expect("a recording"));
    frames.map(|frame| frame.expect("a readable frame").header).map(|header| (header.run_id, header.tick)).collect()
}

/// Plays a show, and kills its recorder, then its server. Returns the stage and the summary of the show.
fn show_with_kills() -> (Stage, Value) {
    let playing = Playing::start(&["--auto-resume"]);
    let pid = playing.show.pid();
    // Without the start of the run, none of its frames can be verified.
    await_commands(&playing.stage.path("out/recording.mcap"), 1);
    await_frames(&playing.stage.path("out/recording.mcap"));
    let recorder = await_child(pid, "record", None);
    kill(recorder);
    await_child(pid, "record", Some(recorder));
    await_frames(&playing.stage.path("out/recording-2.mcap"));
    let before = playing.await_status(|status| status.tick > 10);
    let server = await_child(pid, "serve", None);
    kill(server);
    await_child(pid, "serve", Some(server));
    playing.await_status(|status| status.run_id != before.run_id && status.tick > 50);
    let Playing { show, stage } = playing;
    show.signal(rustix::process::Signal::INT);
    let ended = show.end();
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    (stage, ended.last_json())
}

#[test]
fn a_show_whose_recorder_was_killed_is_one_recording_with_named_gaps() {
    let (stage, summary) = show_with_kills();
    let published = summary["frames"]["published"].as_u64().expect("a count");
    let frames = frames_of_parts(&stage, "out");
    assert_eq!(frames.iter().collect::<BTreeSet<_>>().len(), frames.len(), "each frame is in one part");

    let ended = run(&stage, &["replay", "out", "--verify", "--format", "json"]);
    let mut lines = ended.json_lines();
    let whole = lines.pop().expect("a summary");
    let count = |name: &str| whole[name].as_u64().unwrap_or_else(|| panic!("{name} in {whole}"));
    assert_eq!((count("parts"), count("runs"), count("recorded")), (2, 2, frames.len() as u64), "{whole}");
    assert_eq!(count("recorded") + count("missing") + count("unplaced"), published, "the books balance: {whole}");
    let gaps = whole["gaps"].as_array().expect("a list");
    let is_between = |gap: &&Value| gap["after"] == "out/recording.mcap" && gap["before"] == "out/recording-2.mcap";
    let gap = gaps.iter().find(is_between).unwrap_or_else(|| panic!("no gap between the parts: {whole}"));
    let [from, to] = ["from_tick", "to_tick"].map(|key| gap[key].as_u64().expect("a tick"));
    let run_id = gap["run_id"].as_u64().expect("a run");
    assert!(from <= to && gap["frames"] == to - from + 1, "{gap}");
    assert!(!frames.iter().any(|(run, tick)| *run == run_id && (from..=to).contains(tick)), "{gap}");
    assert!([from - 1, to + 1].iter().all(|tick| frames.contains(&(run_id, *tick))), "{gap}");
    // A gap is no wrong frame. Only periods that a busy machine has missed in the gap cannot be verified.
    assert_ne!(ended.code(), Some(1), "{lines:#?}");
    if ended.code() == Some(0) {
        assert_eq!((count("frames_verified"), &whole["verified"]), (count("recorded"), &Value::Bool(true)));
    } else {
        let is_known = |line: &Value| line["reason"].as_str().is_some_and(|reason| reason.contains(" periods among "));
        assert!(lines.iter().any(is_known), "{lines:#?}");
    }

    let told = run(&stage, &["replay", "out", "--verify"]).stdout;
    let gap_line = format!("ticks {from} to {to} of run {run_id}, show time ");
    let is_named =
        |line: &&str| line.contains(&gap_line) && line.ends_with("between recording.mcap and recording-2.mcap");
    assert!(told.lines().any(|line| is_named(&line)), "{told}");
    let last = told.lines().last().expect("a line");
    assert!(last.starts_with(&format!("out: 2 runs in 2 parts: {published} published, ")), "{told}");
}

#[test]
fn a_single_part_tells_that_it_is_one_of_several() {
    let (stage, _) = show_with_kills();
    let told = run(&stage, &["replay", "out/recording.mcap", "--verify"]);
    assert_eq!(told.code(), Some(0), "{}{}", told.stdout, told.stderr);
    let last = told.stdout.lines().last().expect("a line");
    assert_eq!(
        last,
        "out/recording.mcap is part 1 of 2 of the recording in out; `bench-dragon replay out --verify` verifies all parts"
    );
    let whole = run(&stage, &["replay", "out/recording-2.mcap", "--verify", "--format", "json"]).last_json();
    assert_eq!((&whole["part"]["number"], &whole["part"]["of"]), (&2.into(), &2.into()), "{whole}");
    let told = run(&stage, &["export", "out/recording-2.mcap", "-", "--frames"]).stderr;
    assert_eq!(told, "out/recording-2.mcap is part 2 of 2 of the recording in out: name the folder for all parts\n");
}

#[test]
fn a_folder_is_exported_and_replayed_with_each_frame_and_command_once() {
    let (stage, _) = show_with_kills();
    let frames = frames_of_parts(&stage, "out");
    let exported = run(&stage, &["export", "out", "frames.csv", "--frames", "--every", "0"]);
    assert_eq!(exported.code(), Some(0), "{}", exported.stderr);
    assert!(exported.stderr.contains("between recording.mcap and recording-2.mcap"), "{}", exported.stderr);
    let table = fs::read_to_string(stage.path("frames.csv")).expect("the table");
    let numbers = |row: &str| -> (u64, u64) {
        let mut cells = row.split(',').map(|cell| cell.parse().unwrap_or(u64::MAX));
        (cells.next().expect("a run"), cells.next().expect("a tick"))
    };
    assert_eq!(table.lines().skip(1).map(numbers).collect::<Vec<_>>(), frames);
    let commands = run(&stage, &["export", "out", "-", "--commands"]).stdout;
    let rows: Vec<&str> = commands.lines().skip(1).collect();
    assert_eq!(rows.iter().collect::<BTreeSet<_>>().len(), rows.len(), "{commands}");
    assert_eq!(rows.iter().filter(|row| row.contains(",start,")).count(), 2, "each run starts once: {commands}");

    let mut replay = stage.start(&["replay", "out", "--format", "json", "--readers", "1", "--rate", "4"]);
    replay.json();
    let mut reader = Reader::join(&stage);
    let first = frames.iter().filter(|(run, _)| *run == frames[0].0).count();
    let shots: Vec<_> = (0..frames.len()).map(|_| reader.next()).collect();
    assert!(shots[..first].iter().enumerate().all(|(tick, shot)| shot.header.tick == tick as u64), "one pass, no hole");
    assert_ne!(shots[first].header.run_id, shots[0].header.run_id, "the next run is another pass");
    let ended = replay.end();
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    assert_eq!(ended.last_json()["frames"], frames.len());
    assert!(ended.stderr.contains("between recording.mcap and recording-2.mcap"), "{}", ended.stderr);
}

#[test]
fn all_recordings_of_a_folder_are_repaired_at_once() {
    let stage = Stage::new();
    fs::create_dir(stage.path("out")).expect("a folder");
    let server = stage.serve(&["--rate", "50"]);
    for name in ["out/one.mcap", "out/two.mcap"] {
        let recorder = stage.start(&["record", name, "--no-repair"]);
        await_frames(&stage.path(name));
        recorder.kill();
    }
    server.stop();
    let lines = run(&stage, &["record", "--repair", "out", "--format", "json"]).expect_clean().json_lines();
    let files: Vec<_> = lines.iter().map(|line| (line["file"].as_str(), line["repaired"].as_bool())).collect();
    assert_eq!(files, [(Some("out/one.mcap"), Some(true)), (Some("out/two.mcap"), Some(true))]);
    let again = run(&stage, &["record", "--repair", "--check", "out"]).expect_clean().stdout;
    assert_eq!(again.matches("was finished already: ").count(), 2, "{again}");
    fs::write(stage.path("out/letter.mcap"), "not a recording").expect("a file");
    let failed = run(&stage, &["record", "--repair", "out"]);
    assert_eq!((failed.code(), failed.stdout.lines().count()), (Some(2), 2), "{}", failed.stderr);
    assert_eq!(failed.stderr, "error: out/letter.mcap is not a recording of a bench dragon\n");
}
