//! PosiStageNet, received by two programs of other authors: `pypsn` of PyPI and `@jwetzell/posistagenet` of npm.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use bench_dragon_ipc::BenchState;
use serde_json::Value;
use test_support::process::Process;
use test_support::pytest::python;
use test_support::skip::skip;

use crate::reader::{Reader, Shot};
use crate::stage::Stage;

const BENCHES: usize = 223;
/// Frames of ten seconds.
const FRAMES: usize = 600;
const RATE_HZ: usize = 60;
const PACKETS_IN_A_FRAME: usize = 12;

/// The frames and names that one receiver decoded.
#[derive(Debug)]
struct Received {
    frames: Vec<Value>,
    names: Value,
}

/// Ends the reading when it is dropped, also if an assertion fails.
#[derive(Debug)]
struct Over<'a>(&'a AtomicBool);

impl Drop for Over<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

impl Received {
    fn read(path: &Path) -> Self {
        let text = fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let mut lines: Vec<Value> =
            text.lines().map(|line| serde_json::from_str(line).expect("the receiver writes JSON")).collect();
        let names = lines.pop().expect("the last line has the names");
        Self { frames: lines, names }
    }
}

#[test]
fn two_receivers_get_every_tracker_of_every_frame_for_ten_seconds() {
    let stage = Stage::new();
    let (mut receivers, port) = start_receivers(&stage);
    let target = format!("236.10.10.10:{port}");
    let rate = RATE_HZ.to_string();
    let args = ["bridge", "psn", "--interface", "127.0.0.1", "--to", &target, "--rate", &rate, "--format", "json"];
    let mut bridge = stage.start_waiting(&args);
    let server = stage.serve(&["--rate", "50", "--time-scale", "5", "--readers", "2"]);
    let is_over = AtomicBool::new(false);
    let (shots, summary, epoch_ns) = thread::scope(|scope| {
        let reader = scope.spawn(|| read_until(&stage, &is_over));
        let over = Over(&is_over);
        let started = bridge.json();
        assert_eq!((&started["type"], &started["to"]), (&"started".into(), &target.as_str().into()), "{started}");
        assert_eq!(receivers.next_line(), None, "the receivers end after the last frame");
        receivers.end().expect_clean();
        let summary = bridge.terminate().expect_clean().last_json();
        drop(over);
        let shots = reader.join().expect("the reader does not panic");
        (shots, summary, started["epoch_ns"].as_u64().expect("the bridge's clock has a beginning"))
    });
    server.stop();

    let sent = summary["frames"].as_u64().expect("a count");
    assert!(sent >= FRAMES as u64, "{summary}");
    assert_eq!((&summary["errors"], &summary["dropped"]), (&0.into(), &0.into()));
    for file in decoded(&stage) {
        let received = Received::read(&file);
        assert_eq!(received.frames.len(), FRAMES, "{}", file.display());
        assert_names(&received.names, &stage);
        let mut stale = 0;
        for (index, frame) in received.frames.iter().enumerate() {
            assert_whole(frame, index);
            stale += u64::from(!assert_is_of_the_bus(frame, &shots, epoch_ns));
        }
        // A busy machine may delay the server for longer than a frame is fresh.
        assert!(summary["stale"].as_u64() >= Some(stale), "{stale}: {summary}");
    }
}

/// Returns the paths of the files that the receivers write.
fn decoded(stage: &Stage) -> Vec<PathBuf> {
    let by_npm = node_script().map(|_| stage.path("npm.jsonl"));
    [stage.path("pypsn.jsonl")].into_iter().chain(by_npm).collect()
}

/// Starts both receivers, and waits until they have joined the group. Returns them with their port.
fn start_receivers(stage: &Stage) -> (Process, String) {
    let mut command = python();
    command.args(["tests/python/psn_receivers.py", &FRAMES.to_string()]).arg(stage.path(""));
    match node_script() {
        Some(script) => drop(command.arg(script)),
        None => skip("tests/run has not installed the packages of tests/node"),
    }
    let mut receivers = Process::start(command);
    let port = receivers.next_line().expect("the port");
    (receivers, port)
}

