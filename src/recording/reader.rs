//! Reading a recording back, frame by frame.

use std::{
    collections::BTreeMap,
    fmt,
    fs::{self, File},
    io::{self, BufReader, Seek as _, SeekFrom},
    path::{Path, PathBuf},
};

use bench_dragon_ipc::{FrameHeader, HandleState};
use mcap::records::{Channel, Metadata, Record};

use super::{
    cdr,
    records::{Ending, Records},
    summary::Contents,
    topics::{CONFIGURATION, Recorded, RecordedFrame, Topic},
};

const READ_BUFFER_BYTES: usize = 1 << 20;

/// The frames of a recording in the order in which they were recorded.
///
/// Reads one chunk at a time into memory and needs no index. From a recording that is unfinished or cut off, it returns every
/// frame of the complete chunks, and then ends. It skips damaged chunks. [`FrameReader::flaws`] reports both.
#[derive(Debug)]
pub struct FrameReader {
    path: PathBuf,
    records: Records<BufReader<File>>,
    context: Context,
    /// Byte at which the last chunk to be read begins.
    last_position: u64,
    has_looked_at_summary: bool,
}

/// The unreadable parts of a recording.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Flaws {
    /// Whether the readable records stop before the end of the data, as after a killed recorder.
    pub cut: bool,
    /// Bytes of damaged chunks that were skipped.
    pub skipped_bytes: u64,
}

impl Flaws {
    /// The unreadable parts of two files together.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self { cut: self.cut || other.cut, skipped_bytes: self.skipped_bytes + other.skipped_bytes }
    }
}

impl fmt::Display for Flaws {
    /// Ending of a message such as "no frames"; empty without flaws.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { cut, skipped_bytes } = self;
        match (*skipped_bytes > 0, *cut) {
            (false, false) => Ok(()),
            (true, false) => write!(formatter, ": {skipped_bytes} bytes of it are damaged"),
            (false, true) => formatter.write_str(": it stops in the middle"),
            (true, true) => {
                write!(formatter, ": {skipped_bytes} bytes of it are damaged, and it stops in the middle")
            }
        }
    }
}

/// Channels and configuration read so far; later messages depend on them.
#[derive(Clone, Debug, Default)]
struct Context {
    /// Channels of our topics: one per topic in a file of ours, more if another tool has joined recordings.
    topics: BTreeMap<u16, Topic>,
    configuration: Option<Configuration>,
}

impl Context {
    fn learn(&mut self, channel: &Channel) {
        if let Some(topic) = Topic::named(&channel.topic) {
            self.topics.entry(channel.id).or_insert(topic);
        }
    }
}

/// A position in a recording at which another reader can begin.
#[derive(Clone, Debug)]
pub struct Bookmark {
    position: u64,
    context: Context,
}

/// Configuration of a recorded run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Configuration {
    /// Identifier of the run.
    pub run_id: u64,
    /// Dragon and route as TOML text.
    pub toml: String,
}

/// Reason why a recording cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The system cannot read the file.
    #[error("cannot read {}", .0.display())]
    Io(PathBuf, #[source] io::Error),
    /// The file is not an MCAP file.
    #[error("{} is not an MCAP recording", .0.display())]
    NotMcap(PathBuf),
    /// A message on the frame topic is not a frame of ours.
    #[error("{} holds a message on {} that is not a frame", .0.display(), Topic::Frames.name())]
    NotAFrame(PathBuf),
}

