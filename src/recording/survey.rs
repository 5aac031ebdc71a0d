//! Reads the layout of a recording from the heads of its records: the end of its data, and the contents of its summary.
//!
//! The survey reads the head of each record. So its time grows with the number of chunks, not with their bytes. It unpacks only
//! the first chunk, which declares the channels, and the last chunk, whose message indexes may be incomplete.
//!
//! **Torn or damaged.** A record states its length twice: in its head, and by the lengths of its fields. If both agree and the
//! file ends before the record does, the record is *torn*: the recorder was killed while it wrote, and no data follows. Zeros
//! up to the end of the file, as after a power cut, count as torn too. Any other bytes that are not a record of a recording are
//! *damage*. More data may follow them, so the survey reports damage and nothing is cut off.

use std::{
    collections::BTreeMap,
    io::{self, Cursor},
    ops::Range,
};

use binrw::BinRead;
use mcap::{
    MAGIC,
    records::{ChunkHeader, ChunkIndex, MessageIndex, MessageIndexEntry, MetadataIndex, Record, op},
};

use super::{
    disk::RecordingFile,
    record_heads::{INDEX_HEAD_BYTES, RecordHeads, START_BYTES, is_of_data, length_by_fields, number_at},
    records::{LONGEST_RECORD_BYTES, RECORD_HEAD_BYTES, UnpackedChunk, split_start},
    summary::Contents,
};

/// Bytes of an entry of a message index: time and offset.
const INDEX_ENTRY_BYTES: u64 = 8 + 8;
/// Greatest number of chunks and configurations in a survey: two days of the paper's dragon at 1 kHz, half a gigabyte of
/// memory.
const MOST_ENTRIES: u64 = 1 << 21;

/// The facts that repair needs of a recording.
#[derive(Debug)]
pub(super) struct Survey {
    /// Byte at which the data to keep ends.
    pub(super) end: u64,
    /// Message indexes of the last chunk, to be written at `end`. Empty if the indexes in the file are complete.
    pub(super) last_indexes: Vec<MessageIndex>,
    /// Contents of the summary.
    pub(super) contents: Contents,
}

/// Reason why a recording cannot be surveyed.
#[derive(Debug)]
pub(super) enum SurveyError {
    Io(io::Error),
    /// The file is damaged at this byte, and more data may follow.
    Damaged(u64),
}

impl From<io::Error> for SurveyError {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

/// Surveys a file that begins like a recording of ours.
pub(super) fn survey(file: &dyn RecordingFile) -> Result<Survey, SurveyError> {
    let mut surveying = Surveying {
        heads: RecordHeads::of(file)?,
        at: MAGIC.len() as u64,
        contents: Contents::default(),
        last_chunk: None,
    };
    let ending = loop {
        if let Some(ending) = surveying.step()? {
            break ending;
        }
    };
    surveying.finish(&ending)
}

enum EndOfData {
    /// In the middle of a record, or after a record without the record that ends the data.
    Torn,
    /// With the record that ends the data; a whole or torn summary follows.
    DataEnd,
}

struct Surveying<'a> {
    heads: RecordHeads<'a>,
    /// Byte at which the next record begins.
    at: u64,
    contents: Contents,
    /// The last chunk, while only its message indexes have followed it.
    last_chunk: Option<LastChunk>,
}

/// A chunk and the message indexes after it.
struct LastChunk {
    index: ChunkIndex,
    /// Number of messages in the index of each channel.
    messages: BTreeMap<u16, u64>,
}

impl LastChunk {
    fn begin(&self) -> u64 {
        self.index.chunk_start_offset
    }

    fn end(&self) -> u64 {
        self.begin() + self.index.chunk_length
    }

    /// Adds the message index of a channel, which follows the chunk. Returns whether it is the first index of that channel.
    fn add_index(&mut self, channel: u16, messages: u64) -> bool {
        let begin = self.end() + self.index.message_index_length;
        self.index.message_index_length += RECORD_HEAD_BYTES + INDEX_HEAD_BYTES + messages * INDEX_ENTRY_BYTES;
        self.index.message_index_offsets.insert(channel, begin);
        self.messages.insert(channel, messages).is_none()
    }
}

impl Surveying<'_> {
    /// Reads the next record. Returns `Some` at the end of the data.
    fn step(&mut self) -> Result<Option<EndOfData>, SurveyError> {
        let begin = self.at;
        let start = self.heads.start(begin)?;
        let Some((opcode, length, body)) = split_start(&start) else { return Ok(Some(EndOfData::Torn)) };
        if opcode == 0 && self.heads.is_zero_from(begin)? {
            return Ok(Some(EndOfData::Torn));
        }
        match length_by_fields(opcode, body) {
            Some(by_fields) if by_fields == length && length <= LONGEST_RECORD_BYTES as u64 => {}
            // The file ends before the fields that state the length. So the partial record contains no message.
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

    /// Adds the last chunk to the contents, when a record other than an index follows: all of its indexes are then in the file.
    fn close_chunk(&mut self) -> Result<(), SurveyError> {
        let Some(chunk) = self.last_chunk.take() else { return Ok(()) };
        if chunk.messages.is_empty() {
            // Every chunk of ours contains messages.
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
                // The recorder may have been killed between two message indexes. The heads do not show missing ones.
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

    /// Indexes the messages of a chunk and adds it to the contents. Returns the indexes, to be written after the chunk.
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
