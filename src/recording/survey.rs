//! The layout of a recording, read from the heads of its records: where its data ends, and what its summary holds.
//!
//! The survey goes from record to record and reads the head of each, so its time grows with the number of chunks and not
//! with their bytes. It unpacks two chunks at most: the first one, which declares the channels, and the last one, whose
//! message indexes may be incomplete.
//!
//! **Torn or damaged.** A record states its length twice: in its head, and by the lengths of its fields. Where both agree
//! and the file ends before the record does, the record is *torn*: the recorder was killed while it wrote, and nothing
//! follows. Zeros up to the end of the file, as a power cut leaves them, count as torn too. Everything else that is no
//! record of a recording is *damage*: more data may follow it, so a survey reports it and nothing is cut off.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{self, Cursor},
    ops::Range,
};

use binrw::BinRead;
use mcap::{
    MAGIC,
    records::{ChunkHeader, ChunkIndex, MessageIndex, MessageIndexEntry, MetadataIndex, Record, op},
};

use super::{
    heads::{Heads, INDEX_HEAD_BYTES, START_BYTES, is_of_data, length_by_fields, number_at},
    records::{LONGEST_RECORD_BYTES, RECORD_HEAD_BYTES, UnpackedChunk, split_start},
    summary::Contents,
};

/// An entry of a message index: time and offset.
const INDEX_ENTRY_BYTES: u64 = 8 + 8;
/// Chunks and descriptions that a survey takes at most: two days of the paper's dragon at 1 kHz, half a gigabyte of memory.
const MOST_ENTRIES: u64 = 1 << 21;

/// What repair needs to know of a recording.
#[derive(Debug)]
pub(super) struct Survey {
    /// Where the data ends that stays, in bytes.
    pub(super) end: u64,
    /// Message indexes of the last chunk, to be written there; none where those in the file are complete.
    pub(super) last_indexes: Vec<MessageIndex>,
    /// What the summary holds.
    pub(super) contents: Contents,
}

/// Why a recording could not be surveyed.
#[derive(Debug)]
pub(super) enum SurveyError {
    Io(io::Error),
    /// There is damage at this byte, and there may be more data behind it.
    Damaged(u64),
}

impl From<io::Error> for SurveyError {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

/// Surveys a file that begins like a recording of ours.
pub(super) fn survey(file: &File) -> Result<Survey, SurveyError> {
    let mut surveying =
        Surveying { heads: Heads::of(file)?, at: MAGIC.len() as u64, contents: Contents::default(), last_chunk: None };
    let ending = loop {
        if let Some(ending) = surveying.step()? {
            break ending;
        }
    };
    surveying.finish(&ending)
}

enum EndOfData {
    /// In the middle of a record, or behind a record where another one was to follow.
    Torn,
    /// By the record that ends it; a summary follows, whole or torn.
    DataEnd,
}

struct Surveying<'a> {
    heads: Heads<'a>,
    /// Where the next record begins.
    at: u64,
    contents: Contents,
    /// The last chunk, while nothing but its message indexes has followed.
    last_chunk: Option<LastChunk>,
}

/// A chunk and the message indexes behind it.
struct LastChunk {
    index: ChunkIndex,
    /// How many messages each channel's index has.
    messages: BTreeMap<u16, u64>,
}

impl LastChunk {
    fn begin(&self) -> u64 {
        self.index.chunk_start_offset
    }

    fn end(&self) -> u64 {
        self.begin() + self.index.chunk_length
    }

    /// Takes note of a channel's message index, the next one behind the chunk; whether it is the channel's first one.
    fn add_index(&mut self, channel: u16, messages: u64) -> bool {
        let begin = self.end() + self.index.message_index_length;
        self.index.message_index_length += RECORD_HEAD_BYTES + INDEX_HEAD_BYTES + messages * INDEX_ENTRY_BYTES;
        self.index.message_index_offsets.insert(channel, begin);
        self.messages.insert(channel, messages).is_none()
    }
}

