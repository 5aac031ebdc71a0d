//! The summary of a recording: reads it from a finished recording, and writes it to finish one.

use std::{
    collections::BTreeMap,
    io::{self, BufRead as _, BufReader, Read as _},
};

use binrw::{BinWrite, BinWriterExt as _, io::Cursor};
use mcap::{
    MAGIC,
    records::{
        Channel, ChunkIndex, DataEnd, Footer, MessageIndex, MetadataIndex, Record, SchemaHeader, Statistics,
        SummaryOffset, op,
    },
};

use super::{
    disk::{FileReader, RecordingFile},
    records::{Records, split_start},
    topics::Topic,
};

/// Bytes of the footer's body: position of the summary, position of its offsets, its checksum.
const FOOTER_BODY_BYTES: u64 = 8 + 8 + 4;
/// Bytes that end a finished file: head and body of the footer, and the magic bytes.
const END_BYTES: usize = 9 + FOOTER_BODY_BYTES as usize + MAGIC.len();

/// Contents of a recording's summary. The indexes have the encoding of the file, about 130 bytes per chunk.
#[derive(Debug, Default)]
pub(super) struct Contents {
    schemas: BTreeMap<u16, (SchemaHeader, Vec<u8>)>,
    pub(super) channels: BTreeMap<u16, Channel>,
    statistics: Option<Statistics>,
    chunk_indexes: Vec<u8>,
    metadata_indexes: Vec<u8>,
}

impl Contents {
    /// Reads the declarations and counts of a finished recording's summary, without its indexes. `None` if the file has no
    /// whole summary.
    ///
    /// Memory grows neither with the file nor with the lengths that it states.
    pub(super) fn of_finished(file: &dyn RecordingFile) -> io::Result<Option<Self>> {
        let Some(end_begin) = file.length()?.checked_sub(END_BYTES as u64) else { return Ok(None) };
        let mut end = [0; END_BYTES];
        file.read_exact_at(&mut end, end_begin)?;
        let Some((op::FOOTER, FOOTER_BODY_BYTES, body)) = split_start(&end) else { return Ok(None) };
        let Ok(Record::Footer(Footer { summary_start, summary_crc, .. })) = mcap::parse_record(op::FOOTER, body) else {
            return Ok(None);
        };
        // A position of 0 means that the file has no summary.
        if !end.ends_with(MAGIC) || summary_start == 0 || summary_start > end_begin {
            return Ok(None);
        }
        let checked_end = end_begin + (END_BYTES - MAGIC.len() - size_of_val(&summary_crc)) as u64;
        if summary_crc != 0 && checksum(file, summary_start, checked_end)? != summary_crc {
            return Ok(None);
        }
        let source = BufReader::new(FileReader::new(file, summary_start)).take(end_begin - summary_start);
        let mut records = Records::at(source, summary_start);
        let mut contents = Self::default();
        while let Some(record) = records.next()? {
            contents.declare(record);
        }
        Ok((records.position.end == end_begin).then_some(contents))
    }

    /// Adds a schema, a channel or statistics; ignores other records.
    pub(super) fn declare(&mut self, record: Record<'_>) {
        match record {
            Record::Schema { header, data } => {
                self.schemas.entry(header.id).or_insert((header, data.into_owned()));
            }
            Record::Channel(channel) => {
                self.channels.entry(channel.id).or_insert(channel);
            }
            Record::Statistics(statistics) => self.statistics = Some(statistics),
            _ => {}
        }
    }

