//! The recorder as a process: every frame, bit for bit, whatever happens to the recorder.

use std::fs::{self, File};
use std::path::Path;

use bench_dragon::output::Counted;
use bench_dragon::recording::{FrameReader, Recorded};
use bench_dragon_ipc::{DescriptionReader, FrameHeader};
use serde_json::{Value, json};
use test_support::eventually::eventually;
use test_support::pytest;

use crate::periods::assert_no_frame_missing;
use crate::reader::{Reader, Shot, assert_whole};
use crate::stage::Stage;

/// Returns the frames of a recording, and whether its end is missing.
pub(crate) fn read(path: &Path) -> (Vec<FrameHeader>, bool) {
    let mut reader = FrameReader::open(path).expect("a recording");
    let headers = reader.by_ref().map(|frame| frame.expect("a readable frame").header).collect();
    (headers, reader.flaws().cut)
}

/// Waits until the file of a running recorder has a frame that would survive a kill.
pub(crate) fn await_frames(path: &Path) {
    eventually("the recording has a frame", || FrameReader::open(path).ok()?.next()?.ok().map(drop));
}

/// Waits until the file of a running recorder has this many command events.
pub(crate) fn await_commands(path: &Path, count: usize) {
    eventually(&format!("the recording has {count} events of commands"), || {
        let mut reader = FrameReader::open(path).ok()?;
        let recorded = std::iter::from_fn(|| reader.next_wanted(|_| false).expect("a readable recording"));
        let is_command = |recorded: &Recorded| matches!(recorded, Recorded::Command(_));
        (recorded.filter(is_command).count() >= count).then_some(())
    });
}

#[test]
fn stock_readers_find_every_frame_the_contact_and_the_configuration() {
    let stage = Stage::new();
    let pace = ["--start-at", "411", "--time-scale", "20", "--until", "413", "--readers", "3"];
    let server = stage.serve(&pace);
    let mut record = stage.start(&["record", "show.mcap", "--format", "json"]);
    assert_eq!(record.json(), json!({ "type": "started", "file": "show.mcap" }));
    let descriptions = DescriptionReader::open(stage.domain(), "test").expect("a server has created the services");
    // The recorder opens the alerts before the frames, so it gets every alert of the monitor.
    let monitor = stage.start(&["monitor", "--format", "json"]);
    let mut reader = Reader::join(&stage);
    let description = eventually("the description is there", || descriptions.poll().expect("the bus is readable"));

    let run_id = server.run_id;
    server.summary();
    // By then the recorder's loop has run, so it is connected with the monitor.
    await_frames(&stage.path("show.mcap"));
    let lines = monitor.terminate().expect_clean().json_lines();
    let alerts = lines.iter().filter(|line| line["type"] == "alert").count();
    let summary = record.terminate().expect_clean().last_json();
    let shots = reader.read_to_end();
    assert_whole(&shots, run_id);
    assert_eq!((&summary["frames"], &summary["lost"]), (&json!(shots.len()), &json!(0)));
    assert_eq!((&summary["alerts"], &summary["files"]), (&json!(alerts), &json!(["show.mcap"])));
    assert_eq!(
        (&summary["commands"], &summary["commands_lost"]),
        (&json!(2), &json!(0)),
        "the events are the start and the end"
    );
    assert_eq!(summary["bytes"], fs::metadata(stage.path("show.mcap")).expect("the recording").len());

    let received: Vec<u8> = shots.iter().flat_map(Shot::wire_bytes).collect();
    fs::write(stage.path("frames.bin"), received).expect("a file");
    fs::write(stage.path("description.toml"), description.toml).expect("a file");
    pytest::run("test_live_recording.py", &[("RECORDING_FOLDER", stage.path("").as_os_str())]);
}

#[test]
fn a_killed_recorder_leaves_a_file_that_repair_finishes() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "200"]);
    let recorder = stage.start(&["record", "a.mcap"]);
    await_frames(&stage.path("a.mcap"));
    recorder.kill();
    let (frames, was_cut) = read(&stage.path("a.mcap"));
    assert!(was_cut && frames.iter().all(|header| header.run_id == server.run_id));

    let repair = ["record", "--repair", "a.mcap", "--format", "json"];
    let finished = |repaired: bool| json!({ "file": "a.mcap", "frames": frames.len(), "repaired": repaired, "skipped_bytes": 0, "kept": null });
    assert_eq!(stage.run(&repair).expect_clean().last_json(), finished(true));
    assert_eq!(read(&stage.path("a.mcap")), (frames.clone(), false));
    assert_eq!(stage.run(&repair).expect_clean().last_json(), finished(false), "a second repair changes nothing");
    server.stop();
}

