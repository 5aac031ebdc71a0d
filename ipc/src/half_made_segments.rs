//! Segments of shared memory that a process was killed in making, before they had a size.
//!
//! iceoryx2 0.10 makes a segment empty, and then gives it its size; whoever opens it in between waits for that. It waits
//! without end (`MappingSizeIsZero`, in its `posix_shared_memory.rs`): a process that was killed in between would stop the
//! server, every reader that is its peer, and everyone who cleans up after it. A process needs microseconds from one step to the
//! other. So a segment that stays empty is removed: by each member that joins, before it opens anything, and by the source all
//! the time. Then whoever waits goes on, and makes the segment anew or finds that its peer is gone.

use std::fs;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use crate::domain::Domain;
use crate::sweep::SHARED_MEMORY;

/// So many looks in a row find a segment empty before it is removed.
const SIGHTINGS: u32 = 4;
/// How far apart the looks of a member that joins are.
const LOOK_PERIOD: Duration = Duration::from_millis(50);
/// Looks of a member that joins at most: those of several segments, one made after the other.
const MOST_LOOKS: u32 = 5 * SIGHTINGS;

/// Looks after the segments of a domain. Whoever looks does so at least some ten milliseconds apart.
#[derive(Debug)]
pub struct SegmentWatch {
    domain: Domain,
    empty: Vec<EmptySegment>,
}

/// A segment without a size, and how often it has been seen so.
#[derive(Clone, Debug, PartialEq, Eq)]
struct EmptySegment {
    path: PathBuf,
    inode: u64,
    sightings: u32,
}

impl SegmentWatch {
    /// A watch that has seen nothing yet.
    pub fn new(domain: &Domain) -> Self {
        Self { domain: domain.clone(), empty: Vec::new() }
    }

    /// Looks once, and removes what has been empty for some looks. Returns whether empty segments are left.
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
            // Another process may have removed it just now.
            !(is_half_made && fs::remove_file(&empty.path).is_ok())
        });
        !self.empty.is_empty()
    }
}

/// Waits until no segment is empty, and removes those that stay so; where none is, it takes one look.
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