fn node_script() -> Option<&'static str> {
    let folder = PathBuf::from(env::var_os("BENCH_DRAGON_NODE")?);
    folder.join("node_modules").exists().then_some("tests/node/psn_receiver.cjs")
}

/// Reads every frame of a server until the flag is set.
fn read_until(stage: &Stage, is_over: &AtomicBool) -> Vec<Shot> {
    let mut reader = Reader::join(stage);
    let mut shots = Vec::new();
    while !is_over.load(Ordering::Relaxed) {
        shots.push(reader.next());
    }
    shots.extend(reader.read_unread());
    assert_eq!(reader.lost(), 0);
    shots
}

fn assert_names(names: &Value, stage: &Stage) {
    assert_eq!(names["system_name"], format!("bench-dragon {}", stage.domain().instance()));
    let longest = names["longest"].as_u64().expect("a length");
    assert!(longest <= 1_472, "{longest} bytes");
    let names = names["names"].as_object().expect("names by id");
    assert_eq!(names.len(), BENCHES);
    for (id, name) in names {
        assert_eq!(*name, format!("Bench {id}"));
    }
}

/// Fails unless frame ids are consecutive, each packet has the number of packets, and no tracker is missing.
fn assert_whole(frame: &Value, index: usize) {
    assert_eq!(frame["frame_id"], index % 256, "frame {index}");
    let headers = frame["headers"].as_array().expect("a list of packets");
    assert_eq!(headers.len(), PACKETS_IN_A_FRAME, "frame {index}");
    for header in headers {
        let [timestamp_us, high, low, count] = header.as_array().expect("a list").as_slice() else {
            panic!("{header}")
        };
        assert_eq!(*timestamp_us, headers[0][0]);
        assert_eq!((high, low, count), (&2.into(), &3.into(), &PACKETS_IN_A_FRAME.into()));
    }
    let ids = frame["trackers"].as_array().expect("a list").iter().map(|tracker| tracker[0].as_u64());
    assert!(ids.eq((0..BENCHES as u64).map(Some)), "frame {index}");
}

/// Fails unless every value equals that of the frame of the bus with the trackers' time. Returns whether the frame is marked as
/// fresh.
fn assert_is_of_the_bus(frame: &Value, shots: &[Shot], epoch_ns: u64) -> bool {
    let timestamp_us = frame["trackers"][0][11].as_u64().expect("a time");
    let sent_us = |shot: &Shot| (shot.header.published_ns - epoch_ns) / 1_000;
    let shot = shots.iter().find(|shot| sent_us(shot) == timestamp_us).expect("a frame of the bus");
    assert!(frame["headers"][0][0].as_u64() >= Some(timestamp_us), "the packet is older than its frame");
    let trackers = frame["trackers"].as_array().expect("a list");
    let is_fresh = trackers[0][10] == 1.0;
    for (tracker, handles) in trackers.iter().zip(shot.handles.windows(2)) {
        let expected = tracker_of(&BenchState::between(&handles[0], &handles[1]), shot.header.time_scale, is_fresh);
        let told: Vec<f64> =
            tracker.as_array().expect("a list")[1..].iter().map(|value| value.as_f64().expect("a number")).collect();
        assert_eq!(told[10], timestamp_us as f64);
        for (told, expected) in told.iter().zip(expected) {
            let apart = (told - expected).abs();
            assert!(apart <= f64::from(f32::EPSILON) * expected.abs().max(1e-30), "{tracker}, not {expected}");
        }
    }
    is_fresh
}

/// Returns position, speed, orientation and status as documented: y and z are swapped, angles change their sign, and a stale
/// tracker has no speed.
fn tracker_of(bench: &BenchState, time_scale: f64, is_fresh: bool) -> [f64; 10] {
    let factor = if is_fresh { time_scale } else { 0.0 };
    let ([x, y, z], [vx, vy, vz]) = (bench.centre_m, bench.velocity_mps.map(|value| value * factor));
    [x, z, y, vx, vz, vy, 0.0, -bench.heading_rad, 0.0, f64::from(is_fresh)]
}
