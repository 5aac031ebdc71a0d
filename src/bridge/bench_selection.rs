//! The benches that a bridge sends.

use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

use bench_dragon_geometry::dragon::MAX_BENCHES;

/// End of a range that extends to the tail of any dragon.
const OPEN: usize = usize::MAX;
/// The highest number of a bench.
const LAST: usize = MAX_BENCHES - 1;

/// A choice of benches: numbers and ranges of numbers. A range includes both of its ends.
///
/// As text, `0,10..20,200..` is the head, benches 10 to 20, and all from 200 to the tail. A dragon may have fewer benches than
/// the choice.
///
/// ```
/// use bench_dragon::bridge::BenchSelection;
///
/// let benches: BenchSelection = "0,10..12,20..".parse()?;
/// assert_eq!(benches.indices(22).collect::<Vec<_>>(), [0, 10, 11, 12, 20, 21]);
/// # Ok::<(), bench_dragon::bridge::BenchSelectionError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BenchSelection {
    /// Ascending. Between two of them is at least one number.
    ranges: Vec<RangeInclusive<usize>>,
}

/// Error for a text that is not a choice of benches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("must be numbers from 0 to {LAST} and ranges from a lower to a higher one, such as 0,10..20 or 10..")]
pub struct BenchSelectionError;

impl BenchSelection {
    /// The chosen benches of a dragon with `benches` benches, ascending, each once.
    pub fn indices(&self, benches: usize) -> impl DoubleEndedIterator<Item = usize> + '_ {
        self.ranges(benches).flatten()
    }

    /// Number of chosen benches of a dragon with `benches` benches.
    pub fn count(&self, benches: usize) -> usize {
        self.ranges(benches).map(|range| range.end() - range.start() + 1).sum()
    }

    /// The chosen benches of a dragon with `benches` benches, as ranges without gaps.
    pub fn ranges(&self, benches: usize) -> impl DoubleEndedIterator<Item = RangeInclusive<usize>> + '_ {
        let existing = self.ranges.iter().filter(move |range| *range.start() < benches);
        existing.map(move |range| *range.start()..=(*range.end()).min(benches - 1))
    }

    /// The chosen benches that a dragon with `benches` benches does not have, or `None`. A range without an end misses nothing
    /// where the dragon has its beginning.
    pub fn missing(&self, benches: usize) -> Option<Self> {
        let is_missing = |range: &&RangeInclusive<usize>| {
            *range.start() >= benches || (*range.end() >= benches && *range.end() != OPEN)
        };
        let missing = self.ranges.iter().filter(is_missing);
        let ranges: Vec<_> = missing.map(|range| (*range.start()).max(benches)..=*range.end()).collect();
        (!ranges.is_empty()).then_some(Self { ranges })
    }
}

impl Default for BenchSelection {
    /// All benches.
    fn default() -> Self {
        Self { ranges: vec![0..=OPEN] }
    }
}

impl FromStr for BenchSelection {
    type Err = BenchSelectionError;

    fn from_str(text: &str) -> Result<Self, BenchSelectionError> {
        let ranges: Option<Vec<_>> = text.split(',').map(range).collect();
        Ok(Self { ranges: joined(ranges.ok_or(BenchSelectionError)?) })
    }
}

impl fmt::Display for BenchSelection {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let written = |range: &RangeInclusive<usize>| match (*range.start(), *range.end()) {
            (first, OPEN) => format!("{first}.."),
            (first, last) if first == last => first.to_string(),
            (first, last) => format!("{first}..{last}"),
        };
        formatter.pad(&self.ranges.iter().map(written).collect::<Vec<_>>().join(","))
    }
}

/// Reads a number, a range, or a range without an end.
fn range(text: &str) -> Option<RangeInclusive<usize>> {
    let (first, last) = match text.split_once("..") {
        None => (number(text)?, number(text)?),
        Some((first, "")) => (number(first)?, OPEN),
        Some((first, last)) => (number(first)?, number(last)?),
    };
    (first <= last).then_some(first..=last)
}

fn number(text: &str) -> Option<usize> {
    let has_only_digits = text.bytes().all(|byte| byte.is_ascii_digit());
    text.parse().ok().filter(|number| has_only_digits && *number <= LAST)
}

/// Sorts ranges, and joins those that overlap or touch.
fn joined(mut ranges: Vec<RangeInclusive<usize>>) -> Vec<RangeInclusive<usize>> {
    ranges.sort_unstable_by_key(|range| *range.start());
    let mut joined: Vec<RangeInclusive<usize>> = Vec::with_capacity(ranges.len());
    for range in ranges {
        match joined.last_mut() {
            Some(before) if *range.start() <= before.end().saturating_add(1) => {
                *before = *before.start()..=*before.end().max(range.end());
            }
            _ => joined.push(range),
        }
    }
    joined
}
