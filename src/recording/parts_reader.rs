//! Reading the parts of a recording as one: each frame, alert and command event once, in the recorded order.

use std::{
    collections::{HashSet, VecDeque},
    fs,
    path::PathBuf,
    sync::Arc,
};

use bench_dragon_ipc::{EventKind, FrameHeader, IntoBytes as _};
use serde::{Deserialize, Serialize};

use super::{
    gaps::{Coverage, FrameTrail},
    parts::Parts,
    reader::{Bookmark, Configuration, Flaws, FrameReader, ReadError},
    timeline::TimelinePlace,
    topics::{Recorded, RecordedAlert},
};

/// Number of command events up to which each is read once; 16 bytes each.
const MOST_EVENTS: usize = 1 << 20;
/// Number of the last alerts among which repeated ones are found.
const MOST_ALERTS: usize = 1 << 10;

/// A file that could not be read completely.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FlawedFile {
    /// Path of the file.
    pub file: PathBuf,
    /// Parts that could not be read.
    #[serde(flatten)]
    pub flaws: Flaws,
}

/// The frames, alerts and command events of all parts of a recording.
///
/// A recorder that begins in the middle of a run receives the newest command events once more, and two recorders may have
/// recorded the same frames. Frames of an earlier part are not returned again.
#[derive(Debug)]
pub struct PartsReader {
    parts: Arc<Parts>,
    /// Index of the next part to open.
    next_part: usize,
    reader: Option<FrameReader>,
    configuration: Option<Configuration>,
    /// Total size of the parts that were read completely.
    bytes_before: u64,
    /// Part and byte of the last chunk to read.
    last: Option<(usize, u64)>,
    trail: FrameTrail,
    events: HashSet<(u64, u64)>,
    alerts: VecDeque<(usize, RecordedAlert)>,
    flawed: Vec<FlawedFile>,
}

/// A position in the parts of a recording at which another reader can begin.
#[derive(Clone, Debug)]
pub struct PartsBookmark {
    part: usize,
    bookmark: Bookmark,
}

impl PartsReader {
    /// Reads the parts from the begin. Opens each part when it is needed.
    pub fn new(parts: Arc<Parts>) -> Self {
        Self {
            parts,
            next_part: 0,
            reader: None,
            configuration: None,
            bytes_before: 0,
            last: None,
            trail: FrameTrail::default(),
            events: HashSet::new(),
            alerts: VecDeque::new(),
            flawed: Vec::new(),
        }
    }

    /// Reads the parts from a bookmark on, up to and including the chunk at byte `last.1` of part `last.0`.
    ///
    /// # Errors
    /// [`ReadError::Io`].
    pub fn open_between(parts: Arc<Parts>, begin: &PartsBookmark, last: (usize, u64)) -> Result<Self, ReadError> {
        let PartsBookmark { part, bookmark } = begin;
        let last_byte = if last.0 == *part { last.1 } else { u64::MAX };
        let reader = FrameReader::open_between(&parts.files[*part], bookmark, last_byte)?;
        let excerpt = Self { last: Some(last), trail: FrameTrail::of_excerpt(), ..Self::new(parts) };
        Ok(Self { next_part: part + 1, reader: Some(reader), ..excerpt })
    }

    /// Reads the parts from a place of their timeline on.
    ///
    /// # Errors
    /// As [`FrameReader::open`].
    pub fn open_at(parts: Arc<Parts>, place: &TimelinePlace) -> Result<Self, ReadError> {
        let TimelinePlace { part, position, configuration } = place;
        let reader = FrameReader::open_at(&parts.files[*part], *position, configuration.clone())?;
        let excerpt = Self { trail: FrameTrail::of_excerpt(), ..Self::new(parts) };
        Ok(Self { next_part: part + 1, reader: Some(reader), ..excerpt })
    }

