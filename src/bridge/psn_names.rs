//! Names in PosiStageNet's INFO packets: of the sender, and of its trackers.

use std::fmt;
use std::str::FromStr;

/// The name of a sender: 1 to 64 printable ASCII characters, including spaces.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SystemName(String);

/// Error for a text that is not a system name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("must be 1 to {} printable ASCII characters", SystemName::MAX_LEN)]
pub struct SystemNameError;

impl SystemName {
    /// Longest name in bytes.
    pub const MAX_LEN: usize = 64;

    pub(super) fn as_bytes(&self) -> &[u8] {
        self.0.as_bytes()
    }
}

impl FromStr for SystemName {
    type Err = SystemNameError;

    fn from_str(name: &str) -> Result<Self, SystemNameError> {
        if is_printable(name, Self::MAX_LEN) { Ok(Self(name.to_owned())) } else { Err(SystemNameError) }
    }
}

impl fmt::Display for SystemName {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(&self.0)
    }
}

/// Placeholder for a bench's number.
const INDEX: &str = "{index}";
/// Placeholder for a tracker's id.
const ID: &str = "{id}";
/// The longest number of a bench or tracker: both are at most 65,535.
const LONGEST_NUMBER: &str = "65535";

/// The pattern of the trackers' names: printable ASCII characters, with `{index}` for the bench's number and `{id}` for the
/// tracker's id.
///
/// ```
/// use bench_dragon::bridge::psn::TrackerName;
///
/// let name: TrackerName = "Bench {index}, tracker {id}".parse()?;
/// assert_eq!(name.of_tracker(7, 107), "Bench 7, tracker 107");
/// # Ok::<(), bench_dragon::bridge::psn::TrackerNameError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TrackerName(String);

/// Error for a text that is not a pattern of names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "must be 1 to {} printable ASCII characters, where {INDEX} and {ID} count as five, without any other {{ or }}",
    TrackerName::MAX_LEN
)]
pub struct TrackerNameError;

impl TrackerName {
    /// Longest name in bytes.
    pub const MAX_LEN: usize = 60;

    /// Returns the name of a bench's tracker.
    pub fn of_tracker(&self, index: usize, id: u16) -> String {
        self.0.replace(INDEX, &index.to_string()).replace(ID, &id.to_string())
    }

    /// Length of the longest name, at most [`TrackerName::MAX_LEN`].
    pub(super) fn longest_len(&self) -> usize {
        longest(&self.0).len()
    }
}

impl Default for TrackerName {
    /// "Bench 0" and so on.
    fn default() -> Self {
        Self(format!("Bench {INDEX}"))
    }
}

impl FromStr for TrackerName {
    type Err = TrackerNameError;

    fn from_str(pattern: &str) -> Result<Self, TrackerNameError> {
        let longest = longest(pattern);
        let is_allowed = is_printable(&longest, Self::MAX_LEN) && !longest.contains(['{', '}']);
        if is_allowed { Ok(Self(pattern.to_owned())) } else { Err(TrackerNameError) }
    }
}

impl fmt::Display for TrackerName {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(&self.0)
    }
}

fn longest(pattern: &str) -> String {
    pattern.replace(INDEX, LONGEST_NUMBER).replace(ID, LONGEST_NUMBER)
}

fn is_printable(name: &str, max_len: usize) -> bool {
    (1..=max_len).contains(&name.len()) && name.bytes().all(|byte| (b' '..=b'~').contains(&byte))
}
