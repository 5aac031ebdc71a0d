//! A recording exported as tables. `tests/python/test_export.py` reads them.

use std::fs;
use std::io::Read as _;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;

use bench_dragon::recording::{Recorder, RecorderSettings};
use bench_dragon_ipc::{Command, CommandEvent, CommandReply, FrameHeader, HandleState, Refusal, Request, Sender};
use serde_json::json;
use test_support::process::Ended;
use test_support::pytest;

use crate::stage::{Stage, program};

/// Runs `export` in the stage's folder.
fn export(stage: &Stage, args: &[&str]) -> Ended {
    let mut command = program(&[&["export"], args].concat());
    command.current_dir(stage.path(""));
    test_support::process::Process::start(command).end()
}

/// Writes a recording of one bench at these show times, in milliseconds.
fn write_recording(path: &Path, times_ms: impl Iterator<Item = i64>) {
    let mut recorder = Recorder::start(RecorderSettings::new(path, 0)).expect("a recorder");
    recorder.describe(7, "[dragon]\nbenches = 1\n").expect("the configuration");
    for (tick, time_ms) in (0..).zip(times_ms) {
        let header =
            FrameHeader { run_id: 7, tick, show_time_ns: time_ms * 1_000_000, bench_count: 1, ..Default::default() }
                .of_one_dragon();
        recorder.frame(&header, &[HandleState::default(); 2]).expect("a frame");
    }
    recorder.finish().expect("a finished recording");
}

