//! A recording cut at any byte: its readable part, and its repair.

use std::{
    fs,
    io::Cursor,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    sync::LazyLock,
};

use bench_dragon::recording::{
    FrameReader, Recorder, RecorderSettings, RepairError, repair, repair_checked, repair_folder,
};
use proptest::prelude::*;
use tempfile::{TempDir, tempdir};
use test_support::eventually::eventually;
use test_support::property::random_cases;

use crate::dance::{self, Frame, TOML};

/// Bytes of a record's head: its kind and its length.
const RECORD_HEAD_BYTES: u64 = 9;

/// A finished recording of many small chunks.
struct Original {
    frames: Vec<Frame>,
    bytes: Vec<u8>,
    chunks: Vec<mcap::records::ChunkIndex>,
}

static ORIGINAL: LazyLock<Original> = LazyLock::new(|| {
    let folder = tempdir().expect("a folder");
    let frames = dance::frames(1_200, 12);
    let settings = RecorderSettings { rotate_bytes: Some(1_000_000), ..dance::settings(folder.path()) };
    let path = dance::record(settings, &frames);
    let chunks = dance::summary(&path).expect("a summary").chunk_indexes;
    assert!(chunks.len() > 10, "{} chunks", chunks.len());
    Original { frames, bytes: fs::read(&path).expect("the recording"), chunks }
});

impl Original {
    /// Writes the first `length` bytes as a file.
    fn cut_at(&self, length: usize) -> (TempDir, PathBuf) {
        let folder = tempdir().expect("a folder");
        let path = folder.path().join("show.mcap");
        fs::write(&path, &self.bytes[..length]).expect("the beginning of the recording");
        (folder, path)
    }

    /// Returns the frames of the chunks that lie completely within the first `length` bytes.
    fn frames_within(&self, length: usize) -> &[Frame] {
        let is_within =
            |chunk: &&mcap::records::ChunkIndex| chunk.chunk_start_offset + chunk.chunk_length <= length as u64;
        let last_ns = self.chunks.iter().filter(is_within).map(|chunk| chunk.message_end_time).max().unwrap_or(0);
        let log_time_ns = |frame: &Frame| frame.header.published_ns + dance::OFFSET_NS as u64;
        &self.frames[..self.frames.partition_point(|frame| log_time_ns(frame) <= last_ns)]
    }

    /// Returns the bytes up to the end of the header. Without the header, the file counts as foreign.
    fn header_length(&self) -> usize {
        self.chunks[0].chunk_start_offset as usize
    }
}

proptest! {
    #![proptest_config(random_cases(96))]

    #[test]
    fn a_cut_recording_yields_the_frames_of_its_whole_chunks(part in 0.0..1.0) {
        let length = (ORIGINAL.bytes.len() as f64 * part) as usize;
        prop_assume!(length >= ORIGINAL.header_length());
        let (_folder, path) = ORIGINAL.cut_at(length);
        let (recorded, _) = dance::read(&path);
        dance::assert_same(&recorded, ORIGINAL.frames_within(length));
    }

    #[test]
    fn repair_finishes_a_recording_cut_anywhere(part in 0.0..1.0) {
        let length = (ORIGINAL.bytes.len() as f64 * part) as usize;
        prop_assume!(length >= ORIGINAL.header_length());
        let (_folder, path) = ORIGINAL.cut_at(length);
        let expected = ORIGINAL.frames_within(length);
        let repaired = repair(&path).expect("a repair");
        prop_assert!(repaired.was_unfinished);
        prop_assert_eq!(repaired.frames, expected.len() as u64);
        let (recorded, was_cut) = dance::read(&path);
        prop_assert!(!was_cut);
        dance::assert_same(&recorded, expected);
        prop_assert!(dance::summary(&path).is_some(), "an index");
        assert_repairing_again_changes_nothing(&path);
    }
}

fn assert_repairing_again_changes_nothing(path: &Path) {
    let before = fs::read(path).expect("the recording");
    assert!(!repair(path).expect("a finished recording").was_unfinished);
    assert!(fs::read(path).expect("the recording") == before, "the bytes are the same");
}

