//! A recording has exactly the frames that were sent.

use bench_dragon::recording::{FrameReader, RecordError, Recorder, RecorderProgress, Topic};
use bench_dragon_ipc::{FrameHeader, HandleState};
use tempfile::tempdir;
use test_support::eventually::eventually_from;

use crate::dance::{self, BENCHES, OFFSET_NS, RUN_ID, TOML};

#[test]
fn every_frame_comes_back_bit_for_bit() {
    let folder = tempdir().expect("a folder");
    let frames = dance::frames(400, BENCHES);
    let path = dance::record(dance::settings(folder.path()), &frames);
    let (recorded, was_cut) = dance::read(&path);
    dance::assert_same(&recorded, &frames);
    assert!(!was_cut);
}

#[test]
fn nan_infinity_and_negative_zero_keep_their_bits() {
    let folder = tempdir().expect("a folder");
    let odd = f64::from_bits(0x7ff8_dead_beef_0001);
    let header = FrameHeader {
        run_id: u64::MAX,
        show_time_ns: i64::MIN,
        head_travel_m: odd,
        bench_count: 2,
        ..Default::default()
    }
    .of_one_dragon();
    let handle = HandleState { position_m: [odd, -0.0, f64::INFINITY], velocity_mps: [5e-324, f64::MAX, -odd] };
    let frames = [dance::Frame { header, handles: vec![handle; 3] }];
    let path = dance::record(dance::settings(folder.path()), &frames);
    dance::assert_same(&dance::read(&path).0, &frames);
}

#[test]
fn log_time_is_unix_time_of_the_sending() {
    let folder = tempdir().expect("a folder");
    let frames = dance::frames(3, 5);
    let path = dance::record(dance::settings(folder.path()), &frames);
    for (recorded, sent) in dance::read(&path).0.iter().zip(&frames) {
        assert_eq!(recorded.log_time_ns, sent.header.published_ns + OFFSET_NS as u64);
    }
}

#[test]
fn poses_and_transforms_come_thirty_times_a_second_and_boards_ten_times() {
    let folder = tempdir().expect("a folder");
    let path = dance::record(dance::settings(folder.path()), &dance::frames(2_000, 5));
    let poses = dance::log_times_ns(&path, Topic::Poses.name());
    assert!((60..=61).contains(&poses.len()), "{} poses in 2 s", poses.len());
    let frames = dance::log_times_ns(&path, Topic::Frames.name());
    assert!(poses.iter().all(|pose| frames.binary_search(pose).is_ok()), "a pose has the time of its frame");
    assert_eq!(dance::log_times_ns(&path, Topic::Transforms.name()), poses);
    let boards = dance::log_times_ns(&path, Topic::Boards.name());
    assert!((20..=21).contains(&boards.len()), "{} messages of boards in 2 s", boards.len());
    assert!(boards.iter().all(|time| poses.binary_search(time).is_ok()), "boards have the time of their poses");
    assert_eq!(dance::log_times_ns(&path, Topic::Markers.name()), boards);
}

#[test]
fn the_number_of_benches_may_change_while_recording() {
    let folder = tempdir().expect("a folder");
    let frames: Vec<_> =
        [3, 223, 1, 900, 0].into_iter().zip(0..).map(|(benches, tick)| dance::frame(tick, benches)).collect();
    let path = dance::record(dance::settings(folder.path()), &frames);
    dance::assert_same(&dance::read(&path).0, &frames);
}

#[test]
fn the_configuration_of_each_run_is_in_the_file() {
    let folder = tempdir().expect("a folder");
    let settings = dance::settings(folder.path());
    let path = settings.file.clone();
    let mut recorder = Recorder::start(settings).expect("a recorder");
    for run in [1, 2] {
        recorder.describe(run, &format!("run = {run}")).expect("the configuration");
        let dance::Frame { header, handles } = dance::frame(run, 2);
        recorder.frame(&header, &handles).expect("a frame");
    }
    recorder.finish().expect("a finished recording");
    let mut reader = FrameReader::open(&path).expect("a recording");
    for run in [1, 2] {
        reader.next().expect("a frame").expect("a readable frame");
        let configuration = reader.configuration().expect("the configuration");
        assert_eq!((configuration.run_id, configuration.toml.as_str()), (run, format!("run = {run}").as_str()));
    }
}

