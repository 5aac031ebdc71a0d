//! Several dragons on the bus, and what each client reads of them.

use std::collections::BTreeMap;
use std::fs;

use bench_dragon::recording::FrameReader;
use bench_dragon_ipc::{BenchState, DragonMotion, DragonState, FrameHeader, HandleState, ShowState, frame_bytes};
use serde_json::{Value, json};
use test_support::process::{Ended, Process};
use test_support::pytest::{python, run};

use crate::reader::{Reader, Shot, assert_whole};
use crate::record::await_frames;
use crate::replay::late_frames;
use crate::stage::{Stage, program};

/// Gold of 40 benches and silver of 30.
pub(crate) const TWO_DRAGONS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/two-dragons.toml");
const BENCHES: [(&str, usize); 2] = [("gold", 40), ("silver", 30)];

/// Runs a subcommand that needs no instance, in the stage's folder.
fn run_on_file(stage: &Stage, args: &[&str]) -> Ended {
    let mut command = program(args);
    command.current_dir(stage.path(""));
    Process::start(command).end()
}

/// Records two seconds in which both dragons walk. Returns the frames of the bus.
fn record(stage: &Stage, file: &str) -> Vec<Shot> {
    let walking = ["--start-at", "12", "--until", "15", "--rate", "50", "--readers", "2"];
    let server = stage.serve(&[&["--config", TWO_DRAGONS], &walking[..]].concat());
    let recorder = stage.start(&["record", file, "--format", "json"]);
    let mut reader = Reader::join(stage);
    let shots = reader.read_to_end();
    await_frames(&stage.path(file));
    server.summary();
    let ended = recorder.terminate();
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    let summary = ended.last_json();
    assert_eq!((&summary["lost"], &summary["files"]), (&json!(0), &json!([file])), "{summary}");
    shots
}

/// What a replay keeps: all except run, stamps, state and pace.
fn poses(shot: &Shot) -> Vec<u8> {
    let run = FrameHeader { run_id: 0, scheduled_ns: 0, published_ns: 0, state: 0, ..shot.header };
    frame_bytes(&FrameHeader { time_scale: 0.0, ..run }, &shot.handles)
}

#[test]
fn a_frame_has_all_dragons_and_says_what_each_does() {
    let stage = Stage::new();
    let server = stage.serve(&["--config", TWO_DRAGONS, "--until", "1", "--rate", "50", "--readers", "1"]);
    let shots = Reader::join(&stage).read_to_end();
    assert_whole(&shots, server.run_id);
    for shot in &shots {
        let header = &shot.header;
        assert_eq!((header.is_plan, header.bench_count, shot.handles.len()), (1, 70, 72));
        let places = header.dragons().iter().map(|dragon| (dragon.first_handle, dragon.bench_count));
        assert!(places.eq([(0, 40), (41, 30)]), "{header:?}");
        let benches: Vec<BenchState> = header.benches(&shot.handles).collect();
        let by_dragon: Vec<BenchState> =
            header.dragons().iter().flat_map(|dragon| dragon.benches(&shot.handles).collect::<Vec<_>>()).collect();
        assert_eq!(benches, by_dragon, "no bench is between two dragons");
        assert_eq!((header.place(39), header.place(40), header.place(69)), ((0, 39), (1, 0), (1, 29)));
    }
    let middle = &shots[shots.len() / 2].header;
    let states: Vec<_> = middle.dragons().iter().map(|dragon| dragon.dragon_state().expect("known").name()).collect();
    assert_eq!(states, ["walking", "standing"], "silver leaves at 12.5 s");
    server.summary();
}

