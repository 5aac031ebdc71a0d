//! Parts of a recording, replayed slower or faster, once or several times.

use std::path::Path;

use bench_dragon::recording::{Recorder, RecorderSettings};
use bench_dragon_ipc::{FrameHeader, HandleState};
use serde_json::{Value, json};
use test_support::process::Process;

use crate::reader::{Reader, Shot, assert_whole};
use crate::replay::{assert_paced, contacts, hashes_of_recorded, hashes_of_shots, recorded, replay};
use crate::stage::Stage;

const MILLISECOND_NS: u64 = 1_000_000;

/// Records runs of one bench. Each run has a frame every 5 ms, with these show times in milliseconds.
fn write_runs(path: &Path, runs: &[Vec<i64>]) {
    let mut recorder = Recorder::start(RecorderSettings::new(path, 0)).expect("a recorder");
    let mut scheduled_ns = 1_000 * MILLISECOND_NS;
    for (run_id, times_ms) in (7..).zip(runs) {
        recorder.describe(run_id, &format!("[dragon]\nbenches = 1\n# run {run_id}\n")).expect("the configuration");
        for (tick, time_ms) in (0..).zip(times_ms) {
            scheduled_ns += 5 * MILLISECOND_NS;
            let show_time_ns = time_ms * MILLISECOND_NS as i64;
            let header = FrameHeader {
                run_id,
                tick,
                scheduled_ns,
                show_time_ns,
                bench_count: 1,
                time_scale: 0.3,
                ..Default::default()
            }
            .of_one_dragon();
            let handle = HandleState { position_m: [*time_ms as f64, 0.1, tick as f64], ..Default::default() };
            recorder.frame(&header, &[handle; 2]).expect("a frame");
        }
    }
    recorder.finish().expect("a finished recording");
}

/// Reads all frames of successive passes.
fn read_passes(reader: &mut Reader, frames: &[usize]) -> Vec<Vec<Shot>> {
    let read = |&frames: &usize| -> Vec<Shot> { (0..frames).map(|_| reader.next()).collect() };
    frames.iter().map(read).collect()
}

/// Returns the run ids of the reported passes.
fn run_ids(started: &Value, lines: &[Value]) -> Vec<u64> {
    let others = lines.iter().filter(|line| line["type"] == "started");
    [started].into_iter().chain(others).map(|line| line["run_id"].as_u64().expect("a run has a number")).collect()
}

fn passes(lines: &[Value]) -> Vec<&Value> {
    lines.iter().filter(|line| line["type"] == "pass").collect()
}

#[test]
fn an_interval_is_every_frame_of_its_show_times_wherever_it_was_recorded() {
    let stage = Stage::new();
    // The second run seeks back into the interval. The third never enters it.
    let runs = [(0..100).collect(), (50..90).chain(40..70).collect(), (200..300).collect(), (20..61).collect()];
    write_runs(&stage.path("a.mcap"), &runs);
    let (process, started) = replay(&stage, &["a.mcap", "--from", "0.055", "--to", "0.0605", "--readers", "1"]);
    let shots = read_passes(&mut Reader::join(&stage), &[6, 12, 6]);
    let lines = process.end().expect_clean().json_lines();
    let inside = |frame: &FrameHeader| (55..=60).contains(&(frame.show_time_ns / MILLISECOND_NS as i64));
    let original = recorded(&stage.path("a.mcap"));
    let wanted: Vec<_> = original.into_iter().filter(|(frame, _)| inside(&frame.header)).collect();
    assert_eq!(hashes_of_shots(&shots.concat()), hashes_of_recorded(&wanted));
    let run_ids = run_ids(&started, &lines);
    assert_eq!(run_ids.len(), 3);
    for (shots, run_id) in shots.iter().zip(run_ids) {
        assert_whole(shots, run_id);
    }
    assert!(passes(&lines).iter().all(|pass| pass["missing"] == 0), "omitted frames are not missing: {lines:?}");
    // Omitted frames cause no pause: neighbours are one period apart, except for counted delays.
    let put_off = shots[1].windows(2).filter(|pair| {
        let apart_ns = pair[1].header.scheduled_ns - pair[0].header.scheduled_ns;
        assert!(apart_ns >= 5 * MILLISECOND_NS * 10 / 11, "frames follow at most a tenth faster");
        apart_ns > 5 * MILLISECOND_NS
    });
    assert!(put_off.count() as u64 <= passes(&lines)[1]["overruns"].as_u64().expect("a count"));
    let summary = json!({ "type": "summary", "passes": 3, "frames": 24, "cut": false, "skipped_bytes": 0 });
    assert_eq!(lines.last(), Some(&summary));
}

