//! A replayed recording: the same frames, bit for bit except run and stamps, and the same results of monitor and recorder.

use std::collections::hash_map::DefaultHasher;
use std::fs;
use std::hash::{Hash as _, Hasher as _};
use std::path::Path;

use bench_dragon::recording::{FrameReader, RecordedFrame, Recorder, RecorderSettings};
use bench_dragon::source::replay::PlaybackClock;
use bench_dragon_ipc::{DescriptionReader, FrameHeader, HandleState, ShowState, StatusReader};
use serde_json::{Value, json};
use test_support::eventually::eventually;
use test_support::process::Process;

use crate::periods::assert_no_frame_missing;
use crate::reader::{Reader, Shot, assert_whole};
use crate::stage::Stage;

const SECOND_NS: u64 = 1_000_000_000;

/// Starts a replay, and waits until its first pass is on the bus. Returns its first line too.
pub(crate) fn replay(stage: &Stage, args: &[&str]) -> (Process, Value) {
    let mut process = stage.start(&[&["replay", "--format", "json"], args].concat());
    let started = process.json();
    assert_eq!(started["type"], "started", "{started}");
    (process, started)
}

/// Returns all frames of a recording, each with the text of its configuration.
pub(crate) fn recorded(path: &Path) -> Vec<(RecordedFrame, String)> {
    let mut reader = FrameReader::open(path).expect("a recording");
    let mut frames = Vec::new();
    while let Some(frame) = reader.next() {
        let frame = frame.expect("a readable frame");
        let configuration = reader.configuration().expect("a configuration before the frames");
        assert_eq!(configuration.run_id, frame.header.run_id);
        frames.push((frame, configuration.toml.clone()));
    }
    frames
}

/// Returns the hash of the values that a replay keeps: all except run, tick, stamps and time scale.
fn content_hash(header: &FrameHeader, handles: &[HandleState]) -> u64 {
    let mut hasher = DefaultHasher::new();
    let FrameHeader { show_time_ns, head_travel_m, head_speed_mps, bench_count, state, .. } = *header;
    (show_time_ns, head_travel_m.to_bits(), head_speed_mps.to_bits()).hash(&mut hasher);
    (bench_count, state).hash(&mut hasher);
    let values = handles.iter().flat_map(|handle| [handle.position_m, handle.velocity_mps]).flatten();
    values.for_each(|value| value.to_bits().hash(&mut hasher));
    hasher.finish()
}

pub(crate) fn hashes_of_shots(shots: &[Shot]) -> Vec<u64> {
    shots.iter().map(|shot| content_hash(&shot.header, &shot.handles)).collect()
}

pub(crate) fn hashes_of_recorded(frames: &[(RecordedFrame, String)]) -> Vec<u64> {
    frames.iter().map(|(frame, _)| content_hash(&frame.header, &frame.handles)).collect()
}

/// Fails unless each frame of a pass was due by the recorded instants, the time scales and the rate, or was late. After a delay, the
/// frames follow a tenth faster until the replay is on time again. Returns the number of late frames.
pub(crate) fn late_frames(shots: &[Shot], recorded: &[FrameHeader], rate: f64) -> u64 {
    assert_eq!(shots.len(), recorded.len());
    let mut clock = PlaybackClock::new(rate);
    for (shot, recorded) in shots.iter().zip(recorded) {
        let came_ns = shot.header.scheduled_ns;
        assert_eq!(
            clock.due_ns(recorded.scheduled_ns, came_ns),
            came_ns,
            "no frame is due too early: {:?}",
            shot.header
        );
        assert_eq!(shot.header.time_scale, recorded.time_scale * clock.rate(), "{:?}", shot.header);
    }
    clock.overruns()
}

/// The same of a pass that has counted its late frames.
pub(crate) fn assert_paced(shots: &[Shot], recorded: &[FrameHeader], rate: f64, overruns: &Value) {
    assert_eq!(*overruns, late_frames(shots, recorded, rate), "late frames are counted");
}

/// Returns the contacts that a monitor has reported, without their runs.
pub(crate) fn contacts(lines: &[Value]) -> Vec<Value> {
    let contacts = lines.iter().filter(|line| line["kind"] == "contact");
    let without_run = contacts.cloned().map(|mut contact| {
        contact["run_id"] = Value::Null;
        contact
    });
    without_run.collect()
}

/// Returns the only contact of a show.
fn contact(lines: &[Value]) -> Value {
    let contacts = contacts(lines);
    assert_eq!(contacts.len(), 1, "{lines:?}");
    contacts[0].clone()
}

