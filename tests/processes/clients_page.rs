//! The programs on `docs/reference/clients.md`, run as they are written there, but for the instance, addresses and ports.

use std::env;
use std::fs;
use std::path::PathBuf;
use std::process::Command;

use test_support::process::Process;
use test_support::pytest::python;
use test_support::skip::{has_programs, skip};

use crate::c_compiler::Language::C99;
use crate::c_compiler::Linkage::Shared;
use crate::c_compiler::compile_at;
use crate::stage::Stage;

/// Lines that a program prints before it is believed.
const LINES: usize = 3;

fn page(name: &str) -> String {
    let path = format!("{}/{name}", env!("CARGO_MANIFEST_DIR"));
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// The program in a language under a heading of the page.
fn program(heading: &str, language: &str) -> String {
    let page = page("docs/reference/clients.md");
    let (_, section) = page.split_once(&format!("\n## {heading}\n")).expect("the page has the heading");
    let section = section.split("\n## ").next().expect("a section has a beginning");
    code(section, language)
}

/// The first block of code in a language.
fn code(text: &str, language: &str) -> String {
    let (_, block) = text.split_once(&format!("```{language}\n")).expect("there is code in the language");
    block.split("```").next().expect("a block has an end").to_owned()
}

/// Fails unless a program prints lines, and keeps on running.
fn assert_goes_on(mut client: Process) {
    for _ in 0..LINES {
        assert!(client.next_line().is_some(), "it has ended: {}", client.end().stderr);
    }
    client.kill();
}

/// Starts Python with a program of the page, in which some words are others.
fn start_python(heading: &str, others: &[(&str, &str)]) -> Process {
    let mut client = python();
    client.args(["-u", "-c", &with(program(heading, "python"), others)]);
    Process::start(client)
}

fn with(program: String, others: &[(&str, &str)]) -> String {
    others.iter().fold(program, |program, (word, other)| {
        assert!(program.contains(word), "{word} is in {program}");
        program.replace(word, other)
    })
}

#[test]
fn the_rust_program_is_the_one_that_is_compiled_with_the_crate() {
    let documented = page("ipc/src/lib.rs");
    let (_, example) = documented.split_once("//! ```no_run\n").expect("the crate has an example");
    let lines = example.lines().take_while(|line| *line != "//! ```");
    let compiled: String = lines.map(|line| line.trim_start_matches("//!").trim_start_matches(' ')).collect();
    for text in [program("Rust", "rust,no_run"), code(&page("README.md"), "rust,no_run")] {
        assert!(text.lines().count() <= 15, "{text}");
        assert_eq!(text.lines().map(str::trim_start).collect::<String>(), compiled);
    }
}

#[test]
fn the_c_program_prints_where_the_head_is() {
    if !has_programs(&["gcc", "pkg-config"]) {
        return;
    }
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "20"]);
    let source = stage.path("head.c");
    let instance = format!("bd_dragon_open(\"{}\"", stage.domain().instance());
    fs::write(&source, with(program("C and C++", "c"), &[("bd_dragon_open(NULL", &instance)]))
        .expect("the folder is ours");
    let client = compile_at(&source, stage.path("head"), C99, Shared);
    // Line by line, though it does not print to a terminal.
    let mut unbuffered = Command::new("stdbuf");
    unbuffered.arg("--output=L").arg(client);
    assert_goes_on(Process::start(unbuffered));
    server.stop();
}

#[test]
fn the_python_program_reads_a_dragon_and_pauses_it() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "20", "--start-at", "59", "--readers", "1"]);
    let instance = format!("Dragon(\"{}\")", stage.domain().instance());
    let client = start_python("Python", &[("Dragon(\"dragon\")", &instance)]);
    let stdout = client.end().expect_clean().stdout;
    let last = stdout.lines().last().expect("it has printed");
    assert!(stdout.starts_with("223 benches\n") && last.starts_with("paused from tick "), "{stdout}");
    server.stop();
}

#[test]
fn the_posistagenet_programs_print_trackers() {
    let stage = Stage::new();
    let bridge = stage.start_waiting(&["bridge", "psn", "--interface", "127.0.0.1", "--format", "json"]);
    let server = stage.serve(&["--rate", "20"]);
    let heading = "A lighting desk or media server: PosiStageNet";
    assert_goes_on(start_python(heading, &[("10.0.0.20", "127.0.0.1")]));
    match env::var_os("BENCH_DRAGON_NODE").map(PathBuf::from).filter(|folder| folder.join("node_modules").exists()) {
        Some(folder) => {
            let group = "addMembership('236.10.10.10'";
            let code = with(program(heading, "js"), &[(group, &format!("{group}, '127.0.0.1'"))]);
            let mut client = Command::new("node");
            client.args(["--eval", &code]).current_dir(folder);
            assert_goes_on(Process::start(client));
        }
        None => skip("tests/run has not installed the packages of tests/node"),
    }
    bridge.terminate().expect_clean();
    server.stop();
}

#[test]
fn the_osc_program_prints_where_the_head_is() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "20"]);
    // On any port of this machine, which it prints.
    let serving = "BlockingOSCUDPServer((\"0.0.0.0\", 9000), dispatcher).serve_forever()";
    let on_any_port = "server = BlockingOSCUDPServer((\"127.0.0.1\", 0), dispatcher)
print(server.server_address[1])
server.serve_forever()";
    let mut client = start_python("Open Sound Control", &[(serving, on_any_port)]);
    let port = client.next_line().expect("its port");
    let bridge = stage.start(&["bridge", "osc", "--to", &format!("127.0.0.1:{port}"), "--format", "json"]);
    assert_goes_on(client);
    bridge.terminate().expect_clean();
    server.stop();
}

#[cfg(feature = "zenoh")]
#[test]
fn the_zenoh_program_prints_where_the_head_is() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "20"]);
    let mut bridge = stage.start(&["bridge", "zenoh", "--listen", "tcp/127.0.0.1:0", "--format", "json"]);
    let started = bridge.json();
    let endpoint = started["listens"][0].as_str().expect("it says where it listens").to_owned();
    let key = format!("bench-dragon/{}/frames", stage.domain().instance());
    let others = [("tcp/10.0.0.5:7447", endpoint.as_str()), ("bench-dragon/dragon/frames", key.as_str())];
    assert_goes_on(start_python("Another machine: zenoh", &others));
    bridge.terminate().expect_clean();
    server.stop();
}

#[test]
fn the_timecode_program_is_followed() {
    let stage = Stage::new();
    let mut server = stage.start(&["serve", "--rate", "20", "--timecode", "osc:0", "--format", "json"]);
    let port = server
        .json_until("the server listens for timecode", |line| line["type"] == "listening")
        .pop()
        .expect("the line")["listen"]
        .as_str()
        .and_then(|listen| Some(listen.rsplit_once(':')?.1.to_owned()))
        .expect("an address with a port");
    let client = start_python("Timecode, the other way", &[("7000", &port)]);
    server.json_until("the show follows the timecode", |line| line["event"] == "follows");
    client.kill();
    server.terminate().expect_clean();
}
