//! The files of `examples/`: every configuration is planned and played, and every program reads a show.

use std::env;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use test_support::process::Process;
use test_support::pytest::python;
use test_support::skip::{has_programs, skip};

use crate::browser::View;
use crate::c_compiler::Language::C99;
use crate::c_compiler::Linkage::Shared;
use crate::c_compiler::compile_at;
use crate::clients_page::assert_goes_on;
use crate::stage::{Stage, program};

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples").join(name)
}

fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn configurations() -> Vec<PathBuf> {
    let entries = fs::read_dir(example("")).expect("the folder can be read").flatten();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    paths.sort();
    paths
}

fn contact_s(config: &Path) -> Value {
    let mut solve = program(&["solve", "contact", "--format", "json", "--config"]);
    solve.arg(config);
    Process::start(solve).end().expect_clean().last_json()["time_s"].clone()
}

#[test]
fn every_configuration_is_listed_planned_and_played() {
    let listed = text(&example("README.md"));
    let configurations = configurations();
    assert!(configurations.len() >= 3, "{configurations:?}");
    for config in &configurations {
        let name = config.file_name().expect("a file has a name").to_string_lossy();
        assert!(listed.contains(&format!("]({name})")), "{name} is not in the list");
        let is_formation = text(config).contains("[[dragons]]");
        let config = config.to_str().expect("the path is UTF-8");
        let stage = Stage::new();
        if is_formation {
            let mut solve = program(&["solve", "contact", "--config", config]);
            solve.current_dir(stage.path(""));
            Process::start(solve).end().expect_clean();
            continue;
        }
        let played = ["show", "--config", config, "--rate", "50", "--time-scale", "20", "--out", "out"];
        // Show time 0 of a turnaround is in its middle.
        let is_turnaround = ["stage.toml", "night.toml", "turnaround.toml"].contains(&&*name);
        let until = ["--until", if is_turnaround { "-40" } else { "20" }];
        // No operator gives GO.
        let go: &[&str] = if name == "night.toml" { &["--auto-go", "0.1"] } else { &[] };
        let ended = stage.run(&[&played[..], &until, go].concat());
        assert_eq!(ended.code(), Some(0), "{name}: {}{}", ended.stdout, ended.stderr);
    }
    let paper_s = contact_s(&example("paper.toml")).as_f64().expect("the paper's dragon touches itself");
    assert!((paper_s - 412.473_838).abs() < 1e-6, "{paper_s}");
    assert_eq!(contact_s(&example("turnaround.toml")), Value::Null);
    assert_eq!(contact_s(&example("stage.toml")), Value::Null);
}

#[test]
fn the_example_configurations_have_every_key() {
    let examples = [text(&example("stage.toml")), text(&example("two-dragons.toml"))].concat();
    let reference = text(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/reference/configuration.md")));
    let rows = reference.lines().filter_map(|line| line.strip_prefix("| `")?.split('`').next());
    let keys: Vec<&str> = rows.filter(|key| key.chars().all(|char| char.is_ascii_lowercase() || char == '_')).collect();
    assert!(keys.len() >= 20, "{keys:?}");
    for key in keys {
        let is_there =
            examples.lines().any(|line| line.trim_start_matches(['#', ' ']).starts_with(&format!("{key} =")));
        assert!(is_there, "{key} is not in the examples");
    }
}

/// Starts a program with output line by line, although stdout is not a terminal.
fn by_lines(program: &Path, stage: &Stage) -> Process {
    let mut unbuffered = Command::new("stdbuf");
    unbuffered.arg("--output=L").arg(program).arg(stage.domain().instance().as_str());
    Process::start(unbuffered)
}

#[test]
fn the_c_program_reads_a_show() {
    if !has_programs(&["gcc", "pkg-config"]) {
        return;
    }
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "20"]);
    assert_goes_on(by_lines(&compile_at(&example("head.c"), stage.path("head"), C99, Shared), &stage));
    server.stop();
}

#[test]
fn the_python_program_reads_a_show() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "20"]);
    let mut client = python();
    client.arg(example("head.py")).arg(stage.domain().instance().as_str());
    assert_goes_on(Process::start(client));
    server.stop();
}

