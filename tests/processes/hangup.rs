//! A closed terminal, such as a closed window or a lost ssh connection, ends a command as cleanly as Ctrl-C does.

use std::fs;

use bench_dragon_ipc::StatusReader;
use rustix::process::Signal;
use serde_json::Value;
use test_support::children::children;
use test_support::eventually::eventually;

use crate::pty::Pty;
use crate::reader::Reader;
use crate::record;
use crate::stage::Stage;

fn await_tick(stage: &Stage, tick: u64) {
    let status = eventually("a server runs", || StatusReader::open(stage.domain(), "test").ok());
    let poll = || status.poll().expect("the bus is readable");
    eventually("the server is at a tick", || poll().filter(|status| status.tick >= tick));
}

#[test]
fn a_closed_terminal_ends_a_recorder_with_a_finished_file() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100", "--readers", "1"]);
    let terminal = Pty::open();
    let recorder = terminal.start_session(&[], &stage.command(&["record", "a.mcap"]));
    await_tick(&stage, 1);
    terminal.close();
    assert_eq!(recorder.end().code(), Some(0));
    let (frames, was_cut) = record::read(&stage.path("a.mcap"));
    assert!(!was_cut && !frames.is_empty(), "{} frames", frames.len());
    server.stop();
}

#[test]
fn a_closed_terminal_ends_servers_and_readers_and_leaves_nothing() {
    for reader in [&["monitor"][..], &["echo"], &["view", "--listen", "127.0.0.1:0"]] {
        let stage = Stage::new();
        let (of_server, of_reader) = (Pty::open(), Pty::open());
        let serve = ["serve", "--rate", "100", "--readers", "1"];
        let server = of_server.start_session(&[], &stage.command(&serve));
        let reader_process = of_reader.start_session(&[], &stage.command(reader));
        await_tick(&stage, 1);
        of_reader.close();
        assert_eq!(reader_process.end().code(), Some(0), "{reader:?}");
        of_server.close();
        assert_eq!(server.end().code(), Some(0));
        assert!(stage.remains().is_empty(), "{:?}", stage.remains());
    }
}

#[test]
fn a_show_whose_terminal_is_closed_ends_its_children_and_writes_its_summary() {
    let stage = Stage::new();
    let terminal = Pty::open();
    let command = stage.command(&["show", "--out", "out", "--rate", "50", "--start-at", "100"]);
    let show = terminal.start_session(&[], &command);
    let pid = show.pid();
    await_tick(&stage, 20);
    terminal.close();
    assert_eq!(show.end().code(), Some(0));
    assert_eq!(children(pid), []);
    let summary = fs::read_to_string(stage.path("out/summary.json")).expect("a summary");
    let summary: Value = serde_json::from_str(&summary).expect("JSON");
    let (frames, was_cut) = record::read(&stage.path("out/recording.mcap"));
    assert!(!was_cut);
    assert_eq!(summary["frames"]["recorded"], frames.len(), "{summary}");
}

#[test]
fn a_terminal_that_is_closed_from_the_start_is_no_failure() {
    let stage = Stage::new();
    let terminal = Pty::open();
    let server = terminal.start(stage.command(&["serve", "--rate", "100", "--readers", "1", "--until", "0.5"]));
    terminal.close();
    let mut reader = Reader::await_server(&stage);
    reader.read_to_end();
    drop(reader);
    assert_eq!(server.end().code(), Some(0));
}

#[test]
fn under_nohup_a_recorder_outlives_its_terminal() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100", "--readers", "1"]);
    let terminal = Pty::open();
    let recorder = terminal.start_session(&["nohup"], &stage.command(&["record", "a.mcap"]));
    await_tick(&stage, 1);
    terminal.close();
    recorder.signal(Signal::HUP);
    let mut reader = Reader::join(&stage);
    let tick = reader.next().header.tick;
    reader.read_to_tick(tick + 50);
    drop(reader);
    recorder.signal(Signal::INT);
    assert_eq!(recorder.end().code(), Some(0));
    let (frames, was_cut) = record::read(&stage.path("a.mcap"));
    assert!(!was_cut && frames.iter().any(|header| header.tick >= tick + 50), "{tick}");
    server.stop();
}
