//! Foreign messages under the keys of a bridge.

use std::collections::HashSet;
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use bench_dragon::bridge::zenoh::wire::{Described, encode_described};
use bench_dragon_ipc::{FrameHeader, HandleState, frame_bytes};
use serde_json::{Value, json};
use test_support::eventually::DEADLINE;
use test_support::process::Process;
use test_support::skip::is_possible;
use zenoh::handlers::FifoChannelHandler;
use zenoh::matching::MatchingStatus;
use zenoh::qos::CongestionControl;
use zenoh::{Config, Session, Wait as _};

use super::bridges::{ANY_PORT, Bridge, KEY, arguments};
use crate::reader::{Reader, assert_accounted_for};
use crate::stage::Stage;

fn connected(endpoint: &str) -> Session {
    let config = json!({
        "mode": "peer",
        "connect": { "endpoints": [endpoint] },
        "listen": { "endpoints": [] },
        "scouting": { "multicast": { "enabled": false } },
    });
    zenoh::open(Config::from_json5(&config.to_string()).expect("a configuration")).wait().expect("the peer listens")
}

fn wait_until_matching(mut status: MatchingStatus, changes: &FifoChannelHandler<MatchingStatus>, key: &str) {
    while !status.matching() {
        let changed = changes.recv_timeout(DEADLINE).expect("the session is open");
        status = changed.unwrap_or_else(|| panic!("waited {DEADLINE:?} until the session knew who has {key}"));
    }
}

/// Connects a session to a receiving bridge. A message to a subscriber that the session does not know yet would be lost, so this
/// waits for all that the bridge subscribes to.
fn connected_to_receiver(receiver: &Bridge) -> Session {
    let session = connected(&receiver.endpoint);
    for key in ["description", "frames", "alerts"] {
        let publisher = session.declare_publisher(format!("{KEY}/{key}")).wait().expect("the session is open");
        let changes = publisher.matching_listener().wait().expect("the session is open");
        let matching = publisher.matching_status().wait().expect("the session is open");
        wait_until_matching(matching, &changes, key);
    }
    session
}

/// Connects a session to a sending bridge, and waits until it knows all that the bridge answers.
pub(super) fn connected_to_sender(sender: &Bridge) -> Session {
    let session = connected(&sender.endpoint);
    for key in ["description", "commands"] {
        let querier = session.declare_querier(format!("{KEY}/{key}")).wait().expect("the session is open");
        let changes = querier.matching_listener().wait().expect("the session is open");
        let matching = querier.matching_status().wait().expect("the session is open");
        wait_until_matching(matching, &changes, key);
    }
    session
}

#[test]
fn malformed_and_foreign_messages_are_counted_and_dropped() {
    let (near, far) = (Stage::new(), Stage::new());
    let server = near.serve(&["--rate", "50"]);
    let sender = Bridge::sending(&near, &[]);
    let mut receiver = Bridge::start(&far, &["--receive", "--listen", ANY_PORT, "--connect", &sender.endpoint]);
    let remote_run_id = receiver.until("receiving")["remote_run_id"].as_u64().expect("a number");
    let mut reader = Reader::join(&far);
    let mut shots = vec![reader.next()];

    let session = connected_to_receiver(&receiver);
    let put = |key: &str, payload: Vec<u8>| {
        session
            .put(format!("{KEY}/{key}"), payload)
            .congestion_control(CongestionControl::Block)
            .wait()
            .expect("the session is open");
    };
    let handles = [HandleState::default(); 3];
    let sound = FrameHeader { run_id: remote_run_id, tick: u64::MAX - 9, bench_count: 2, ..FrameHeader::default() };
    let not_finite = FrameHeader { head_travel_m: f64::NAN, ..sound };
    let malformed =
        [vec![], vec![0; 71], vec![0xff; 300], frame_bytes(&not_finite, &handles), frame_bytes(&sound, &handles)];
    for payload in malformed.clone() {
        put("frames", payload.clone());
        put("alerts", payload.clone());
        put("description", payload);
    }
    // A valid frame of a run without a description.
    let foreign = frame_bytes(&FrameHeader { run_id: remote_run_id ^ 1, ..sound }, &handles);
    put("frames", foreign);
    // A valid frame with a tick that the run reaches in half a billion years.
    let ahead = FrameHeader { bench_count: 223, ..sound };
    put("frames", frame_bytes(&ahead, &[HandleState::default(); 224]));
    session.get(format!("{KEY}/commands")).wait().expect("the session is open");
    session.close().wait().expect("the session is open");

    shots.extend(reader.read_to_tick(shots[0].header.tick + 100));
    assert_accounted_for(&shots, reader.lost());
    server.stop();
    let received = receiver.stop();
    assert_eq!(received["malformed"], 3 * malformed.len(), "{received}");
    // The foreign frame, and frames that came before the description of the received run.
    assert!(received["foreign"].as_u64() >= Some(1), "{received}");
    assert_eq!(received["too_fast"], 1, "{received}");
    assert_eq!((&received["lost"], &received["not_new"]), (&json!(0), &json!(0)), "{received}");
    sender.stop();
}

