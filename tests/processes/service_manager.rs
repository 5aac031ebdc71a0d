//! The notifications of a server to its service manager, as defined by `sd_notify(3)`. The test owns the socket.

use std::os::unix::net::UnixDatagram;
use std::process::Command;
use std::time::Instant;

use test_support::eventually::DEADLINE;
use test_support::process::Process;
use test_support::skip::has_programs;

use crate::reader::Reader;
use crate::stage::Stage;

/// The service manager's end of the socket.
struct Listener(UnixDatagram);

impl Listener {
    /// Starts a server on the stage that notifies this socket.
    fn start(stage: &Stage, args: &[&str], watchdog_us: Option<u32>) -> (Self, Process) {
        let path = stage.path("notify");
        let socket = UnixDatagram::bind(&path).expect("the path is short and free");
        socket.set_read_timeout(Some(DEADLINE)).expect("a timeout");
        let mut command = stage.command(&[&["serve", "--format", "json"], args].concat());
        command.env("NOTIFY_SOCKET", path).env_remove("WATCHDOG_PID").env_remove("WATCHDOG_USEC");
        command.envs(watchdog_us.map(|watchdog_us| ("WATCHDOG_USEC", watchdog_us.to_string())));
        (Self(socket), Process::start(command))
    }

    /// Waits for the next message.
    #[track_caller]
    fn next(&self, until: &str) -> String {
        let mut message = [0; 4096];
        let length = self.0.recv(&mut message).unwrap_or_else(|error| panic!("waiting for {until}: {error}"));
        String::from_utf8(message[..length].to_vec()).expect("text").trim_end().to_owned()
    }

    /// Returns the next messages up to one with this beginning, which is the last element.
    #[track_caller]
    fn until(&self, beginning: &str) -> Vec<String> {
        let begun = Instant::now();
        let mut messages = vec![self.next(beginning)];
        while !messages.last().is_some_and(|message| message.starts_with(beginning)) {
            assert!(begun.elapsed() < DEADLINE, "waited {DEADLINE:?} for {beginning}; so far: {messages:?}");
            messages.push(self.next(beginning));
        }
        messages
    }
}

#[test]
fn a_server_notifies_the_manager_of_its_start_life_status_and_end() {
    let stage = Stage::new();
    let (manager, mut server) = Listener::start(&stage, &["--rate", "100", "--readers", "1"], Some(400_000));
    manager.until("READY=1");
    // The services exist now: a client can join after this message.
    let mut reader = Reader::join(&stage);
    assert_eq!(server.json()["type"], "started");
    reader.read_to_tick(3);
    manager.until("WATCHDOG=1");
    manager.until("WATCHDOG=1");
    let messages = manager.until("STATUS=running at ");
    assert!(messages.last().is_some_and(|status| status.ends_with(" overruns")), "{messages:?}");
    drop(reader);
    server.signal(rustix::process::Signal::TERM);
    manager.until("STOPPING=1");
    server.end().expect_clean();
}

#[test]
fn a_server_that_waits_for_its_readers_sends_signs_of_life() {
    let stage = Stage::new();
    let (manager, server) = Listener::start(&stage, &["--readers", "1"], Some(4));
    manager.until("WATCHDOG=1");
    manager.until("WATCHDOG=1");
    // A send to a socket without a reader would block.
    drop(manager);
    server.terminate();
}

#[test]
fn the_loop_sends_at_most_one_sign_of_life_per_turn() {
    let stage = Stage::new();
    let (manager, server) = Listener::start(&stage, &["--rate", "1", "--until", "5"], Some(4));
    let messages = manager.until("STOPPING=1");
    let signs = messages.iter().filter(|message| *message == "WATCHDOG=1").count() as u64;
    let frames = server.end().expect_clean().last_json()["frames"].as_u64().expect("a number");
    assert!(0 < signs && signs <= frames, "{signs} signs of {frames} turns: {messages:?}");
}

#[test]
fn no_signs_of_life_are_sent_without_a_watchdog() {
    let stage = Stage::new();
    let (manager, server) = Listener::start(&stage, &["--rate", "100", "--until", "0.5"], None);
    let messages = manager.until("STOPPING=1");
    assert!(!messages.iter().any(|message| message.starts_with("WATCHDOG")), "{messages:?}");
    server.end().expect_clean();
}

#[test]
fn systemd_accepts_the_unit() {
    if !has_programs(&["systemd-analyze"]) {
        return;
    }
    let unit = concat!(env!("CARGO_MANIFEST_DIR"), "/packaging/bench-dragon.service");
    let stage = Stage::new();
    // The unit is verified with an existing program instead of the installed one.
    let text = std::fs::read_to_string(unit).expect("the unit is in the repository");
    let installed = text.replace("/usr/local/bin/bench-dragon", env!("CARGO_BIN_EXE_bench-dragon"));
    assert_ne!(installed, text, "the unit starts the installed program");
    let path = stage.path("bench-dragon.service");
    std::fs::write(&path, installed).expect("a file");
    let mut analyze = Command::new("systemd-analyze");
    analyze.args(["verify", "--man=no"]).arg(&path);
    let verified = Process::start(analyze).end();
    let complaints = &verified.stderr;
    assert!(verified.status.success() && !complaints.contains("bench-dragon.service"), "{complaints}");
}