impl Surveying<'_> {
    /// Takes the next record; `Some` where the data ends.
    fn step(&mut self) -> Result<Option<EndOfData>, SurveyError> {
        let begin = self.at;
        let start = self.heads.start(begin)?;
        let Some((opcode, length, body)) = split_start(&start) else { return Ok(Some(EndOfData::Torn)) };
        if opcode == 0 && self.heads.is_zero_from(begin)? {
            return Ok(Some(EndOfData::Torn));
        }
        match length_by_fields(opcode, body) {
            Some(by_fields) if by_fields == length && length <= LONGEST_RECORD_BYTES as u64 => {}
            // The fields that state the length lie behind the file's end: what is there of the record holds no message.
            None if is_of_data(opcode) && start.len() < START_BYTES => return Ok(Some(EndOfData::Torn)),
            _ => return Err(SurveyError::Damaged(begin)),
        }
        let record = begin..begin + RECORD_HEAD_BYTES + length;
        if record.end > self.heads.length {
            return Ok(Some(EndOfData::Torn));
        }
        self.at = record.end;
        match opcode {
            op::HEADER if begin == MAGIC.len() as u64 => {}
            op::CHUNK => self.take_chunk(record, body)?,
            op::MESSAGE_INDEX => self.take_message_index(record, body)?,
            op::METADATA => self.take_metadata(record)?,
            op::DATA_END if self.heads.is_summary_from(record.end)? => {
                self.at = begin;
                return Ok(Some(EndOfData::DataEnd));
            }
            _ => return Err(SurveyError::Damaged(begin)),
        }
        Ok(None)
    }

    fn take_chunk(&mut self, Range { start: begin, end }: Range<u64>, body: &[u8]) -> Result<(), SurveyError> {
        self.close_chunk()?;
        let header = ChunkHeader::read_le(&mut Cursor::new(body)).map_err(|_| SurveyError::Damaged(begin))?;
        if self.contents.channels.is_empty() {
            let mut chunk = self.unpack(begin, end)?;
            while let Some((_, record)) = chunk.next_with_offset() {
                self.contents.declare(record);
            }
        }
        let index = ChunkIndex {
            message_start_time: header.message_start_time,
            message_end_time: header.message_end_time,
            chunk_start_offset: begin,
            chunk_length: end - begin,
            message_index_offsets: BTreeMap::new(),
            message_index_length: 0,
            compression: header.compression,
            compressed_size: header.compressed_size,
            uncompressed_size: header.uncompressed_size,
        };
        self.last_chunk = Some(LastChunk { index, messages: BTreeMap::new() });
        Ok(())
    }

    fn take_message_index(&mut self, record: Range<u64>, body: &[u8]) -> Result<(), SurveyError> {
        let damaged = SurveyError::Damaged(record.start);
        let Some(chunk) = &mut self.last_chunk else { return Err(damaged) };
        let (Some(channel), Some(bytes)) = (number_at(body, 0), number_at::<u32>(body, 2).map(u64::from)) else {
            return Err(damaged);
        };
        let is_sound = bytes.is_multiple_of(INDEX_ENTRY_BYTES) && self.contents.channels.contains_key(&channel);
        if chunk.add_index(channel, bytes / INDEX_ENTRY_BYTES) && is_sound { Ok(()) } else { Err(damaged) }
    }

    fn take_metadata(&mut self, Range { start: begin, end }: Range<u64>) -> Result<(), SurveyError> {
        self.close_chunk()?;
        let body = self.heads.body(begin, end)?;
        let Ok(Record::Metadata(metadata)) = mcap::parse_record(op::METADATA, &body) else {
            return Err(SurveyError::Damaged(begin));
        };
        self.contents.add_metadata(&MetadataIndex { offset: begin, length: end - begin, name: metadata.name });
        self.require_bound(begin)
    }

    fn unpack(&mut self, begin: u64, end: u64) -> Result<UnpackedChunk, SurveyError> {
        let body = self.heads.body(begin, end)?;
        let mut chunk = UnpackedChunk::default();
        chunk.unpack(&body).map(|()| chunk).ok_or(SurveyError::Damaged(begin))
    }

    /// Takes note of the last chunk where something else than an index follows it: all of its indexes are there.
    fn close_chunk(&mut self) -> Result<(), SurveyError> {
        let Some(chunk) = self.last_chunk.take() else { return Ok(()) };
        if chunk.messages.is_empty() {
            // A chunk of ours holds messages.
            return Err(SurveyError::Damaged(chunk.begin()));
        }
        self.add_chunk(chunk)
    }

    fn add_chunk(&mut self, LastChunk { index, messages }: LastChunk) -> Result<(), SurveyError> {
        self.contents.add_chunk(&index, messages);
        self.require_bound(index.chunk_start_offset)
    }

    fn require_bound(&self, at: u64) -> Result<(), SurveyError> {
        if self.contents.entries() <= MOST_ENTRIES { Ok(()) } else { Err(SurveyError::Damaged(at)) }
    }

    fn finish(mut self, ending: &EndOfData) -> Result<Survey, SurveyError> {
        let mut last_indexes = Vec::new();
        match (ending, self.last_chunk.take()) {
            (EndOfData::Torn, Some(chunk)) => {
                // Its recorder may have been killed between two of its indexes, of which the heads show nothing.
                self.at = chunk.end();
                last_indexes = self.index_again(chunk)?;
            }
            (_, chunk) => {
                self.last_chunk = chunk;
                self.close_chunk()?;
            }
        }
        Ok(Survey { end: self.at, last_indexes, contents: self.contents })
    }

    /// Takes note of a chunk by the messages in it; returns its indexes, which are to be written behind it.
    fn index_again(&mut self, chunk: LastChunk) -> Result<Vec<MessageIndex>, SurveyError> {
        let mut entries: BTreeMap<u16, Vec<MessageIndexEntry>> = BTreeMap::new();
        let mut unpacked = self.unpack(chunk.begin(), chunk.end())?;
        while let Some((offset, record)) = unpacked.next_with_offset() {
            if let Record::Message { header, .. } = record {
                let entry = MessageIndexEntry { log_time: header.log_time, offset };
                entries.entry(header.channel_id).or_default().push(entry);
            }
        }
        if !entries.keys().all(|&channel| self.contents.channels.contains_key(&channel)) {
            return Err(SurveyError::Damaged(chunk.begin()));
        }
        let mut chunk = LastChunk {
            index: ChunkIndex { message_index_offsets: BTreeMap::new(), message_index_length: 0, ..chunk.index },
            messages: BTreeMap::new(),
        };
        for (&channel, entries) in &entries {
            chunk.add_index(channel, entries.len() as u64);
        }
        self.add_chunk(chunk)?;
        Ok(entries.into_iter().map(|(channel_id, records)| MessageIndex { channel_id, records }).collect())
    }
}