fn files(stage: &Stage) -> Vec<String> {
    let entries = fs::read_dir(stage.path("")).expect("a folder").flatten();
    let mut names: Vec<String> = entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn python_finds_the_recording_in_its_tables() {
    let stage = Stage::new();
    let recorder = stage.start(&["record", "a.mcap"]);
    let monitor = stage.start(&["monitor"]);
    let first = ["--rate", "50", "--start-at", "411", "--until", "413", "--time-scale", "2", "--readers", "2"];
    stage.serve(&first).summary();
    fs::write(stage.path("stage.toml"), "[dragon]\nbenches = 5\n").expect("a file");
    // Long enough for readers that stay to find it.
    let second = ["--config", "stage.toml", "--rate", "10", "--until", "6", "--readers", "2"];
    stage.serve(&second).summary();
    monitor.terminate();
    recorder.terminate();
    for (out, args) in [
        ("all.csv", &["--every", "0"][..]),
        ("some.csv", &["--every", "0.5", "--handles"]),
        ("benches.csv", &["--every", "0.5", "--benches"]),
        ("frames.csv", &["--every", "0.5", "--frames"]),
        ("alerts.csv", &["--alerts"]),
        ("commands.csv", &["--commands"]),
        ("handles.xlsx", &["--every", "0.5"]),
        ("benches.xlsx", &["--every", "0.5", "--benches"]),
    ] {
        export(&stage, &[&["a.mcap", out], args].concat()).expect_clean();
    }
    pytest::run("test_export.py", &[("EXPORT_FOLDER", stage.path("").as_os_str())]);
}

#[test]
fn rows_go_to_stdout_and_written_files_are_reported() {
    let stage = Stage::new();
    write_recording(&stage.path("a.mcap"), 0..2500);
    let printed = export(&stage, &["a.mcap", "-", "--frames", "--to", "2"]).expect_clean().stdout;
    let titles = "run_id,tick,time_s,wall_time,state,head_travel_m,head_speed_mps,time_scale,benches\n";
    let rows = ["7,0,0.0", "7,1000,1.0", "7,2000,2.0"]
        .map(|when| format!("{when},1970-01-01T00:00:00Z,running,0.0,0.0,0.0,1\n"));
    assert_eq!(printed, format!("{titles}{}", rows.concat()));
    let told = export(&stage, &["a.mcap", "a.csv"]).expect_clean().stdout;
    assert_eq!(told, "6 rows of handles, from 3 frames, written to a.csv\n");
    let told = export(&stage, &["a.mcap", "a.xlsx", "--format", "json"]).expect_clean().last_json();
    let expected = json!({
        "file": "a.xlsx", "runs": 1, "frames": 3, "alerts": 0, "commands": 0, "rows": null, "cut": false,
        "skipped_bytes": 0, "parts": 1, "recorded": 2500, "repeated": 0, "missing": 0, "gaps": [], "published": null,
    });
    assert_eq!(told, expected);
    assert_eq!(files(&stage), ["a.csv", "a.mcap", "a.xlsx"]);
}

#[test]
fn a_cut_recording_is_exported_up_to_the_cut() {
    let stage = Stage::new();
    write_recording(&stage.path("whole.mcap"), 0..10);
    let bytes = fs::read(stage.path("whole.mcap")).expect("the recording");
    let summary_start = mcap::read::footer(&bytes).expect("a footer").summary_start as usize;
    fs::write(stage.path("a.mcap"), &bytes[..summary_start - 5]).expect("a cut recording");
    let ended = export(&stage, &["a.mcap", "a.csv", "--every", "0"]);
    assert_eq!(ended.stderr, "a.mcap stops in the middle: its complete part was exported\n");
    assert_eq!(
        (ended.code(), ended.stdout.as_str()),
        (Some(0), "20 rows of handles, from 10 frames, written to a.csv\n")
    );
}

#[test]
fn impossible_exports_are_refused_in_one_line_and_leave_no_file() {
    let stage = Stage::new();
    write_recording(&stage.path("a.mcap"), 0..17_000);
    fs::write(stage.path("letter"), "not a recording").expect("a file");
    std::os::unix::fs::symlink("/dev/full", stage.path("full.csv")).expect("a link");
    std::os::unix::fs::symlink("a.mcap", stage.path("link.csv")).expect("a link");
    for (args, code, error) in [
        (&["letter", "a.csv"][..], 2, "letter is not an MCAP recording"),
        (&["a.mcap", "link.csv"], 2, "OUT is link.csv, must not be the recording itself"),
        (&["a.mcap", "a.csv", "--from", "3", "--to", "2"], 2, "--to is 2, must be at least --from, which is 3"),
        (
            &["a.mcap", "a.csv", "--from", "20"],
            2,
            "a.mcap holds no frames from 20 s: its show times are from 0 s to 16.999 s",
        ),
        (
            &["a.mcap", "a.xlsx", "--every", "0"],
            2,
            "there are at least 16384 frames with one column of handles each; a workbook has room for 16383: choose a greater \
             --every, a shorter --from and --to, or .csv",
        ),
        (&["a.mcap", "a.txt"], 2, "invalid value 'a.txt' for '<OUT>': must end in .csv or .xlsx, or be -"),
        (&["a.mcap", "none/a.csv"], 1, "cannot write none/a.csv: No such file or directory (os error 2)"),
        (&["a.mcap", "full.csv"], 1, "cannot write full.csv: No space left on device (os error 28)"),
    ] {
        let ended = export(&stage, args);
        let told = format!("error: {error}\n");
        assert_eq!((ended.code(), ended.stdout.as_str(), ended.stderr), (Some(code), "", told), "{args:?}");
    }
    assert_eq!(files(&stage), ["a.mcap", "full.csv", "letter", "link.csv"]);
}

#[test]
fn an_existing_file_is_overwritten_only_by_force_and_keeps_its_mode() {
    let stage = Stage::new();
    write_recording(&stage.path("a.mcap"), 0..3);
    for (name, kept) in [("a.csv", 0o600), ("a.xlsx", 0o640)] {
        let path = stage.path(name);
        fs::write(&path, "kept").expect("a file");
        fs::set_permissions(&path, fs::Permissions::from_mode(kept)).expect("the file is ours");
        let ended = export(&stage, &["a.mcap", name]);
        let told =
            format!("error: {name} already exists and is not overwritten: choose another name, or give --force\n");
        assert_eq!((ended.code(), ended.stderr), (Some(2), told));
        assert_eq!(fs::read_to_string(&path).expect("the file"), "kept");
        export(&stage, &["a.mcap", name, "--force"]).expect_clean();
        assert_ne!(fs::read(&path).expect("the file"), b"kept");
        let mode = fs::metadata(&path).expect("the file").permissions().mode() & 0o7777;
        assert_eq!(mode, kept, "{name}");
    }
}

#[test]
fn a_guards_grants_are_listed_only_on_request() {
    let stage = Stage::new();
    let mut recorder = Recorder::start(RecorderSettings::new(stage.path("a.mcap"), 0)).expect("a recorder");
    recorder.describe(7, "[dragon]\nbenches = 1\n").expect("the configuration");
    let header = FrameHeader { run_id: 7, bench_count: 1, ..Default::default() }.of_one_dragon();
    recorder.frame(&header, &[HandleState::default(); 2]).expect("a frame");
    let grant = Request::Grant { run_id: 7, from_m: 0.0, to_m: 5.0, is_final: false };
    let accepted = CommandReply::accepted(7, 3);
    let refused = CommandReply::refused(7, 3, Refusal::OtherRun);
    for (number, request, reply) in [(0, Request::Hold, accepted), (1, grant, accepted), (2, grant, refused)] {
        let command = Command { sender: Sender::Guard.to_wire(), ..request.to_wire() };
        let event = CommandEvent { run_id: 7, number, ..CommandEvent::answered(&command, &reply) };
        recorder.record(&event, 0).expect("an event");
    }
    recorder.finish().expect("a finished recording");
    let numbers = |args: &[&str]| -> Vec<String> {
        let rows = export(&stage, &[&["a.mcap", "-", "--commands"], args].concat()).expect_clean().stdout;
        let number = |row: &str| row.rsplit(',').nth(1).expect("a column").to_owned();
        rows.lines().skip(1).map(number).collect()
    };
    assert_eq!(numbers(&[]), ["0", "2"], "a refused grant is worth a look");
    assert_eq!(numbers(&["--grants"]), ["0", "1", "2"]);
}

#[test]
fn a_reader_may_close_the_pipe_before_the_last_row() {
    let stage = Stage::new();
    write_recording(&stage.path("a.mcap"), 0..17_000);
    let mut command = program(&["export", "a.mcap", "-", "--every", "0"]);
    let mut child =
        command.current_dir(stage.path("")).stdout(std::process::Stdio::piped()).spawn().expect("the program starts");
    let mut first = [0; 20];
    child.stdout.take().expect("a pipe").read_exact(&mut first).expect("rows");
    assert_eq!(child.wait().expect("the program ends").code(), Some(0));
}
