//! An upper bound on the least clearance of all pairs at each travel, from the pieces of a search.
//!
//! Each piece bounds the clearance of one pair on an interval. The least of the bounds at a travel bounds the least clearance there.
//! The bounds are painted from the lowest to the highest on the intervals that are still without one.

use crate::clearance::Piece;
use crate::dragon::Meter;

/// Upper bounds on the least clearance, on intervals of travel.
#[derive(Clone, Debug)]
pub(super) struct Ceiling {
    /// The ends of the intervals, in order.
    cuts_m: Vec<f64>,
    /// The bound on each interval; infinite without a piece.
    most_m: Vec<f64>,
}

impl Ceiling {
    /// The bounds of these pieces; `None` once the meter's question is cancelled.
    pub(super) fn of(pieces: &[Piece], meter: &Meter) -> Option<Self> {
        if meter.is_cancelled() {
            return None;
        }
        let mut cuts_m: Vec<f64> = pieces.iter().flat_map(|piece| piece.travels_m).collect();
        cuts_m.sort_unstable_by(f64::total_cmp);
        cuts_m.dedup();
        if meter.is_cancelled() {
            return None;
        }
        let mut lowest_first: Vec<&Piece> = pieces.iter().collect();
        lowest_first.sort_by(|one, other| one.bounds_m[1].total_cmp(&other.bounds_m[1]));
        let mut most_m = vec![f64::INFINITY; cuts_m.len()];
        // The first interval without a bound, from each interval on.
        let mut free: Vec<usize> = (0..=cuts_m.len()).collect();
        for piece in lowest_first {
            if meter.is_cancelled() {
                return None;
            }
            let [from, to] = piece.travels_m.map(|end_m| cuts_m.partition_point(|&cut_m| cut_m < end_m));
            let mut at = first_free(&mut free, from);
            while at < to {
                most_m[at] = piece.bounds_m[1];
                free[at] = at + 1;
                at = first_free(&mut free, at);
            }
        }
        Some(Self { cuts_m, most_m })
    }

    /// A bound on the least clearance at each travel of an interval; infinite if there is none.
    pub(super) fn over(&self, [from_m, to_m]: [f64; 2]) -> f64 {
        let from = self.cuts_m.partition_point(|&cut_m| cut_m <= from_m);
        let to = self.cuts_m.partition_point(|&cut_m| cut_m < to_m);
        let Some(first) = from.checked_sub(1).filter(|_| to < self.cuts_m.len()) else { return f64::INFINITY };
        self.most_m[first..to.max(from)].iter().copied().fold(f64::NEG_INFINITY, f64::max)
    }
}

/// The end of the row of intervals with a bound that begins at `at`. Rows that were passed are joined.
fn first_free(free: &mut [usize], mut at: usize) -> usize {
    while free[at] != at {
        free[at] = free[free[at]];
        at = free[at];
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;

    fn piece(travels_m: [f64; 2], most_m: f64) -> Piece {
        let bounds_m = [most_m - 1.0, most_m];
        Piece { benches: [0, 2], travels_m, places: travels_m, clearances_m: [most_m; 2], bounds_m, is_rigid: false }
    }

    #[test]
    fn the_lowest_bound_counts_at_each_travel() {
        let pieces = [piece([0.0, 4.0], 3.0), piece([1.0, 2.0], 1.0), piece([1.5, 3.0], 2.0)];
        let ceiling = Ceiling::of(&pieces, &Meter::unlimited()).expect("nobody cancels it");
        let bounds = [[0.0, 1.0], [1.0, 2.0], [1.2, 1.4], [2.0, 3.0], [1.2, 2.5], [0.5, 2.0], [3.0, 4.0]];
        assert_eq!(bounds.map(|span_m| ceiling.over(span_m)), [3.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0]);
        assert_eq!([[-1.0, 1.0], [3.5, 4.5]].map(|span_m| ceiling.over(span_m)), [f64::INFINITY; 2]);
    }
}
