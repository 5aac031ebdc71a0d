//! Records of an MCAP file in order, up to its end or to the first unreadable record.

use std::{
    fmt,
    io::{self, Read},
    ops::Range,
};

use mcap::{
    MAGIC,
    records::{ChunkHeader, Record, op},
};
use zstd::bulk::Decompressor;

/// Greatest length of a record or an unpacked chunk; a longer one counts as damage. Our chunks have about 1 MB, or 10 MB if a
/// frame has the greatest number of benches.
pub(super) const LONGEST_RECORD_BYTES: usize = 64 << 20;

/// Bytes of a record before its body: its kind and its length.
pub(super) const RECORD_HEAD_BYTES: u64 = 9;

/// The way in which the records of a file end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ending {
    /// After the last record of the data.
    Whole,
    /// In the middle: the rest is missing, as after a killed recorder.
    Cut,
    /// In the middle: unreadable bytes follow, and perhaps readable records after those.
    Damaged,
}

/// Reads records one by one. Checks each chunk as a whole before it returns a record of it, and skips a damaged chunk.
///
/// Memory scales with the largest chunk, not with the file.
pub(super) struct Records<R> {
    source: R,
    /// The last bytes read: head or body of a record.
    bytes: Vec<u8>,
    chunk: UnpackedChunk,
    /// Bytes of the file that contain the last chunk, or the last record outside of chunks.
    pub(super) position: Range<u64>,
    /// Bytes of the damaged chunks that were skipped so far.
    pub(super) skipped_bytes: u64,
    /// The end of the file; `Some` after [`Records::next`] has returned `None`.
    pub(super) ending: Option<Ending>,
}

impl<R: Read> Records<R> {
    pub(super) fn new(source: R) -> Self {
        Self::at(source, 0)
    }

    /// The records of a file from byte `begin`, at which a record begins. The source must be at that byte.
    pub(super) fn at(source: R, begin: u64) -> Self {
        let (bytes, chunk) = (Vec::new(), UnpackedChunk::default());
        Self { source, bytes, chunk, position: begin..begin, skipped_bytes: 0, ending: None }
    }

    /// The next record of the data, or `None` at its end. Does not read the summary after the data.
    pub(super) fn next(&mut self) -> io::Result<Option<Record<'static>>> {
        if self.ending.is_some() {
            return Ok(None);
        }
        loop {
            if let Some((_, record)) = self.chunk.next_with_offset() {
                return Ok(Some(record));
            }
            let Some(record) = self.read()? else { continue };
            self.ending = match record {
                Outer::Record(Record::DataEnd(_)) => Some(Ending::Whole),
                Outer::Broken => Some(self.broken_ending()?),
                Outer::Record(record) => return Ok(Some(record)),
            };
            return Ok(None);
        }
    }

    fn broken_ending(&mut self) -> io::Result<Ending> {
        let goes_on = self.source.by_ref().take(1).read_to_end(&mut Vec::new())? > 0;
        Ok(if goes_on { Ending::Damaged } else { Ending::Cut })
    }

    /// The next record of the file. `None` for a chunk, which `self.chunk` then contains, and for a kind of record that no
    /// reader of ours uses.
    fn read(&mut self) -> io::Result<Option<Outer>> {
        let begin = self.position.end;
        if begin == 0 {
            self.position = 0..MAGIC.len() as u64;
            let is_mcap = self.fill(self.position.end)? && self.bytes == MAGIC;
            return Ok((!is_mcap).then_some(Outer::Broken));
        }
        let is_head = self.fill(RECORD_HEAD_BYTES)?;
        let Some((opcode, length, _)) = split_start(&self.bytes).filter(|_| is_head) else {
            return Ok(Some(Outer::Broken));
        };
        if length > LONGEST_RECORD_BYTES as u64 || !self.fill(length)? {
            return Ok(Some(Outer::Broken));
        }
        self.position = begin..begin + RECORD_HEAD_BYTES + length;
        match opcode {
            op::CHUNK => {
                if self.chunk.unpack(&self.bytes).is_none() {
                    self.skipped_bytes += length;
                }
                Ok(None)
            }
            // Not a kind of record: after a power cut a file may continue with zeros.
            0 => Ok(Some(Outer::Broken)),
            // Only these kinds go to the parser of the crate `mcap`: it panics on an attachment that is too short.
            op::HEADER | op::SCHEMA | op::CHANNEL | op::MESSAGE | op::METADATA | op::STATISTICS | op::DATA_END => {
                let record = mcap::parse_record(opcode, &self.bytes).ok().map(Record::into_owned);
                Ok(Some(record.map_or(Outer::Broken, Outer::Record)))
            }
            _ => Ok(None),
        }
    }

    /// Reads a number of bytes. Returns whether the file contains so many.
    fn fill(&mut self, bytes: u64) -> io::Result<bool> {
        self.bytes.clear();
        Ok(self.source.by_ref().take(bytes).read_to_end(&mut self.bytes)? as u64 == bytes)
    }
}

