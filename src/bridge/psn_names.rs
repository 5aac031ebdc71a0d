//! Names in PosiStageNet's INFO packets: of the sender, and of its trackers.

use std::fmt;
use std::str::FromStr;

use crate::config::NamedLayout;

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
/// Placeholder for the dragon's name.
const DRAGON: &str = "{dragon}";
/// The name of a dragon that has none.
const NAMELESS: &str = "dragon";
/// Placeholder for a tracker's id.
const ID: &str = "{id}";
/// The longest number of a bench or tracker: both are at most 65,535.
const LONGEST_NUMBER: &str = "65535";

/// The pattern of the trackers' names: printable ASCII characters, with `{index}` for the bench's number, `{id}` for the
/// tracker's id and `{dragon}` for the dragon's name.
///
/// Of several dragons, `{index}` is the bench's number within its dragon. A pattern without `{dragon}` then has the name before it,
/// and a longer name than [`TrackerName::MAX_LEN`] is cut.
///
/// ```
/// use bench_dragon::bridge::psn::TrackerName;
///
/// let name: TrackerName = "Bench {index}, tracker {id}".parse()?;
/// assert_eq!(name.of_tracker(7, 107), "Bench 7, tracker 107");
/// # Ok::<(), bench_dragon::bridge::psn::TrackerNameError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TrackerName {
    pattern: String,
    dragons: NamedLayout,
}

/// Error for a text that is not a pattern of names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "must be 1 to {} printable ASCII characters, where {INDEX} and {ID} count as five and {DRAGON} as six, without any other {{ or }}",
    TrackerName::MAX_LEN
)]
pub struct TrackerNameError;

impl TrackerName {
    /// Longest name in bytes.
    pub const MAX_LEN: usize = 60;

    /// The same pattern for these dragons.
    #[must_use]
    pub fn of(&self, dragons: &NamedLayout) -> Self {
        Self { pattern: self.pattern.clone(), dragons: dragons.clone() }
    }

    /// Returns the name of a bench's tracker.
    pub fn of_tracker(&self, bench: usize, id: u16) -> String {
        let numbered =
            |pattern: &str, index: usize| pattern.replace(INDEX, &index.to_string()).replace(ID, &id.to_string());
        let Some((dragon, index)) = self.dragons.place(bench) else {
            return numbered(&self.pattern, bench).replace(DRAGON, NAMELESS);
        };
        let name = numbered(&self.pattern, index);
        let mut name = if name.contains(DRAGON) { name.replace(DRAGON, dragon) } else { format!("{dragon} {name}") };
        name.truncate(Self::MAX_LEN);
        name
    }

    /// Upper bound on the length of a name, at most [`TrackerName::MAX_LEN`].
    pub(super) fn longest_len(&self) -> usize {
        if self.dragons.are_named() { Self::MAX_LEN } else { longest(&self.pattern).len() }
    }
}

impl Default for TrackerName {
    /// "Bench 0" and so on.
    fn default() -> Self {
        Self { pattern: format!("Bench {INDEX}"), dragons: NamedLayout::default() }
    }
}

impl FromStr for TrackerName {
    type Err = TrackerNameError;

    fn from_str(pattern: &str) -> Result<Self, TrackerNameError> {
        let longest = longest(pattern);
        let is_allowed = is_printable(&longest, Self::MAX_LEN) && !longest.contains(['{', '}']);
        let name = Self { pattern: pattern.to_owned(), dragons: NamedLayout::default() };
        if is_allowed { Ok(name) } else { Err(TrackerNameError) }
    }
}

impl fmt::Display for TrackerName {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(&self.pattern)
    }
}

fn longest(pattern: &str) -> String {
    pattern.replace(INDEX, LONGEST_NUMBER).replace(ID, LONGEST_NUMBER).replace(DRAGON, NAMELESS)
}

fn is_printable(name: &str, max_len: usize) -> bool {
    (1..=max_len).contains(&name.len()) && name.bytes().all(|byte| (b' '..=b'~').contains(&byte))
}