/// Returns the frames of the first six chunks except those of a damaged chunk.
fn frames_but_those_of(chunk: &mcap::records::ChunkIndex) -> Vec<Frame> {
    let (begin, end) = (chunk.chunk_start_offset as usize, (chunk.chunk_start_offset + chunk.chunk_length) as usize);
    let all = ORIGINAL.frames_within(ORIGINAL.chunks[6].chunk_start_offset as usize);
    let (before, with) = (ORIGINAL.frames_within(begin), ORIGINAL.frames_within(end));
    assert!(with.len() > before.len(), "the chunk holds frames");
    [before, &all[with.len()..]].concat()
}

#[test]
fn a_damaged_chunk_costs_its_own_frames_and_the_old_file_is_kept() {
    let chunk = &ORIGINAL.chunks[3];
    let expected = frames_but_those_of(chunk);
    let (_folder, path) = ORIGINAL.cut_at(ORIGINAL.chunks[6].chunk_start_offset as usize);
    let mut bytes = fs::read(&path).expect("the recording");
    bytes[(chunk.chunk_start_offset + chunk.chunk_length / 2) as usize] ^= 0xff;
    fs::write(&path, &bytes).expect("a damaged recording");
    let mut reader = FrameReader::open(&path).expect("a recording");
    let read: Vec<_> = reader.by_ref().collect::<Result<_, _>>().expect("readable frames");
    dance::assert_same(&read, &expected);
    let chunk_bytes = chunk.chunk_length - RECORD_HEAD_BYTES;
    assert_eq!(reader.flaws().skipped_bytes, chunk_bytes);

    let repaired = repair_checked(&path, |_| ()).expect("a repair");
    assert_eq!((repaired.frames, repaired.skipped_bytes), (expected.len() as u64, chunk_bytes));
    assert!(fs::read(repaired.kept.expect("damage inside")).expect("the old file") == bytes);
    dance::assert_same(&dance::read(&path).0, &expected);
    assert!(dance::summary(&path).is_some(), "an index");
}

#[test]
fn a_finished_recording_whose_first_chunk_is_damaged_has_all_other_frames() {
    let chunk = &ORIGINAL.chunks[0];
    let (_folder, path) = ORIGINAL.cut_at(ORIGINAL.bytes.len());
    let mut bytes = fs::read(&path).expect("the recording");
    bytes[(chunk.chunk_start_offset + chunk.chunk_length / 2) as usize] ^= 0xff;
    fs::write(&path, &bytes).expect("a damaged recording");
    let mut reader = FrameReader::open(&path).expect("a recording");
    let read: Vec<_> = reader.by_ref().collect::<Result<_, _>>().expect("readable frames");
    dance::assert_same(&read, &ORIGINAL.frames[1..]);
    assert_eq!(reader.flaws().skipped_bytes, chunk.chunk_length - RECORD_HEAD_BYTES);
}

#[test]
fn a_recording_whose_records_can_no_longer_be_followed_ends_there_and_is_kept() {
    let chunk = &ORIGINAL.chunks[3];
    let (_folder, path) = ORIGINAL.cut_at(ORIGINAL.chunks[6].chunk_start_offset as usize);
    let mut bytes = fs::read(&path).expect("the recording");
    bytes[chunk.chunk_start_offset as usize + 8] ^= 0xff; // the highest byte of the chunk's length
    fs::write(&path, &bytes).expect("a damaged recording");
    let expected = ORIGINAL.frames_within(chunk.chunk_start_offset as usize);
    let (recorded, was_cut) = dance::read(&path);
    assert!(was_cut);
    dance::assert_same(&recorded, expected);
    let error = repair(&path).expect_err("there may be more behind the damage");
    assert!(matches!(error, RepairError::Damaged { at_byte, .. } if at_byte == chunk.chunk_start_offset), "{error}");
    assert!(fs::read(&path).expect("the recording") == bytes, "nothing is cut off");
    let repaired = repair_checked(&path, |_| ()).expect("a repair");
    assert_eq!((repaired.frames, repaired.skipped_bytes), (expected.len() as u64, 0));
    assert!(fs::read(repaired.kept.expect("more behind the damage")).expect("the old file") == bytes);
}

#[test]
fn no_copy_is_kept_of_a_torn_end() {
    let (folder, path) = ORIGINAL.cut_at(ORIGINAL.chunks[6].chunk_start_offset as usize + 100);
    assert_eq!(repair(&path).expect("a repair").kept, None);
    assert_eq!(fs::read_dir(folder.path()).expect("the folder").count(), 1);
}

