//! The promises of a recording: a book of the frames that a recorder was given, and what must be found of them.

use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash as _, Hasher as _};
use std::path::PathBuf;

use bench_dragon_ipc::{FrameHeader, HandleState};
use zerocopy::IntoBytes as _;

use crate::frame::hash_header;

/// A frame: its run, its tick and a hash of all its bits.
pub(crate) type FrameHash = (u64, u64, u64);

pub(crate) fn frame_hash(header: &FrameHeader, handles: &[HandleState]) -> FrameHash {
    let mut hasher = DefaultHasher::new();
    hash_header(header, &mut hasher);
    handles.as_bytes().hash(&mut hasher);
    (header.run_id, header.tick, hasher.finish())
}

/// The frames of one recorder, in the order in which it read them.
#[derive(Clone, Debug)]
pub(crate) struct RecordingBook {
    /// The first file.
    pub(crate) path: PathBuf,
    frames: Vec<FrameHash>,
    /// Instant at which each frame was read.
    read_ns: Vec<u64>,
    /// Number of frames that the operating system has, and that the disk has.
    written: usize,
    synced: usize,
    /// Whether the recorder has ended in order.
    pub(crate) is_finished: bool,
    /// Instant of the last fault of the recorder or its disk.
    pub(crate) trouble_ns: u64,
}

impl RecordingBook {
    pub(crate) fn new(path: PathBuf, now_ns: u64) -> Self {
        let (frames, read_ns) = (Vec::new(), Vec::new());
        Self { path, frames, read_ns, written: 0, synced: 0, is_finished: false, trouble_ns: now_ns }
    }

    pub(crate) fn hand(&mut self, frame: FrameHash, now_ns: u64) {
        self.frames.push(frame);
        self.read_ns.push(now_ns);
    }

    pub(crate) fn frames(&self) -> &[FrameHash] {
        &self.frames
    }

    pub(crate) fn note_written(&mut self, frames: u64) {
        self.written = frames as usize;
    }

    pub(crate) fn note_synced(&mut self, frames: u64) {
        self.synced = self.synced.max(frames as usize);
    }

    /// Age of the oldest frame that the operating system does not have yet.
    pub(crate) fn unwritten_ns(&self, now_ns: u64) -> u64 {
        self.read_ns.get(self.written).map_or(0, |read_ns| now_ns - read_ns)
    }

    /// Age of the oldest frame that the disk does not have yet.
    pub(crate) fn unsynced_ns(&self, now_ns: u64) -> u64 {
        self.read_ns.get(self.synced).map_or(0, |read_ns| now_ns - read_ns)
    }

    /// The power was lost: only synced frames are sure.
    pub(crate) fn lose_power(&mut self) {
        self.written = self.synced;
        self.is_finished = false;
    }

    /// Checks the frames that were read back: they are a prefix of what the recorder read, at least up to the last frame that
    /// must be there. `may_have_holes`: whether damage was cut out, as after a power loss. Then frames may be missing behind those
    /// that are sure.
    pub(crate) fn check(&self, found: &[FrameHash], may_have_holes: bool) -> Result<(), String> {
        let sure = if self.is_finished { self.frames.len() } else { self.written };
        let same = self.frames.iter().zip(found).take_while(|(read, found)| read == found).count();
        if same < sure {
            return Err(format!(
                "{} has {} frames, of which {same} are the first ones that its recorder read; {sure} are sure, of {}",
                self.path.display(),
                found.len(),
                self.frames.len()
            ));
        }
        let mut rest = self.frames.iter().skip(same);
        let is_subsequence = found[same..].iter().all(|found| rest.any(|read| read == found));
        if same < found.len() && !(may_have_holes && is_subsequence) {
            return Err(format!(
                "{} has other frames than its recorder read, from frame {same} on",
                self.path.display()
            ));
        }
        Ok(())
    }
}
