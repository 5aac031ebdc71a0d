//! The programs for bridges on `docs/reference/clients.md`, run as they are written there, except for instance, addresses and ports.
//! `examples.rs` has those in Rust, C and Python.

use std::env;
use std::fs;
use std::path::PathBuf;
use std::process::Command;

use test_support::process::Process;
use test_support::pytest::python;
use test_support::skip::skip;

use crate::stage::Stage;

/// Lines that a program has to print.
const LINES: usize = 3;

/// Returns the program in a language under a heading of the page.
fn program(heading: &str, language: &str) -> String {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/reference/clients.md");
    let page = fs::read_to_string(path).expect("there is a page about clients");
    let (_, section) = page.split_once(&format!("\n## {heading}\n")).expect("the page has the heading");
    let section = section.split("\n## ").next().expect("a section has a beginning");
    let (_, block) = section.split_once(&format!("```{language}\n")).expect("there is code in the language");
    block.split("```").next().expect("a block has an end").to_owned()
}

/// Fails unless a program prints lines, and continues to run.
pub(crate) fn assert_goes_on(mut client: Process) {
    for _ in 0..LINES {
        assert!(client.next_line().is_some(), "the program has ended: {}", client.end().stderr);
    }
    client.kill();
}

/// Starts Python with a program of the page, in which some words are replaced.
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
    // The program uses any free port, and prints it.
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
    let endpoint = started["listens"][0].as_str().expect("the line has the endpoint").to_owned();
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
    let client = start_python("Timecode to the show", &[("7000", &port)]);
    server.json_until("the show follows the timecode", |line| line["event"] == "follows");
    client.kill();
    server.terminate().expect_clean();
}