/// Publishes the description of a run with this many benches.
fn describe(session: &Session, run_id: u64, benches: u32) {
    let attached = encode_described(Described { run_id, every: 1, rate_hz: 50 });
    session
        .put(format!("{KEY}/description"), format!("[dragon]\nbenches = {benches}\n"))
        .attachment(attached)
        .congestion_control(CongestionControl::Block)
        .wait()
        .expect("the session is open");
}

/// Returns a frame with this many benches.
fn frame_of(run_id: u64, bench_count: u32) -> Vec<u8> {
    let handles = vec![HandleState::default(); bench_count as usize + 1];
    frame_bytes(&FrameHeader { run_id, bench_count, ..FrameHeader::default() }, &handles)
}

#[test]
fn a_frame_that_contradicts_the_description_of_its_run_is_dropped() {
    let (near, far) = (Stage::new(), Stage::new());
    let server = near.serve(&["--rate", "50"]);
    let sender = Bridge::sending(&near, &[]);
    let mut receiver = Bridge::start(&far, &["--receive", "--listen", ANY_PORT, "--connect", &sender.endpoint]);
    let run_id = receiver.until("receiving")["run_id"].clone();
    let mut reader = Reader::join(&far);
    let session = connected_to_receiver(&receiver);
    describe(&session, 5, 223);
    assert_eq!(receiver.until("found")["remote_run_id"], 5);
    let put = |frame| session.put(format!("{KEY}/frames"), frame).congestion_control(CongestionControl::Block).wait();
    put(frame_of(5, 100_000)).expect("the session is open");
    // This frame matches the description. When it is received, the frame before it has been handled.
    put(frame_of(5, 223)).expect("the session is open");
    assert_eq!(receiver.until("receiving")["remote_run_id"], 5);
    let before = reader.read_until("a frame of the next run", |header| run_id != header.run_id);
    assert!(before.iter().all(|shot| shot.header.bench_count == 223));
    session.close().wait().expect("the session is open");
    server.stop();
    let received = receiver.stop();
    assert_eq!((&received["malformed"], &received["runs"]), (&json!(1), &json!(2)), "{received}");
    sender.stop();
}

