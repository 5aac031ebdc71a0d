//! Which benches are near to each other.
//!
//! Neighbours share a hinge and are never a pair. Candidates come from a grid over the boards' centres; a candidate's
//! exact clearance is worked out only if neither its circumscribed circles nor the separating axis test already rule it
//! out.

use glam::DVec2;

use super::board::Board;
use super::grid::Grid;

/// Two benches and how near they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairClearance {
    /// Lower index first; not neighbours.
    pub benches: [usize; 2],
    /// Distance of the boards where they are apart, minus the penetration depth where they overlap.
    pub clearance_m: f64,
    /// Midway between the nearest points; inside the overlap if there is one.
    pub point: DVec2,
}

impl PairClearance {
    pub(super) fn of(boards: &[Board], benches: [usize; 2]) -> Self {
        let approach = boards[benches[0]].approach(&boards[benches[1]]);
        Self { benches, clearance_m: approach.clearance_m, point: approach.point }
    }

    pub(super) fn order(&self, other: &Self) -> std::cmp::Ordering {
        self.clearance_m.total_cmp(&other.clearance_m).then(self.benches.cmp(&other.benches))
    }
}

/// Searches boards for near pairs. Keeps its buffers, so that once it has seen as many boards and as many near pairs it
/// allocates nothing.
#[derive(Clone, Debug, Default)]
pub struct ClearanceSearch {
    centres: Vec<DVec2>,
    grid: Grid,
    found: Vec<PairClearance>,
    last_nearest: Option<[usize; 2]>,
}

impl ClearanceSearch {
    /// Every pair with a clearance of at most `reach_m`, nearest first, equal ones by their indices.
    pub fn within(&mut self, boards: &[Board], reach_m: f64) -> &[PairClearance] {
        let Self { centres, grid, found, .. } = self;
        found.clear();
        sort_into(grid, centres, boards, reach_m);
        grid.for_each_pair(|first, second| {
            if may_be_within(boards, first, second, reach_m) {
                let pair = PairClearance::of(boards, [first, second]);
                if pair.clearance_m <= reach_m {
                    found.push(pair);
                }
            }
        });
        found.sort_unstable_by(PairClearance::order);
        found
    }

    /// The pair with the least clearance, of equal ones the one with the lowest indices; none with fewer than three
    /// boards.
    ///
    /// The clearance of the last call's pair bounds the least one, so the search is quickest while boards move little.
    pub fn nearest(&mut self, boards: &[Board]) -> Option<PairClearance> {
        if boards.len() < 3 {
            return None;
        }
        let guess = self.last_nearest.filter(|benches| benches[1] < boards.len()).unwrap_or([0, 2]);
        let mut nearest = PairClearance::of(boards, guess);
        sort_into(&mut self.grid, &mut self.centres, boards, nearest.clearance_m);
        self.grid.for_each_pair(|first, second| {
            if may_be_within(boards, first, second, nearest.clearance_m) {
                let pair = PairClearance::of(boards, [first, second]);
                if pair.order(&nearest).is_lt() {
                    nearest = pair;
                }
            }
        });
        self.last_nearest = Some(nearest.benches);
        Some(nearest)
    }
}

/// Fills the grid so that boards with a clearance of at most `reach_m` lie in neighbouring cells.
fn sort_into(grid: &mut Grid, centres: &mut Vec<DVec2>, boards: &[Board], reach_m: f64) {
    centres.clear();
    centres.extend(boards.iter().map(|board| board.centre));
    let radius_m = boards.iter().map(Board::radius_m).fold(0.0, f64::max);
    grid.fill(centres, 2.0 * radius_m + reach_m.max(0.0));
}

/// Whether two benches are a pair whose clearance may be `reach_m` or less, by bounds that never exceed the clearance.
fn may_be_within(boards: &[Board], first: usize, second: usize, reach_m: f64) -> bool {
    let (ours, theirs) = (&boards[first], &boards[second]);
    let sum_m = ours.radius_m() + theirs.radius_m() + reach_m.max(0.0);
    second > first + 1
        && ours.centre.distance_squared(theirs.centre) <= sum_m * sum_m
        && ours.gap_across_m(theirs) <= reach_m
        && ours.separation(theirs).0 <= reach_m
}
