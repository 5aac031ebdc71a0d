//! The benches that a bridge sends.

use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

use bench_dragon_geometry::dragon::MAX_BENCHES;

use crate::config::NamedLayout;

/// End of a range that extends to the tail of any dragon.
const OPEN: usize = usize::MAX;
/// The highest number of a bench.
const LAST: usize = MAX_BENCHES - 1;

/// A choice of benches: numbers and ranges of numbers. A range includes both of its ends.
///
/// As text, `0,10..20,200..` is the head, benches 10 to 20, and all from 200 to the tail. A dragon may have fewer benches than
/// the choice. Of several dragons, `gold:0..` is all benches of one, and `gold:0..5` some of them; without a name, benches are
/// numbered on from dragon to dragon. [`BenchSelection::of`] replaces the names by these numbers.
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
    /// Ascending. Between two of them is at least one number, or the beginning of a dragon.
    ranges: Vec<RangeInclusive<usize>>,
    /// Names of dragons, each with a range of their benches.
    named: Vec<(String, RangeInclusive<usize>)>,
}

/// Error for a text that is not a choice of benches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "must be numbers from 0 to {LAST} and ranges from a lower to a higher one, such as 0,10..20 or 10.., or those of one of several \
     dragons, such as gold:0..5"
)]
pub struct BenchSelectionError;

impl BenchSelection {
    /// The same choice of these dragons, by numbers alone. Each range is of one dragon.
    #[must_use]
    pub fn of(&self, dragons: &NamedLayout) -> Self {
        let of_dragon = |(name, range): &(String, RangeInclusive<usize>)| {
            let benches = dragons.of_dragon(name)?;
            let last = range.end().saturating_add(benches.start).min(benches.end - 1);
            let first = range.start() + benches.start;
            (first <= last).then_some(first..=last)
        };
        let ranges = joined(self.ranges.iter().cloned().chain(self.named.iter().filter_map(of_dragon)).collect());
        if !dragons.are_named() {
            return Self { ranges, named: Vec::new() };
        }
        let split = |range: &RangeInclusive<usize>| {
            let (first, last) = (*range.start(), *range.end());
            let parts = dragons.dragons().map(move |(_, benches)| benches.start.max(first)..=last.min(benches.end - 1));
            parts.filter(|part| !part.is_empty()).collect::<Vec<_>>()
        };
        Self { ranges: ranges.iter().flat_map(split).collect(), named: Vec::new() }
    }

    /// The chosen benches that these dragons, of `benches` benches in all, do not have, or `None`. A range without an end misses
    /// nothing where its dragon has its beginning.
    pub fn missing_of(&self, dragons: &NamedLayout, benches: usize) -> Option<Self> {
        let missing = |(name, range): &(String, RangeInclusive<usize>)| {
            let benches = dragons.of_dragon(name).map_or(0, |benches| benches.len());
            let missing = missing_in(range, benches)?;
            Some((name.clone(), missing))
        };
        let named: Vec<_> = self.named.iter().filter_map(missing).collect();
        let ranges: Vec<_> = self.ranges.iter().filter_map(|range| missing_in(range, benches)).collect();
        (!ranges.is_empty() || !named.is_empty()).then_some(Self { ranges, named })
    }

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
        self.missing_of(&NamedLayout::default(), benches)
    }
}

/// The part of a range that `benches` benches do not have. A range without an end misses nothing where it has its beginning.
fn missing_in(range: &RangeInclusive<usize>, benches: usize) -> Option<RangeInclusive<usize>> {
    let (first, last) = (*range.start(), *range.end());
    let is_missing = first >= benches || (last >= benches && last != OPEN);
    is_missing.then_some(first.max(benches)..=last)
}

impl Default for BenchSelection {
    /// All benches.
    fn default() -> Self {
        Self { ranges: vec![0..=OPEN], named: Vec::new() }
    }
}

impl FromStr for BenchSelection {
    type Err = BenchSelectionError;

    fn from_str(text: &str) -> Result<Self, BenchSelectionError> {
        let (mut ranges, mut named) = (Vec::new(), Vec::new());
        for part in text.split(',') {
            match range(part) {
                Some(range) => ranges.push(range),
                None => named.push(named_range(part).ok_or(BenchSelectionError)?),
            }
        }
        Ok(Self { ranges: joined(ranges), named })
    }
}

impl fmt::Display for BenchSelection {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let written = |range: &RangeInclusive<usize>| match (*range.start(), *range.end()) {
            (first, OPEN) => format!("{first}.."),
            (first, last) if first == last => first.to_string(),
            (first, last) => format!("{first}..{last}"),
        };
        let of_dragon = |(name, range): &(String, RangeInclusive<usize>)| format!("{name}:{}", written(range));
        let texts = self.ranges.iter().map(written).chain(self.named.iter().map(of_dragon));
        formatter.pad(&texts.collect::<Vec<_>>().join(","))
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

/// Reads the name of a dragon, and a range of its benches behind a colon.
fn named_range(text: &str) -> Option<(String, RangeInclusive<usize>)> {
    let (name, benches) = text.split_once(':')?;
    let is_name = |char: char| char.is_ascii_lowercase() || char.is_ascii_digit() || char == '-';
    let is_named = !name.is_empty() && name.chars().all(is_name);
    range(benches).filter(|_| is_named).map(|range| (name.to_owned(), range))
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
