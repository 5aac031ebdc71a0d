//! The heads of a recording's records, read wherever they are in the file, without what lies between them.

use std::{
    fs::File,
    io::{self, BufRead, BufReader, Read, Seek},
};

use bench_dragon_ipc::FromBytes;
use mcap::{MAGIC, records::op};
use rustix::fs::{Advice, fadvise};

use super::records::{RECORD_HEAD_BYTES, split_start};

/// The head of a record and as much of its body as tells the lengths of its fields.
pub(super) const START_BYTES: usize = 64;
/// Read at once: the indexes of a chunk and the start of the next one, as a rule.
const BUFFER_BYTES: usize = 4096;
/// A chunk's header without the name of its compression.
const CHUNK_HEADER_BYTES: u64 = CHUNK_TIMES_BYTES as u64 + 4 + 8;
/// What comes before that name: two times, a size and a checksum.
const CHUNK_TIMES_BYTES: usize = 8 + 8 + 8 + 4;
/// A message index without its entries: a channel and their length.
pub(super) const INDEX_HEAD_BYTES: u64 = 2 + 4;

/// Reads here and there in a file.
pub(super) struct Heads<'a> {
    source: BufReader<&'a File>,
    /// Bytes of the file.
    pub(super) length: u64,
    /// Where `source` stands.
    at: u64,
}

impl<'a> Heads<'a> {
    pub(super) fn of(mut file: &'a File) -> io::Result<Self> {
        // Without this the kernel reads ahead, which are the chunks' contents. It is advice: nothing depends on it.
        let _ = fadvise(file, 0, None, Advice::Random);
        file.rewind()?;
        Ok(Self { length: file.metadata()?.len(), source: BufReader::with_capacity(BUFFER_BYTES, file), at: 0 })
    }

    /// The first bytes of a record, fewer where the file ends.
    pub(super) fn start(&mut self, begin: u64) -> io::Result<Vec<u8>> {
        self.bytes(begin, START_BYTES as u64)
    }

    /// A whole record without its head.
    pub(super) fn body(&mut self, begin: u64, end: u64) -> io::Result<Vec<u8>> {
        self.bytes(begin + RECORD_HEAD_BYTES, end - begin - RECORD_HEAD_BYTES)
    }

    fn bytes(&mut self, begin: u64, count: u64) -> io::Result<Vec<u8>> {
        self.go_to(begin)?;
        let mut bytes = Vec::new();
        self.at += self.source.by_ref().take(count).read_to_end(&mut bytes)? as u64;
        Ok(bytes)
    }

    /// Keeps what has been read ahead, where it is of use.
    fn go_to(&mut self, at: u64) -> io::Result<()> {
        self.source.seek_relative(at.cast_signed() - self.at.cast_signed())?;
        self.at = at;
        Ok(())
    }

    /// Whether the file goes on with zeros alone, up to its end.
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

    /// Whether what follows the data is a summary or the beginning of one: nothing that would be missed.
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

/// The length of a record's body as its fields state it; `None` where they are not there.
pub(super) fn length_by_fields(opcode: u8, body: &[u8]) -> Option<u64> {
    match opcode {
        op::CHUNK => {
            let name_bytes: u32 = number_at(body, CHUNK_TIMES_BYTES)?;
            let data_bytes: u64 =
                number_at(body, CHUNK_TIMES_BYTES.saturating_add(4).saturating_add(name_bytes as usize))?;
            (CHUNK_HEADER_BYTES + u64::from(name_bytes)).checked_add(data_bytes)
        }
        op::MESSAGE_INDEX => Some(INDEX_HEAD_BYTES + u64::from(number_at::<u32>(body, 2)?)),
        // Of a header two names, of metadata a name and a map.
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

/// A little-endian number in bytes, where it is there.
pub(super) fn number_at<T: FromBytes>(bytes: &[u8], at: usize) -> Option<T> {
    T::read_from_prefix(bytes.get(at..)?).ok().map(|(number, _)| number)
}
