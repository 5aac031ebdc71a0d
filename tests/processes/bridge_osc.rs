//! Open Sound Control, received by `python-osc` of PyPI.

use std::f64::consts::PI;

use bench_dragon_ipc::BenchState;
use serde_json::Value;
use test_support::process::Process;
use test_support::pytest::python;

use crate::reader::{Reader, Shot};
use crate::stage::Stage;

const BENCHES: usize = 223;
const FRAMES: usize = 10;

/// A kind of transport and its expected messages.
#[derive(Clone, Copy, Debug)]
struct Way {
    transport: &'static str,
    args: &'static [&'static str],
    show_address: &'static str,
    bench_address: fn(usize) -> String,
    degrees: bool,
    /// Whether a bench is sent.
    is_chosen: fn(usize) -> bool,
    /// Position and heading in radians, of a bench with these on the bus.
    placed: fn([f64; 4]) -> [f64; 4],
}

const PLAIN: Way = Way {
    transport: "udp",
    args: &[],
    show_address: "/dragon/show",
    bench_address: |index| format!("/dragon/bench/{index}"),
    degrees: true,
    is_chosen: |_| true,
    placed: |pose| pose,
};

const NAMED: Way = Way {
    args: &["--address", "/stage/{index}/pose", "--show-address", "/stage/show", "--angle", "radians"],
    show_address: "/stage/show",
    bench_address: |index| format!("/stage/{index}/pose"),
    degrees: false,
    ..PLAIN
};

/// A renderer with y up and z towards the audience, where the dragon is turned to the left and moved.
const PLACED: Way = Way {
    args: &["--benches", "0,7..9,221..", "--rotate", "90", "--offset", "-12,3.5,1", "--axes", "x,z,-y"],
    is_chosen: |index| index == 0 || (7..=9).contains(&index) || index >= 221,
    placed: |[x, y, z, heading]| {
        let turned = heading + PI / 2.0;
        [-y - 12.0, z + 1.0, -(x + 3.5), (-turned.sin()).atan2(turned.cos())]
    },
    ..PLAIN
};

#[test]
fn python_osc_receives_every_bench_as_a_message() {
    let received = receive(PLAIN);
    assert!(received["times"].as_array().is_some_and(|times| times.iter().all(Value::is_null)));
}

#[test]
fn addresses_and_angles_follow_the_flags() {
    receive(NAMED);
}

#[test]
fn python_osc_receives_the_chosen_benches_where_the_transform_puts_them() {
    receive(PLACED);
}

#[test]
fn python_osc_receives_bundles_that_fit_into_a_datagram_and_carry_the_time() {
    let received = receive(Way { args: &["--bundle"], ..PLAIN });
    assert!(received["longest"].as_u64() <= Some(1_472), "{}", received["longest"]);
    let now_s = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).expect("after 1970").as_secs_f64();
    let times: Vec<f64> = received["times"].as_array().expect("a list").iter().filter_map(Value::as_f64).collect();
    assert!(times.len() > FRAMES && times.len() < FRAMES * BENCHES, "{} bundles", times.len());
    assert!(times.is_sorted() && times.iter().all(|time| *time <= now_s && now_s - time < 3_600.0), "{times:?}");
}

#[test]
fn python_osc_receives_messages_and_bundles_by_tcp() {
    receive(Way { transport: "tcp", args: &["--tcp"], ..PLAIN });
    receive(Way { transport: "tcp", args: &["--tcp", "--bundle"], ..PLAIN });
}

/// Runs a server, a bridge and python-osc, and compares every received value with the bus.
fn receive(way: Way) -> Value {
    let stage = Stage::new();
    let mut receiver = start_receiver(way.transport);
    let port = receiver.next_line().expect("a port");
    let target = format!("127.0.0.1:{port}");
    let args = [&["bridge", "osc", "--format", "json", "--rate", "10", "--to", target.as_str()], way.args].concat();
    let mut bridge = stage.start_waiting(&args);
    // At this rate the bus keeps forty seconds for the reader, which reads when the receiver has ended.
    let server = stage.serve(&["--rate", "5", "--time-scale", "10", "--catch-up", "10", "--readers", "2"]);
    let mut reader = Reader::join(&stage);
    assert_eq!(bridge.json()["to"], target.as_str());
    let received = receiver.json();
    receiver.end().expect_clean();
    let summary = bridge.terminate().expect_clean().last_json();
    assert!(summary["frames"].as_u64() >= Some(FRAMES as u64), "{summary}");
    server.stop();
    let shots = reader.read_unread();
    assert_eq!(reader.lost(), 0);
    let frames = received["frames"].as_array().expect("a list");
    assert_eq!(frames.len(), FRAMES);
    for frame in frames {
        assert_is_of_the_bus(frame, &shots, way);
    }
    received
}

fn start_receiver(transport: &str) -> Process {
    let mut command = python();
    command.args(["tests/python/osc_receiver.py", transport, &FRAMES.to_string()]);
    Process::start(command)
}

fn assert_is_of_the_bus(frame: &Value, shots: &[Shot], way: Way) {
    let messages = frame.as_array().expect("a list");
    assert_eq!(messages.len(), 1 + (0..BENCHES).filter(|index| (way.is_chosen)(*index)).count());
    assert_eq!(messages[0][0], way.show_address);
    let show = &messages[0][1];
    let shot = shots.iter().find(|shot| show[3] == shot.header.tick).expect("a frame of the bus");
    assert_close(&show[0], shot.header.show_time_s());
    assert_eq!((&show[1], &show[2]), (&"running".into(), &10.0.into()));
    // A frame is stale if a busy machine has delayed the server.
    let is_fresh = show[4] == 1;
    assert!(is_fresh || show[4] == 0, "{show}");
    let time_scale = if is_fresh { 10.0 } else { 0.0 };
    let chosen = shot.handles.windows(2).enumerate().filter(|(index, _)| (way.is_chosen)(*index));
    for (message, (index, handles)) in messages[1..].iter().zip(chosen) {
        assert_eq!(message[0], (way.bench_address)(index));
        let bench = BenchState::between(&handles[0], &handles[1]);
        let [x, y, z] = bench.centre_m;
        let [x, y, z, heading] = (way.placed)([x, y, z, bench.heading_rad]);
        let heading = if way.degrees { heading * 180.0 / PI } else { heading };
        for (told, expected) in [x, y, z, heading, bench.speed_mps() * time_scale].into_iter().enumerate() {
            assert_close(&message[1][told], expected);
        }
        assert!(message[1][5].is_null(), "{message}");
    }
}

fn assert_close(told: &Value, expected: f64) {
    let apart = (told.as_f64().expect("a number") - expected).abs();
    assert!(apart <= f64::from(f32::EPSILON) * expected.abs(), "{told}, not {expected}");
}