#[test]
fn each_lap_of_a_loop_is_a_run_of_its_own() {
    let stage = Stage::new();
    write_runs(&stage.path("a.mcap"), &[(0..40).collect(), (0..25).collect()]);
    let (process, started) =
        replay(&stage, &["a.mcap", "--loop", "3", "--from", "0.003", "--to", "0.03", "--readers", "1"]);
    let shots = read_passes(&mut Reader::join(&stage), &[28, 22, 28, 22, 28, 22]);
    let lines = process.end().expect_clean().json_lines();
    let run_ids = run_ids(&started, &lines);
    assert_eq!(run_ids.len(), 6);
    for (lap, (shots, run_id)) in shots.iter().zip(&run_ids).enumerate() {
        assert_whole(shots, *run_id);
        assert!(!run_ids[..lap].contains(run_id), "{run_ids:?}");
    }
    let hashes: Vec<_> = shots.chunks(2).map(|lap| hashes_of_shots(&lap.concat())).collect();
    assert!(hashes.iter().all(|lap| lap == &hashes[0]));
    let summary = json!({ "type": "summary", "passes": 6, "frames": 150, "cut": false, "skipped_bytes": 0 });
    assert_eq!(lines.last(), Some(&summary));
}

#[test]
fn a_loop_without_a_number_goes_on_until_it_is_stopped() {
    let stage = Stage::new();
    write_runs(&stage.path("a.mcap"), &[(0..4).collect()]);
    // The first pass waits for its reader. The others follow without a wait.
    let (mut process, _) = replay(&stage, &["a.mcap", "--loop", "--readers", "1"]);
    let mut reader = Reader::join(&stage);
    for _ in 0..12 {
        reader.read_to_tick(3);
    }
    process.json_until("a pass begins", |line| line["type"] == "pass");
    let summary = process.terminate().expect_clean().last_json();
    assert!(summary["passes"].as_u64() >= Some(12), "{summary}");
}

#[test]
fn at_another_rate_every_frame_is_sooner_by_this_factor_and_has_its_time_scale() {
    let stage = Stage::new();
    write_runs(&stage.path("a.mcap"), &[(0..200).collect()]);
    let original = recorded(&stage.path("a.mcap"));
    for (rate, apart_ns) in [("10", MILLISECOND_NS / 2), ("0.5", 10 * MILLISECOND_NS)] {
        let (process, started) = replay(&stage, &["a.mcap", "--rate", rate, "--readers", "1"]);
        let shots = read_passes(&mut Reader::join(&stage), &[200]).concat();
        let lines = process.end().expect_clean().json_lines();
        assert_whole(&shots, started["run_id"].as_u64().expect("a run has a number"));
        assert_eq!(hashes_of_shots(&shots), hashes_of_recorded(&original));
        let headers: Vec<FrameHeader> = original.iter().map(|(frame, _)| frame.header).collect();
        let factor: f64 = rate.parse().expect("a number");
        assert_paced(&shots, &headers, factor, &passes(&lines)[0]["overruns"]);
        let planned_ns = (headers[199].scheduled_ns - headers[0].scheduled_ns) as f64 / factor;
        assert_eq!(planned_ns, 199.0 * apart_ns as f64, "the intervals follow the rate");
    }
}

#[test]
fn a_monitor_finds_the_same_contact_in_each_lap() {
    let stage = Stage::new();
    // No step is missing, so the excerpt begins before the contact.
    let pace = ["--start-at", "411", "--time-scale", "20", "--until", "413", "--readers", "1", "--catch-up", "0"];
    let server = stage.serve(&pace);
    let recorder = stage.start(&["record", "a.mcap"]);
    server.summary();
    recorder.terminate().expect_clean();
    // Slow enough that each reader looks while a lap lasts: it finds the next one's source when it looks.
    let laps = ["a.mcap", "--from", "412.4", "--loop", "2", "--rate", "0.05", "--readers", "2"];
    let (process, _) = replay(&stage, &laps);
    let monitor = stage.start(&["monitor", "--format", "json"]);
    let mut reader = Reader::join(&stage);
    for _ in 0..2 {
        reader.read_to_end();
    }
    process.end().expect_clean();
    let contacts = contacts(&monitor.terminate().expect_clean().json_lines());
    assert_eq!(contacts.len(), 2, "{contacts:?}");
    assert_eq!(contacts[0], contacts[1]);
    assert_eq!(contacts[0]["benches"], json!([0, 8]));
}

#[test]
fn impossible_excerpts_are_refused_in_one_line() {
    let stage = Stage::new();
    write_runs(&stage.path("a.mcap"), &[(5..40).collect()]);
    for (args, error) in [
        (&["--from", "2", "--to", "1"][..], "error: --to is 1, must be at least --from, which is 2\n"),
        (
            &["--from", "1", "--to", "2.5"],
            "error: a.mcap holds no frames from 1 s to 2.5 s: its show times are from 0.005 s to 0.039 s\n",
        ),
        (&["--to", "-1"], "error: a.mcap holds no frames to -1 s: its show times are from 0.005 s to 0.039 s\n"),
        (&["--rate", "0"], "error: invalid value '0' for '--rate <FACTOR>': must be from 0.01 to 100\n"),
        (&["--rate", "nan"], "error: invalid value 'nan' for '--rate <FACTOR>': must be from 0.01 to 100\n"),
    ] {
        let ended: test_support::process::Ended =
            Process::start(stage.command(&[&["replay", "a.mcap"], args].concat())).end();
        assert_eq!((ended.code(), ended.stdout.as_str(), ended.stderr.as_str()), (Some(2), "", error), "{args:?}");
    }
    let ended = stage.run(&["replay", "a.mcap", "--loop", "0"]);
    assert!(ended.code() == Some(2) && ended.stderr.lines().count() == 1, "{}", ended.stderr);
}