    /// As [`FrameReader::next_wanted`], over all parts.
    ///
    /// # Errors
    /// As [`FrameReader::open`] and [`FrameReader::next_wanted`].
    pub fn next_wanted(
        &mut self,
        mut is_wanted: impl FnMut(&FrameHeader) -> bool,
    ) -> Result<Option<Recorded>, ReadError> {
        loop {
            let Some(mut reader) = self.open_next()? else { return Ok(None) };
            let part = self.next_part - 1;
            let (trail, files) = (&mut self.trail, &self.parts.files);
            let recorded = reader.next_wanted(|header| trail.take(header, part, files) && is_wanted(header))?;
            let Some(recorded) = recorded else {
                self.end_part(&reader);
                continue;
            };
            self.reader = Some(reader);
            if self.is_new(&recorded, part) {
                return Ok(Some(recorded));
            }
        }
    }

    /// Bookmark of the last frame, alert or command event, as [`FrameReader::bookmark`]; `None` before the first one.
    pub fn bookmark(&self) -> Option<PartsBookmark> {
        let reader = self.reader.as_ref()?;
        Some(PartsBookmark { part: self.next_part - 1, bookmark: reader.bookmark() })
    }

    /// Part and byte of the chunk of the last frame, alert or command event.
    pub fn position(&self) -> (usize, u64) {
        (self.next_part.saturating_sub(1), self.reader.as_ref().map_or(0, FrameReader::position))
    }

    /// The configuration at the last frame.
    pub fn configuration(&self) -> Option<&Configuration> {
        self.reader.as_ref().and_then(FrameReader::configuration).or(self.configuration.as_ref())
    }

    /// Number of bytes read so far, of [`Parts::bytes`].
    pub fn bytes_read(&self) -> u64 {
        self.bytes_before + self.reader.as_ref().map_or(0, FrameReader::position)
    }

    /// The frames read so far, and the gaps between them.
    pub fn coverage(&self) -> Coverage {
        Coverage { published: self.parts.published, ..self.trail.coverage(&self.parts.files) }
    }

    /// The parts read so far that could not be read completely. Ends the reading.
    pub fn into_flawed(mut self) -> Vec<FlawedFile> {
        if let Some(reader) = self.reader.take() {
            self.end_part(&reader);
        }
        self.flawed
    }

    /// The unreadable parts of all files together, as far as they are read.
    pub fn flaws(&self) -> Flaws {
        let reading = self.reader.as_ref().map(FrameReader::flaws);
        self.flawed.iter().map(|file| file.flaws).chain(reading).fold(Flaws::default(), Flaws::and)
    }

    fn open_next(&mut self) -> Result<Option<FrameReader>, ReadError> {
        if let Some(reader) = self.reader.take() {
            return Ok(Some(reader));
        }
        let last_part = self.last.map_or(usize::MAX, |(part, _)| part);
        let Some(file) = self.parts.files.get(self.next_part).filter(|_| self.next_part <= last_part) else {
            return Ok(None);
        };
        let mut reader = FrameReader::open(file)?;
        if let Some((part, byte)) = self.last
            && part == self.next_part
        {
            reader.end_at(byte);
        }
        self.next_part += 1;
        Ok(Some(reader))
    }

    fn is_new(&mut self, recorded: &Recorded, part: usize) -> bool {
        match recorded {
            Recorded::Frame(_) => true,
            Recorded::Command(event) => {
                if event.event_kind() == Some(EventKind::End) {
                    self.trail.end(event.run_id, event.tick);
                }
                if self.events.len() >= MOST_EVENTS {
                    self.events.clear();
                }
                self.events.insert((event.run_id, event.number))
            }
            Recorded::Alert(recorded) => {
                let is_known = |(of, known): &(usize, RecordedAlert)| {
                    *of != part && known.alert.as_bytes() == recorded.alert.as_bytes()
                };
                if self.alerts.iter().any(is_known) {
                    return false;
                }
                if self.alerts.len() == MOST_ALERTS {
                    self.alerts.pop_front();
                }
                self.alerts.push_back((part, *recorded));
                true
            }
        }
    }

    fn end_part(&mut self, reader: &FrameReader) {
        let file = &self.parts.files[self.next_part - 1];
        let flaws = reader.flaws();
        if flaws != Flaws::default() {
            self.flawed.push(FlawedFile { file: file.clone(), flaws });
        }
        self.configuration = reader.configuration().cloned().or(self.configuration.take());
        self.bytes_before += fs::metadata(file).map_or(0, |metadata| metadata.len());
    }
}
