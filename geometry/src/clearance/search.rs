//! Finds benches near each other.
//!
//! Neighbours share a hinge and are never a pair. Candidates are in a list of the pairs that may be near, which is reused while
//! it is valid. The exact clearance of a candidate is calculated only if the gaps along the boards' own axes do not rule it
//! out.

use glam::DVec2;

use super::near_pairs::{MAX_PAIRS, NearPairs};
use crate::dragon::board::{Approach, Board};
use crate::formation::Layout;

/// Largest difference of equal clearances, in metres. The same pose differs by rounding, about 10⁻¹² m, between a solved chain, a
/// stepped one and a part of one. So the order of pairs that lie alike, as on two laps of a circle, does not depend on rounding.
const EQUAL_M: f64 = 1e-10;

/// Two benches and their clearance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairClearance {
    /// Indices of two benches that are not neighbours, the lower one first.
    pub benches: [usize; 2],
    /// Distance of the boards if they are apart, minus the penetration depth if they overlap.
    pub clearance_m: f64,
    /// Midpoint between the nearest points; a point inside the overlap if the boards overlap.
    pub point: DVec2,
}

impl PairClearance {
    pub(crate) fn new(benches: [usize; 2], Approach { clearance_m, point, .. }: Approach) -> Self {
        Self { benches, clearance_m, point }
    }

    pub(super) fn of(boards: &[Board], benches: [usize; 2]) -> Self {
        Self::new(benches, boards[benches[0]].approach(&boards[benches[1]]))
    }

    /// The same pair of a dragon whose first bench has this number.
    pub(super) fn numbered_from(self, begin: usize) -> Self {
        Self { benches: self.benches.map(|bench| begin + bench), ..self }
    }

    /// Whether this pair is nearer than another one, by more than rounding.
    pub(super) fn is_nearer(&self, other: &Self) -> bool {
        self.clearance_m < other.clearance_m - EQUAL_M
    }
}

/// Searches boards for near pairs. It reuses its buffers: it allocates nothing after a search with as many boards and as many
/// near pairs.
///
/// The result is a function of the boards alone. The search is fastest if the boards have moved little since the last search.
/// Then most pairs are known to be apart (see `near_pairs`), and the last nearest pair bounds the least clearance.
#[derive(Clone, Debug, Default)]
pub struct ClearanceSearch {
    near: NearPairs,
    found: Vec<PairClearance>,
    last_nearest: Option<[usize; 2]>,
}

impl ClearanceSearch {
    /// A search of the boards of the first benches of a formation. The default is that of one dragon, of any number of benches.
    pub fn of(layout: &Layout) -> Self {
        Self { near: NearPairs::of(layout), ..Self::default() }
    }

    /// The same search, whose list is reduced to the `pairs` nearest pairs once it has more than twice as many. The default is
    /// about two million.
    ///
    /// # Panics
    /// Panics if `pairs` is 0 or above 2 097 152.
    #[must_use]
    pub fn with_room(self, pairs: usize) -> Self {
        assert!((1..=MAX_PAIRS).contains(&pairs), "room for {pairs} pairs, must be from 1 to {MAX_PAIRS}");
        Self { near: self.near.with_room(pairs), ..self }
    }

    /// Every pair with a clearance of at most `reach_m`, nearest first. Pairs whose clearances differ only by rounding are in
    /// the order of their indices. If there are more than about two million, only the nearest of them.
    pub fn within(&mut self, boards: &[Board], reach_m: f64) -> &[PairClearance] {
        self.found.clear();
        if self.near.layout().first_pair(boards.len()).is_some() {
            self.near.note(boards);
            self.collect(boards, reach_m, reach_m);
        }
        &self.found
    }

    /// The same; `None`, without a search, if the list has no room for all of them.
    pub(super) fn all_within(&mut self, boards: &[Board], reach_m: f64) -> Option<&[PairClearance]> {
        self.found.clear();
        if self.near.layout().first_pair(boards.len()).is_some() {
            self.near.note(boards);
            if !self.near.reaches(reach_m) {
                self.near.renew(boards, reach_m);
            }
            if !self.near.reaches(reach_m) {
                return None;
            }
            self.collect(boards, reach_m, reach_m);
        }
        Some(&self.found)
    }

