//! The README's run-sheet, run line by line. Only the instance, the page's port and the folder of the examples are replaced.

use std::fs;

use bench_dragon_ipc::ShowState;
use serde_json::Value;
use test_support::process::{Ended, Process};

use crate::reader::Reader;
use crate::stage::{Stage, program};

/// Returns the lines of the run-sheet that begin with the program's name, in their order, without comments.
fn lines() -> Vec<Vec<String>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/README.md");
    let readme = fs::read_to_string(path).expect("there is a README");
    let (_, sheet) = readme.split_once("\n## A show night\n").expect("the README has a run-sheet");
    let sheet = sheet.split("\n## ").next().expect("a section has a beginning");
    let commands = sheet.lines().filter_map(|line| line.strip_prefix("bench-dragon "));
    let words = |line: &str| -> Vec<String> {
        let command = line.split(" #").next().unwrap_or(line);
        command.split_whitespace().map(word).collect()
    };
    commands.map(words).collect()
}

/// Replaces a word of the run-sheet for the test.
fn word(word: &str) -> String {
    match word.strip_prefix("examples/") {
        Some(file) => format!("{}/examples/{file}", env!("CARGO_MANIFEST_DIR")),
        None if word == "--view" => "--view=127.0.0.1:0".to_owned(),
        None => word.to_owned(),
    }
}

/// The run-sheet, which the test takes line by line.
struct RunSheet<'a> {
    stage: &'a Stage,
    lines: std::vec::IntoIter<Vec<String>>,
}

impl RunSheet<'_> {
    /// Takes the next line, which must begin with these words.
    fn take(&mut self, begins: &[&str]) -> Vec<String> {
        let line = self.lines.next().unwrap_or_else(|| panic!("the run-sheet ends before {begins:?}"));
        assert!(line.iter().zip(begins).all(|(word, wanted)| word == wanted), "{line:?} is not {begins:?}");
        line
    }

    /// Starts the next line on the stage.
    fn start(&mut self, begins: &[&str]) -> Process {
        let line = self.take(begins);
        self.stage.start(&line)
    }

    /// Runs the next line, a command that needs no bus.
    fn run_alone(&mut self, begins: &[&str]) -> Ended {
        let mut command = program(&self.take(begins));
        command.current_dir(self.stage.path("."));
        Process::start(command).end()
    }

    /// Runs a command that the server accepts.
    fn accepted(&mut self, command: &str) {
        let ended = self.start(&["ctl", command]).end();
        assert_eq!(ended.code(), Some(0), "{}{}", ended.stdout, ended.stderr);
    }
}

#[test]
fn the_run_sheet_of_the_readme_runs_line_by_line() {
    let stage = Stage::new();
    let mut sheet = RunSheet { stage: &stage, lines: lines().into_iter() };

    let doctor = sheet.start(&["doctor", "--config"]).end();
    assert!(doctor.code() != Some(2) && doctor.stdout.contains("shared memory"), "{}{}", doctor.stdout, doctor.stderr);
    let turn = sheet.run_alone(&["solve", "turn"]).expect_clean();
    assert!(turn.stdout.contains("least clearance  0.279043 m"), "{}", turn.stdout);
    let rehearsal = sheet.start(&["show", "--config"]).end();
    assert_eq!(rehearsal.code(), Some(0), "{}{}", rehearsal.stdout, rehearsal.stderr);
    assert!(rehearsal.stdout.contains("first contact   none"), "{}", rehearsal.stdout);

    let checks = sheet.start(&["doctor", "--tonight"]).end();
    assert!(checks.code() != Some(2), "{}{}", checks.stdout, checks.stderr);
    assert!(stage.path("tonight/checks.html").exists());
    let mut show = sheet.start(&["show", "--config"]);
    let address = show.next_line().expect("the address of the page");
    assert!(address.starts_with("http://127.0.0.1:"), "{address}");
    let mut reader = Reader::await_server(&stage);
    reader.read_until("the dragon waits at its start", |header| header.show_state() == Some(ShowState::Ready));
    let status = sheet.start(&["ctl", "status"]).end();
    assert!(status.stdout.contains("recorder"), "{}{}", status.stdout, status.stderr);
    sheet.accepted("release");
    reader.read_until("the dragon waits at its first cue", |header| header.show_state() == Some(ShowState::Waiting));
    sheet.accepted("go");
    reader.read_until("the dragon walks on", |header| header.show_state() == Some(ShowState::Running));
    let cues = sheet.start(&["ctl", "cues"]).end();
    assert!(cues.stdout.contains("first lanterns") && cues.stdout.contains("next: "), "{}{}", cues.stdout, cues.stderr);
    // `watch.rs` tests this command in a terminal.
    sheet.take(&["watch"]);
    sheet.accepted("hold");
    reader.read_until("the dragon is held", |header| header.show_state() == Some(ShowState::Held));
    sheet.accepted("release");
    reader.read_until("the dragon walks again", |header| header.show_state() == Some(ShowState::Running));
    sheet.accepted("stop");
    let ended = show.end();
    assert_eq!(ended.code(), Some(0), "{}{}", ended.stdout, ended.stderr);
    let summary = fs::read_to_string(stage.path("tonight/summary.json")).expect("the show's summary");
    let summary: Value = serde_json::from_str(&summary).expect("the text is JSON");
    assert_eq!(summary["contact"], Value::Null, "{summary}");

    let verified = sheet.run_alone(&["replay", "tonight", "--verify"]);
    assert_eq!(verified.code(), Some(0), "{}{}", verified.stdout, verified.stderr);
    let exported = sheet.run_alone(&["export", "tonight", "tonight.xlsx"]);
    assert_eq!(exported.code(), Some(0), "{}{}", exported.stdout, exported.stderr);
    assert!(stage.path("tonight.xlsx").exists());
    assert_eq!(sheet.lines.next(), None, "every line was run");
}