#[test]
fn echo_prints_each_dragon_with_its_name_and_its_handles() {
    let stage = Stage::new();
    let server = stage.serve(&["--config", TWO_DRAGONS, "--until", "1", "--rate", "50", "--readers", "2"]);
    let echo = stage.start(&["echo", "--count", "20", "--format", "json"]);
    let shots = Reader::join(&stage).read_to_end();
    let lines = echo.end().expect_clean().json_lines();
    assert_eq!(lines.len(), 20);
    let handles = |handles: &[HandleState]| -> Vec<Value> {
        let line =
            |handle: &HandleState| json!({ "position_m": handle.position_m, "velocity_mps": handle.velocity_mps });
        handles.iter().map(line).collect()
    };
    for (line, shot) in lines.iter().zip(&shots) {
        let dragon = |(name, motion): (&str, &DragonMotion)| {
            json!({
                "name": name, "travel_m": motion.travel_m, "speed_mps": motion.speed_mps, "state": motion.state,
                "first_handle": motion.first_handle, "bench_count": motion.bench_count,
                "handles": handles(&shot.handles[motion.handles()]),
            })
        };
        let dragons: Vec<Value> = ["gold", "silver"].into_iter().zip(shot.header.dragons()).map(dragon).collect();
        assert_eq!((&line["tick"], &line["dragons"]), (&json!(shot.header.tick), &json!(dragons)));
        assert_eq!((&line["course_m"], &line["handles"]), (&json!(shot.header.course_m), &Value::Null));
    }
    server.summary();
    let server = stage.serve(&["--config", TWO_DRAGONS, "--held"]);
    let text = stage.run(&["echo", "--count", "1"]).expect_clean().stdout;
    assert!(text.contains("  gold front hinge (") && text.contains("  silver rear hinge ("), "{text}");
    server.stop();
}

#[test]
fn stock_readers_find_every_dragon_in_a_recording() {
    let stage = Stage::new();
    let shots = record(&stage, "a.mcap");
    let read: Vec<_> =
        FrameReader::open(&stage.path("a.mcap")).expect("a recording").map(|frame| frame.expect("one")).collect();
    assert_eq!(read.len(), shots.len());
    for (frame, shot) in read.iter().zip(&shots) {
        assert_eq!((frame.header, &frame.handles), (shot.header, &shot.handles));
    }
    let bytes: Vec<u8> = shots.iter().flat_map(Shot::wire_bytes).collect();
    fs::write(stage.path("frames.bin"), bytes).expect("a file");
    let (recording, frames) = (stage.path("a.mcap"), stage.path("frames.bin"));
    run("test_formation.py", &[("RECORDING", recording.as_os_str()), ("RECORDING_FRAMES", frames.as_os_str())]);
}

#[test]
fn a_recording_of_dragons_is_as_simulated_and_replays_bit_for_bit() {
    let stage = Stage::new();
    let shots = record(&stage, "a.mcap");
    let verified =
        run_on_file(&stage, &["replay", "--verify", "a.mcap", "--format", "json"]).expect_clean().last_json();
    assert_eq!((&verified["verified"], &verified["frames"]), (&json!(true), &json!(shots.len())), "{verified}");
    let replay = stage.start(&["replay", "a.mcap", "--stay", "--readers", "1"]);
    let mut reader = Reader::await_server(&stage);
    let replayed = reader.read_until("the replay ends", |header| header.tick + 1 == shots.len() as u64);
    assert_eq!(replayed.len(), shots.len());
    for (again, shot) in replayed.iter().zip(&shots) {
        assert_eq!(poses(again), poses(shot), "tick {}", shot.header.tick);
    }
    let headers: Vec<FrameHeader> = shots.iter().map(|shot| shot.header).collect();
    late_frames(&replayed, &headers, 1.0);
    let standing = reader.read_until("the replay stands", |header| header.show_state() == Some(ShowState::Finished));
    let header = standing.last().expect("a frame").header;
    assert_eq!((header.course_mps, header.head_speed_mps), (0.0, 0.0));
    let motions = header.dragons().iter().map(|dragon| (dragon.speed_mps, dragon.dragon_state()));
    assert!(motions.eq([(0.0, Some(DragonState::Standing)); 2]), "{header:?}");
    replay.terminate();
}

