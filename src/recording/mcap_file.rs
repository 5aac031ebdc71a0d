//! The MCAP file that a recording is writing.
//!
//! Messages collect in a chunk in memory. [`McapFile::flush`] compresses the chunk and hands it to the operating system with
//! its index, in one write. So if the process stops at any instant, the file ends behind a whole record, or inside a record
//! whose head states the full length. No byte is written twice, and no placeholder is filled in later. Every chunk contains
//! messages: viewers use the earliest time of any chunk as the start of the recording.
//!
//! Before a chunk begins, the room for it *and for the file's summary* is reserved on the disk. If the disk is full, the
//! reservation fails before any data is lost. The file is then finished within its reserved room.
//!
//! The file is locked until it is finished and on the disk, and repair rejects a locked file. [`McapFile::finish`] leaves the last
//! bytes to a [`FileSync`].

use std::{
    collections::BTreeMap,
    io::{self, BufWriter},
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use mcap::{
    MAGIC, McapError, McapResult, WriteOptions, Writer,
    records::{MessageHeader, Metadata},
    write::NoSeek,
};

use super::{
    disk::{FileAppender, RecordingDisk, RecordingFile},
    disk_sync::FileSync,
    error::{Kept, RecordError, is_disk_full},
    progress::DiskSpace,
    reader::Configuration,
    repair::Locked,
    topics::{CONFIGURATION, Channels, LIBRARY, MessageCounts, PROFILE, Topic, channel_names},
};
use crate::system::whole_file::folder_of;

/// Room for a compressed chunk and its index, so that one write sends both.
const WRITE_BUFFER_BYTES: usize = 2 << 20;
/// Greatest overhead of a message in bytes: head of the record, and index entry.
const MESSAGE_OVERHEAD_BYTES: u64 = 64;
/// Upper bound on the schemas, channels, statistics and footer of a summary.
const SUMMARY_BYTES: u64 = 16 << 10;
/// Upper bound on the index of one chunk, or of one metadata record, in the summary.
const SUMMARY_ENTRY_BYTES: u64 = 160;
/// Upper bound on the part of such an index for the poses of one dragon more.
const CHANNEL_ENTRY_BYTES: u64 = 10;
/// Upper bound on the declarations and counts of the poses of one dragon, in the first chunk and in the summary.
const CHANNEL_BYTES: u64 = 256;

type Sink = NoSeek<BufWriter<FileAppender>>;

/// Options of the MCAP writer. The header contains our library name. Only [`McapFile`] closes chunks, and no chunk is partly
/// written.
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

/// Sequence number and times of a recorded message.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stamp {
    pub(super) sequence: u32,
    pub(super) log_time_ns: u64,
    pub(super) publish_time_ns: u64,
}

pub(super) struct McapFile {
    pub(super) path: PathBuf,
    pub(super) file: Arc<dyn RecordingFile>,
    writer: Writer<Sink>,
    channels: Option<Channels>,
    /// Names of the dragons of a plan, whose channels the file has; none for the short form for one dragon.
    dragons: Vec<String>,
    chunk: BufferedChunk,
    chunk_limit_bytes: u64,
    summary_bytes: u64,
    /// Bytes handed to the operating system; they contain the messages in `counts`. Of a finished file, the last bytes are included.
    pub(super) written_bytes: u64,
    pub(super) counts: MessageCounts,
    reserved_bytes: Option<u64>,
    /// Whether the end is written, but for the last bytes; the sink holds these back.
    is_ended: Arc<AtomicBool>,
    /// Unlocks the file at the end, after the fields above.
    locked: Arc<Locked>,
}

/// The open chunk: messages that the operating system does not have yet.
#[derive(Default)]
struct BufferedChunk {
    bytes: u64,
    counts: MessageCounts,
}

