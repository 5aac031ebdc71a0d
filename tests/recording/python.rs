//! The stock Python readers open a recording without code of the project. `python/test_recording.py` checks the content.

use std::{fs, io::Write, path::Path};

use bench_dragon::recording::{Recorder, repair};
use tempfile::tempdir;
use test_support::pytest::{expect_passed, pytest};

use crate::dance::{self, BENCHES, Frame, OFFSET_NS, RUN_ID, TOML};

const FRAMES: u64 = 250;

/// Writes a finished recording, and a file with the frames' bytes on the bus.
fn write_whole(folder: &Path) {
    let frames = dance::frames(FRAMES, BENCHES);
    let mut recorder = Recorder::start(dance::settings(folder)).expect("a recorder");
    recorder.describe(RUN_ID, TOML).expect("the configuration");
    let mut expected = fs::File::create(folder.join("frames.bin")).expect("a file");
    for Frame { header, handles } in &frames {
        recorder.frame(header, handles).expect("a frame");
        expected.write_all(&bench_dragon_ipc::frame_bytes(header, handles)).expect("the bytes of a frame");
    }
    recorder.record(&dance::alert(FRAMES - 1), 6_000_000_000_000).expect("an alert");
    recorder.finish().expect("a finished recording");
}

/// Writes the recording cut in the middle of a chunk, and its repair. Returns the number of frames in both.
fn write_cut_and_repaired(folder: &Path) -> u64 {
    let whole = folder.join("show.mcap");
    let chunks = dance::summary(&whole).expect("a summary").chunk_indexes;
    let middle = chunks.get(chunks.len() / 2).expect("a chunk");
    let length = (middle.chunk_start_offset + middle.chunk_length / 2) as usize;
    let bytes = &fs::read(&whole).expect("the recording")[..length];
    fs::write(folder.join("cut.mcap"), bytes).expect("a cut recording");
    let repaired = folder.join("repaired.mcap");
    fs::write(&repaired, bytes).expect("a cut recording");
    repair(&repaired).expect("a repair").frames
}

#[test]
fn stock_python_readers_find_every_bit() {
    let folder = tempdir().expect("a folder");
    write_whole(folder.path());
    let frames_in_cut = write_cut_and_repaired(folder.path());
    assert!(0 < frames_in_cut && frames_in_cut < FRAMES, "the cut took some frames: {frames_in_cut} are left");
    let mut readers = pytest("tests/python/test_recording.py");
    readers
        .env("RECORDING_FOLDER", folder.path())
        .env("RECORDING_FRAMES", FRAMES.to_string())
        .env("RECORDING_FRAMES_IN_CUT", frames_in_cut.to_string())
        .env("RECORDING_OFFSET_NS", OFFSET_NS.to_string());
    expect_passed(readers);
}