#[test]
fn the_rust_program_reads_a_show() {
    let tests = env::current_exe().expect("a process knows its program");
    let folder = tests.parent().and_then(Path::parent).expect("a test is in target/PROFILE/deps");
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "20"]);
    assert_goes_on(by_lines(&folder.join("examples/head"), &stage));
    server.stop();
}

#[test]
fn the_node_program_reads_a_show() {
    let Some(node) = env::var_os("BENCH_DRAGON_NODE").map(PathBuf::from) else {
        return skip("tests/run has not installed the packages of tests/node");
    };
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "20"]);
    let view = View::of(&stage);
    // A program imports the packages beside it.
    fs::copy(example("stream.mjs"), stage.path("stream.mjs")).expect("a copy");
    symlink(node.join("node_modules"), stage.path("node_modules")).expect("a link");
    let mut client = Command::new("node");
    client.arg(stage.path("stream.mjs")).arg(&view.address);
    assert_goes_on(Process::start(client));
    view.process.terminate().expect_clean();
    server.stop();
}

#[test]
fn the_shell_program_reads_and_steers_a_show() {
    if !has_programs(&["curl"]) {
        return;
    }
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "20"]);
    let view = View::of(&stage);
    let token = view.url.split_once("#token=").expect("an address with a token").1;
    let ask = |args: &[&str]| {
        let mut curl = Command::new("sh");
        curl.arg(example("steer.sh")).arg(format!("http://{}", view.address)).args(args);
        Process::start(curl).end()
    };
    let reply = ask(&[token, "hold"]).expect_clean().last_json();
    assert_eq!(reply["accepted"], true, "{reply}");
    let reply = ask(&[token, "seek", "-1e9"]).expect_clean().last_json();
    assert!(reply["accepted"] == false && reply["reason"].is_string(), "{reply}");
    assert_eq!(ask(&[token]).expect_clean().last_json()["type"], "status");
    let refused = ask(&["0123456789abcdef", "hold"]);
    assert_eq!(refused.code(), Some(22), "{}", refused.stderr);
    assert!(refused.stdout.contains("a command needs the token"), "{}", refused.stdout);
    let ended = view.process.terminate();
    assert!(ended.code() == Some(0) && ended.stderr.contains("1 wrong token"), "{}", ended.stderr);
    server.stop();
}

#[test]
fn the_small_programs_wait_for_a_server() {
    if !has_programs(&["gcc", "pkg-config"]) {
        return;
    }
    let tests = env::current_exe().expect("a process knows its program");
    let folder = tests.parent().and_then(Path::parent).expect("a test is in target/PROFILE/deps");
    let stage = Stage::new();
    let name = stage.domain().instance().as_str();
    let mut client = python();
    client.arg(example("head.py")).arg(name);
    let clients = [
        (by_lines(&folder.join("examples/head"), &stage), "as soon as `bench-dragon serve` runs"),
        (
            by_lines(&compile_at(&example("head.c"), stage.path("head"), C99, Shared), &stage),
            "as soon as `bench-dragon serve` runs",
        ),
        (Process::start(client), "start the show, or by hand `bench-dragon serve"),
    ];
    for (client, remedy) in &clients {
        let waits = client.complaint();
        assert!(waits.contains(remedy), "{waits}");
    }
    let server = stage.serve(&["--rate", "20"]);
    for (mut client, _) in clients {
        assert!(client.next_line().is_some_and(|line| line.contains("front hinge")));
        client.terminate();
    }
    server.stop();
}

#[test]
fn the_page_about_clients_shows_these_programs() {
    let page = text(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/reference/clients.md")));
    for name in ["head.rs", "head.c", "head.py"] {
        // Lints are this project's own.
        let program = text(&example(name));
        let program: String =
            program.split_inclusive('\n').filter(|line| !line.starts_with("#![allow(clippy")).collect();
        assert!(page.contains(&format!("\n{program}```\n")), "{name} is not on the page as it is");
        assert!(program.lines().count() <= 20, "{name} has too many lines");
    }
}
