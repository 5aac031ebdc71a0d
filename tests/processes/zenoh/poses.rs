//! Frames, runs and the description on the far bus.

use std::fs;

use bench_dragon::recording::{Recorder, RecorderSettings};
use bench_dragon_ipc::{DescriptionReader, FrameHeader, HandleState, StatusReader};
use rustix::process::Signal;
use test_support::eventually::eventually;

use super::bridges::{ANY_PORT, Bridge};
use crate::dragons::TWO_DRAGONS;
use crate::periods::assert_no_frame_missing;
use crate::reader::{Reader, Shot};
use crate::stage::Stage;

/// Returns the bytes of a frame that a bridge keeps: all except run, tick and stamps.
pub(crate) fn content(shot: &Shot) -> Vec<u8> {
    let header = FrameHeader { run_id: 0, tick: 0, scheduled_ns: 0, published_ns: 0, ..shot.header };
    Shot { header, ..shot.clone() }.wire_bytes()
}

#[test]
fn the_far_bus_has_the_same_frames_bit_for_bit_except_run_and_stamps() {
    let (near, far) = (Stage::new(), Stage::new());
    // The near reader's buffer holds the whole show, and the far reader has three seconds to join.
    let server = near.serve(&["--rate", "50", "--until", "3.2", "--readers", "2"]);
    let sender = Bridge::sending(&near, &[]);
    let mut receiver = Bridge::receiving(&far, &sender);
    let mut reader = Reader::join(&near);
    let receiving = receiver.until("receiving");
    let far_shots = Reader::join(&far).read_to_end();
    let near_shots = reader.read_to_end();
    assert_eq!(server.run_id, receiving["remote_run_id"]);
    for shot in &far_shots {
        let original = &near_shots[shot.header.tick as usize];
        assert_eq!(original.header.tick, shot.header.tick, "no frame is missing");
        assert_eq!(content(shot), content(original), "tick {}", shot.header.tick);
        assert_eq!(receiving["run_id"], shot.header.run_id);
        // Both machines are this one, so the least delay on the way is above 0.
        assert!(shot.header.scheduled_ns > original.header.scheduled_ns, "no frame is due before it was due there");
        assert!(shot.header.published_ns >= shot.header.scheduled_ns);
    }
    let served = server.summary();
    assert_no_frame_missing(&served, 161);
    let (received, sent) = (receiver.stop(), sender.stop());
    assert_eq!(
        (&sent["type"], &sent["frames"], &sent["lost"]),
        (&"sent".into(), &served["frames"], &0.into()),
        "{sent}"
    );
    for (what, count) in
        [("runs", 1), ("frames", near_shots.len()), ("lost", 0), ("malformed", 0), ("foreign", 0), ("not_new", 0)]
    {
        assert_eq!(received[what], count, "{what}: {received}");
    }
}

#[test]
fn the_far_bus_has_all_dragons_bit_for_bit() {
    let (near, far) = (Stage::new(), Stage::new());
    let server = near.serve(&["--config", TWO_DRAGONS, "--rate", "50", "--until", "3.2", "--readers", "2"]);
    let sender = Bridge::sending(&near, &["--spin-us", "100"]);
    let mut receiver = Bridge::receiving(&far, &sender);
    let mut reader = Reader::join(&near);
    receiver.until("receiving");
    let far_shots = Reader::join(&far).read_to_end();
    let near_shots = reader.read_to_end();
    for shot in &far_shots {
        let original = &near_shots[shot.header.tick as usize];
        assert_eq!(content(shot), content(original), "tick {}", shot.header.tick);
        assert_eq!(shot.header.dragons(), original.header.dragons());
    }
    server.summary();
    let received = receiver.stop();
    assert_eq!((&received["malformed"], &received["lost"]), (&0.into(), &0.into()), "{received}");
    sender.stop();
}

#[test]
fn one_frame_of_ten_leaves_no_hole_in_the_ticks_and_counts_as_no_loss() {
    let (near, far) = (Stage::new(), Stage::new());
    let server = near.serve(&["--rate", "50", "--until", "3.2", "--readers", "2"]);
    let sender = Bridge::sending(&near, &["--rate", "5"]);
    let mut receiver = Bridge::receiving(&far, &sender);
    let mut reader = Reader::join(&near);
    receiver.until("receiving");
    let far_shots = Reader::join(&far).read_to_end();
    let near_shots = reader.read_to_end();
    for shot in &far_shots {
        // The last frame is sent between two due ones, since it ends the show.
        let tick = (shot.header.tick as usize * 10).min(near_shots.len() - 1);
        assert_eq!(content(shot), content(&near_shots[tick]), "tick {}", shot.header.tick);
    }
    assert_no_frame_missing(&server.summary(), 161);
    let (received, sent) = (receiver.stop(), sender.stop());
    let due = (near_shots.len() - 1).div_ceil(10) + 1;
    assert_eq!((&received["frames"], &received["lost"], &sent["frames"]), (&due.into(), &0.into(), &due.into()));
}

