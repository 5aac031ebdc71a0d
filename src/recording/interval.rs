//! Which part of a recording: frames by their show time, the search for them, and what there was where there are none.

use std::{
    fmt,
    path::{Path, PathBuf},
};

use super::Flaws;

/// Show times from one to another, both included.
///
/// A recording may hold several runs, and a run may go back to where it was. So an interval is no stretch of the file, but
/// all frames whose show time lies in it, wherever they are.
///
/// ```
/// use bench_dragon::recording::ShowInterval;
///
/// let refrain = ShowInterval { from_ns: 5_000_000_000, to_ns: 7_500_000_000 };
/// assert!(refrain.contains(7_500_000_000) && !refrain.contains(7_500_000_001));
/// assert_eq!(refrain.to_string(), "from 5 s to 7.5 s");
/// assert!(ShowInterval::ALL.contains(-100));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShowInterval {
    /// The least show time, in nanoseconds.
    pub from_ns: i64,
    /// The greatest.
    pub to_ns: i64,
}

impl ShowInterval {
    /// Every show time.
    pub const ALL: Self = Self { from_ns: i64::MIN, to_ns: i64::MAX };

    /// Whether a show time lies in it.
    pub fn contains(&self, sim_time_ns: i64) -> bool {
        (self.from_ns..=self.to_ns).contains(&sim_time_ns)
    }
}

impl fmt::Display for ShowInterval {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [from_s, to_s] = [self.from_ns, self.to_ns].map(|time_ns| time_ns as f64 / 1e9);
        match (self.from_ns, self.to_ns) {
            (i64::MIN, i64::MAX) => formatter.write_str("at any time"),
            (i64::MIN, _) => write!(formatter, "to {to_s} s"),
            (_, i64::MAX) => write!(formatter, "from {from_s} s"),
            _ => write!(formatter, "from {from_s} s to {to_s} s"),
        }
    }
}

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