impl McapFile {
    /// Creates the file, locks it and writes its beginning. On an error, no file remains.
    ///
    /// The file gets its name after its beginning is written. So a file with this name is always a recording, even if the
    /// recorder is killed. On a file system without unnamed files, the file has its name from the start.
    pub(super) fn create(
        disk: &dyn RecordingDisk,
        path: &Path,
        compression_level: u32,
        chunk_limit_bytes: u64,
    ) -> Result<Self, RecordError> {
        let begin = |file| Self::begin(path, file, compression_level, chunk_limit_bytes);
        let created = match disk.create_nameless(folder_of(path)) {
            Ok(file) => begin(file).and_then(|begun| {
                begun.file.give_name(path)?;
                Ok(begun)
            }),
            Err(_) => disk.create_new(path).map_err(McapError::from).and_then(|file| {
                begin(file).inspect_err(|_| {
                    // The file is ours and empty. The first error explains more than an error of the removal.
                    let _ = disk.remove(path);
                })
            }),
        };
        created.map_err(|error| match error {
            McapError::Io(source) if source.kind() == io::ErrorKind::AlreadyExists => RecordError::Exists(path.into()),
            McapError::Io(source) => RecordError::Create(path.into(), source),
            other => RecordError::Create(path.into(), io::Error::other(other)),
        })
    }

    fn begin(
        path: &Path,
        file: Arc<dyn RecordingFile>,
        compression_level: u32,
        chunk_limit_bytes: u64,
    ) -> McapResult<Self> {
        if !file.lock()? {
            return Err(io::Error::from(io::ErrorKind::WouldBlock).into());
        }
        let (locked, is_ended) = (Arc::new(Locked(Arc::clone(&file))), Arc::new(AtomicBool::new(false)));
        let appender = FileAppender::new(Arc::clone(&file), Arc::clone(&is_ended));
        let sink = NoSeek::new(BufWriter::with_capacity(WRITE_BUFFER_BYTES, appender));
        let mut begun = Self {
            path: path.into(),
            file,
            writer: write_options(compression_level).create(sink)?,
            channels: None,
            dragons: Vec::new(),
            chunk: BufferedChunk::default(),
            chunk_limit_bytes,
            summary_bytes: SUMMARY_BYTES,
            written_bytes: 0,
            counts: MessageCounts::default(),
            reserved_bytes: Some(0),
            is_ended,
            locked,
        };
        begun.reserve(&[])?;
        begun.flush()?;
        Ok(begun)
    }

    /// Whether the open chunk contains messages.
    pub(super) fn has_unflushed(&self) -> bool {
        self.chunk.bytes > 0
    }

    /// Whether a message was written to this file.
    pub(super) fn holds_messages(&self) -> bool {
        self.channels.is_some()
    }

    /// The names of the dragons whose channels the file has.
    pub(super) fn dragons(&self) -> &[String] {
        &self.dragons
    }

    /// Sets the names of the dragons, for a file that holds no message yet: its first chunk declares the channels of all others.
    pub(super) fn set_dragons(&mut self, dragons: Vec<String>) {
        assert!(!self.holds_messages(), "the channels of a file are declared once");
        self.dragons = dragons;
    }

    /// Upper bound on the index of one chunk, or of one metadata record, in the summary.
    fn summary_entry_bytes(&self) -> u64 {
        SUMMARY_ENTRY_BYTES + self.dragons.len() as u64 * CHANNEL_ENTRY_BYTES
    }

    /// Upper bound on the size of the finished file after one more chunk that begins with a message, in bytes.
    pub(super) fn bytes_after_chunk_with(&self, message: &[u8]) -> u64 {
        let chunk = self.chunk_limit_bytes.max(recorded_bytes(message));
        // Zstandard enlarges incompressible data by less than 1/128.
        let declared = self.dragons.len() as u64 * CHANNEL_BYTES;
        self.written_bytes + chunk + chunk / 128 + self.summary_bytes + declared + self.summary_entry_bytes()
    }

    pub(super) fn space(&self) -> io::Result<DiskSpace> {
        self.file.space()
    }

    /// Records the configuration and flushes it.
    pub(super) fn describe(&mut self, Configuration { run_id, toml }: &Configuration) -> McapResult<()> {
        self.flush()?;
        if !self.holds_messages() {
            self.dragons = channel_names(toml);
        }
        let metadata = [("run_id".to_owned(), run_id.to_string()), ("toml".to_owned(), toml.clone())];
        self.summary_bytes += self.summary_entry_bytes();
        self.reserve(toml.as_bytes())?;
        self.writer.write_metadata(&Metadata { name: CONFIGURATION.to_owned(), metadata: BTreeMap::from(metadata) })?;
        self.flush()
    }