#[test]
fn a_run_too_large_for_the_bus_is_refused_and_the_show_continues() {
    // Shared memory has room for the paper's dragon, and not for one of a hundred thousand benches.
    let script = r#"mount -t tmpfs -o size=128m none /dev/shm && exec "$@""#;
    let launcher = ["unshare", "--mount", "sh", "-c", script, "sh"];
    if !is_possible(&launcher) {
        return;
    }
    let (near, far) = (Stage::new(), Stage::new());
    let server = near.serve(&["--rate", "50"]);
    let sender = Bridge::sending(&near, &[]);
    let plain = far.command(&arguments(&["--receive", "--listen", ANY_PORT, "--connect", &sender.endpoint]));
    let mut command = Command::new(launcher[0]);
    command.args(&launcher[1..]).arg(plain.get_program()).args(plain.get_args()).env_remove("RUST_LOG");
    let mut receiver = Bridge::announced(Process::start(command));
    receiver.until("receiving");
    let session = connected_to_receiver(&receiver);
    describe(&session, 5, 100_000);
    receiver.until("found");
    let put =
        || session.put(format!("{KEY}/frames"), frame_of(5, 100_000)).congestion_control(CongestionControl::Block);
    put().wait().expect("the session is open");
    let refused = receiver.until("refused");
    assert_eq!(refused["remote_run_id"], 5);
    let reason = refused["reason"].as_str().expect("a text");
    assert!(reason.starts_with("/dev/shm has less than the "), "{reason}");
    put().wait().expect("the session is open");
    session.close().wait().expect("the session is open");
    let mut reader = Reader::join(&near);
    let begun = reader.next().header.tick;
    reader.read_to_tick(begun + 50);
    server.stop();
    let received = receiver.stop();
    assert_eq!(received["runs"], 1, "{received}");
    // The two frames, and frames that came before the description of the received run.
    assert!(received["foreign"].as_u64() >= Some(2), "{received}");
    assert!(received["frames"].as_u64() >= Some(50), "{received}");
    sender.stop();
}

#[test]
fn a_flood_of_descriptions_is_limited_to_a_few_per_second() {
    let far = Stage::new();
    let mut receiver = Bridge::start(&far, &["--receive", "--listen", ANY_PORT]);
    let begun = Instant::now();
    let session = connected_to_receiver(&receiver);
    (1..=4_000).for_each(|run_id| describe(&session, run_id, 5));
    let mut lines = find_last(&mut receiver, &session, 4_001);
    // A session that closes first would leave a description on the way, which zenoh cannot place then.
    lines.extend(receiver.process.terminate().expect_clean().json_lines());
    session.close().wait().expect("the session is open");
    let found = lines.iter().filter(|line| line["type"] == "found");
    let runs: HashSet<u64> = found.filter_map(|line| line["remote_run_id"].as_u64()).collect();
    let most = 8 + 5 * (begun.elapsed().as_secs() + 1);
    assert!(runs.len() as u64 <= most, "{} of {most}", runs.len());
    let received = lines.last().expect("a summary");
    assert!(received["too_fast"].as_u64() > Some(0), "{received}");
}

/// Describes a run again and again until the receiver, which limits descriptions, has found it. The link keeps their order, so the
/// receiver then has all before. Returns its lines.
fn find_last(receiver: &mut Bridge, session: &Session, last_run_id: u64) -> Vec<Value> {
    let until = Instant::now() + DEADLINE;
    let is_found = AtomicBool::new(false);
    thread::scope(|scope| {
        scope.spawn(|| {
            while !is_found.load(Ordering::Relaxed) && Instant::now() < until {
                describe(session, last_run_id, 5);
                thread::sleep(Duration::from_millis(100));
            }
        });
        let lines = receiver.process.json_until("the last run", |line| line["remote_run_id"] == last_run_id);
        is_found.store(true, Ordering::Relaxed);
        lines
    })
}

#[test]
fn a_second_source_under_the_same_key_takes_over_once_and_the_first_one_never_comes_back() {
    let (near, other, far) = (Stage::new(), Stage::new(), Stage::new());
    let server = near.serve(&["--rate", "50"]);
    let sender = Bridge::sending(&near, &[]);
    let mut receiver = Bridge::start(&far, &["--receive", "--listen", ANY_PORT, "--connect", &sender.endpoint]);
    let first = receiver.until("receiving");
    let other_server = other.serve(&["--rate", "50"]);
    let other_sender = Bridge::start(&other, &["--connect", &receiver.endpoint]);
    let second = receiver.until("receiving");
    assert_eq!(
        (&first["remote_run_id"], &second["remote_run_id"]),
        (&server.run_id.into(), &other_server.run_id.into())
    );
    let mut reader = Reader::join(&far);
    let begun = reader.next().header.tick;
    let shots = reader.read_to_tick(begun + 50);
    assert!(shots.iter().all(|shot| second["run_id"] == shot.header.run_id));
    server.stop();
    other_server.stop();
    assert_eq!(receiver.stop()["runs"], 2);
    sender.stop();
    other_sender.stop();
}
