//! Recordings of several dragons: cut, damaged and repaired. Their channels depend on the names of the dragons.

use std::fs;
use std::path::{Path, PathBuf};

use bench_dragon::recording::{Recorder, RecorderSettings, repair, repair_checked};
use bench_dragon_ipc::{DragonMotion, FrameHeader};
use tempfile::tempdir;

use crate::dance::{self, Frame, RUN_ID};

const FRAMES: u64 = 600;
const TOML: &str =
    "[[dragons]]\nname = \"gold\"\nbenches = 4\nhead_length_m = 3.41\nbody_length_m = 2.2\nwidth_m = 0.3\n
[[dragons]]\nname = \"silver\"\nbenches = 6\nhead_length_m = 3.41\nbody_length_m = 2.2\nwidth_m = 0.3\n";

/// The frames of two dragons of 4 and 6 benches, which have the handles of one of 11.
fn frames() -> Vec<Frame> {
    let of_two = |Frame { header, handles }: Frame| {
        let motion = |first_handle, bench_count| DragonMotion {
            travel_m: header.head_travel_m,
            speed_mps: header.head_speed_mps,
            first_handle,
            bench_count,
            state: 1,
            reserved: 0,
        };
        let course = [header.head_travel_m, header.head_speed_mps];
        let header = FrameHeader { bench_count: 10, ..header };
        Frame { header: header.of_plan(course, &[motion(0, 4), motion(5, 6)]).expect("two dragons"), handles }
    };
    dance::frames(FRAMES, 11).into_iter().map(of_two).collect()
}

fn record(folder: &Path) -> PathBuf {
    // Rotation makes the chunks small; the whole recording is in the first file.
    let settings = RecorderSettings { rotate_bytes: Some(1_000_000), ..dance::settings(folder) };
    let path = settings.file.clone();
    let mut recorder = Recorder::start(settings).expect("a recorder");
    recorder.describe(RUN_ID, TOML).expect("the configuration");
    for Frame { header, handles } in frames() {
        recorder.frame(&header, &handles).expect("a frame");
    }
    assert_eq!(recorder.finish().expect("a finished recording").frames, FRAMES);
    path
}

/// The names of the topics with their numbers of messages.
fn topics(path: &Path) -> Vec<(String, u64)> {
    let summary = dance::summary(path).expect("a summary");
    let counts = summary.stats.expect("statistics").channel_message_counts;
    let count = |id| counts.get(&id).copied().unwrap_or(0);
    let mut topics: Vec<_> =
        summary.channels.values().map(|channel| (channel.topic.clone(), count(channel.id))).collect();
    topics.sort();
    topics
}

#[test]
fn a_file_has_a_channel_of_poses_for_each_dragon_and_a_repair_keeps_them() {
    let folder = tempdir().expect("a folder");
    let path = record(folder.path());
    dance::assert_same(&dance::read(&path).0, &frames());
    let whole = topics(&path);
    let names: Vec<_> = whole.iter().map(|(name, _)| name.as_str()).collect();
    let poses = ["/dragon/gold/poses", "/dragon/silver/poses"];
    let [alerts, boards, commands] = ["/dragon/alerts", "/dragon/boards", "/dragon/commands"];
    assert_eq!(names, [alerts, boards, commands, "/dragon/frames", poses[0], "/dragon/markers", poses[1], "/tf"]);
    let [viewed, transformed] = [1, 4].map(|first| whole[first].1);
    assert!(viewed > 0 && viewed == whole[5].1, "{whole:?}");
    assert!(transformed > viewed && transformed == whole[6].1 && transformed == whole[7].1, "{whole:?}");
    let chunks = dance::summary(&path).expect("a summary").chunk_indexes;
    let bytes = fs::read(&path).expect("the recording");
    let middle = &chunks[chunks.len() / 2];
    fs::write(&path, &bytes[..(middle.chunk_start_offset + middle.chunk_length / 2) as usize])
        .expect("a cut recording");
    let repaired = repair(&path).expect("a repair");
    assert!(0 < repaired.frames && repaired.frames < FRAMES, "{repaired:?}");
    dance::assert_same(&dance::read(&path).0, &frames()[..repaired.frames as usize]);
    assert_eq!(topics(&path).iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), names);
}

#[test]
fn one_dragon_with_cues_is_recorded_in_one_file_also_over_a_restart() {
    let folder = tempdir().expect("a folder");
    let settings = dance::settings(folder.path());
    let path = settings.file.clone();
    let mut recorder = Recorder::start(settings).expect("a recorder");
    let toml = "[dragon]\nbenches = 10\n\n[[cues]]\nname = \"bow\"\nat_s = 1.0\n";
    let of_plan = |header: FrameHeader| {
        let bench_count = header.bench_count;
        let motion = DragonMotion { first_handle: 0, bench_count, state: 1, ..DragonMotion::default() };
        header.of_plan([header.head_travel_m, header.head_speed_mps], &[motion]).expect("one dragon")
    };
    for run_id in [RUN_ID, RUN_ID + 1] {
        recorder.describe(run_id, toml).expect("the configuration");
        // An event precedes the frames, as at the start of a server.
        recorder.record(&dance::alert(0), 0).expect("an alert");
        for Frame { header, handles } in dance::frames(FRAMES, 10) {
            recorder.frame(&of_plan(FrameHeader { run_id, ..header }), &handles).expect("a frame");
        }
    }
    let summary = recorder.finish().expect("a finished recording");
    assert_eq!((summary.frames, fs::read_dir(folder.path()).expect("the folder").count()), (2 * FRAMES, 1));
    assert!(topics(&path).iter().any(|(name, count)| name == "/dragon/1/poses" && *count > 0));
}

#[test]
fn damage_in_the_first_chunk_costs_its_one_frame_of_all_dragons() {
    let folder = tempdir().expect("a folder");
    let path = record(folder.path());
    let bytes = fs::read(&path).expect("the recording");
    let chunks = dance::summary(&path).expect("a summary").chunk_indexes;
    let (first, last) = (&chunks[0], &chunks[chunks.len() - 1]);
    for length in [bytes.len(), last.chunk_start_offset as usize] {
        let mut damaged = bytes[..length].to_vec();
        damaged[(first.chunk_start_offset + first.chunk_length / 2) as usize] ^= 0xff;
        fs::write(&path, &damaged).expect("a damaged recording");
        let repaired = repair_checked(&path, |_| ()).expect("a repair");
        assert!(repaired.frames > 0, "{repaired:?}");
        dance::assert_same(&dance::read(&path).0, &frames()[1..=repaired.frames as usize]);
        assert_eq!(topics(&path).len(), 8, "the channels of both dragons");
    }
}
