//! Reads the heads of a recording's records at any position, without the bytes between them.

use std::io::{self, BufRead, BufReader, Read};

use bench_dragon_ipc::FromBytes;
use mcap::{MAGIC, records::op};

use super::{
    disk::{FileReader, RecordingFile},
    records::{RECORD_HEAD_BYTES, split_start},
};

/// Bytes read of each record: its head, and enough of its body for the lengths of its fields.
pub(super) const START_BYTES: usize = 64;
/// Size of the read buffer: usually enough for the indexes of a chunk and the start of the next chunk.
const BUFFER_BYTES: usize = 4096;
/// Bytes of a chunk's header without the name of its compression.
const CHUNK_HEADER_BYTES: u64 = CHUNK_TIMES_BYTES as u64 + 4 + 8;
/// Bytes before that name: two times, a size and a checksum.
const CHUNK_TIMES_BYTES: usize = 8 + 8 + 8 + 4;
/// Bytes of a message index without its entries: a channel, and the length of the entries.
pub(super) const INDEX_HEAD_BYTES: u64 = 2 + 4;

/// A reader of single records at any position of a file.
pub(super) struct RecordHeads<'a> {
    source: BufReader<FileReader<'a>>,
    /// Length of the file in bytes.
    pub(super) length: u64,
    /// Position of `source` in bytes.
    at: u64,
}

impl<'a> RecordHeads<'a> {
    pub(super) fn of(file: &'a dyn RecordingFile) -> io::Result<Self> {
        file.expect_random_reads();
        let source = BufReader::with_capacity(BUFFER_BYTES, FileReader::new(file, 0));
        Ok(Self { length: file.length()?, source, at: 0 })
    }

    /// The first [`START_BYTES`] of a record, or fewer at the end of the file.
    pub(super) fn start(&mut self, begin: u64) -> io::Result<Vec<u8>> {
        self.bytes(begin, START_BYTES as u64)
    }

    /// The body of a record.
    pub(super) fn body(&mut self, begin: u64, end: u64) -> io::Result<Vec<u8>> {
        self.bytes(begin + RECORD_HEAD_BYTES, end - begin - RECORD_HEAD_BYTES)
    }

    fn bytes(&mut self, begin: u64, count: u64) -> io::Result<Vec<u8>> {
        self.go_to(begin)?;
        let mut bytes = Vec::new();
        self.at += self.source.by_ref().take(count).read_to_end(&mut bytes)? as u64;
        Ok(bytes)
    }

    /// Seeks to a byte, and keeps the buffered bytes if they contain it.
    fn go_to(&mut self, at: u64) -> io::Result<()> {
        self.source.seek_relative(at.cast_signed() - self.at.cast_signed())?;
        self.at = at;
        Ok(())
    }

    /// Whether the file contains only zeros from `begin` to its end.
    pub(super) fn is_zero_from(&mut self, begin: u64) -> io::Result<bool> {
        self.go_to(begin)?;
        loop {
            let block = self.source.fill_buf()?;
            let bytes = block.len();
            if bytes == 0 || block.iter().any(|&byte| byte != 0) {
                return Ok(bytes == 0);
            }
            self.source.consume(bytes);
            self.at += bytes as u64;
        }
    }

    /// Whether a summary, or the beginning of one, follows the data. Such bytes can be cut off without loss.
    pub(super) fn is_summary_from(&mut self, mut begin: u64) -> io::Result<bool> {
        loop {
            let start = self.start(begin)?;
            let Some((opcode, length, _)) = split_start(&start) else { return Ok(true) };
            let end = begin.saturating_add(RECORD_HEAD_BYTES).saturating_add(length);
            match opcode {
                0 => return self.is_zero_from(begin),
                op::FOOTER => {
                    let rest = self.bytes(end.min(self.length), MAGIC.len() as u64 + 1)?;
                    return Ok(MAGIC.starts_with(&rest) || rest.iter().all(|&byte| byte == 0));
                }
                _ if !is_of_summary(opcode) => return Ok(false),
                _ if end > self.length => return Ok(true),
                _ => begin = end,
            }
        }
    }
}

/// Length of a record's body by its fields. `None` if `body` does not contain them, and for kinds of record that a recording's
/// data does not contain.
pub(super) fn length_by_fields(opcode: u8, body: &[u8]) -> Option<u64> {
    match opcode {
        op::CHUNK => {
            let name_bytes: u32 = number_at(body, CHUNK_TIMES_BYTES)?;
            let data_bytes: u64 =
                number_at(body, CHUNK_TIMES_BYTES.saturating_add(4).saturating_add(name_bytes as usize))?;
            (CHUNK_HEADER_BYTES + u64::from(name_bytes)).checked_add(data_bytes)
        }
        op::MESSAGE_INDEX => Some(INDEX_HEAD_BYTES + u64::from(number_at::<u32>(body, 2)?)),
        // A header has two names; metadata has a name and a map.
        op::HEADER | op::METADATA => {
            let first_bytes: u32 = number_at(body, 0)?;
            let rest_bytes: u32 = number_at(body, 4_usize.saturating_add(first_bytes as usize))?;
            Some(4 + u64::from(first_bytes) + 4 + u64::from(rest_bytes))
        }
        op::DATA_END => Some(4),
        _ => None,
    }
}

pub(super) fn is_of_data(opcode: u8) -> bool {
    matches!(opcode, op::CHUNK | op::MESSAGE_INDEX | op::METADATA)
}

fn is_of_summary(opcode: u8) -> bool {
    matches!(
        opcode,
        op::SCHEMA
            | op::CHANNEL
            | op::STATISTICS
            | op::CHUNK_INDEX
            | op::ATTACHMENT_INDEX
            | op::METADATA_INDEX
            | op::SUMMARY_OFFSET
    )
}

/// Reads a little-endian number at a byte. `None` if the bytes end before it.
pub(super) fn number_at<T: FromBytes>(bytes: &[u8], at: usize) -> Option<T> {
    T::read_from_prefix(bytes.get(at..)?).ok().map(|(number, _)| number)
}
