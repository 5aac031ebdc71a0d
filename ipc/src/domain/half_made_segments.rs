//! Removal of shared-memory segments whose creator was killed before they had a size.
//!
//! iceoryx2 0.10 creates a segment empty and then sets its size. A process that opens the segment in between waits for
//! the size, without a time limit (`MappingSizeIsZero`, in `posix_shared_memory.rs` of iceoryx2). If the creator is
//! killed in between, the server, every connected reader and every process that removes its remains would wait forever.
//! The two steps are microseconds apart, so a segment that stays empty is abandoned. Each joining member removes such
//! segments before it opens anything, and the source removes them continuously. The waiting process then continues: it
//! creates the segment again, or finds that its peer is gone.

use std::fs;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use super::place::Domain;
use super::shortage::SHARED_MEMORY;

/// Number of successive checks that must find a segment empty before it is removed.
const SIGHTINGS: u32 = 4;
/// Period of the checks of a joining member.
const LOOK_PERIOD: Duration = Duration::from_millis(50);
/// Greatest number of checks of a joining member: enough for several segments, created one after the other.
const MOST_LOOKS: u32 = 5 * SIGHTINGS;

/// Removes empty segments of a domain. Checks must be at least some ten milliseconds apart.
#[derive(Debug)]
pub struct SegmentWatch {
    domain: Domain,
    empty: Vec<EmptySegment>,
}

/// A segment without a size, and the number of successive checks that found it empty.
#[derive(Clone, Debug, PartialEq, Eq)]
struct EmptySegment {
    path: PathBuf,
    inode: u64,
    sightings: u32,
}

impl SegmentWatch {
    /// Returns a watch without observations.
    pub fn new(domain: &Domain) -> Self {
        Self { domain: domain.clone(), empty: Vec::new() }
    }

    /// Checks once, and removes the segments that several successive checks found empty. Returns whether empty segments
    /// are left.
    pub fn look(&mut self) -> bool {
        let found = empty_segments(&self.domain);
        self.empty = found
            .into_iter()
            .map(|(path, inode)| {
                let before = self.empty.iter().find(|empty| empty.inode == inode && empty.path == path);
                EmptySegment { path, inode, sightings: before.map_or(0, |empty| empty.sightings) + 1 }
            })
            .collect();
        self.empty.retain(|empty| {
            let is_half_made = empty.sightings >= SIGHTINGS;
            // Another process may have removed the segment just now.
            !(is_half_made && fs::remove_file(&empty.path).is_ok())
        });
        !self.empty.is_empty()
    }
}

/// Waits until no segment is empty, and removes segments that stay empty. Without empty segments, one check is made and
/// nothing waits.
pub(crate) fn settle(domain: &Domain) {
    let mut watch = SegmentWatch::new(domain);
    for _ in 0..MOST_LOOKS {
        if !watch.look() {
            return;
        }
        thread::sleep(LOOK_PERIOD);
    }
}

fn empty_segments(domain: &Domain) -> Vec<(PathBuf, u64)> {
    let prefix = domain.prefix();
    let Ok(entries) = fs::read_dir(Path::new(SHARED_MEMORY)) else { return Vec::new() };
    let is_ours = |name: &str| name.starts_with(&prefix);
    let empty = |entry: fs::DirEntry| {
        if !entry.file_name().to_str().is_some_and(is_ours) {
            return None;
        }
        let metadata = entry.metadata().ok()?;
        let is_empty = metadata.is_file() && metadata.len() == 0 && metadata.uid() == domain.uid();
        is_empty.then(|| (entry.path(), metadata.ino()))
    };
    entries.flatten().filter_map(empty).collect()
}