#[test]
fn the_next_recorder_in_a_folder_finishes_the_file_of_a_killed_one() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "200"]);
    let killed = stage.start(&["record", "a.mcap"]);
    await_frames(&stage.path("a.mcap"));
    killed.kill();
    let frames = read(&stage.path("a.mcap")).0.len();

    let recorder = stage.start(&["record", "./b.mcap"]);
    assert_eq!(
        recorder.complaint(),
        format!("finished ./a.mcap, which a killed recorder left: {}", Counted(frames as u64, "frame"))
    );
    await_frames(&stage.path("b.mcap"));
    recorder.terminate().expect_clean();
    for name in ["a.mcap", "b.mcap"] {
        assert!(!read(&stage.path(name)).1, "{name} is whole");
    }
    assert_eq!(read(&stage.path("a.mcap")).0.len(), frames);
    server.stop();
}

/// Number of zeros after the recording. A repair reads them for much longer than this test runs.
const ZERO_BYTES: u64 = 1 << 40;

#[test]
fn a_recording_begins_and_ends_while_the_repair_of_another_takes_its_time() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "200"]);
    let killed = stage.start(&["record", "a.mcap"]);
    await_frames(&stage.path("a.mcap"));
    killed.kill();
    let frames = read(&stage.path("a.mcap")).0;
    let file = File::options().write(true).open(stage.path("a.mcap")).expect("the recording");
    let length = file.metadata().expect("its length").len();
    file.set_len(length + ZERO_BYTES).expect("the file system supports sparse files");

    let recorder = stage.start(&["record", "b.mcap"]);
    await_frames(&stage.path("b.mcap"));
    recorder.terminate().expect_clean();
    assert!(!read(&stage.path("b.mcap")).1, "b.mcap is whole");
    assert_eq!(
        file.metadata().expect("its length").len(),
        length + ZERO_BYTES,
        "the repair of the other file still ran"
    );
    file.set_len(length + 5_000).expect("a shorter file");
    let repaired = stage.run(&["record", "--repair", "a.mcap"]).expect_clean().stdout;
    assert_eq!(repaired, format!("a.mcap finished: {}\n", Counted(frames.len() as u64, "frame")));
    assert_eq!(read(&stage.path("a.mcap")), (frames, false));
    server.stop();
}

#[test]
fn a_recorder_finishes_the_unfinished_file_whose_name_it_was_given_and_refuses_it() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "200"]);
    let killed = stage.start(&["record", "a.mcap"]);
    await_frames(&stage.path("a.mcap"));
    killed.kill();
    let (frames, was_cut) = read(&stage.path("a.mcap"));
    assert!(was_cut);
    let refused = stage.run(&["record", "a.mcap"]);
    assert_eq!(refused.code(), Some(2));
    let finished = format!("finished a.mcap, which a killed recorder left: {}", Counted(frames.len() as u64, "frame"));
    assert!(refused.stderr.replace("./", "").contains(&finished), "{}", refused.stderr);
    assert!(refused.stderr.contains("error: a.mcap already exists and is not overwritten"), "{}", refused.stderr);
    assert_eq!(read(&stage.path("a.mcap")), (frames, false));
    server.stop();
}

#[test]
fn damage_is_found_by_a_check_and_never_cut_off() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "1000", "--until", "1", "--readers", "1"]);
    let recorder = stage.start(&["record", "a.mcap", "--format", "json"]);
    server.summary();
    // A recorder without a processor for 0.2 s loses frames at this rate.
    let recorded = recorder.terminate().expect_clean().last_json()["frames"].as_u64().expect("a count");
    let check = ["record", "--repair", "--check", "a.mcap"];
    let sound = format!("a.mcap was finished already: {recorded} frames; every chunk was read and is sound\n");
    assert_eq!(stage.run(&check).expect_clean().stdout, sound);

    let whole = fs::read(stage.path("a.mcap")).expect("the recording");
    let chunks = mcap::Summary::read(&whole).expect("a summary").expect("an index").chunk_indexes;
    let chunk = &chunks[chunks.len() / 2];
    let mut damaged = whole[..whole.len() - 1].to_vec();
    damaged[chunk.chunk_start_offset as usize + 3] ^= 1; // its length
    fs::write(stage.path("a.mcap"), &damaged).expect("a damaged recording");
    let refused = stage.run(&["record", "--repair", "a.mcap"]);
    assert_eq!(refused.code(), Some(2));
    let at = chunk.chunk_start_offset;
    let advice =
        "`record --repair --check` copies all readable parts, and needs free disk space of the size of the file";
    assert_eq!(refused.stderr, format!("error: a.mcap is damaged at byte {at}: {advice}\n"));
    assert!(fs::read(stage.path("a.mcap")).expect("the recording") == damaged, "the file is unchanged");

    let checked = stage.run(&[&check[..], &["--format", "json"]].concat()).expect_clean().last_json();
    assert_eq!(checked["repaired"], true);
    let kept = checked["kept"].as_str().expect("the old file's name");
    assert!(kept.ends_with("/a.mcap.damaged") && fs::read(kept).expect("the old file") == damaged, "{kept}");
    let (frames, was_cut) = read(&stage.path("a.mcap"));
    assert!(!was_cut && checked["frames"] == frames.len() && (frames.len() as u64) < recorded, "{checked}");
}

