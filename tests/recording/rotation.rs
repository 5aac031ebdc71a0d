//! A recording in several files.

use std::path::PathBuf;

use bench_dragon::recording::{RecordError, RecordedFrame, Recorder, RecorderSettings, RecordingSummary};
use mcap::records::ChunkIndex;
use tempfile::{TempDir, tempdir};

use crate::dance::{self, BENCHES, RUN_ID, TOML};

const FILE_BYTES: u64 = 1_000_000;
const FRAMES: u64 = 700;

fn record_in_files(max_total_bytes: Option<u64>) -> (TempDir, RecordingSummary) {
    let folder = tempdir().expect("a folder");
    let settings =
        RecorderSettings { rotate_bytes: Some(FILE_BYTES), max_total_bytes, ..dance::settings(folder.path()) };
    let mut recorder = Recorder::start(settings).expect("a recorder");
    recorder.describe(RUN_ID, TOML).expect("the configuration");
    for dance::Frame { header, handles } in dance::frames(FRAMES, BENCHES) {
        recorder.frame(&header, &handles).expect("a frame");
    }
    let summary = recorder.finish().expect("a finished recording");
    assert_eq!(summary.frames, FRAMES);
    (folder, summary)
}

fn read_all(files: &[PathBuf]) -> Vec<RecordedFrame> {
    files.iter().flat_map(|file| dance::read(file).0).collect()
}

#[test]
fn the_files_together_hold_every_frame() {
    let (folder, summary) = record_in_files(None);
    assert!(summary.files.len() > 2, "{:?}", summary.files);
    assert_eq!(summary.files[0], folder.path().join("show.mcap"));
    assert_eq!(summary.files[1], folder.path().join("show-0002.mcap"));
    dance::assert_same(&read_all(&summary.files), &dance::frames(FRAMES, BENCHES));
}

#[test]
fn no_file_exceeds_its_limit() {
    let (_folder, summary) = record_in_files(None);
    let sizes: Vec<u64> = summary.files.iter().map(|file| file.metadata().expect("a file").len()).collect();
    assert!(sizes.iter().all(|size| *size <= FILE_BYTES), "{sizes:?}");
    assert_eq!(sizes.iter().sum::<u64>(), summary.bytes);
}

#[test]
fn every_file_is_whole_and_described() {
    let (_folder, summary) = record_in_files(None);
    for file in &summary.files {
        assert!(dance::summary(file).is_some(), "{} has an index", file.display());
        assert_eq!(dance::configuration_toml(file).as_deref(), Some(TOML), "{}", file.display());
    }
}

#[test]
fn every_chunk_holds_messages_so_that_viewers_find_the_beginning() {
    let (_folder, summary) = record_in_files(None);
    for file in &summary.files {
        let chunks = dance::summary(file).expect("a summary").chunk_indexes;
        let begins_with_messages = |chunk: &ChunkIndex| chunk.message_start_time > 0;
        assert!(!chunks.is_empty() && chunks.iter().all(begins_with_messages), "{}", file.display());
    }
}

#[test]
fn the_oldest_files_are_removed_and_the_newest_frames_kept() {
    let limit_bytes = 2 * FILE_BYTES + FILE_BYTES / 2;
    let (folder, summary) = record_in_files(Some(limit_bytes));
    let in_folder: Vec<_> = folder.path().read_dir().expect("a folder").collect();
    assert_eq!(in_folder.len(), summary.files.len(), "the summary lists all files");
    let sizes = summary.files.iter().map(|file| file.metadata().expect("a file").len());
    assert!(sizes.sum::<u64>() <= limit_bytes);
    let recorded = read_all(&summary.files);
    let first_tick = recorded[0].header.tick;
    assert!(first_tick > 0, "the oldest files are removed");
    dance::assert_same(&recorded, &dance::frames(FRAMES, BENCHES)[first_tick as usize..]);
}

#[test]
fn a_later_file_that_is_in_the_way_is_an_error_at_the_start() {
    let folder = tempdir().expect("a folder");
    let in_the_way = folder.path().join("show-0007.mcap");
    std::fs::write(&in_the_way, "precious").expect("a file");
    let settings = RecorderSettings { rotate_bytes: Some(FILE_BYTES), ..dance::settings(folder.path()) };
    let error = Recorder::start(settings).expect_err("a file in the way");
    assert!(matches!(&error, RecordError::Exists(path) if *path == in_the_way), "{error}");
    assert!(!folder.path().join("show.mcap").exists());
}