impl FrameReader {
    /// Opens a recording and reads its header.
    ///
    /// # Errors
    /// [`ReadError::Io`], and [`ReadError::NotMcap`] if the file does not begin like an MCAP file.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        let failed = |source| ReadError::Io(path.into(), source);
        // Opening a named pipe would wait for a writer.
        if !fs::metadata(path).map_err(failed)?.is_file() {
            return Err(ReadError::NotMcap(path.into()));
        }
        let file = File::open(path).map_err(failed)?;
        let records = Records::new(BufReader::with_capacity(READ_BUFFER_BYTES, file));
        let mut reader = Self {
            path: path.into(),
            records,
            context: Context::default(),
            last_position: u64::MAX,
            has_looked_at_summary: false,
        };
        match reader.next_record()? {
            Some(Record::Header(_)) => Ok(reader),
            _ => Err(ReadError::NotMcap(path.into())),
        }
    }

    /// Opens a recording at the bookmark of another reader. Reads up to and including the chunk at byte `last_position`.
    ///
    /// # Errors
    /// [`ReadError::Io`].
    pub fn open_between(
        path: &Path,
        Bookmark { position, context }: &Bookmark,
        last_position: u64,
    ) -> Result<Self, ReadError> {
        let open = || {
            let mut file = File::open(path)?;
            file.seek(SeekFrom::Start(*position))?;
            Ok(file)
        };
        let file = open().map_err(|source| ReadError::Io(path.into(), source))?;
        let records = Records::at(BufReader::with_capacity(READ_BUFFER_BYTES, file), *position);
        Ok(Self { path: path.into(), records, context: context.clone(), last_position, has_looked_at_summary: false })
    }

    /// Opens a recording at the chunk that begins at a byte, behind a configuration.
    ///
    /// # Errors
    /// As [`FrameReader::open`].
    pub(super) fn open_at(path: &Path, position: u64, configuration: Option<Configuration>) -> Result<Self, ReadError> {
        let mut first = Self::open(path)?;
        // The first chunk declares the channels.
        while first.records.position.start < position
            && let Some(record) = first.next_record()?
        {
            match record {
                Record::Channel(channel) => first.context.learn(&channel),
                Record::Message { .. } => break,
                _ => {}
            }
        }
        let context = Context { topics: first.context.topics, configuration };
        Self::open_between(path, &Bookmark { position, context }, u64::MAX)
    }

    /// Ends the reading with the chunk at a byte.
    pub(super) fn end_at(&mut self, last_position: u64) {
        self.last_position = last_position;
    }

    /// Bookmark of the last frame, alert or command event. A reader opened there begins with the chunk that contains it, so it
    /// returns some earlier messages of that chunk again.
    pub fn bookmark(&self) -> Bookmark {
        Bookmark { position: self.records.position.start, context: self.context.clone() }
    }

    /// Byte at which the chunk of the last frame, alert or command event begins.
    pub fn position(&self) -> u64 {
        self.records.position.start
    }

    /// Configuration of the frames being read: the last one before them in the file.
    pub fn configuration(&self) -> Option<&Configuration> {
        self.context.configuration.as_ref()
    }

    /// Unreadable parts found so far. `cut` is valid only after the last frame has been read.
    pub fn flaws(&self) -> Flaws {
        let cut = matches!(self.records.ending, Some(Ending::Cut | Ending::Damaged));
        Flaws { cut, skipped_bytes: self.records.skipped_bytes }
    }

    /// Returns the next alert, the next command event, or the next frame whose header `is_wanted` accepts. Skips other frames
    /// without decoding their handles, which is fast.
    ///
    /// # Errors
    /// [`ReadError::Io`] and [`ReadError::NotAFrame`].
    pub fn next_wanted(
        &mut self,
        mut is_wanted: impl FnMut(&FrameHeader) -> bool,
    ) -> Result<Option<Recorded>, ReadError> {
        while let Some(record) = self.next_record()?.filter(|_| self.records.position.start <= self.last_position) {
            if matches!(record, Record::Message { .. }) {
                self.require_channels()?;
            }
            let (topic, log_time_ns, data) = match record {
                Record::Message { header, data } => {
                    (self.context.topics.get(&header.channel_id), header.log_time, data)
                }
                Record::Channel(channel) => {
                    self.context.learn(&channel);
                    continue;
                }
                Record::Metadata(metadata) => {
                    let known = self.context.configuration.take();
                    self.context.configuration = Configuration::from_metadata(metadata).or(known);
                    continue;
                }
                _ => continue,
            };
            let recorded = match topic {
                Some(Topic::Frames) => {
                    let not_a_frame = || ReadError::NotAFrame(self.path.clone());
                    if !is_wanted(&cdr::decode_header(&data).ok_or_else(not_a_frame)?) {
                        continue;
                    }
                    let (header, handles) = cdr::decode_frame(&data).filter(is_whole).ok_or_else(not_a_frame)?;
                    Some(Recorded::Frame(RecordedFrame { log_time_ns, header, handles }))
                }
                // Skips messages of another version. A gap in the numbers of the command events shows them.
                topic => topic.and_then(|topic| topic.read(log_time_ns, &data)),
            };
            if recorded.is_some() {
                return Ok(recorded);
            }
        }
        Ok(None)
    }

    /// Returns the next frame that `is_wanted` accepts, like [`FrameReader::next_wanted`]. Skips alerts and command events.
    ///
    /// # Errors
    /// [`ReadError::Io`] and [`ReadError::NotAFrame`].
    pub fn next_wanted_frame(
        &mut self,
        mut is_wanted: impl FnMut(&FrameHeader) -> bool,
    ) -> Result<Option<RecordedFrame>, ReadError> {
        loop {
            match self.next_wanted(&mut is_wanted)? {
                Some(Recorded::Frame(frame)) => return Ok(Some(frame)),
                Some(_) => {}
                None => return Ok(None),
            }
        }
    }

    /// Takes the channels from the summary of a finished recording, if the chunk that declares them is damaged.
    fn require_channels(&mut self) -> Result<(), ReadError> {
        let knows_frames = || self.context.topics.values().any(|&topic| topic == Topic::Frames);
        if self.has_looked_at_summary || self.records.skipped_bytes == 0 || knows_frames() {
            return Ok(());
        }
        self.has_looked_at_summary = true;
        let contents = File::open(&self.path).and_then(|file| Contents::of_finished(&file));
        let contents = contents.map_err(|source| ReadError::Io(self.path.clone(), source))?;
        for channel in contents.unwrap_or_default().channels.values() {
            self.context.learn(channel);
        }
        Ok(())
    }

    fn next_record(&mut self) -> Result<Option<Record<'static>>, ReadError> {
        self.records.next().map_err(|source| ReadError::Io(self.path.clone(), source))
    }
}

/// Whether a frame has the handles that its header states.
fn is_whole((header, handles): &(FrameHeader, Vec<HandleState>)) -> bool {
    header.has_handles(handles.len())
}

impl Iterator for FrameReader {
    type Item = Result<RecordedFrame, ReadError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.next_wanted_frame(|_| true).transpose()
    }
}

impl Configuration {
    /// The configuration in a metadata record; `None` for any other metadata.
    pub(super) fn from_metadata(Metadata { name, mut metadata }: Metadata) -> Option<Self> {
        if name != CONFIGURATION {
            return None;
        }
        Some(Self { run_id: metadata.get("run_id")?.parse().ok()?, toml: metadata.remove("toml")? })
    }
}
