//! The records of an MCAP file in order, up to its end or to where it can no longer be followed.

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

/// A record, or a chunk unpacked, that claims to be longer is taken for damage: ours are of about a megabyte, and of
/// eleven where a frame has the most benches that there may be.
pub(super) const LONGEST_RECORD_BYTES: usize = 64 << 20;

/// Bytes of a record before its body: what it is and how long.
pub(super) const RECORD_HEAD_BYTES: u64 = 9;

/// How the records of a file end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ending {
    /// Behind the last record of the data.
    Whole,
    /// In the middle: the rest is missing, as a killed recorder leaves it.
    Cut,
    /// In the middle, and the file goes on: with something that cannot be read, and perhaps more that could.
    Damaged,
}

/// Reads records one by one; a chunk is checked as a whole before anything of it is given out, and passed over where it
/// is damaged.
///
/// Memory scales with the largest chunk, not with the file.
pub(super) struct Records<R> {
    source: R,
    /// What was read last: a record's head or its body.
    bytes: Vec<u8>,
    chunk: UnpackedChunk,
    /// Where in the file the last record outside of chunks, or the last chunk, begins and ends.
    pub(super) position: Range<u64>,
    /// Bytes of the damaged chunks that were passed over so far.
    pub(super) skipped_bytes: u64,
    /// How the file ended, once [`Records::next`] has returned `None`.
    pub(super) ending: Option<Ending>,
}

impl<R: Read> Records<R> {
    pub(super) fn new(source: R) -> Self {
        Self::at(source, 0)
    }

    /// The records of a file from where one begins, at which the source stands.
    pub(super) fn at(source: R, begin: u64) -> Self {
        let (bytes, chunk) = (Vec::new(), UnpackedChunk::default());
        Self { source, bytes, chunk, position: begin..begin, skipped_bytes: 0, ending: None }
    }

    /// The next record of the data, or `None` at its end; what follows the data (the summary) is not read.
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

    /// The next record of the file; `None` where that was a chunk, whose records are to be taken from it, or one of a kind
    /// that tells no reader of ours anything.
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
            // No kind of record: a file that lost its end in a power cut may go on with zeros.
            0 => Ok(Some(Outer::Broken)),
            // The crate's parser is asked for nothing else: it panics at an attachment that is too short.
            op::HEADER | op::SCHEMA | op::CHANNEL | op::MESSAGE | op::METADATA | op::STATISTICS | op::DATA_END => {
                let record = mcap::parse_record(opcode, &self.bytes).ok().map(Record::into_owned);
                Ok(Some(record.map_or(Outer::Broken, Outer::Record)))
            }
            _ => Ok(None),
        }
    }

    /// Reads so many bytes; whether they are there.
    fn fill(&mut self, bytes: u64) -> io::Result<bool> {
        self.bytes.clear();
        Ok(self.source.by_ref().take(bytes).read_to_end(&mut self.bytes)? as u64 == bytes)
    }
}

/// What stands in a file outside of chunks.
enum Outer {
    Record(Record<'static>),
    /// The rest cannot be read.
    Broken,
}

/// The records of one chunk, unpacked and checked.
#[derive(Default)]
pub(super) struct UnpackedChunk {
    decompressor: Option<Decompressor<'static>>,
    unpacked: Vec<u8>,
    /// Where the next record begins.
    position: usize,
}

impl UnpackedChunk {
    /// Takes the next chunk. `None` where it is damaged; then it has no records.
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

    /// Whether the chunk is what was written: by its checksum, where it has one, and record by record.
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

    /// The next record, and where in the unpacked chunk it begins.
    pub(super) fn next_with_offset(&mut self) -> Option<(u64, Record<'static>)> {
        let offset = self.position as u64;
        let (record, behind) = split_record(&self.unpacked[self.position..])?;
        let record = record.into_owned();
        self.position = self.unpacked.len() - behind.len();
        Some((offset, record))
    }
}

/// A record of a chunk and what is behind it; `None` where no whole record is, or none that a chunk may hold.
fn split_record(bytes: &[u8]) -> Option<(Record<'_>, &[u8])> {
    let (opcode, length, rest) = split_start(bytes)?;
    let (body, behind) = rest.split_at_checked(usize::try_from(length).ok()?)?;
    if !matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE) {
        return None;
    }
    Some((mcap::parse_record(opcode, body).ok()?, behind))
}

/// What a record is, its length, and what is there of its body; `None` where the file ends within the head.
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
