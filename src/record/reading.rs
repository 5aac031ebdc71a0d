//! Reading a recording back, frame by frame.

use std::{
    collections::BTreeSet,
    fs::{self, File},
    io::{self, BufReader},
    path::{Path, PathBuf},
};

use bench_dragon_ipc::{FrameHeader, HandleState};
use mcap::records::{Metadata, Record};

use super::{
    cdr,
    records::{Ending, Records},
    schema,
};

const READ_BUFFER_BYTES: usize = 1 << 20;

/// The frames of a recording in the order in which they were recorded.
///
/// Reads as it goes, one chunk in memory at a time, and needs no index: a recording that was never finished, or was cut
/// off anywhere, yields every frame of its whole chunks and then ends; [`FrameReader::was_cut`] tells. A damaged chunk is
/// passed over; [`FrameReader::skipped_bytes`] tells.
#[derive(Debug)]
pub struct FrameReader {
    path: PathBuf,
    records: Records<BufReader<File>>,
    /// The channels that carry frames: one in a file of ours, more where recordings were joined by another tool.
    frame_channels: BTreeSet<u16>,
    configuration: Option<Configuration>,
}

/// A frame as it was on the bus, bit for bit.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedFrame {
    /// Unix time at which it was sent, in nanoseconds.
    pub log_time_ns: u64,
    /// What it says about the whole dragon.
    pub header: FrameHeader,
    /// The handles.
    pub handles: Vec<HandleState>,
}

/// The configuration that a run was recorded with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Configuration {
    /// The run.
    pub run_id: u64,
    /// Dragon and route as TOML text.
    pub toml: String,
}

/// Why a recording could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The system could not read the file.
    #[error("cannot read {}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
    /// The file is no MCAP file.
    #[error("{} is not an MCAP recording", path.display())]
    NotMcap {
        /// The file.
        path: PathBuf,
    },
    /// A message on the frame topic is not a frame of ours.
    #[error("{} holds a message on {} that is not a frame", path.display(), schema::FRAMES)]
    NotAFrame {
        /// The file.
        path: PathBuf,
    },
}

impl FrameReader {
    /// Opens a recording and reads up to what comes after its header.
    ///
    /// # Errors
    /// [`ReadError::Io`], and [`ReadError::NotMcap`] where the file does not begin like an MCAP file.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        let failed = |source| ReadError::Io { path: path.into(), source };
        // Opening a pipe would wait for somebody who writes into it.
        if !fs::metadata(path).map_err(failed)?.is_file() {
            return Err(ReadError::NotMcap { path: path.into() });
        }
        let file = File::open(path).map_err(failed)?;
        let records = Records::new(BufReader::with_capacity(READ_BUFFER_BYTES, file));
        let mut reader = Self { path: path.into(), records, frame_channels: BTreeSet::new(), configuration: None };
        match reader.next_record()? {
            Some(Record::Header(_)) => Ok(reader),
            _ => Err(ReadError::NotMcap { path: path.into() }),
        }
    }

    /// The configuration of the frames that are being read: the last one before them.
    pub fn configuration(&self) -> Option<&Configuration> {
        self.configuration.as_ref()
    }

    /// Whether the file stopped in the middle; known once there are no more frames.
    pub fn was_cut(&self) -> bool {
        matches!(self.records.ending(), Some(Ending::Cut | Ending::Damaged))
    }

    /// Bytes of the damaged chunks that were passed over so far; what was in them is missing among the frames.
    pub fn skipped_bytes(&self) -> u64 {
        self.records.skipped_bytes()
    }

    fn next_record(&mut self) -> Result<Option<Record<'static>>, ReadError> {
        self.records.next().map_err(|source| ReadError::Io { path: self.path.clone(), source })
    }

    fn next_frame(&mut self) -> Result<Option<RecordedFrame>, ReadError> {
        while let Some(record) = self.next_record()? {
            match record {
                Record::Channel(channel) if channel.topic == schema::FRAMES => {
                    self.frame_channels.insert(channel.id);
                }
                Record::Metadata(metadata) if metadata.name == schema::CONFIGURATION => {
                    self.configuration = Configuration::from_metadata(metadata).or(self.configuration.take());
                }
                Record::Message { header, data } if self.frame_channels.contains(&header.channel_id) => {
                    let not_a_frame = || ReadError::NotAFrame { path: self.path.clone() };
                    let decoded = cdr::decode_frame(&data);
                    let (frame, handles) = decoded.filter(is_whole).ok_or_else(not_a_frame)?;
                    return Ok(Some(RecordedFrame { log_time_ns: header.log_time, header: frame, handles }));
                }
                _ => {}
            }
        }
        Ok(None)
    }
}

/// Whether a frame has the handles that it says.
fn is_whole((header, handles): &(FrameHeader, Vec<HandleState>)) -> bool {
    handles.len() == header.bench_count as usize + 1
}

impl Iterator for FrameReader {
    type Item = Result<RecordedFrame, ReadError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.next_frame().transpose()
    }
}

impl Configuration {
    fn from_metadata(Metadata { mut metadata, .. }: Metadata) -> Option<Self> {
        Some(Self { run_id: metadata.get("run_id")?.parse().ok()?, toml: metadata.remove("toml")? })
    }
}
