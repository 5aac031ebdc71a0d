//! A restarted server, and a reader that stays.

use bench_dragon_ipc::Continuity;

use crate::periods::assert_no_frame_missing;
use crate::reader::{Reader, Shot, assert_whole};
use crate::server::Server;
use crate::stage::Stage;

/// A run of 101 periods. A reader's buffer holds all its frames. The run is long enough for a reader that stays to find it.
const SHORT_RUN: [&str; 6] = ["--rate", "25", "--until", "4", "--readers", "1"];

/// Reads the whole second run with a reader that has seen the first run.
fn read_next_run(stage: &Stage, reader: &mut Reader, first_run_id: u64) {
    let server = stage.serve(&SHORT_RUN);
    assert_ne!(server.run_id, first_run_id);
    let mut shots = reader.read_until("a frame of the second run", |header| header.run_id != first_run_id);
    let first_of_run = shots.pop().expect("the frame that ended the reading");
    assert_eq!(first_of_run.continuity, Continuity::Restarted);
    assert_eq!((first_of_run.header.run_id, first_of_run.header.tick), (server.run_id, 0));
    let rest = reader.read_to_end();
    assert!(rest.iter().all(|shot| shot.continuity == Continuity::Next));
    assert_short_run(server, &[vec![first_of_run], rest].concat());
}

/// Fails unless these are all frames of a [`SHORT_RUN`].
fn assert_short_run(server: Server, shots: &[Shot]) {
    assert_whole(shots, server.run_id);
    let summary = server.summary();
    assert_no_frame_missing(&summary, 101);
    assert_eq!(summary["frames"], shots.len());
}

/// Starts a server, and a reader that reads its first frames.
fn begin(stage: &Stage) -> (Server, Reader, Vec<Shot>) {
    let server = stage.serve(&["--rate", "100", "--readers", "1"]);
    let mut reader = Reader::join(stage);
    let shots = reader.read_to_tick(3);
    (server, reader, shots)
}

#[test]
fn the_subscriber_of_a_killed_server_continues_with_the_next_one_from_tick_0() {
    let stage = Stage::new();
    let (server, mut reader, _) = begin(&stage);
    let run_id = server.run_id;
    server.process.kill();
    read_next_run(&stage, &mut reader, run_id);
    assert_eq!(reader.lost(), 0);
}

#[test]
fn the_subscriber_of_a_stopped_server_continues_with_the_next_one_from_tick_0() {
    let stage = Stage::new();
    let (server, mut reader, mut shots) = begin(&stage);
    let run_id = server.run_id;
    let published = server.stop()["frames"].clone();
    shots.extend(reader.read_unread());
    assert_whole(&shots, run_id);
    assert_eq!(published, shots.len(), "unread frames outlive the server");
    read_next_run(&stage, &mut reader, run_id);
    assert_eq!(reader.lost(), 0);
}

#[test]
fn a_server_starts_after_ten_killed_ones() {
    let stage = Stage::new();
    for _ in 0..10 {
        let server = stage.serve(&["--rate", "1000"]);
        Reader::join(&stage).next();
        server.process.kill();
    }
    let server = stage.serve(&SHORT_RUN);
    let shots = Reader::join(&stage).read_to_end();
    assert_short_run(server, &shots);
}
