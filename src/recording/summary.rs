//! The summary at the end of a recording that is finished.

use std::{
    fs::File,
    io::{self, BufReader, Read, Seek, SeekFrom},
};

use mcap::{
    MAGIC,
    records::{Channel, Record, Statistics, op},
};

use super::schema;

/// Bytes of a record before its body: what it is and how long.
const RECORD_HEAD_BYTES: u64 = 9;
/// The footer's body: where the summary begins, where its offsets do, its checksum.
const FOOTER_BODY_BYTES: u64 = 8 + 8 + 4;
/// What a finished file ends with.
const END_BYTES: u64 = RECORD_HEAD_BYTES + FOOTER_BODY_BYTES + MAGIC.len() as u64;
/// The part of it that the checksum covers.
const END_CHECKED_BYTES: usize = END_BYTES as usize - MAGIC.len() - 4;
/// A record of the summary that claims to be longer is not one of ours; those that are not needed may be.
const LONGEST_RECORD_BYTES: u64 = 1 << 20;

/// The frames of a finished recording, as its summary has them; `None` where the file has no whole summary.
///
/// Memory does not grow with the file, nor with what it claims.
///
/// # Errors
/// Where the file cannot be read.
pub(super) fn frames_of_finished(file: &File) -> io::Result<Option<u64>> {
    let Some(Summary { channels, statistics: Some(Statistics { channel_message_counts, .. }), .. }) = read(file)?
    else {
        return Ok(None);
    };
    let is_of_frames = |id: u16| channels.iter().any(|channel| channel.id == id && channel.topic == schema::FRAMES);
    let of_frames = channel_message_counts.iter().filter(|&(&id, _)| is_of_frames(id));
    Ok(Some(of_frames.fold(0_u64, |sum, (_, &count)| sum.saturating_add(count))))
}

/// The channels of a finished recording; none where the file has no whole summary.
///
/// # Errors
/// Where the file cannot be read.
pub(super) fn channels_of_finished(file: &File) -> io::Result<Vec<Channel>> {
    Ok(read(file)?.map(|summary| summary.channels).unwrap_or_default())
}

/// The schemas of a finished recording, and then its channels; none where the file has no whole summary.
///
/// # Errors
/// Where the file cannot be read.
pub(super) fn declared_in_finished(file: &File) -> io::Result<Vec<Record<'static>>> {
    let Summary { schemas, channels, .. } = read(file)?.unwrap_or_default();
    Ok(schemas.into_iter().chain(channels.into_iter().map(Record::Channel)).collect())
}

/// What is needed of a summary.
#[derive(Default)]
struct Summary {
    schemas: Vec<Record<'static>>,
    channels: Vec<Channel>,
    statistics: Option<Statistics>,
}

/// Reads the summary; `None` where the file has no whole one.
fn read(mut file: &File) -> io::Result<Option<Summary>> {
    let Some(section) = Section::find(file)? else { return Ok(None) };
    if !section.is_sound(file)? {
        return Ok(None);
    }
    file.seek(SeekFrom::Start(section.begin))?;
    read_records(&mut BufReader::new(file).take(section.length))
}

/// Where the summary lies.
struct Section {
    begin: u64,
    length: u64,
    /// What its checksum covers of the file's end.
    end: [u8; END_CHECKED_BYTES],
    /// 0 where there is none.
    checksum: u32,
}

impl Section {
    fn find(mut file: &File) -> io::Result<Option<Self>> {
        let Some(end_begin) = file.seek(SeekFrom::End(0))?.checked_sub(END_BYTES) else { return Ok(None) };
        file.seek(SeekFrom::Start(end_begin))?;
        let (mut end, mut checksum, mut magic) = ([0; END_CHECKED_BYTES], [0; 4], [0; MAGIC.len()]);
        for part in [&mut end[..], &mut checksum, &mut magic] {
            file.read_exact(part)?;
        }
        let [length, begin] = [1, 9].map(|at| u64_at(&end, at));
        let is_end = end[0] == op::FOOTER && length == FOOTER_BODY_BYTES && magic == MAGIC[..];
        // A summary that begins at 0 is none.
        let length = end_begin.checked_sub(begin).filter(|_| is_end && begin > 0);
        let checksum = u32::from_le_bytes(checksum);
        Ok(length.map(|length| Self { begin, length, end, checksum }))
    }

    /// Whether its checksum is right, where it has one.
    fn is_sound(&self, mut file: &File) -> io::Result<bool> {
        if self.checksum == 0 {
            return Ok(true);
        }
        file.seek(SeekFrom::Start(self.begin))?;
        let mut hasher = crc32fast::Hasher::new();
        let (mut rest, mut block) = (file.take(self.length), [0; 1 << 14]);
        loop {
            match rest.read(&mut block)? {
                0 => break,
                bytes => hasher.update(&block[..bytes]),
            }
        }
        hasher.update(&self.end);
        Ok(hasher.finalize() == self.checksum)
    }
}

/// Reads a summary record by record; `None` where it is not whole.
fn read_records<R: Read>(summary: &mut io::Take<R>) -> io::Result<Option<Summary>> {
    let mut read = Summary::default();
    while summary.limit() > 0 {
        let mut head = [0; RECORD_HEAD_BYTES as usize];
        if summary.limit() < RECORD_HEAD_BYTES {
            return Ok(None);
        }
        summary.read_exact(&mut head)?;
        let (opcode, length) = (head[0], u64_at(&head, 1));
        let is_needed = matches!(opcode, op::SCHEMA | op::CHANNEL | op::STATISTICS);
        if length > summary.limit() || is_needed && length > LONGEST_RECORD_BYTES {
            return Ok(None);
        }
        let mut rest = summary.by_ref().take(length);
        if !is_needed {
            io::copy(&mut rest, &mut io::sink())?;
            continue;
        }
        let mut body = Vec::new();
        rest.read_to_end(&mut body)?;
        match mcap::parse_record(opcode, &body) {
            Ok(schema @ Record::Schema { .. }) => read.schemas.push(schema.into_owned()),
            Ok(Record::Channel(channel)) => read.channels.push(channel),
            Ok(Record::Statistics(statistics)) => read.statistics = Some(statistics),
            Ok(_) => {}
            Err(_) => return Ok(None),
        }
    }
    Ok(Some(read))
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes"))
}
