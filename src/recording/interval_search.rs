//! Looking for the frames of an interval, and what there was where there are none.

use std::path::{Path, PathBuf};

use super::{Flaws, ShowInterval};

/// A search of a recording for the frames whose show time lies in an interval.
#[derive(Clone, Copy, Debug)]
pub struct IntervalSearch {
    interval: ShowInterval,
    /// Show times that it has come by: the least and the greatest.
    seen: Option<ShowInterval>,
}

/// Why no frame was found.
#[derive(Debug, thiserror::Error)]
pub enum NothingFound {
    /// There are none at all, or none that can be read.
    #[error("{} holds no frames{flaws}", path.display())]
    NoFrames {
        /// The file.
        path: PathBuf,
        /// What could not be read of it.
        flaws: Flaws,
    },
    /// There are frames, but none of the show times that were asked for.
    #[error("{} holds no frames {asked}: its show times are {there}", path.display())]
    NothingThere {
        /// The file.
        path: PathBuf,
        /// What was asked for.
        asked: ShowInterval,
        /// From the least show time to the greatest.
        there: ShowInterval,
    },
}

impl IntervalSearch {
    /// A search that has just begun.
    pub fn new(interval: ShowInterval) -> Self {
        Self { interval, seen: None }
    }

    /// Comes by a frame of this show time; whether it is one of the interval.
    pub fn comes_by(&mut self, sim_time_ns: i64) -> bool {
        let seen = self.seen.get_or_insert(ShowInterval { from_ns: sim_time_ns, to_ns: sim_time_ns });
        *seen = ShowInterval { from_ns: seen.from_ns.min(sim_time_ns), to_ns: seen.to_ns.max(sim_time_ns) };
        self.interval.contains(sim_time_ns)
    }

    /// Why nothing was found in a file that has been searched, as far as it could be read.
    pub fn nothing_found(&self, path: &Path, flaws: Flaws) -> NothingFound {
        let path = path.to_owned();
        match self.seen {
            None => NothingFound::NoFrames { path, flaws },
            Some(there) => NothingFound::NothingThere { path, asked: self.interval, there },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_search_that_finds_nothing_tells_what_there_is() {
        let mut search = IntervalSearch::new(ShowInterval { from_ns: 5_000_000_000, to_ns: i64::MAX });
        let path = Path::new("dance.mcap");
        let told = |flaws| IntervalSearch::new(ShowInterval::ALL).nothing_found(path, flaws).to_string();
        assert_eq!(told(Flaws::default()), "dance.mcap holds no frames");
        let flaws = Flaws { cut: true, skipped_bytes: 7 };
        assert_eq!(told(flaws), "dance.mcap holds no frames: 7 bytes of it are damaged, and it stops in the middle");
        assert!(!search.comes_by(3_000_000_000) && !search.comes_by(1_000_000_000));
        let told = "dance.mcap holds no frames from 5 s: its show times are from 1 s to 3 s";
        assert_eq!(search.nothing_found(path, Flaws::default()).to_string(), told);
        assert!(search.comes_by(5_000_000_000));
    }
}
