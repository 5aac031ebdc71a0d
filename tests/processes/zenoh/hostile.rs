//! What others put under our keys.

use bench_dragon::bridge::zenoh::wire::encode_frame;
use bench_dragon_ipc::{FrameHeader, HandleState};
use serde_json::json;
use zenoh::{Config, Session, Wait as _};

use super::bridges::{ANY_PORT, Bridge, KEY};
use crate::reader::{Reader, assert_accounted_for};
use crate::stage::Stage;

fn connected(endpoint: &str) -> Session {
    let config = json!({
        "mode": "peer",
        "connect": { "endpoints": [endpoint] },
        "listen": { "endpoints": [] },
        "scouting": { "multicast": { "enabled": false } },
    });
    zenoh::open(Config::from_json5(&config.to_string()).expect("a configuration")).wait().expect("it listens")
}

#[test]
fn what_is_malformed_or_foreign_is_counted_and_dropped_and_the_show_goes_on() {
    let (near, far) = (Stage::new(), Stage::new());
    let server = near.serve(&["--rate", "50"]);
    let sender = Bridge::sending(&near, &[]);
    let mut receiver = Bridge::start(&far, &["--receive", "--listen", ANY_PORT, "--connect", &sender.endpoint]);
    let remote_run_id = receiver.until("receiving")["remote_run_id"].as_u64().expect("a number");
    let mut reader = Reader::join(&far);
    let mut shots = vec![reader.next()];

    let session = connected(&receiver.endpoint);
    let put = |key: &str, payload: Vec<u8>| session.put(format!("{KEY}/{key}"), payload).wait().expect("it is open");
    let handles = [HandleState::default(); 3];
    let sound = FrameHeader { run_id: remote_run_id, tick: u64::MAX - 9, bench_count: 2, ..FrameHeader::default() };
    let not_finite = FrameHeader { head_travel_m: f64::NAN, ..sound };
    let malformed =
        [vec![], vec![0; 71], vec![0xff; 300], encode_frame(&not_finite, &handles), encode_frame(&sound, &handles)];
    for payload in malformed.clone() {
        put("frames", payload.clone());
        put("alerts", payload.clone());
        put("description", payload);
    }
    // Of a dragon as sound as ours, but no run that anybody has described.
    let foreign = encode_frame(&FrameHeader { run_id: remote_run_id ^ 1, ..sound }, &handles);
    put("frames", foreign);
    // As sound as can be, but of a tick that the run reaches in half a billion years.
    let ahead = FrameHeader { bench_count: 223, ..sound };
    put("frames", encode_frame(&ahead, &[HandleState::default(); 224]));
    session.get(format!("{KEY}/commands")).wait().expect("it is open");
    session.close().wait().expect("it is open");

    shots.extend(reader.read_to_tick(shots[0].header.tick + 100));
    assert_accounted_for(&shots, reader.lost());
    server.stop();
    let received = receiver.stop();
    assert_eq!(received["malformed"], 3 * malformed.len(), "{received}");
    assert_eq!((&received["foreign"], &received["too_fast"]), (&json!(1), &json!(1)), "{received}");
    assert_eq!((&received["lost"], &received["not_new"]), (&json!(0), &json!(0)), "{received}");
    sender.stop();
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