#[test]
fn a_file_that_ends_with_zeros_is_repaired_up_to_them() {
    let length = ORIGINAL.chunks[5].chunk_start_offset as usize;
    let (_folder, path) = ORIGINAL.cut_at(length);
    let mut bytes = fs::read(&path).expect("the recording");
    bytes.resize(length + 100_000, 0);
    fs::write(&path, bytes).expect("a recording with zeros behind it");
    assert_eq!(repair(&path).expect("a repair").frames, ORIGINAL.frames_within(length).len() as u64);
}

#[test]
fn repair_keeps_the_configuration() {
    let (_folder, path) = ORIGINAL.cut_at(ORIGINAL.bytes.len() / 2);
    repair(&path).expect("a repair");
    assert_eq!(dance::configuration_toml(&path).as_deref(), Some(TOML));
    assert_eq!(dance::summary(&path).expect("a summary").metadata_indexes.len(), 1);
}

#[test]
fn a_finished_recording_is_left_untouched() {
    let (_folder, path) = ORIGINAL.cut_at(ORIGINAL.bytes.len());
    assert_eq!(repair(&path).expect("a finished recording").frames, ORIGINAL.frames.len() as u64);
    assert_repairing_again_changes_nothing(&path);
    assert!(fs::read(&path).expect("the recording") == ORIGINAL.bytes);
}

#[test]
fn a_recording_that_is_being_made_is_not_repaired() {
    let folder = tempdir().expect("a folder");
    let settings = dance::settings(folder.path());
    let path = settings.file.clone();
    let recorder = Recorder::start(settings).expect("a recorder");
    let error = repair(&path).expect_err("a file in use");
    assert!(matches!(error, RepairError::InUse { .. }), "{error}");
    assert!(repair_folder(folder.path()).expect("a folder").is_empty());
    recorder.finish().expect("a finished recording");
    let repaired = eventually("no process has the recording open", || match repair(&path) {
        // A process that another test starts has this test's files open until its exec.
        Err(RepairError::InUse { .. }) => None,
        done => Some(done.expect("a finished recording")),
    });
    assert!(!repaired.was_unfinished);
}

#[test]
fn files_of_others_are_refused_and_left_untouched() {
    let mut other = mcap::Writer::new(Cursor::new(Vec::new())).expect("a writer");
    other.finish().expect("a finished file");
    let other = other.into_inner().into_inner();
    for bytes in [&b""[..], b"not a recording", &other, &other[..other.len() - 20]] {
        let folder = tempdir().expect("a folder");
        let path = folder.path().join("other.mcap");
        fs::write(&path, bytes).expect("a file");
        let error = repair(&path).expect_err("a file of another program");
        assert!(matches!(error, RepairError::Foreign { .. }), "{error}");
        assert!(repair_folder(folder.path()).expect("a folder").is_empty());
        assert_eq!(fs::read(&path).expect("the file"), bytes);
    }
}

#[test]
fn all_unfinished_recordings_of_a_folder_are_repaired() {
    let (folder, first) = ORIGINAL.cut_at(ORIGINAL.bytes.len() / 3);
    let second = folder.path().join("show-0002.mcap");
    fs::write(&second, &ORIGINAL.bytes[..ORIGINAL.bytes.len() - 1]).expect("an unfinished recording");
    fs::write(folder.path().join("whole.mcap"), &ORIGINAL.bytes).expect("a finished recording");
    fs::write(folder.path().join("notes.txt"), "steps").expect("a text");
    let repairs = repair_folder(folder.path()).expect("a folder");
    let paths: Vec<_> = repairs.into_iter().map(|repair| repair.expect("a repair").path).collect();
    assert_eq!(paths, [second, first]);
    assert!(repair_folder(folder.path()).expect("a folder").is_empty());
}

