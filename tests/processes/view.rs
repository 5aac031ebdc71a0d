//! The view's server, tested by clients of other authors. Their tests are in `tests/python`. `view_page.rs` tests the page
//! itself.

use std::ffi::OsStr;
use std::process::Command;
use std::thread;

use serde_json::Value;
use test_support::process::Process;
use test_support::pytest::{self, expect_passed, pytest, python};
use test_support::skip::{has_programs, is_possible};

use crate::reader::{Reader, assert_accounted_for};
use crate::stage::{Stage, program};

/// Returns the environment of a Python program for a view.
fn variables(stage: &Stage) -> [(&'static str, &OsStr); 2] {
    [
        ("BENCH_DRAGON", OsStr::new(env!("CARGO_BIN_EXE_bench-dragon"))),
        ("BENCH_DRAGON_INSTANCE", OsStr::new(stage.domain().instance().as_str())),
    ]
}

#[test]
fn pages_with_the_token_are_served_and_others_are_refused() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100"]);
    pytest::run("test_view.py", &variables(&stage));
    server.stop();
}

#[test]
fn the_interface_is_as_its_description_says() {
    let stage = Stage::new();
    let _server = stage.serve(&["--rate", "100", "--start-at", "400"]);
    let monitor = stage.start(&["monitor"]);
    // The last test of the file ends the server.
    pytest::run("test_interface.py", &variables(&stage));
    monitor.terminate().expect_clean();
}

#[test]
fn of_two_hundred_pages_the_allowed_number_is_served_and_no_reader_loses_a_frame() {
    let stage = Stage::new();
    // At this rate, a reader that waits for ten seconds loses nothing.
    let server = stage.serve(&["--rate", "20"]);
    let mut reader = Reader::join(&stage);
    let mut crowd = python();
    crowd.arg("tests/python/crowd.py").envs(variables(&stage));
    let crowd = thread::spawn(move || Process::start(crowd).end());
    let mut shots = Vec::new();
    while !crowd.is_finished() {
        shots.push(reader.next());
    }
    let outcome = crowd.join().expect("no panic").expect_clean().last_json();
    let let_in = outcome["let_in"].as_u64().expect("a count");
    let refused: u64 = outcome["refused"].as_object().expect("counts").values().filter_map(Value::as_u64).sum();
    assert_eq!(let_in + refused, 200, "{outcome}");
    assert!((1..=32).contains(&let_in), "{outcome}");
    assert_eq!(outcome["in_order"], true, "{outcome}");
    assert_accounted_for(&shots, 0);
    let summary = server.stop();
    println!(
        "two hundred pages knocked: {outcome}; lateness {}, {} overruns",
        summary["lateness_us"], summary["overruns"]
    );
}

#[test]
fn three_hundred_idle_connections_do_not_shut_the_operator_out() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "50"]);
    pytest::run("test_idle_crowd.py", &variables(&stage));
    server.stop();
}

#[test]
fn off_loopback_viewing_needs_the_token_too() {
    if !is_possible(&["unshare", "--net"]) || !has_programs(&["ip"]) {
        return;
    }
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "50"]);
    let inside = pytest("tests/python/test_exposed_view.py");
    let mut alone = Command::new("unshare");
    alone.args(["--net", "sh", "-c", "ip link set lo up && ip address add 10.77.0.1/32 dev lo && exec \"$@\"", "sh"]);
    alone.arg(inside.get_program()).args(inside.get_args()).current_dir(env!("CARGO_MANIFEST_DIR"));
    alone.envs(inside.get_envs().filter_map(|(name, value)| Some((name, value?)))).envs(variables(&stage));
    expect_passed(alone);
    server.stop();
}

#[test]
fn a_view_waits_for_a_server_and_outlives_it() {
    let stage = Stage::new();
    pytest::run("test_view_without_server.py", &variables(&stage));
}

#[test]
fn a_view_that_cannot_listen_reports_the_reason_in_one_line() {
    let stage = Stage::new();
    let mut first = stage.start(&["view", "--listen", "127.0.0.1:0", "--format", "json"]);
    let address = first.json()["address"].as_str().expect("an address").to_owned();
    let second = stage.run(&["view", "--listen", &address]);
    assert_eq!(second.code(), Some(1));
    assert_eq!(second.stderr.lines().count(), 1, "{}", second.stderr);
    assert!(second.stderr.contains(&address) && second.stderr.contains("in use"), "{}", second.stderr);
    first.terminate().expect_clean();
}

#[test]
fn invalid_addresses_hosts_and_tokens_are_bad_input() {
    for (args, named) in [
        (vec!["view", "--listen", "localhost"], "localhost"),
        (vec!["view", "--listen", "127.0.0.1:99999"], "127.0.0.1:99999"),
        (vec!["view", "--allow-host", "http://booth"], "http://booth"),
    ] {
        let ended = Process::start(program(&args)).end();
        assert_eq!(ended.code(), Some(2), "{}", ended.stderr);
        assert!(ended.stderr.lines().count() == 1 && ended.stderr.contains(named), "{}", ended.stderr);
    }
    let mut short = program(&["view", "--listen", "127.0.0.1:0"]);
    short.env("BENCH_DRAGON_TOKEN", "short");
    let ended = Process::start(short).end();
    let told = "error: the environment's BENCH_DRAGON_TOKEN must be 16 to 128 characters of A-Z, a-z, 0-9, - and _\n";
    assert_eq!((ended.code(), ended.stderr.as_str()), (Some(2), told));
}
