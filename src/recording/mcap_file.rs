//! One MCAP file of a recording while it is written.
//!
//! Messages collect in a chunk in memory. [`McapFile::flush`] compresses it and hands it to the operating system with
//! its index in one write, so that whatever stops the process, the file ends behind a whole record or inside one that
//! says how long it should have been. Nothing is ever written twice, and no placeholder is left to be filled in later.
//! Every chunk holds messages: viewers take the earliest chunk's time for the beginning of the recording.
//!
//! Before a chunk is begun, the room for it *and for the file's summary* is reserved on the disk. When the disk is full
//! the reservation fails while nothing is at stake, and the file is finished within the room it had.
//!
//! The file is locked while it is open: repair leaves a locked file alone.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{self, BufWriter},
    path::{Path, PathBuf},
};

use mcap::{
    McapError, McapResult, WriteOptions, Writer,
    records::{MessageHeader, Metadata},
    write::NoSeek,
};
use rustix::fs::{FallocateFlags, FlockOperation, fallocate, flock};

use super::{
    error::{Kept, RecordError, is_disk_full},
    progress::DiskSpace,
    reader::Configuration,
    topics::{CONFIGURATION, Channels, LIBRARY, MessageCounts, PROFILE, Topic},
};
use crate::system::whole_file::{create_nameless, folder_of, give_name};

/// Holds a compressed chunk with its index, so that both leave in one write.
const WRITE_BUFFER_BYTES: usize = 2 << 20;
/// Bytes that a message needs besides its own: record, index entry.
const MESSAGE_OVERHEAD_BYTES: u64 = 64;
/// More than the schemas, channels, statistics and footer of a summary.
const SUMMARY_BYTES: u64 = 16 << 10;
/// More than the index of one chunk, or of one metadata record, in the summary.
const SUMMARY_ENTRY_BYTES: u64 = 160;

type Sink = NoSeek<BufWriter<File>>;

/// How a file is written: our name in the header, chunks closed by [`McapFile`] alone and never half written.
pub(super) fn write_options(compression_level: u32) -> WriteOptions {
    WriteOptions::new()
        .profile(PROFILE)
        .library(LIBRARY)
        .compression(Some(mcap::Compression::Zstd))
        .compression_level(compression_level)
        .compression_threads(0)
        .disable_seeking(true)
        .chunk_size(None)
}

/// When and as what a message is recorded.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stamp {
    pub(super) sequence: u32,
    pub(super) log_time_ns: u64,
    pub(super) publish_time_ns: u64,
}

pub(super) struct McapFile {
    pub(super) path: PathBuf,
    pub(super) file: File,
    writer: Writer<Sink>,
    channels: Option<Channels>,
    chunk: BufferedChunk,
    chunk_limit_bytes: u64,
    summary_bytes: u64,
    /// Handed to the operating system, as are the messages in `counts`.
    pub(super) written_bytes: u64,
    pub(super) counts: MessageCounts,
    reserved_bytes: Option<u64>,
    is_ended: bool,
}

/// What has not been handed to the operating system yet.
#[derive(Default)]
struct BufferedChunk {
    bytes: u64,
    counts: MessageCounts,
}

impl McapFile {
    /// Makes the file, locks it and writes its beginning. Where that fails, no file is left.
    ///
    /// The file gets its name when its beginning is in it, so that one that is there is a recording, whenever its recorder
    /// is killed. A file system that makes no files without a name is given one at once.
    pub(super) fn create(path: &Path, compression_level: u32, chunk_limit_bytes: u64) -> Result<Self, RecordError> {
        let begin = |file| Self::begin(path, file, compression_level, chunk_limit_bytes);
        let created = match create_nameless(folder_of(path)) {
            Ok(file) => begin(file).and_then(|begun| {
                give_name(&begun.file, path)?;
                Ok(begun)
            }),
            Err(_) => File::create_new(path).map_err(McapError::from).and_then(|file| {
                begin(file).inspect_err(|_| {
                    // The file is ours and holds nothing; the error that is on its way tells more than this one would.
                    let _ = std::fs::remove_file(path);
                })
            }),
        };
        created.map_err(|error| match error {
            McapError::Io(source) if source.kind() == io::ErrorKind::AlreadyExists => RecordError::Exists(path.into()),
            McapError::Io(source) => RecordError::Create(path.into(), source),
            other => RecordError::Create(path.into(), io::Error::other(other)),
        })
    }

    fn begin(path: &Path, file: File, compression_level: u32, chunk_limit_bytes: u64) -> McapResult<Self> {
        flock(&file, FlockOperation::NonBlockingLockExclusive).map_err(io::Error::from)?;
        let sink = NoSeek::new(BufWriter::with_capacity(WRITE_BUFFER_BYTES, file.try_clone()?));
        let mut begun = Self {
            path: path.into(),
            file,
            writer: write_options(compression_level).create(sink)?,
            channels: None,
            chunk: BufferedChunk::default(),
            chunk_limit_bytes,
            summary_bytes: SUMMARY_BYTES,
            written_bytes: 0,
            counts: MessageCounts::default(),
            reserved_bytes: Some(0),
            is_ended: false,
        };
        begun.reserve(&[])?;
        begun.flush()?;
        Ok(begun)
    }

    /// Whether messages wait for the next flush.
    pub(super) fn has_unflushed(&self) -> bool {
        self.chunk.bytes > 0
    }

