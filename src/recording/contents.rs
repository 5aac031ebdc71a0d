//! What a recording holds by its summary, and the bytes that finish it: the end of the data, the summary, the footer.

use std::collections::BTreeMap;

use binrw::{BinWrite, BinWriterExt as _, io::Cursor};
use mcap::{
    MAGIC,
    records::{
        Channel, ChunkIndex, DataEnd, Footer, MessageIndex, MetadataIndex, Record, SchemaHeader, Statistics,
        SummaryOffset, op,
    },
};

use super::schema;

/// What is known of a recording, chunk by chunk. Indexes are kept as the summary has them, about 130 bytes a chunk.
#[derive(Debug, Default)]
pub(super) struct Contents {
    schemas: BTreeMap<u16, (SchemaHeader, Vec<u8>)>,
    channels: BTreeMap<u16, Channel>,
    statistics: Statistics,
    chunk_indexes: Vec<u8>,
    metadata_indexes: Vec<u8>,
}

impl Contents {
    /// Takes note of a schema or a channel; other records declare nothing.
    pub(super) fn declare(&mut self, record: Record<'_>) {
        match record {
            Record::Schema { header, data } => {
                self.schemas.entry(header.id).or_insert((header, data.into_owned()));
            }
            Record::Channel(channel) => {
                self.channels.entry(channel.id).or_insert(channel);
            }
            _ => {}
        }
    }

    /// Whether no channel has been declared.
    pub(super) fn is_without_channels(&self) -> bool {
        self.channels.is_empty()
    }

    /// Whether a channel has been declared.
    pub(super) fn knows(&self, channel: u16) -> bool {
        self.channels.contains_key(&channel)
    }

    /// Chunks and metadata records.
    pub(super) fn entries(&self) -> u64 {
        u64::from(self.statistics.chunk_count) + u64::from(self.statistics.metadata_count)
    }

    /// Messages on the topic of the frames.
    pub(super) fn frames(&self) -> u64 {
        let is_of_frames = |id: &u16| self.channels.get(id).is_some_and(|channel| channel.topic == schema::FRAMES);
        let counts = self.statistics.channel_message_counts.iter();
        counts.filter(|&(id, _)| is_of_frames(id)).map(|(_, count)| count).sum()
    }

    /// Takes note of a chunk and of how many messages of each channel it holds.
    pub(super) fn add_chunk(&mut self, index: &ChunkIndex, messages: impl Iterator<Item = (u16, u64)>) {
        let statistics = &mut self.statistics;
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

    /// Takes note of a metadata record.
    pub(super) fn add_metadata(&mut self, index: &MetadataIndex) {
        self.statistics.metadata_count += 1;
        put(&mut self.metadata_indexes, op::METADATA_INDEX, index);
    }

    /// What finishes a file whose data ends at byte `end` but for these message indexes: laid out as the crate `mcap` does
    /// it, without a checksum of the data.
    pub(super) fn into_ending(self, end: u64, indexes: &[MessageIndex]) -> Vec<u8> {
        let mut bytes = Vec::new();
        for index in indexes {
            put(&mut bytes, op::MESSAGE_INDEX, index);
        }
        // 0: not known, for that the data would have to be read.
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
        // The checksum stands last in the footer, and covers what is before it.
        bytes.truncate(bytes.len() - size_of::<u32>());
        let checksum = crc32fast::hash(&bytes[summary..]);
        bytes.extend(checksum.to_le_bytes());
        bytes.extend(MAGIC);
        bytes
    }

    /// The records of the summary, by kind.
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
            ..self.statistics
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

/// Appends a record.
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