#[test]
fn a_finished_file_has_an_index_of_everything() {
    let folder = tempdir().expect("a folder");
    let settings = dance::settings(folder.path());
    let path = settings.file.clone();
    let mut recorder = Recorder::start(settings).expect("a recorder");
    recorder.describe(RUN_ID, TOML).expect("the configuration");
    for dance::Frame { header, handles } in dance::frames(300, BENCHES) {
        recorder.frame(&header, &handles).expect("a frame");
    }
    recorder.record(&dance::alert(299), 7).expect("an alert");
    let recorded = recorder.finish().expect("a finished recording");
    assert_eq!((recorded.frames, recorded.alerts, &recorded.files), (300, 1, &vec![path.clone()]));
    assert_eq!(recorded.bytes, path.metadata().expect("a file").len());
    let summary = dance::summary(&path).expect("a summary");
    let stats = summary.stats.expect("statistics");
    assert_eq!(stats.message_count, 300 + 10 + 10 + 4 + 4 + 1, "frames, poses, transforms, boards twice and the alert");
    assert!(summary.chunk_indexes.len() > 1 && summary.chunk_indexes.iter().all(|chunk| chunk.compression == "zstd"));
    assert_eq!(summary.metadata_indexes.len(), 1);
}

#[test]
fn an_existing_file_is_not_overwritten() {
    let folder = tempdir().expect("a folder");
    let settings = dance::settings(folder.path());
    std::fs::write(&settings.file, "precious").expect("a file");
    let error = Recorder::start(settings.clone()).expect_err("a file in the way");
    assert!(matches!(&error, RecordError::Exists(path) if *path == settings.file), "{error}");
    assert_eq!(std::fs::read(&settings.file).expect("the file"), b"precious");
}

#[test]
fn progress_counts_what_has_been_written_without_waiting_for_more() {
    let folder = tempdir().expect("a folder");
    let settings = dance::settings(folder.path());
    let path = settings.file.clone();
    let mut recorder = Recorder::start(settings).expect("a recorder");
    let dance::Frame { header, handles } = dance::frame(0, BENCHES);
    recorder.frame(&header, &handles).expect("a frame");
    recorder.record(&dance::alert(0), 7).expect("an alert");
    let is_written = |progress: &RecorderProgress| {
        let bytes = path.metadata().expect("a file").len();
        (progress.frames, progress.alerts, progress.bytes_written) == (1, 1, bytes)
    };
    eventually_from("the frame and the alert are written", || {
        let progress = recorder.progress();
        if is_written(&progress) { Ok(()) } else { Err(format!("{progress:?}")) }
    });
    let RecorderProgress { files, file, .. } = recorder.progress();
    assert_eq!((files, &file), (1, &path));
    assert_eq!(dance::read(&path).0.len(), 1, "a running recording can be read");
}

#[test]
fn a_part_that_is_reread_ends_with_the_chunk_of_its_last_frame() {
    let folder = tempdir().expect("a folder");
    let path = dance::record(dance::settings(folder.path()), &dance::frames(2_000, BENCHES));
    let mut reader = FrameReader::open(&path).expect("a recording");
    reader.next().expect("a frame").expect("a readable frame");
    let first = reader.bookmark();
    let mut positions: Vec<u64> = Vec::new();
    while reader.next().is_some() {
        positions.push(reader.position());
    }
    let last = positions[1_000];
    let again = FrameReader::open_between(&path, &first, last).expect("the same recording");
    let of_the_chunks = 1 + positions.iter().filter(|&&position| position <= last).count();
    assert_eq!(again.count(), of_the_chunks);
    assert!(of_the_chunks < 2_000, "there is more than one chunk");
}

#[test]
fn topics_keep_the_numbers_that_earlier_versions_gave_them() {
    let folder = tempdir().expect("a folder");
    let path = dance::record(dance::settings(folder.path()), &dance::frames(10, 5));
    let channels = dance::summary(&path).expect("a summary").channels;
    let mut numbered: Vec<_> = channels.values().map(|channel| (channel.id, channel.topic.as_str())).collect();
    numbered.sort_unstable();
    let topics: Vec<_> = numbered.into_iter().map(|(_, topic)| topic).collect();
    let earlier = ["/dragon/frames", "/dragon/poses", "/dragon/alerts", "/dragon/commands", "/tf"];
    assert_eq!(topics, [&earlier[..], &["/dragon/boards", "/dragon/markers"]].concat());
}