    /// Returns the schemas, then the channels.
    pub(super) fn into_declarations(self) -> impl Iterator<Item = Record<'static>> {
        let schemas = self.schemas.into_values().map(|(header, data)| Record::Schema { header, data: data.into() });
        schemas.chain(self.channels.into_values().map(Record::Channel))
    }

    /// Number of chunks and metadata records.
    pub(super) fn entries(&self) -> u64 {
        self.statistics.as_ref().map_or(0, |known| u64::from(known.chunk_count) + u64::from(known.metadata_count))
    }

    /// Number of messages on the frame topic; `None` without statistics.
    pub(super) fn frames(&self) -> Option<u64> {
        let is_of_frames =
            |id: &u16| self.channels.get(id).is_some_and(|channel| channel.topic == Topic::Frames.name());
        let counts = self.statistics.as_ref()?.channel_message_counts.iter();
        Some(counts.filter(|&(id, _)| is_of_frames(id)).fold(0, |sum, (_, &count)| sum.saturating_add(count)))
    }

    /// Adds a chunk and the number of its messages on each channel.
    pub(super) fn add_chunk(&mut self, index: &ChunkIndex, messages: BTreeMap<u16, u64>) {
        let statistics = self.statistics.get_or_insert_default();
        let is_first = statistics.message_count == 0;
        let mut in_chunk = 0;
        for (channel, count) in messages {
            *statistics.channel_message_counts.entry(channel).or_default() += count;
            in_chunk += count;
        }
        statistics.chunk_count += 1;
        statistics.message_count += in_chunk;
        if in_chunk > 0 {
            let [start, end] = [index.message_start_time, index.message_end_time];
            let start_before = if is_first { start } else { statistics.message_start_time };
            statistics.message_start_time = start.min(start_before);
            statistics.message_end_time = end.max(statistics.message_end_time);
        }
        put(&mut self.chunk_indexes, op::CHUNK_INDEX, index);
    }

    pub(super) fn add_metadata(&mut self, index: &MetadataIndex) {
        self.statistics.get_or_insert_default().metadata_count += 1;
        put(&mut self.metadata_indexes, op::METADATA_INDEX, index);
    }

    /// Returns the bytes that finish a file whose data ends at byte `end`: these message indexes, then the summary. The layout
    /// is that of the crate `mcap`, without a checksum of the data.
    pub(super) fn into_ending(self, end: u64, indexes: &[MessageIndex]) -> Vec<u8> {
        let mut bytes = Vec::new();
        for index in indexes {
            put(&mut bytes, op::MESSAGE_INDEX, index);
        }
        // 0: no checksum. It would need a read of all data.
        put(&mut bytes, op::DATA_END, &DataEnd { data_section_crc: 0 });
        let summary = bytes.len();
        let mut offsets = Vec::new();
        for (opcode, group) in self.into_groups() {
            if !group.is_empty() {
                let group_start = end + bytes.len() as u64;
                offsets.push(SummaryOffset { group_opcode: opcode, group_start, group_length: group.len() as u64 });
                bytes.extend(group);
            }
        }
        let summary_offset_start = end + bytes.len() as u64;
        for offset in &offsets {
            put(&mut bytes, op::SUMMARY_OFFSET, offset);
        }
        let summary_start = end + summary as u64;
        put(&mut bytes, op::FOOTER, &Footer { summary_start, summary_offset_start, summary_crc: 0 });
        // The checksum is the last field of the footer, and covers the summary and footer before it.
        bytes.truncate(bytes.len() - size_of::<u32>());
        let checksum = crc32fast::hash(&bytes[summary..]);
        bytes.extend(checksum.to_le_bytes());
        bytes.extend(MAGIC);
        bytes
    }

    /// Returns the records of the summary, grouped by kind.
    fn into_groups(self) -> [(u8, Vec<u8>); 5] {
        let [mut schemas, mut channels, mut statistics] = [const { Vec::new() }; 3];
        for (header, definition) in self.schemas.values() {
            let mut body = encoded(header);
            body.extend((definition.len() as u32).to_le_bytes());
            body.extend(definition);
            put_body(&mut schemas, op::SCHEMA, &body);
        }
        for channel in self.channels.values() {
            put(&mut channels, op::CHANNEL, channel);
        }
        let counted = Statistics {
            schema_count: self.schemas.len() as u16,
            channel_count: self.channels.len() as u32,
            ..self.statistics.unwrap_or_default()
        };
        put(&mut statistics, op::STATISTICS, &counted);
        [
            (op::SCHEMA, schemas),
            (op::CHANNEL, channels),
            (op::STATISTICS, statistics),
            (op::CHUNK_INDEX, self.chunk_indexes),
            (op::METADATA_INDEX, self.metadata_indexes),
        ]
    }
}

fn checksum(file: &dyn RecordingFile, begin: u64, end: u64) -> io::Result<u32> {
    let mut part = BufReader::new(FileReader::new(file, begin)).take(end - begin);
    let mut hasher = crc32fast::Hasher::new();
    loop {
        match part.fill_buf()? {
            [] => return Ok(hasher.finalize()),
            block => {
                hasher.update(block);
                let bytes = block.len();
                part.consume(bytes);
            }
        }
    }
}

fn put<T: for<'a> BinWrite<Args<'a> = ()>>(bytes: &mut Vec<u8>, opcode: u8, record: &T) {
    put_body(bytes, opcode, &encoded(record));
}

fn put_body(bytes: &mut Vec<u8>, opcode: u8, body: &[u8]) {
    bytes.push(opcode);
    bytes.extend((body.len() as u64).to_le_bytes());
    bytes.extend(body);
}

fn encoded<T: for<'a> BinWrite<Args<'a> = ()>>(record: &T) -> Vec<u8> {
    let mut body = Cursor::new(Vec::new());
    body.write_le(record).expect("a Vec takes every byte");
    body.into_inner()
}