    /// Whether any message was ever written.
    pub(super) fn holds_messages(&self) -> bool {
        self.channels.is_some()
    }

    /// Size that the finished file would stay under if one more chunk were written that begins with a message.
    pub(super) fn bytes_after_chunk_with(&self, message: &[u8]) -> u64 {
        let chunk = self.chunk_limit_bytes.max(recorded_bytes(message));
        // Zstandard makes incompressible data larger by less than 1/128.
        self.written_bytes + chunk + chunk / 128 + self.summary_bytes + SUMMARY_ENTRY_BYTES
    }

    pub(super) fn space(&self) -> io::Result<DiskSpace> {
        DiskSpace::around(&self.file)
    }

    /// Records the configuration, at once.
    pub(super) fn describe(&mut self, Configuration { run_id, toml }: &Configuration) -> McapResult<()> {
        self.flush()?;
        let metadata = [("run_id".to_owned(), run_id.to_string()), ("toml".to_owned(), toml.clone())];
        self.summary_bytes += SUMMARY_ENTRY_BYTES;
        self.reserve(toml.as_bytes())?;
        self.writer.write_metadata(&Metadata { name: CONFIGURATION.to_owned(), metadata: BTreeMap::from(metadata) })?;
        self.flush()
    }

    /// Whether a message fits into the open chunk; into an empty one any does. The first chunk holds one message: it declares the
    /// channels by which all that follows is read, and the less of it there is, the less can be damaged.
    pub(super) fn fits(&self, message: &[u8]) -> bool {
        let is_first_chunk = self.counts == MessageCounts::default();
        let room = if is_first_chunk { 0 } else { self.chunk_limit_bytes };
        self.chunk.bytes == 0 || self.chunk.bytes + recorded_bytes(message) <= room
    }

    pub(super) fn write(&mut self, topic: Topic, stamp: Stamp, message: &[u8]) -> McapResult<()> {
        if self.chunk.bytes == 0 {
            self.reserve(message)?;
        }
        let header = MessageHeader {
            channel_id: self.channels()?.of(topic),
            sequence: stamp.sequence,
            log_time: stamp.log_time_ns,
            publish_time: stamp.publish_time_ns,
        };
        self.writer.write_to_known_channel(&header, message)?;
        self.chunk.bytes += recorded_bytes(message);
        self.chunk.counts.count(topic);
        Ok(())
    }

    /// The channels; the first message's chunk begins with all of them.
    fn channels(&mut self) -> McapResult<Channels> {
        Ok(match self.channels {
            Some(channels) => channels,
            None => *self.channels.insert(Channels::declare(&mut self.writer)?),
        })
    }

    /// Closes the chunk and hands it to the operating system: from here on it outlives the process.
    pub(super) fn flush(&mut self) -> McapResult<()> {
        self.writer.flush()?;
        self.written_bytes = self.file.metadata()?.len();
        let chunk = std::mem::take(&mut self.chunk);
        self.counts.add(chunk.counts);
        self.summary_bytes += SUMMARY_ENTRY_BYTES;
        Ok(())
    }

    /// Writes the summary and gives back the room that was reserved for more; once only, successful or not.
    pub(super) fn finish(&mut self) -> McapResult<()> {
        if self.is_ended {
            return Ok(());
        }
        self.flush()?;
        self.is_ended = true;
        self.writer.finish()?;
        self.written_bytes = self.file.metadata()?.len();
        self.file.set_len(self.written_bytes)?;
        Ok(())
    }

    /// Ends the file after an error: finished if that is possible, else cut behind the last whole record.
    pub(super) fn give_up(mut self, error: McapError) -> RecordError {
        let free_bytes = self.space().map_or(0, |space| space.free_bytes);
        let is_finished = !self.is_ended && !self.has_unflushed() && self.finish().is_ok();
        let kept = if is_finished { Kept::Finished } else { Kept::Unfinished };
        let Self { path, file, writer, written_bytes, .. } = self;
        if kept == Kept::Unfinished {
            // Not dropped: a dropped buffer tries once more to write what could not be written.
            let _ = writer.into_inner().into_inner().into_parts();
            // The cut only tidies the file: readers and repair stop at a torn record just as well.
            let _ = file.set_len(written_bytes);
        }
        match error {
            McapError::Io(source) if is_disk_full(&source) => RecordError::DiskFull { path, free_bytes, kept },
            source => RecordError::Write { path, free_bytes, kept, source },
        }
    }

    /// Reserves the room for a chunk that begins with a message, and for the summary behind it.
    fn reserve(&mut self, message: &[u8]) -> io::Result<()> {
        let needed_bytes = self.bytes_after_chunk_with(message);
        let Some(reserved_bytes) = self.reserved_bytes.filter(|reserved| *reserved < needed_bytes) else {
            return Ok(());
        };
        match fallocate(&self.file, FallocateFlags::KEEP_SIZE, reserved_bytes, needed_bytes - reserved_bytes) {
            Ok(()) => self.reserved_bytes = Some(needed_bytes),
            Err(full) if is_disk_full(&full.into()) => return Err(full.into()),
            // A file system that reserves nothing: its full disk shows when a chunk is written.
            Err(_) => self.reserved_bytes = None,
        }
        Ok(())
    }
}

fn recorded_bytes(message: &[u8]) -> u64 {
    message.len() as u64 + MESSAGE_OVERHEAD_BYTES
}