#[test]
fn a_late_bridge_gets_the_description_and_the_next_run_is_a_run_of_its_own() {
    let (near, far) = (Stage::new(), Stage::new());
    let server = near.serve(&["--rate", "20"]);
    Reader::join(&near).read_to_tick(3);
    let sender = Bridge::sending(&near, &[]);
    let mut receiver = Bridge::receiving(&far, &sender);
    let first = receiver.until("receiving");
    let descriptions = DescriptionReader::open(far.domain(), "test").expect("the bridge has created the services");
    let near_descriptions =
        DescriptionReader::open(near.domain(), "test").expect("the server has created the services");
    let there = || eventually("the description is there", || near_descriptions.poll().expect("the bus is readable"));
    let here = || eventually("the description is on the far bus", || descriptions.poll().expect("the bus is readable"));
    let (description, original) = (here(), there());
    assert_eq!((&first["run_id"], &first["remote_run_id"]), (&description.run_id.into(), &original.run_id.into()));
    assert_eq!(description.toml, original.toml);
    let mut reader = Reader::join(&far);
    reader.next();
    server.stop();

    fs::write(near.path("wide.toml"), "[route]\npitch_m = 0.7\n").expect("a file");
    let server = near.serve(&["--rate", "20", "--config", "wide.toml"]);
    let second = receiver.until("receiving");
    assert_eq!(second["remote_run_id"], server.run_id);
    let shots = reader.read_until("a frame of the second run", |header| second["run_id"] == header.run_id);
    assert_eq!(shots.last().expect("at least one frame").header.tick, 0, "the ticks begin at 0");
    let (description, original) = (here(), there());
    assert_eq!(second["run_id"], description.run_id);
    assert_eq!(description.toml, original.toml);
    assert!(description.toml.contains("pitch_m = 0.7"));
    server.stop();
    assert_eq!(receiver.stop()["runs"], 2);
    sender.stop();
}

#[test]
fn the_end_of_a_source_is_reported_and_the_far_services_stay() {
    let (near, far) = (Stage::new(), Stage::new());
    let server = near.serve(&["--rate", "20"]);
    let mut sender = Bridge::sending(&near, &[]);
    let mut receiver = Bridge::receiving(&far, &sender);
    let run_id = receiver.until("receiving")["run_id"].clone();
    server.stop();
    assert_eq!(sender.until("silent")["reason"], "no_source");
    let silent = receiver
        .process
        .json_until("the bridge has no source", |line| line["reason"] == "no_source")
        .pop()
        .expect("a line");
    assert_eq!((&silent["type"], &silent["run_id"]), (&"silent".into(), &run_id));
    Reader::join(&far);
    receiver.stop();
    sender.stop();
}

#[test]
fn a_recording_played_faster_passes_completely() {
    // A reader's buffer holds all of them.
    const FRAMES: u64 = 250;
    let (near, far) = (Stage::new(), Stage::new());
    let mut recorder = Recorder::start(RecorderSettings::new(near.path("a.mcap"), 0)).expect("a recorder");
    recorder.describe(7, "[dragon]\nbenches = 1\n[serve]\nrate_hz = 20\n").expect("the configuration");
    for tick in 0..FRAMES {
        let (scheduled_ns, show_time_ns) = (tick * 50_000_000, tick as i64);
        let header = FrameHeader { run_id: 7, tick, scheduled_ns, show_time_ns, bench_count: 1, ..Default::default() }
            .of_one_dragon();
        recorder.frame(&header, &[HandleState::default(); 2]).expect("a frame");
    }
    recorder.finish().expect("a finished recording");

    let replay = near.start(&["replay", "a.mcap", "--rate", "20", "--readers", "3"]);
    replay.complaint();
    let sender = Bridge::sending(&near, &[]);
    let mut slow = Bridge::start(&near, &["--listen", ANY_PORT, "--rate", "40"]);
    assert_eq!(slow.until("sending")["every"], 10, "one of ten frames, from 400 Hz to 40 Hz");
    let mut receiver = Bridge::receiving(&far, &sender);
    let _third = Reader::join(&near);
    receiver.until("receiving");
    let statuses = StatusReader::open(far.domain(), "test").expect("the bridge has created the services");
    // A late subscriber gets the status, but could miss the last frame.
    let last = eventually("the status of the last frame", || {
        statuses.poll().expect("the bus is readable").filter(|status| status.show_time_ns == FRAMES as i64 - 1)
    });
    assert_eq!(last.rate_hz, 400);
    replay.end().expect_clean();
    let received = receiver.stop();
    assert_eq!(
        (&received["frames"], &received["lost"], &received["too_fast"]),
        (&FRAMES.into(), &0.into(), &0.into()),
        "{received}"
    );
    let sent = slow.stop();
    assert_eq!(sent["unheard"], FRAMES / 10, "{sent}");
    sender.stop();
}

#[test]
fn a_bridge_that_lagged_across_a_restart_skips_as_many_frames_as_before() {
    const EVERY: u64 = 50;
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "50"]);
    let mut sender = Bridge::sending(&stage, &["--every", &EVERY.to_string()]);
    let mut reader = Reader::join(&stage);
    let begun = reader.next().header.tick;
    sender.process.signal(Signal::STOP);
    reader.read_to_tick(begun + 100);
    let first = server.stop();
    let server = stage.serve(&["--rate", "50"]);
    let mut reader = Reader::join(&stage);
    reader.read_to_tick(100);
    sender.process.signal(Signal::CONT);
    assert_eq!(sender.until("sending")["run_id"], server.run_id);
    let now = reader.read_unread().last().map_or(100, |shot| shot.header.tick);
    reader.read_to_tick(now + 2 * EVERY);
    let second = server.stop();
    let sent = sender.stop();
    let count = |line: &serde_json::Value, key: &str| line[key].as_u64().expect("a count");
    let most = (count(&first, "frames") + count(&second, "frames")) / EVERY + 2;
    assert!((1..=most).contains(&count(&sent, "unheard")), "{most}: {sent}");
    assert!(count(&sent, "lost") > 0, "no frame of the first run was lost: {sent}");
}
