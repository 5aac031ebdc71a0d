//! A file with the name of a recording.

use std::fs;
use std::path::Path;

use bench_dragon::recording::cdr::encode_frame;
use bench_dragon::recording::{FrameReader, ReadError, RepairError, repair, repair_checked};
use bench_dragon::source::replay::PlaybackClock;

/// Greatest number of frames that are kept for comparison.
const MOST_FRAMES: usize = 1 << 12;

/// Fails unless a file is rejected or read up to its damage, each frame has a due time in a replay, and a repair leaves a
/// recording with an index and every frame that was read before.
pub(crate) fn check(input: &[u8]) {
    // The folder is in memory if possible, since a fuzzer creates thousands of files per second.
    let memory = Path::new("/dev/shm");
    let folder = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
    let folder = folder.expect("a folder");
    let path = folder.path().join("recording.mcap");
    fs::write(&path, input).expect("a file");
    let before = read(&path);
    match repair(&path) {
        Ok(repaired) if repaired.was_unfinished => check_finished(&path, &before),
        Ok(_) => {}
        Err(RepairError::Foreign { .. } | RepairError::Damaged { .. }) => {
            assert!(fs::read(&path).expect("the file is still there") == input, "the file is unchanged");
        }
        Err(error) => panic!("unexpected error: {error}"),
    }
    fs::write(&path, input).expect("a file");
    match repair_checked(&path, |_| ()) {
        Ok(_) => check_finished(&path, &before),
        Err(RepairError::Foreign { .. } | RepairError::Write { .. }) => {
            assert!(read(&path).ok() == before.ok(), "only an index was added");
        }
        Err(error) => panic!("unexpected error: {error}"),
    }
}

/// Fails unless a repaired recording is finished, and has every frame that was read before.
fn check_finished(path: &Path, before: &Result<Vec<Vec<u8>>, ReadError>) {
    assert!(!repair(path).expect("a finished recording").was_unfinished, "a repaired recording is finished");
    if let Ok(before) = before {
        assert!(read(path).expect("a repaired recording is readable") == *before, "repair keeps every frame");
    }
}

/// Returns the messages of the frames that a replay would publish.
fn read(path: &Path) -> Result<Vec<Vec<u8>>, ReadError> {
    let mut clock = PlaybackClock::new(1.0);
    let mut frames = Vec::new();
    let mut now_ns = 1_000_000_000;
    for frame in FrameReader::open(path)? {
        let frame = frame?;
        let due_ns = clock.due_ns(frame.header.scheduled_ns, now_ns);
        assert!(due_ns >= now_ns, "no frame is due in the past");
        now_ns = due_ns.min(1 << 62);
        if frames.len() < MOST_FRAMES {
            let mut message = Vec::new();
            encode_frame(&mut message, &frame.header, &frame.handles);
            frames.push(message);
        }
    }
    Ok(frames)
}
