//! Intervals of show time: the search of a recording for their frames, and the error if it finds none.

use std::{
    fmt,
    path::{Path, PathBuf},
};

use super::Flaws;

/// A closed interval of show times.
///
/// A recording may contain several runs, and a run may seek back. So an interval is not a contiguous part of the file. It
/// selects all frames whose show time lies in it.
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
    /// Least show time, in nanoseconds.
    pub from_ns: i64,
    /// Greatest show time, in nanoseconds.
    pub to_ns: i64,
}

impl ShowInterval {
    /// All show times.
    pub const ALL: Self = Self { from_ns: i64::MIN, to_ns: i64::MAX };

    /// Whether a show time lies in the interval.
    pub fn contains(&self, show_time_ns: i64) -> bool {
        (self.from_ns..=self.to_ns).contains(&show_time_ns)
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
    /// Least and greatest show time found so far.
    seen: Option<ShowInterval>,
}

/// Reason why a search found no frame.
#[derive(Debug, thiserror::Error)]
pub enum NothingFound {
    /// The recording has no readable frames.
    #[error("{} holds no frames{flaws}", path.display())]
    NoFrames {
        /// The file.
        path: PathBuf,
        /// Unreadable parts of the file.
        flaws: Flaws,
    },
    /// The recording has frames, but none in the interval.
    #[error("{} holds no frames {asked}: its show times are {there}", path.display())]
    NothingThere {
        /// The file.
        path: PathBuf,
        /// Interval of the search.
        asked: ShowInterval,
        /// Least and greatest show time in the file.
        there: ShowInterval,
    },
}

impl IntervalSearch {
    /// Begins a search.
    pub fn new(interval: ShowInterval) -> Self {
        Self { interval, seen: None }
    }

    /// Whether a show time lies in the interval.
    pub fn contains(&self, show_time_ns: i64) -> bool {
        self.interval.contains(show_time_ns)
    }

    /// Takes the show time of the next frame. Returns whether it lies in the interval.
    pub fn comes_by(&mut self, show_time_ns: i64) -> bool {
        let seen = self.seen.get_or_insert(ShowInterval { from_ns: show_time_ns, to_ns: show_time_ns });
        *seen = ShowInterval { from_ns: seen.from_ns.min(show_time_ns), to_ns: seen.to_ns.max(show_time_ns) };
        self.interval.contains(show_time_ns)
    }

    /// Returns the reason why the search found no frame in the readable part of a file.
    pub fn nothing_found(&self, path: &Path, flaws: Flaws) -> NothingFound {
        let path = path.to_owned();
        match self.seen {
            None => NothingFound::NoFrames { path, flaws },
            Some(there) => NothingFound::NothingThere { path, asked: self.interval, there },
        }
    }
}