/// A record outside of chunks.
enum Outer {
    Record(Record<'static>),
    /// The rest of the file is unreadable.
    Broken,
}

/// Records of one chunk, unpacked and checked.
#[derive(Default)]
pub(super) struct UnpackedChunk {
    decompressor: Option<Decompressor<'static>>,
    unpacked: Vec<u8>,
    /// Offset at which the next record begins.
    position: usize,
}

impl UnpackedChunk {
    /// Unpacks a chunk. `None` if it is damaged; it then has no records.
    pub(super) fn unpack(&mut self, chunk: &[u8]) -> Option<()> {
        self.unpacked.clear();
        self.position = 0;
        let Ok(Record::Chunk { header, data }) = mcap::parse_record(op::CHUNK, chunk) else { return None };
        let is_sound = self.decompress(&header, &data).is_some() && self.is_sound(&header);
        if !is_sound {
            self.unpacked.clear();
        }
        is_sound.then_some(())
    }

    fn decompress(&mut self, header: &ChunkHeader, data: &[u8]) -> Option<()> {
        let length = usize::try_from(header.uncompressed_size).ok().filter(|&length| length <= LONGEST_RECORD_BYTES)?;
        match header.compression.as_str() {
            "" => self.unpacked.extend_from_slice(data),
            "zstd" => {
                self.unpacked.reserve_exact(length);
                let decompressor = match &mut self.decompressor {
                    Some(decompressor) => decompressor,
                    none => none.insert(Decompressor::new().ok()?),
                };
                decompressor.decompress_to_buffer(data, &mut self.unpacked).ok()?;
            }
            _ => return None,
        }
        (self.unpacked.len() == length).then_some(())
    }

    /// Whether the chunk is undamaged: its checksum matches, if it has one, and it consists of whole records.
    fn is_sound(&mut self, header: &ChunkHeader) -> bool {
        if header.uncompressed_crc != 0 && crc32fast::hash(&self.unpacked) != header.uncompressed_crc {
            return false;
        }
        let mut rest = self.unpacked.as_slice();
        while let Some((_, behind)) = split_record(rest) {
            rest = behind;
        }
        rest.is_empty()
    }

    /// The next record, and its offset in the unpacked chunk.
    pub(super) fn next_with_offset(&mut self) -> Option<(u64, Record<'static>)> {
        let offset = self.position as u64;
        let (record, behind) = split_record(&self.unpacked[self.position..])?;
        let record = record.into_owned();
        self.position = self.unpacked.len() - behind.len();
        Some((offset, record))
    }
}

/// Splits the first record of a chunk from the rest. `None` if it is incomplete, or of a kind that a chunk may not contain.
fn split_record(bytes: &[u8]) -> Option<(Record<'_>, &[u8])> {
    let (opcode, length, rest) = split_start(bytes)?;
    let (body, behind) = rest.split_at_checked(usize::try_from(length).ok()?)?;
    if !matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE) {
        return None;
    }
    Some((mcap::parse_record(opcode, body).ok()?, behind))
}

/// Kind of a record, its length, and the available bytes of its body. `None` if the file ends within the head.
pub(super) fn split_start(start: &[u8]) -> Option<(u8, u64, &[u8])> {
    let (&opcode, rest) = start.split_first()?;
    let (length, body) = rest.split_first_chunk()?;
    Some((opcode, u64::from_le_bytes(*length), body))
}

impl<R> fmt::Debug for Records<R> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Records").field("ending", &self.ending).finish_non_exhaustive()
    }
}