/// Records frames of one bench with these ticks and instants.
fn write_recording(path: &Path, run_id: u64, frames: &[(u64, u64)]) {
    let mut recorder = Recorder::start(RecorderSettings::new(path, 0)).expect("a recorder");
    recorder.describe(run_id, "[dragon]\nbenches = 1\n[serve]\nrate_hz = 50\n").expect("the configuration");
    for &(tick, scheduled_ns) in frames {
        let header =
            FrameHeader { run_id, tick, scheduled_ns, show_time_ns: tick as i64, bench_count: 1, ..Default::default() }
                .of_one_dragon();
        recorder.frame(&header, &[HandleState::default(); 2]).expect("a frame");
    }
    recorder.finish().expect("a finished recording");
}

/// Writes a recording of two frames, the second due an hour after the first.
fn write_long_pause(stage: &Stage) {
    write_recording(&stage.path("a.mcap"), 7, &[(0, 0), (1, 3_600 * SECOND_NS)]);
}

#[test]
fn a_replay_is_the_recording_bit_for_bit_except_run_and_stamps() {
    let stage = Stage::new();
    let pace = ["--start-at", "411", "--time-scale", "20", "--until", "413", "--readers", "2"];
    let server = stage.serve(&pace);
    let recorder = stage.start(&["record", "a.mcap"]);
    let monitor = stage.start(&["monitor", "--format", "json"]);
    let served = server.summary();
    assert_no_frame_missing(&served, 101);
    recorder.terminate().expect_clean();
    let live = contact(&monitor.terminate().expect_clean().json_lines());

    let (process, started) = replay(&stage, &["a.mcap", "--readers", "3"]);
    let recorder = stage.start(&["record", "b.mcap"]);
    let monitor = stage.start(&["monitor", "--format", "json"]);
    let shots = Reader::join(&stage).read_to_end();
    let lines = process.end().expect_clean().json_lines();
    recorder.terminate().expect_clean();
    let again = contact(&monitor.terminate().expect_clean().json_lines());

    let original = recorded(&stage.path("a.mcap"));
    assert_eq!(served["frames"], original.len());
    assert_eq!(hashes_of_shots(&shots), hashes_of_recorded(&original));
    let run_id = started["run_id"].as_u64().expect("a run has a number");
    assert_whole(&shots, run_id);
    assert_ne!(run_id, original[0].0.header.run_id);
    assert_eq!(started["recorded_run_id"], original[0].0.header.run_id);
    assert!(shots.iter().all(|shot| shot.header.published_ns >= shot.header.scheduled_ns));
    assert!(shots[0].header.scheduled_ns > original[original.len() - 1].0.header.published_ns, "restamped");
    assert_eq!(again, live, "the monitor finds the same contact");

    let copy = recorded(&stage.path("b.mcap"));
    assert_eq!(hashes_of_recorded(&copy), hashes_of_recorded(&original));
    let toml = |frames: &[(RecordedFrame, String)]| frames.iter().map(|(_, toml)| toml.clone()).collect::<Vec<_>>();
    assert_eq!(toml(&copy), toml(&original), "the description");
    let [pass, summary] = &lines[..] else { panic!("{lines:?}") };
    assert_eq!((&pass["type"], &pass["frames"], &pass["missing"]), (&json!("pass"), &served["frames"], &json!(0)));
    let headers: Vec<FrameHeader> = original.iter().map(|(frame, _)| frame.header).collect();
    assert_paced(&shots, &headers, 1.0, &pass["overruns"]);
    assert_eq!((&pass["run_id"], &pass["sim_time_s"]), (&json!(run_id), &json!(413.0)));
    assert_eq!(
        summary,
        &json!({ "type": "summary", "passes": 1, "frames": served["frames"], "cut": false, "skipped_bytes": 0 })
    );
}

