//! Which part of a recording: frames by their show time.

use std::fmt;

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