#[test]
fn a_recording_that_another_process_has_open_is_left_alone() {
    let (folder, path) = ORIGINAL.cut_at(ORIGINAL.bytes.len() / 2);
    let being_copied = fs::File::options().append(true).open(&path).expect("the recording");
    let mut copier = Command::new("cat").stdin(Stdio::piped()).stdout(being_copied).spawn().expect("cat is installed");
    assert!(repair_folder(folder.path()).expect("a folder").is_empty());
    drop(copier.stdin.take());
    eventually("the copier ends", || copier.try_wait().expect("a child can be waited for"));
    assert_eq!(repair_folder(folder.path()).expect("a folder").len(), 1);
}

#[test]
fn a_damaged_recording_that_cannot_be_copied_stays_as_it_is() {
    let (folder, path) = ORIGINAL.cut_at(ORIGINAL.bytes.len() / 2);
    let mut bytes = fs::read(&path).expect("the recording");
    bytes[(ORIGINAL.chunks[2].chunk_start_offset + ORIGINAL.chunks[2].chunk_length / 2) as usize] ^= 0xff;
    fs::write(&path, &bytes).expect("a damaged recording");
    fs::create_dir(folder.path().join("show.mcap.repairing")).expect("something in the way of the copy");
    let error = repair_checked(&path, |_| ()).expect_err("no room for the copy");
    assert!(matches!(error, RepairError::Write { .. }), "{error}");
    assert!(fs::read(&path).expect("the recording") == bytes);
}

#[test]
fn damage_in_the_first_chunk_costs_its_one_frame() {
    let first = &ORIGINAL.chunks[0];
    // The summary of a finished file declares the channels. For an unfinished file, the reader uses those of this version.
    for length in [ORIGINAL.bytes.len(), ORIGINAL.chunks[6].chunk_start_offset as usize] {
        let (_folder, path) = ORIGINAL.cut_at(length);
        let mut bytes = fs::read(&path).expect("the recording");
        bytes[(first.chunk_start_offset + first.chunk_length / 2) as usize] ^= 0xff;
        fs::write(&path, &bytes).expect("a damaged recording");
        let repaired = repair_checked(&path, |_| ()).expect("a repair");
        assert_eq!(repaired.skipped_bytes, first.chunk_length - RECORD_HEAD_BYTES);
        assert!(fs::read(repaired.kept.expect("damage inside")).expect("the old file") == bytes);
        dance::assert_same(&dance::read(&path).0, &ORIGINAL.frames_within(length)[1..]);
    }
}

#[test]
fn only_a_check_finds_damage_in_a_finished_recording() {
    let (folder, path) = ORIGINAL.cut_at(ORIGINAL.bytes.len());
    for chunk in &ORIGINAL.chunks[3..5] {
        let mut bytes = fs::read(&path).expect("the recording");
        let middle = (chunk.chunk_start_offset + chunk.chunk_length / 2) as usize;
        bytes[middle] ^= 0xff;
        fs::write(&path, &bytes).expect("a damaged recording");
        assert!(!repair(&path).expect("a finished recording").was_unfinished);
        let repaired = repair_checked(&path, |_| ()).expect("a repair");
        assert!(fs::read(repaired.kept.expect("damage inside")).expect("the old file") == bytes);
        assert_eq!(dance::read(&path).0.len() as u64, repaired.frames);
    }
    let mut names: Vec<_> =
        fs::read_dir(folder.path()).expect("the folder").map(|entry| entry.expect("a file").file_name()).collect();
    names.sort();
    assert_eq!(names, ["show.mcap", "show.mcap.2.damaged", "show.mcap.damaged"]);
}

#[test]
fn a_check_of_a_sound_recording_changes_as_much_as_a_repair() {
    for length in [ORIGINAL.bytes.len(), ORIGINAL.bytes.len() / 2] {
        let (folder, path) = ORIGINAL.cut_at(length);
        let (_other, repaired) = ORIGINAL.cut_at(length);
        let expected = repair(&repaired).expect("a repair");
        let mut last_bytes = 0;
        let checked = repair_checked(&path, |bytes| last_bytes = bytes).expect("a check");
        assert_eq!(
            (checked.frames, checked.was_unfinished, checked.kept),
            (expected.frames, expected.was_unfinished, None)
        );
        assert!(fs::read(&path).expect("the recording") == fs::read(&repaired).expect("the repaired recording"));
        assert!(last_bytes > length as u64 / 2, "{last_bytes} of {length} bytes were reported");
        assert_eq!(fs::read_dir(folder.path()).expect("the folder").count(), 1);
    }
}