    /// Whether a message fits into the open chunk. Any message fits into an empty chunk. The first chunk holds one message
    /// only: it declares the channels that readers need for all later chunks, and a short chunk is less likely to be damaged.
    pub(super) fn fits(&self, message: &[u8]) -> bool {
        let is_first_chunk = self.counts == MessageCounts::default();
        let room = if is_first_chunk { 0 } else { self.chunk_limit_bytes };
        self.chunk.bytes == 0 || self.chunk.bytes + recorded_bytes(message) <= room
    }

    /// Writes a message. Of poses, `dragon` is the number of the dragon.
    pub(super) fn write(&mut self, topic: Topic, dragon: usize, stamp: Stamp, message: &[u8]) -> McapResult<()> {
        if self.chunk.bytes == 0 {
            self.reserve(message)?;
        }
        let header = MessageHeader {
            channel_id: self.channels()?.of(topic, dragon),
            sequence: stamp.sequence,
            log_time: stamp.log_time_ns,
            publish_time: stamp.publish_time_ns,
        };
        self.writer.write_to_known_channel(&header, message)?;
        self.chunk.bytes += recorded_bytes(message);
        self.chunk.counts.count(topic);
        Ok(())
    }

    /// Returns the channels. Declares all of them before the first message, in its chunk.
    fn channels(&mut self) -> McapResult<&Channels> {
        Ok(match &mut self.channels {
            Some(channels) => channels,
            none => none.insert(Channels::declare(&mut self.writer, &self.dragons)?),
        })
    }

    /// Closes the chunk and hands it to the operating system. After that it survives the end of the process.
    pub(super) fn flush(&mut self) -> McapResult<()> {
        self.writer.flush()?;
        self.written_bytes = self.file.length()?;
        let chunk = std::mem::take(&mut self.chunk);
        self.counts.add(chunk.counts);
        self.summary_bytes += self.summary_entry_bytes();
        Ok(())
    }

    /// Writes the summary, but for the last bytes. Returns the sync that writes these. Acts only once, even after an error.
    pub(super) fn finish(&mut self) -> McapResult<Option<FileSync>> {
        if self.is_ended() {
            return Ok(None);
        }
        self.flush()?;
        self.is_ended.store(true, Ordering::Relaxed);
        self.writer.finish()?;
        let length = self.file.length()?;
        self.written_bytes = length + MAGIC.len() as u64;
        Ok(Some(FileSync::of_finished(&self.file, length, &self.locked)))
    }

    fn is_ended(&self) -> bool {
        self.is_ended.load(Ordering::Relaxed)
    }

    /// Ends the file after an error. Finishes it on the disk if possible, else cuts it behind the last whole record.
    pub(super) fn give_up(mut self, error: McapError) -> RecordError {
        let free_bytes = self.space().map_or(0, |space| space.free_bytes);
        let was_ended = self.is_ended();
        let finished = if self.has_unflushed() { None } else { self.finish().ok().flatten() };
        let has_end = was_ended || finished.is_some();
        let is_finished = finished.is_some_and(|finished| finished.run().is_ok());
        let kept = if is_finished { Kept::Finished } else { Kept::Unfinished };
        let Self { path, file, writer, written_bytes, .. } = self;
        if kept == Kept::Unfinished {
            // Takes the buffer apart: dropping it would repeat the failed write.
            let _ = writer.into_inner().into_inner().into_parts();
            if !has_end {
                // The cut is not essential: readers and repair also stop at a torn record.
                let _ = file.set_length(written_bytes);
            }
        }
        match error {
            McapError::Io(source) if is_disk_full(&source) => RecordError::DiskFull { path, free_bytes, kept },
            source => RecordError::Write { path, free_bytes, kept, source },
        }
    }

    /// Reserves disk space for a chunk that begins with a message, and for the summary behind it.
    fn reserve(&mut self, message: &[u8]) -> io::Result<()> {
        let needed_bytes = self.bytes_after_chunk_with(message);
        let Some(reserved_bytes) = self.reserved_bytes.filter(|reserved| *reserved < needed_bytes) else {
            return Ok(());
        };
        match self.file.reserve(reserved_bytes, needed_bytes - reserved_bytes) {
            Ok(()) => self.reserved_bytes = Some(needed_bytes),
            Err(full) if is_disk_full(&full) => return Err(full),
            // The file system has no reservation: a full disk shows when a chunk is written.
            Err(_) => self.reserved_bytes = None,
        }
        Ok(())
    }
}

fn recorded_bytes(message: &[u8]) -> u64 {
    message.len() as u64 + MESSAGE_OVERHEAD_BYTES
}
