//! PosiStageNet, received by two programs of other authors: `pypsn` of PyPI and `@jwetzell/posistagenet` of npm.

use std::collections::BTreeMap;
use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use bench_dragon_ipc::BenchState;
use glam::{DQuat, DVec3};
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
    let (mut receivers, port) = start_receivers(&stage, FRAMES);
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
        let name = stage.domain().instance();
        let settings = format!(
            "PosiStageNet: multicast 236.10.10.10 port {port}, system \"bench-dragon {name}\", trackers 0 to 222 \"Bench 0\" to \
             \"Bench 222\", axes x right, y up, z away, metres and radians, at the centre of each board"
        );
        assert_eq!(started["settings"], settings);
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

/// Flags of a desk whose stage is turned, and where the head and the tail are trackers 101 and 321 to 323.
const ON_A_DESK: [&str; 14] = [
    "--benches",
    "0,220..",
    "--first-id",
    "101",
    "--tracker-name",
    "Dragon {index} is {id}",
    "--rotate",
    "90",
    "--offset",
    "-12,3.5,1",
    "--axes",
    "-x,z,y",
    "--spin-us",
    "100",
];

#[test]
fn two_receivers_get_the_chosen_benches_with_ids_and_names_where_the_desk_has_them() {
    // Two seconds: the decoder of npm does not assemble the first frame of names.
    let frames = 120;
    let stage = Stage::new();
    let (mut receivers, port) = start_receivers(&stage, frames);
    let target = format!("236.10.10.10:{port}");
    let args = ["bridge", "psn", "--interface", "127.0.0.1", "--to", &target, "--format", "json"];
    let mut bridge = stage.start_waiting(&[&args[..], &ON_A_DESK].concat());
    // The bus keeps all frames of this rate until the receivers have ended.
    let server = stage.serve(&["--rate", "5", "--time-scale", "5", "--catch-up", "10", "--readers", "2"]);
    let mut reader = Reader::join(&stage);
    let started = bridge.json();
    let settings = started["settings"].as_str().expect("a text");
    let trackers = "trackers 101, 321 to 323 \"Dragon 0 is 101\" to \"Dragon 222 is 323\", axes x left, y up, z away, ";
    assert!(settings.contains(trackers), "{settings}");
    assert_eq!(receivers.next_line(), None, "the receivers end after the last frame");
    receivers.end().expect_clean();
    bridge.terminate().expect_clean();
    server.stop();
    let shots = reader.read_unread();
    let epoch_ns = started["epoch_ns"].as_u64().expect("the bridge's clock has a beginning");
    for file in decoded(&stage) {
        let received = Received::read(&file);
        let names: BTreeMap<u64, &str> = received.names["names"]
            .as_object()
            .expect("names by id")
            .iter()
            .map(|(id, name)| (id.parse().expect("an id"), name.as_str().expect("a name")))
            .collect();
        let expected = [
            (101, "Dragon 0 is 101"),
            (321, "Dragon 220 is 321"),
            (322, "Dragon 221 is 322"),
            (323, "Dragon 222 is 323"),
        ];
        assert_eq!(names, BTreeMap::from(expected));
        assert_eq!(received.frames.len(), frames, "{}", file.display());
        for frame in &received.frames {
            assert_is_on_the_desk(frame, &shots, epoch_ns);
        }
    }
}

/// Fails unless each tracker is where the flags put its bench. The quarter turn puts (x, y, z) at (-y, x, z), the offset at
/// (-y - 12, x + 3.5, z + 1), and the desk's axes are left, up, away. So a board with the direction (cos h, sin h) on the bus has
/// (sin h, 0, cos h) on the desk.
fn assert_is_on_the_desk(frame: &Value, shots: &[Shot], epoch_ns: u64) {
    let trackers = frame["trackers"].as_array().expect("a list");
    assert!(trackers.iter().map(|tracker| tracker[0].as_u64()).eq([101, 321, 322, 323].map(Some)), "{frame}");
    let shot = shot_of(frame, shots, epoch_ns);
    let factor = if trackers[0][10] == 1.0 { shot.header.time_scale } else { 0.0 };
    for (tracker, index) in trackers.iter().zip([0, 220, 221, 222]) {
        let bench = BenchState::between(&shot.handles[index], &shot.handles[index + 1]);
        let ([x, y, z], [vx, vy, vz]) = (bench.centre_m, bench.velocity_mps.map(|value| value * factor));
        let expected = [y + 12.0, z + 1.0, x + 3.5, vy, vz, vx];
        let numbers: Vec<f64> = (1..10).map(|field| tracker[field].as_f64().expect("a number")).collect();
        for (told, expected) in numbers.iter().zip(expected) {
            assert!((told - expected).abs() <= 1e-6 * expected.abs().max(1.0), "{tracker}, not {expected}");
        }
        let direction = DVec3::new(bench.heading_rad.sin(), 0.0, bench.heading_rad.cos());
        let turned = DQuat::from_scaled_axis(DVec3::new(numbers[6], numbers[7], numbers[8])) * DVec3::X;
        assert!(turned.distance(direction) < 1e-5, "{tracker}: {turned}, not {direction}");
    }
}

/// Returns the frame of the bus with the time of the trackers.
fn shot_of<'a>(frame: &Value, shots: &'a [Shot], epoch_ns: u64) -> &'a Shot {
    let timestamp_us = frame["trackers"][0][11].as_u64().expect("a time");
    let due_us = |shot: &Shot| shot.header.scheduled_ns.saturating_sub(epoch_ns) / 1_000;
    shots.iter().find(|shot| due_us(shot) == timestamp_us).expect("a frame of the bus")
}

/// Returns the paths of the files that the receivers write.
fn decoded(stage: &Stage) -> Vec<PathBuf> {
    let by_npm = node_script().map(|_| stage.path("npm.jsonl"));
    [stage.path("pypsn.jsonl")].into_iter().chain(by_npm).collect()
}

/// Starts both receivers for a number of frames, and waits until they have joined the group. Returns them with their port.
fn start_receivers(stage: &Stage, frames: usize) -> (Process, String) {
    let mut command = python();
    command.args(["tests/python/psn_receivers.py", &frames.to_string()]).arg(stage.path(""));
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
    let shot = shot_of(frame, shots, epoch_ns);
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
