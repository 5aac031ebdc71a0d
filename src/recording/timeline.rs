//! The timeline of a recording: which wall time lies in which chunk of which part.

use std::fs::File;

use super::{
    outline::{Outline, OutlinedChunk},
    parts::Parts,
    reader::{Configuration, FrameReader, ReadError},
};

/// The wall times of a recording's chunks. It takes about 40 bytes per megabyte of recording.
#[derive(Clone, Debug)]
pub struct Timeline {
    /// Wall time of the first frame: Unix time in nanoseconds.
    begin_ns: u64,
    end_ns: u64,
    /// Part and chunk, in the order of their wall times.
    chunks: Vec<(usize, OutlinedChunk)>,
    /// The configurations of each part.
    configurations: Vec<Vec<Configuration>>,
}

/// The begin of a chunk.
#[derive(Clone, Debug)]
pub struct TimelinePlace {
    pub(super) part: usize,
    /// Byte at which the chunk begins.
    pub(super) position: u64,
    /// The last configuration before the chunk.
    pub(super) configuration: Option<Configuration>,
}

impl Timeline {
    /// Reads the timeline. This reads the heads of all records, and the first chunk of the first part.
    ///
    /// # Errors
    /// [`ReadError`].
    pub fn of(parts: &Parts) -> Result<Self, ReadError> {
        let mut timeline = Self { begin_ns: 0, end_ns: 0, chunks: Vec::new(), configurations: Vec::new() };
        for (part, path) in parts.files.iter().enumerate() {
            let outline = File::open(path).and_then(|file| Outline::of(&file));
            let Outline { chunks, configurations } = outline.map_err(|source| ReadError::Io(path.clone(), source))?;
            timeline.configurations.push(configurations);
            for chunk in chunks {
                // Another recorder has recorded this time, too.
                if chunk.end_ns <= timeline.end_ns {
                    continue;
                }
                timeline.end_ns = chunk.end_ns;
                timeline.chunks.push((part, chunk));
            }
        }
        // The configuration and the first command events come before the first frame.
        let first = parts.files.first().map(|path| FrameReader::open(path)?.next_wanted_frame(|_| true)).transpose()?;
        timeline.begin_ns = first.flatten().map_or(0, |frame| frame.log_time_ns);
        timeline.end_ns = timeline.end_ns.max(timeline.begin_ns);
        Ok(timeline)
    }

    /// Wall time from the first frame to the end of the recording, in nanoseconds.
    pub fn length_ns(&self) -> u64 {
        self.end_ns - self.begin_ns
    }

    /// Wall time of a frame, counted from the first frame in nanoseconds.
    pub fn position_ns(&self, log_time_ns: u64) -> u64 {
        log_time_ns.saturating_sub(self.begin_ns).min(self.length_ns())
    }

    /// Unix time of a position, in nanoseconds.
    pub fn log_time_ns(&self, position_ns: u64) -> u64 {
        self.begin_ns.saturating_add(position_ns)
    }

    /// Number of chunks.
    pub fn chunks(&self) -> usize {
        self.chunks.len()
    }

    /// The chunk at a position, or the last one before it, or one that is `back` chunks before that. `None` for a recording
    /// without chunks.
    pub fn place(&self, position_ns: u64, back: usize) -> Option<TimelinePlace> {
        let log_time_ns = self.log_time_ns(position_ns);
        let behind = self.chunks.partition_point(|(_, chunk)| chunk.begin_ns <= log_time_ns);
        let (part, chunk) = self.chunks.get(behind.saturating_sub(1).saturating_sub(back))?;
        let before = chunk.configurations.checked_sub(1);
        let configuration = before.and_then(|index| self.configurations[*part].get(index)).cloned();
        Some(TimelinePlace { part: *part, position: chunk.position, configuration })
    }
}