#[test]
fn the_file_of_a_running_recorder_is_left_alone() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "200"]);
    let first = stage.start(&["record", "a.mcap"]);
    await_frames(&stage.path("a.mcap"));
    let repair = stage.run(&["record", "--repair", "a.mcap"]);
    assert_eq!(repair.code(), Some(1));
    assert_eq!(repair.stderr, "error: a.mcap is being recorded or repaired by another process\n");
    let second = stage.run(&["record", "a.mcap"]);
    assert_eq!(second.code(), Some(2));
    assert!(second.stderr.starts_with("error: a.mcap already exists and is not overwritten"), "{}", second.stderr);
    first.terminate().expect_clean();
    assert!(!read(&stage.path("a.mcap")).1);
    server.stop();
}

#[test]
fn a_recording_continues_across_a_restart_of_the_server() {
    let stage = Stage::new();
    // Each run is long enough for a reader that stays to find it.
    let run = ["--rate", "25", "--until", "4", "--readers", "1"];
    let recorder = stage.start(&["record", "a.mcap", "--format", "json"]);
    let runs: [(u64, u64); 2] = [(); 2].map(|()| {
        let server = stage.serve(&run);
        let run_id = server.run_id;
        let served = server.summary();
        assert_no_frame_missing(&served, 101);
        (run_id, served["frames"].as_u64().expect("a count"))
    });
    let summary = recorder.terminate().last_json();
    let frames: u64 = runs.iter().map(|(_, frames)| frames).sum();
    assert_eq!((&summary["frames"], &summary["lost"]), (&json!(frames), &json!(0)));
    let (frames, _) = read(&stage.path("a.mcap"));
    let ticks: Vec<(u64, u64)> = frames.iter().map(|header| (header.run_id, header.tick)).collect();
    let expected = runs.iter().flat_map(|&(run_id, frames)| (0..frames).map(move |tick| (run_id, tick)));
    assert_eq!(ticks, expected.collect::<Vec<_>>());
}

#[test]
fn a_recorder_in_text_prints_its_summary_in_one_line() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "1000", "--until", "0.1", "--readers", "1"]);
    let recorder = stage.start(&["record", "a.mcap"]);
    let frames = &server.summary()["frames"];
    let text = recorder.terminate().expect_clean().stdout;
    let begins = text.starts_with(&format!("{frames} frames, 0 lost; 0 alerts; 2 command events, 0 lost; "));
    assert!(begins && text.ends_with(" in a.mcap\n"), "{text}");
    let repair = stage.run(&["record", "--repair", "a.mcap"]).expect_clean().stdout;
    assert_eq!(repair, format!("a.mcap was finished already: {frames} frames\n"));
}

#[test]
fn a_rotated_recording_has_every_frame_once() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "1000", "--until", "0.2", "--readers", "1"]);
    let recorder = stage.start(&["record", "a.mcap", "--rotate-mb", "1", "--format", "json"]);
    let served = server.summary()["frames"].as_u64().expect("a count");
    let summary = recorder.terminate().expect_clean().last_json();
    let files: Vec<&str> = summary["files"].as_array().expect("an array").iter().filter_map(Value::as_str).collect();
    assert!(files.len() > 1, "{summary}");
    let ticks: Vec<u64> = files.iter().flat_map(|file| read(&stage.path(file)).0).map(|header| header.tick).collect();
    assert_eq!(ticks, (0..served).collect::<Vec<_>>());
}