#[test]
fn each_recorded_run_is_a_pass_with_its_own_description() {
    let stage = Stage::new();
    let recorder = stage.start(&["record", "a.mcap"]);
    for benches in [5, 9] {
        fs::write(stage.path("stage.toml"), format!("[dragon]\nbenches = {benches}\n")).expect("a file");
        // Each run is long enough for a reader that stays to find it.
        let run = ["--config", "stage.toml", "--rate", "10", "--until", "5", "--readers", "1"];
        assert_no_frame_missing(&stage.serve(&run).summary(), 51);
    }
    recorder.terminate();
    let original = recorded(&stage.path("a.mcap"));

    let (mut process, first) = replay(&stage, &["a.mcap", "--readers", "2"]);
    let recorder = stage.start(&["record", "b.mcap"]);
    let mut reader = Reader::join(&stage);
    let (one, other) = (reader.read_to_end(), reader.read_to_end());
    let second =
        process.json_until("the second replay starts", |line| line["type"] == "started").pop().expect("a line");
    let summary = process.end().expect_clean().last_json();
    recorder.terminate().expect_clean();
    for (shots, started, benches) in [(&one, first, 5), (&other, second, 9)] {
        assert_whole(shots, started["run_id"].as_u64().expect("a run has a number"));
        assert!(shots.iter().all(|shot| shot.header.bench_count == benches));
    }
    assert_eq!(hashes_of_shots(&[one, other].concat()), hashes_of_recorded(&original));
    let copy = recorded(&stage.path("b.mcap"));
    assert_eq!(hashes_of_recorded(&copy), hashes_of_recorded(&original));
    assert!(copy.iter().zip(&original).all(|((_, copy), (_, original))| copy == original), "the descriptions");
    let frames = original.len();
    assert_eq!(summary, json!({ "type": "summary", "passes": 2, "frames": frames, "cut": false, "skipped_bytes": 0 }));
}

#[test]
fn lost_frames_of_a_recording_leave_a_pause_and_no_hole_in_the_ticks() {
    let stage = Stage::new();
    let ticks = (10..40).chain(60..100);
    let frames: Vec<(u64, u64)> = ticks.map(|tick| (tick, SECOND_NS + tick * SECOND_NS / 200)).collect();
    write_recording(&stage.path("a.mcap"), 7, &frames);
    let (process, started) = replay(&stage, &["a.mcap", "--readers", "1"]);
    let mut reader = Reader::join(&stage);
    let shots = reader.read_to_tick(69);
    let pass = process.end().expect_clean().json_lines().swap_remove(0);
    assert_whole(&shots, started["run_id"].as_u64().expect("a run has a number"));
    assert_eq!((&pass["frames"], &pass["missing"]), (&json!(70), &json!(20)));
    let replayed: Vec<i64> = shots.iter().map(|shot| shot.header.show_time_ns).collect();
    assert_eq!(replayed, frames.iter().map(|&(tick, _)| tick as i64).collect::<Vec<_>>());
    let header = |&(tick, scheduled_ns): &(u64, u64)| FrameHeader { tick, scheduled_ns, ..Default::default() };
    assert_paced(&shots, &frames.iter().map(header).collect::<Vec<_>>(), 1.0, &pass["overruns"]);
}

#[test]
fn a_cut_recording_is_replayed_up_to_the_cut_and_reported() {
    let stage = Stage::new();
    write_recording(&stage.path("whole.mcap"), 7, &[(0, 0), (1, 1_000), (2, 2_000)]);
    let bytes = fs::read(stage.path("whole.mcap")).expect("the recording");
    let summary_start = mcap::read::footer(&bytes).expect("a footer").summary_start as usize;
    // The cut is after the frames, within the record that ends the data.
    fs::write(stage.path("a.mcap"), &bytes[..summary_start - 5]).expect("a cut recording");
    let ended = stage.run(&["replay", "a.mcap", "--format", "json"]);
    assert_eq!(ended.stderr, "a.mcap stops in the middle: its complete part was replayed\n");
    assert_eq!(ended.code(), Some(0));
    assert_eq!(
        ended.last_json(),
        json!({ "type": "summary", "passes": 1, "frames": 3, "cut": true, "skipped_bytes": 0 })
    );
}

#[test]
fn a_client_may_not_change_a_replayed_show() {
    let stage = Stage::new();
    write_long_pause(&stage);
    let (process, started) = replay(&stage, &["a.mcap", "--readers", "1"]);
    Reader::join(&stage).read_to_tick(0);
    let refused: [&[&str]; 3] = [&["speed", "1"], &["hold"], &["release"]];
    for order in refused {
        let reply = stage.run(&[&["ctl", "--format", "json"], order].concat());
        let line = reply.last_json();
        assert_eq!((reply.code(), &line["accepted"], &line["run_id"]), (Some(1), &json!(false), &started["run_id"]));
        assert_eq!(
            line["reason"],
            "the source replays a recording: it accepts only pause, resume, seek, pace and stop"
        );
    }
    assert_eq!(stage.run(&["ctl", "stop"]).expect_clean().stdout, "accepted, from tick 1 on\n");
    let summary = process.end().expect_clean().last_json();
    assert_eq!(summary, json!({ "type": "summary", "passes": 1, "frames": 1, "cut": false, "skipped_bytes": 0 }));
}

