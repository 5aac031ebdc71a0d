//! Ground on which body benches may be near each other.
//!
//! The handles behind a handle depend on its place alone, and all body links are alike. So the place x of the front handle of a
//! bench, and the number of benches to the other one, determine a pair of body benches. A pair that is not near at x is near with no
//! other benches at x either. So a search of the pairs with a leading bench finds the ground on which pairs behind them may be
//! near when they get there.

use std::collections::BTreeMap;

use super::approach_search::Piece;
use super::pose::Pose;

/// Places of the front handle at which pairs of body benches may be near, as ordered intervals of the parameter for each number of
/// benches from the front bench of a pair to the other one.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct NearGround {
    by_offset: BTreeMap<usize, Vec<[f64; 2]>>,
}

impl NearGround {
    /// The ground of the pairs of body benches among these pieces.
    pub(crate) fn of<'a>(pieces: impl Iterator<Item = &'a Piece>) -> Self {
        let mut by_offset: BTreeMap<usize, Vec<[f64; 2]>> = BTreeMap::new();
        for Piece { benches: [first, second], places: [from, to], .. } in pieces {
            if *first > 0 {
                // A place differs by rounding when another bench gets there.
                let spare = to - from;
                by_offset.entry(second - first).or_default().push([from - spare, to + spare]);
            }
        }
        by_offset.values_mut().for_each(join);
        Self { by_offset }
    }

    /// Whether no pair is near anywhere.
    pub(crate) fn is_empty(&self) -> bool {
        self.by_offset.is_empty()
    }

    /// The pairs of body benches behind the leading ones whose front handle is on this ground somewhere between two poses.
    pub(super) fn pairs(&self, earlier: &Pose, later: &Pose) -> Vec<[usize; 2]> {
        let benches = earlier.boards.len();
        let mut pairs = Vec::new();
        for (&offset, intervals) in &self.by_offset {
            let mut next = 2;
            // From the head backwards, so that each bench counts once.
            for &[from, to] in intervals.iter().rev() {
                let first = next.max(earlier.handles.partition_point(|handle| handle.parameter > to));
                next = later.handles.partition_point(|handle| handle.parameter >= from).max(first);
                let last = next.min(benches.saturating_sub(offset));
                pairs.extend((first..last).map(|bench| [bench, bench + offset]));
            }
        }
        pairs
    }
}

/// Orders intervals, and joins those that meet.
fn join(intervals: &mut Vec<[f64; 2]>) {
    intervals.sort_by(|one, other| one[0].total_cmp(&other[0]));
    intervals.dedup_by(|later, earlier| {
        let meet = later[0] <= earlier[1];
        if meet {
            earlier[1] = earlier[1].max(later[1]);
        }
        meet
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_that_meet_are_one() {
        let mut intervals = vec![[3.0, 4.0], [0.0, 1.0], [1.0, 2.0], [0.5, 0.7]];
        join(&mut intervals);
        assert_eq!(intervals, [[0.0, 2.0], [3.0, 4.0]]);
    }
}