#[test]
fn a_run_of_other_dragons_begins_another_file_of_the_recording() {
    let stage = Stage::new();
    let recorder = stage.start_waiting(&["record", "a.mcap", "--format", "json"]);
    let served = |more: &[&str]| {
        let args = [&["--rate", "50", "--until", "2", "--readers", "2"], more].concat();
        let server = stage.serve(&args);
        let shots = Reader::join(&stage).read_to_end();
        server.summary();
        shots
    };
    let (one, two) = (served(&[]), served(&["--config", TWO_DRAGONS]));
    let summary = recorder.terminate().expect_clean().last_json();
    assert_eq!((&summary["files"], &summary["lost"]), (&json!(["a.mcap", "a-0002.mcap"]), &json!(0)), "{summary}");
    for (file, shots) in [("a.mcap", one), ("a-0002.mcap", two)] {
        let frames = FrameReader::open(&stage.path(file)).expect("a recording").map(|frame| frame.expect("one").header);
        assert!(frames.eq(shots.iter().map(|shot| shot.header)), "{file}");
    }
}

#[test]
fn tables_have_a_column_with_the_name_of_the_dragon() {
    let stage = Stage::new();
    let shots = record(&stage, "a.mcap");
    let table = |args: &[&str]| {
        let csv = run_on_file(&stage, &[&["export", "a.mcap", "-"], args].concat()).expect_clean().stdout;
        csv.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>()).collect::<Vec<_>>()
    };
    let benches = table(&["--benches", "--every", "0"]);
    assert_eq!(benches[0][4..8], ["dragon", "bench", "x_m", "y_m"]);
    assert_eq!(benches.len(), 1 + 70 * shots.len());
    let expected = shots.iter().flat_map(|shot| {
        shot.header.benches(&shot.handles).enumerate().map(|(number, bench)| {
            let (dragon, index) = shot.header.place(number);
            (BENCHES[dragon].0.to_owned(), index.to_string(), bench.centre_m[0])
        })
    });
    for (row, (name, index, x_m)) in benches[1..].iter().zip(expected) {
        assert_eq!((&row[4], &row[5], row[6].parse()), (&name, &index, Ok(x_m)), "{row:?}");
    }
    let handles = table(&["--every", "9"]);
    assert_eq!((handles[0][4..6].join(","), handles.len()), ("dragon,handle".to_owned(), 1 + 72));
    assert_eq!(
        (handles[41][4..6].join(","), handles[42][4..6].join(",")),
        ("gold,40".to_owned(), "silver,0".to_owned())
    );
    let frames = table(&["--frames", "--every", "9"]);
    let titles =
        ["gold_travel_m", "gold_speed_mps", "gold_state", "silver_travel_m", "silver_speed_mps", "silver_state"];
    assert_eq!(frames[0][9..], titles);
    assert_eq!((&frames[1][11], &frames[1][14]), (&"walking".to_owned(), &"standing".to_owned()));
    run_on_file(&stage, &["export", "a.mcap", "a.xlsx", "--benches", "--every", "1"]).expect_clean();
}

