//! The end of a reader, in any way, does not affect the server and the other readers.

use std::fs;

use crate::reader::{Reader, assert_accounted_for};
use crate::stage::Stage;

#[test]
fn a_killed_reader_stops_neither_the_server_nor_the_other_readers() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100"]);
    let mut witness = Reader::join(&stage);
    let mut killed = stage.start(&["echo", "--format", "json"]);
    let last_tick = killed.json()["tick"].as_u64().expect("a tick");
    killed.kill();

    let shots = witness.read_to_tick(last_tick + 10);
    assert_accounted_for(&shots, witness.lost());
    let joined = stage.run(&["echo", "--count", "2", "--format", "json"]).expect_clean();
    assert!(joined.last_json()["tick"].as_u64() > Some(last_tick));
    drop(witness);
    server.stop();
}

#[test]
fn the_server_removes_the_remains_of_a_killed_reader() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100"]);
    let mut killed = stage.start(&["echo", "--format", "json"]);
    killed.json();
    killed.kill();
    server.stop();
    assert!(stage.remains().is_empty(), "{:?}", stage.remains());
}

#[test]
fn the_last_reader_removes_the_remains_of_its_server() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100"]);
    let mut reader = Reader::join(&stage);
    reader.next();
    server.stop();
    assert!(!stage.remains().is_empty(), "a reader still runs");
    drop(reader);
    assert!(stage.remains().is_empty(), "{:?}", stage.remains());
}

#[test]
fn a_reader_that_is_slower_than_the_server_ends_at_a_signal() {
    let stage = Stage::new();
    let config = stage.path("long.toml");
    fs::write(&config, "[dragon]\nbenches = 20000\n").expect("the test's folder is its own");
    let config = config.to_str().expect("a folder with a name in UTF-8");
    let server = stage.serve(&["--rate", "10000", "--config", config]);
    let mut monitor = stage.start(&["monitor", "--format", "json", "--progress", "0.01"]);
    monitor.json_until("the monitor loses a frame", |line| line["lost"].as_u64() > Some(0));
    monitor.terminate().expect_clean();
    server.stop();
}

#[test]
fn a_reader_with_a_closed_output_ends_cleanly() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "1000"]);
    for format in ["text", "json"] {
        let mut echo = stage.start(&["echo", "--format", format]);
        echo.next_line().expect("a frame");
        echo.close_stdout();
        echo.end().expect_clean();
    }
    server.stop();
}

#[test]
fn a_source_without_its_readers_starts_after_the_wait_that_it_is_told() {
    let stage = Stage::new();
    let ended = stage.run(&["serve", "--until", "0.01", "--readers", "2", "--reader-wait", "0"]);
    assert!(ended.code() == Some(0) && ended.stderr.contains("starting with 0 of 2 readers"), "{}", ended.stderr);
    let refused = stage.run(&["serve", "--readers", "2", "--reader-wait", "26"]);
    let error = "error: invalid value '26' for '--reader-wait <SECONDS>': must be from 0 to 25\n";
    assert_eq!((refused.code(), refused.stderr.as_str()), (Some(2), error));
}
