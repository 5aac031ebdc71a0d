//! Repair in place: no whole chunk is lost, wherever the repair is cut and whichever bit is flipped.

use std::{
    fs,
    ops::RangeInclusive,
    path::{Path, PathBuf},
};

use bench_dragon::recording::{Recorder, RepairError, repair};
use tempfile::TempDir;

use crate::dance::{self, Frame};

/// Bytes of the record that ends the data: its kind, its length, a checksum.
const DATA_END_BYTES: usize = 1 + 8 + 4;
/// Bytes of a chunk's head: kind, length, and the fields of its header.
const CHUNK_HEAD_BYTES: u64 = 1 + 8 + 8 + 8 + 8 + 4 + 4 + "zstd".len() as u64 + 8;

/// A small recording of several chunks, with alerts and descriptions in between.
struct Small {
    frames: Vec<Frame>,
    /// The finished file, but without a checksum of the data, since a repair does not read the data.
    bytes: Vec<u8>,
    data_end: usize,
    chunks: Vec<mcap::records::ChunkIndex>,
}

/// Returns a folder, in memory if possible, since these tests create thousands of files.
fn folder() -> TempDir {
    let memory = Path::new("/dev/shm");
    let folder = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
    folder.expect("a folder")
}

impl Small {
    fn record() -> Self {
        let folder = folder();
        let settings = dance::settings(folder.path());
        let path = settings.file.clone();
        let frames = dance::frames(10, 1);
        let mut recorder = Recorder::start(settings).expect("a recorder");
        for (index, Frame { header, handles }) in frames.iter().enumerate() {
            if matches!(index, 0 | 3 | 6) {
                // A description ends the chunk before it.
                recorder.describe(dance::RUN_ID, dance::TOML).expect("the configuration");
            }
            recorder.frame(header, handles).expect("a frame");
            recorder.record(&dance::alert(header.tick), header.published_ns).expect("an alert");
        }
        recorder.finish().expect("a finished recording");
        let mut bytes = fs::read(&path).expect("the recording");
        let data_end = mcap::read::footer(&bytes).expect("a footer").summary_start as usize - DATA_END_BYTES;
        bytes[data_end + DATA_END_BYTES - 4..][..4].fill(0);
        Self { frames, bytes, data_end, chunks: dance::summary(&path).expect("a summary").chunk_indexes }
    }

    fn chunk_end(&self, number: usize) -> u64 {
        self.chunks[number].chunk_start_offset + self.chunks[number].chunk_length
    }

    /// Returns the frames of the chunks that lie completely within the first `length` bytes.
    fn frames_within(&self, length: usize) -> &[Frame] {
        let whole = self.chunks.iter().filter(|chunk| chunk.chunk_start_offset + chunk.chunk_length <= length as u64);
        let last_ns = whole.map(|chunk| chunk.message_end_time).max().unwrap_or(0);
        let log_time_ns = |frame: &Frame| frame.header.published_ns + dance::OFFSET_NS as u64;
        &self.frames[..self.frames.partition_point(|frame| log_time_ns(frame) <= last_ns)]
    }
}

fn write(folder: &TempDir, bytes: &[u8]) -> PathBuf {
    let path = folder.path().join("cut.mcap");
    fs::write(&path, bytes).expect("a file");
    path
}

#[test]
fn a_recording_or_repair_cut_at_any_byte_is_repaired_to_the_same_file() {
    let small = Small::record();
    assert!(small.chunks.len() >= 4, "{} chunks", small.chunks.len());
    let folder = folder();
    let header_end = {
        let first_metadata = dance::summary(&write(&folder, &small.bytes)).expect("a summary").metadata_indexes;
        first_metadata.iter().map(|index| index.offset).min().expect("a description") as usize
    };
    for length in header_end..small.bytes.len() {
        let path = write(&folder, &small.bytes[..length]);
        let repaired = repair(&path).unwrap_or_else(|error| panic!("cut at byte {length}: {error}"));
        let expected = small.frames_within(length);
        assert_eq!((repaired.frames, repaired.was_unfinished), (expected.len() as u64, true), "cut at byte {length}");
        dance::assert_same(&dance::read(&path).0, expected);
        let bytes = fs::read(&path).expect("the repaired recording");
        if length as u64 >= small.chunk_end(small.chunks.len() - 1) {
            assert!(bytes == small.bytes, "cut at byte {length}: the file differs from the finished one");
        }
        let begins_with = |end: u64| bytes[..end as usize] == small.bytes[..end as usize];
        let whole = (0..small.chunks.len()).map(|number| small.chunk_end(number)).filter(|&end| end <= length as u64);
        assert!(whole.max().is_none_or(begins_with), "cut at byte {length}: the data was changed");
        let summary = dance::summary(&path).expect("an index");
        assert_eq!(summary.stats.expect("statistics").chunk_count as usize, summary.chunk_indexes.len());
    }
}

#[test]
fn a_flipped_byte_in_the_head_of_a_record_cuts_nothing_off() {
    let small = Small::record();
    let [chunk, next] = [&small.chunks[2], &small.chunks[3]];
    let heads: [RangeInclusive<u64>; 3] = [
        chunk.chunk_start_offset..=chunk.chunk_start_offset + CHUNK_HEAD_BYTES,
        // The indexes of the chunk, and the description after them.
        small.chunk_end(2)..=next.chunk_start_offset,
        small.data_end as u64..=small.data_end as u64,
    ];
    let folder = folder();
    for length in [small.data_end, small.bytes.len() - 1] {
        for at in heads.iter().cloned().flatten().filter(|&at| at < length as u64) {
            for bit in 0..8 {
                let mut bytes = small.bytes[..length].to_vec();
                bytes[at as usize] ^= 1 << bit;
                let path = write(&folder, &bytes);
                match repair(&path) {
                    Ok(_) => {
                        let repaired = fs::read(&path).expect("the repaired recording");
                        assert!(repaired.len() >= small.data_end, "bit {bit} of byte {at}: something was cut off");
                        assert!(repaired[..small.data_end] == bytes[..small.data_end], "bit {bit} of byte {at}");
                    }
                    Err(RepairError::Damaged { .. }) => {
                        assert!(
                            fs::read(&path).expect("the file") == bytes,
                            "bit {bit} of byte {at}: the file was changed"
                        );
                    }
                    Err(error) => panic!("bit {bit} of byte {at}: {error}"),
                }
            }
        }
    }
}

#[test]
fn bytes_after_the_end_of_the_data_are_not_cut_off() {
    let small = Small::record();
    let folder = folder();
    for more in [&b"more"[..], &small.bytes[small.chunks[1].chunk_start_offset as usize..]] {
        for end in [small.data_end + DATA_END_BYTES, small.bytes.len()] {
            let bytes = [&small.bytes[..end], b"\x10more than a record's head", more].concat();
            let path = write(&folder, &bytes);
            let error = repair(&path).expect_err("there is more behind the end");
            assert!(matches!(error, RepairError::Damaged { .. }), "{error}");
            assert!(fs::read(&path).expect("the file") == bytes);
        }
    }
}