#[test]
fn trackers_are_numbered_on_and_have_the_names_of_the_dragons() {
    let stage = Stage::new();
    let mut command = python();
    command.args(["tests/python/psn_receivers.py", "60"]).arg(stage.path(""));
    let mut receivers = Process::start(command);
    let port = receivers.next_line().expect("the port");
    let target = format!("236.10.10.10:{port}");
    let args = ["--interface", "127.0.0.1", "--to", &target, "--benches", "gold:0..1,silver:28..", "--first-id", "101"];
    let mut bridge = stage.start_waiting(&[&["bridge", "psn", "--format", "json"], &args[..]].concat());
    let server = stage.serve(&["--config", TWO_DRAGONS, "--rate", "5", "--catch-up", "10", "--readers", "2"]);
    let mut reader = Reader::join(&stage);
    let started = bridge.json();
    let settings = started["settings"].as_str().expect("a text");
    assert!(
        settings.contains("trackers 101 to 102, 169 to 170 \"gold Bench 0\" to \"silver Bench 29\","),
        "{settings}"
    );
    assert_eq!(receivers.next_line(), None, "the receivers end after the last frame");
    receivers.end().expect_clean();
    bridge.terminate().expect_clean();
    server.stop();
    let shots = reader.read_unread();
    let epoch_ns = started["epoch_ns"].as_u64().expect("the bridge's clock has a beginning");
    let text = fs::read_to_string(stage.path("pypsn.jsonl")).expect("the receiver has written it");
    let mut lines: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    let names: BTreeMap<String, String> =
        serde_json::from_value(lines.pop().expect("names")["names"].clone()).expect("names by id");
    let expected =
        [("101", "gold Bench 0"), ("102", "gold Bench 1"), ("169", "silver Bench 28"), ("170", "silver Bench 29")];
    assert!(names.iter().map(|(id, name)| (id.as_str(), name.as_str())).eq(expected), "{names:?}");
    for frame in &lines {
        let trackers = frame["trackers"].as_array().expect("a list");
        let due_us = trackers[0][11].as_u64().expect("a time");
        let is_of = |shot: &&Shot| shot.header.scheduled_ns.saturating_sub(epoch_ns) / 1_000 == due_us;
        let shot = shots.iter().find(is_of).expect("a frame of the bus");
        for (tracker, handle) in trackers.iter().zip([0, 1, 41 + 28, 41 + 29]) {
            let bench = BenchState::between(&shot.handles[handle], &shot.handles[handle + 1]);
            for (field, expected) in [(1, bench.centre_m[0]), (3, bench.centre_m[1])] {
                let told = tracker[field].as_f64().expect("a number");
                assert!((told - expected).abs() <= 1e-6 * expected.abs().max(1.0), "{tracker}, not {expected}");
            }
        }
    }
}

#[test]
fn addresses_of_messages_have_the_names_of_the_dragons() {
    for (more, [gold, silver]) in [
        (&[][..], ["/dragon/gold/bench/0", "/dragon/silver/bench/29"]),
        (&["--address", "/stage/{index}/of/{dragon}"], ["/stage/0/of/gold", "/stage/29/of/silver"]),
    ] {
        let stage = Stage::new();
        let mut command = python();
        command.args(["tests/python/osc_receiver.py", "udp", "20"]);
        let mut receiver = Process::start(command);
        let target = format!("127.0.0.1:{}", receiver.next_line().expect("a port"));
        let args = [&["bridge", "osc", "--format", "json", "--rate", "10", "--to", target.as_str()], more].concat();
        let bridge = stage.start_waiting(&args);
        let server = stage.serve(&["--config", TWO_DRAGONS, "--rate", "5", "--catch-up", "10", "--readers", "2"]);
        let mut reader = Reader::join(&stage);
        let received = receiver.json();
        receiver.end().expect_clean();
        bridge.terminate().expect_clean();
        server.stop();
        let shots = reader.read_unread();
        for frame in received["frames"].as_array().expect("a list") {
            let messages = frame.as_array().expect("a list");
            assert_eq!((messages.len(), &messages[0][0]), (71, &json!("/dragon/show")));
            assert_eq!((&messages[1][0], &messages[70][0]), (&json!(gold), &json!(silver)));
            let shot = shots.iter().find(|shot| messages[0][1][3] == shot.header.tick).expect("a frame of the bus");
            let tail = BenchState::between(&shot.handles[70], &shot.handles[71]).centre_m[0];
            let told = messages[70][1][0].as_f64().expect("a number");
            assert!((told - tail).abs() <= 1e-6 * tail.abs().max(1.0), "{told}, not {tail}");
        }
    }
}

#[test]
fn benches_that_no_dragon_has_are_reported_with_the_names() {
    let stage = Stage::new();
    let server = stage.serve(&["--config", TWO_DRAGONS, "--held"]);
    let args = ["bridge", "osc", "--to", "127.0.0.1:9", "--benches", "gold:30..40,bronze:0..", "--format", "json"];
    let mut bridge = stage.start(&args);
    bridge.json();
    let message =
        "benches gold:40,bronze:0.. are not sent: the last bench of gold is 39, the last bench of silver is 29";
    assert_eq!(bridge.json(), json!({ "type": "notice", "message": message }));
    bridge.terminate();
    server.stop();
}
