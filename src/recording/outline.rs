//! The outline of a recording's file: its chunks with their times, and its configurations, without the bytes of the chunks.
//!
//! The outline reads the head of each record. So its time grows with the number of chunks, not with their bytes. It needs no
//! index, and ends where a reader of the file ends: at the end of the data, or at the first record that is torn or damaged.

use std::{
    io::{self, Cursor},
    ops::Range,
};

use binrw::BinRead;
use mcap::{
    MAGIC,
    records::{ChunkHeader, Record, op},
};

use super::{
    disk::RecordingFile,
    reader::Configuration,
    record_heads::RecordHeads,
    records::{LONGEST_RECORD_BYTES, RECORD_HEAD_BYTES, split_start},
};

/// A chunk of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct OutlinedChunk {
    /// Byte at which the chunk begins.
    pub(super) position: u64,
    /// Least and greatest log time of its messages: Unix time in nanoseconds.
    pub(super) begin_ns: u64,
    pub(super) end_ns: u64,
    /// Number of configurations before it in the file.
    pub(super) configurations: usize,
}

/// The outline of a file.
#[derive(Clone, Debug, Default)]
pub(super) struct Outline {
    /// The chunks, in the order of the file.
    pub(super) chunks: Vec<OutlinedChunk>,
    /// The configurations, in the order of the file.
    pub(super) configurations: Vec<Configuration>,
}

impl Outline {
    /// Reads the outline of a file that begins like an MCAP file.
    pub(super) fn of(file: &dyn RecordingFile) -> io::Result<Self> {
        let (mut heads, mut outline) = (RecordHeads::of(file)?, Self::default());
        let mut at = MAGIC.len() as u64;
        while let Some((opcode, record)) = next_record(&mut heads, at)? {
            at = record.end;
            match opcode {
                op::CHUNK => outline.take_chunk(&heads.start(record.start)?, record.start),
                op::METADATA => outline.take_metadata(&heads.body(record.start, record.end)?),
                _ => {}
            }
        }
        Ok(outline)
    }

    fn take_chunk(&mut self, start: &[u8], position: u64) {
        let Some(header) = start.get(RECORD_HEAD_BYTES as usize..) else { return };
        if let Ok(header) = ChunkHeader::read_le(&mut Cursor::new(header)) {
            let [begin_ns, end_ns] = [header.message_start_time, header.message_end_time];
            let configurations = self.configurations.len();
            self.chunks.push(OutlinedChunk { position, begin_ns, end_ns, configurations });
        }
    }

    fn take_metadata(&mut self, body: &[u8]) {
        if let Ok(Record::Metadata(metadata)) = mcap::parse_record(op::METADATA, body) {
            self.configurations.extend(Configuration::from_metadata(metadata));
        }
    }
}

/// Kind and bytes of the record at a byte. `None` at the end of the data, and at a torn or damaged record.
fn next_record(heads: &mut RecordHeads<'_>, at: u64) -> io::Result<Option<(u8, Range<u64>)>> {
    let start = heads.start(at)?;
    let Some((opcode, length, _)) = split_start(&start) else { return Ok(None) };
    let is_end = matches!(opcode, 0 | op::DATA_END) || length > LONGEST_RECORD_BYTES as u64;
    let record = at..at.saturating_add(RECORD_HEAD_BYTES).saturating_add(length);
    Ok((!is_end && record.end <= heads.length).then_some((opcode, record)))
}