    /// Returns the steps of work since the last call.
    pub(crate) fn take_steps(&mut self) -> u64 {
        self.near.take_steps() + self.found.len() as u64
    }

    /// The pair with the least clearance; `None` without a pair. Of pairs whose clearances differ only by rounding,
    /// at most 10⁻¹⁰ m, it is that with the lowest indices.
    pub fn nearest(&mut self, boards: &[Board]) -> Option<PairClearance> {
        self.nearest_and_within(boards, f64::NEG_INFINITY).first().copied()
    }

    /// The nearest pair at any distance, and every other pair with a clearance of at most `reach_m`. It combines
    /// [`nearest`](Self::nearest) and [`within`](Self::within) in one search. Empty without a pair.
    pub fn nearest_and_within(&mut self, boards: &[Board], reach_m: f64) -> &[PairClearance] {
        self.found.clear();
        if let Some(first) = self.near.layout().first_pair(boards.len()) {
            self.near.note(boards);
            let last = self.last_nearest.filter(|benches| benches[1] < boards.len()).unwrap_or(first);
            let mut limit_m = reach_m.max(boards[last[0]].clearance(&boards[last[1]]) + EQUAL_M);
            if !self.near.reaches(limit_m) {
                limit_m = reach_m.max((self.least_clearance_of(boards, last[0]) + EQUAL_M).min(limit_m));
            }
            self.collect(boards, reach_m, limit_m);
            self.last_nearest = self.found.first().map(|pair| pair.benches);
            let nearest = self.last_nearest;
            self.found.retain(|pair| pair.clearance_m <= reach_m || Some(pair.benches) == nearest);
        }
        &self.found
    }

    /// The least clearance of one bench's pairs. If boards lie close, it is hardly more than the least of all.
    fn least_clearance_of(&self, boards: &[Board], bench: usize) -> f64 {
        let mut least_m = f64::INFINITY;
        for other in (0..boards.len()).filter(|&other| self.near.layout().is_pair(other, bench)) {
            // The order is fixed, because rounding may depend on it.
            let (first, second) = (&boards[bench.min(other)], &boards[bench.max(other)]);
            if first.gap_m(second) < least_m {
                least_m = first.clearance(second).min(least_m);
            }
        }
        least_m
    }

    /// Finds all pairs within `reach_m`. Without such pairs it finds some pairs within `limit_m`, including the nearest.
    fn collect(&mut self, boards: &[Board], reach_m: f64, mut limit_m: f64) {
        let Self { near, found, .. } = self;
        if !near.reaches(limit_m) {
            near.renew(boards, limit_m);
        }
        for pair in near.list() {
            if pair.gap_m > limit_m + near.slack_m() {
                continue;
            }
            let benches = pair.benches();
            if boards[benches[0]].gap_m(&boards[benches[1]]) > limit_m + near.rounding_m() {
                continue;
            }
            let pair = PairClearance::of(boards, benches);
            if pair.clearance_m <= limit_m {
                limit_m = limit_m.min(reach_m.max(pair.clearance_m + EQUAL_M));
                found.push(pair);
            }
        }
        sort(found);
    }
}

/// Sorts pairs by their clearances, and by their indices where the clearances differ only by rounding.
fn sort(pairs: &mut [PairClearance]) {
    pairs.sort_unstable_by(|one, other| one.clearance_m.total_cmp(&other.clearance_m));
    let mut rest = pairs;
    while let Some(&first) = rest.first() {
        let equal = rest.partition_point(|pair| !first.is_nearer(pair));
        let (alike, further) = std::mem::take(&mut rest).split_at_mut(equal);
        alike.sort_unstable_by_key(|pair| pair.benches);
        rest = further;
    }
}