#[test]
fn a_signal_ends_a_replay_with_its_summary_in_one_line() {
    let stage = Stage::new();
    write_long_pause(&stage);
    let process = stage.start(&["replay", "a.mcap", "--readers", "1"]);
    let instance = stage.domain().instance();
    let announced = process.complaint();
    assert!(announced.starts_with(&format!("replaying a.mcap on instance {instance}, run ")), "{announced}");
    Reader::join(&stage).read_to_tick(0);
    let text = process.terminate().expect_clean().stdout;
    assert!(
        text.starts_with("1 frame to 0.000000 s, 0 overruns, lateness p50 ") && text.lines().count() == 1,
        "{text}"
    );
}

#[test]
fn a_replay_publishes_its_status_and_the_recorded_description() {
    let stage = Stage::new();
    write_long_pause(&stage);
    let (process, started) = replay(&stage, &["a.mcap", "--readers", "1"]);
    let descriptions = DescriptionReader::open(stage.domain(), "test").expect("the replay has created the services");
    let statuses = StatusReader::open(stage.domain(), "test").expect("the replay has created the services");
    Reader::join(&stage).read_to_tick(0);
    let description = eventually("the description is there", || descriptions.poll().expect("the bus is readable"));
    let status = eventually("the status is there", || statuses.poll().expect("the bus is readable"));
    assert_eq!(started["run_id"], description.run_id);
    assert_eq!(description.toml, "[dragon]\nbenches = 1\n[serve]\nrate_hz = 50\n");
    assert_eq!((started["run_id"].as_u64(), status.pid), (Some(status.run_id), process.pid()));
    assert_eq!((status.rate_hz, status.show_state()), (50, Some(ShowState::Running)));
    process.terminate().expect_clean();
}

#[test]
fn an_instance_has_one_source_a_server_or_a_replay() {
    let stage = Stage::new();
    write_long_pause(&stage);
    let told = |process: &Process| {
        let (instance, pid) = (stage.domain().instance(), process.pid());
        format!(
            "error: a server already runs on instance \"{instance}\", pid {pid}: stop it, or choose another --instance\n"
        )
    };
    let (process, _) = replay(&stage, &["a.mcap"]);
    for second in [&["serve"][..], &["replay", "a.mcap"]] {
        let refused = stage.run(second);
        assert_eq!((refused.code(), refused.stderr), (Some(1), told(&process)), "{second:?}");
    }
    process.terminate().expect_clean();
    let server = stage.serve(&[]);
    let refused = stage.run(&["replay", "a.mcap"]);
    assert_eq!((refused.code(), refused.stderr), (Some(1), told(&server.process)));
    server.stop();
}

#[test]
fn each_kind_of_file_that_cannot_be_replayed_has_its_message() {
    let stage = Stage::new();
    fs::write(stage.path("letter"), "not a recording").expect("a file");
    write_recording(&stage.path("empty.mcap"), 7, &[]);
    let mut nameless = Recorder::start(RecorderSettings::new(stage.path("nameless.mcap"), 0)).expect("a recorder");
    let header = FrameHeader { run_id: 7, bench_count: 1, ..Default::default() }.of_one_dragon();
    nameless.frame(&header, &[HandleState::default(); 2]).expect("a frame");
    nameless.finish().expect("a finished recording");
    let mut uneven = Recorder::start(RecorderSettings::new(stage.path("uneven.mcap"), 0)).expect("a recorder");
    uneven.frame(&header, &[HandleState::default(); 3]).expect("a frame");
    uneven.finish().expect("a finished recording");
    for (file, code, error) in [
        ("none.mcap", 2, "cannot read none.mcap: No such file or directory (os error 2)"),
        ("letter", 2, "letter is not an MCAP recording"),
        ("empty.mcap", 1, "empty.mcap holds no frames"),
        ("nameless.mcap", 1, "nameless.mcap holds frames of run 7, but not its configuration"),
        ("uneven.mcap", 1, "the replay ends early: uneven.mcap holds a message on /dragon/frames that is not a frame"),
    ] {
        let ended = stage.run(&["replay", file]);
        assert_eq!((ended.code(), ended.stderr), (Some(code), format!("error: {error}\n")), "{file}");
    }
}
