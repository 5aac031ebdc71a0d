//! How near any two benches ever come.
//!
//! *Method.* Branch and bound on all cores: the clearances at the ends of all strides bound the least one from above, and
//! what the boards may cover in between bounds each pair's from below. Ways on which the lower bound stays over the least
//! clearance found so far are done, others are halved, and what is left of them is refined by Brent's method. Of the
//! pairs that stand one after the other in the same place only the first is looked at.
//!
//! *Guarantee.* The result is the clearance of a pair at a travel, the least of that valley to rounding, and nothing
//! outside the pieces left over falls under it. That no pair has two valleys within one piece rests on the pieces being
//! 1/256 of a link's length.

use std::sync::atomic::{AtomicU64, Ordering};

use super::cores::on_all_cores;
use super::peak::peak;
use crate::dragon::{ApproachSearch, Dragon, PairClearance, Pairs, Piece};

/// Travel to which a least clearance is refined, in metres; the clearance is then right to rounding.
const TOLERANCE_M: f64 = 1e-11;

/// Strides that a core takes at a time.
const STRIDES_AT_A_TIME: usize = 16;

/// Two benches where they come nearest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestApproach {
    /// Travel of the head.
    pub travel_m: f64,
    /// The benches, their clearance and where.
    pub pair: PairClearance,
}

impl ClosestApproach {
    pub(super) fn at(dragon: &Dragon, benches: [usize; 2], travel_m: f64) -> Self {
        let approach = dragon.approach(benches, travel_m);
        let pair = PairClearance { benches, clearance_m: approach.clearance_m, point: approach.point };
        Self { travel_m, pair }
    }

    /// The valley of a pair's clearance on a short way.
    pub(super) fn between(dragon: &Dragon, benches: [usize; 2], from_m: f64, to_m: f64) -> Self {
        let nearness = |travel_m| -dragon.approach(benches, travel_m).clearance_m;
        Self::at(dragon, benches, peak(from_m, to_m, TOLERANCE_M, nearness).at)
    }
}

/// Where two benches come nearest with the head between two travels of the run; none with fewer than three benches. Of
/// equal clearances the first.
///
/// `progress` hears of the share of the work that is done, from any thread.
pub fn least_clearance(
    dragon: &Dragon,
    from_travel_m: f64,
    to_travel_m: f64,
    progress: impl Fn(f64) + Sync,
) -> Option<ClosestApproach> {
    if dragon.dimensions().benches() < 3 {
        return None;
    }
    let strides_m = ApproachSearch::strides(dragon, from_travel_m, to_travel_m);
    let stretches = stretches(&strides_m);
    // Each is looked at twice.
    let look = 0.5 / stretches.len() as f64;
    let at_ends = on_all_cores(stretches.len(), |stretch| {
        let stretch_m = stretches[stretch];
        let mut search = ApproachSearch::new(dragon, Pairs::UnrepeatedSince(from_travel_m), stretch_m[0]);
        let nearest = stretch_m.iter().filter_map(|&travel_m| {
            search.stand(travel_m);
            Some(ClosestApproach { travel_m, pair: search.nearest()? })
        });
        let nearest = nearest.reduce(nearer);
        progress(look);
        nearest
    });
    let start = in_valley(dragon, at_ends.into_iter().flatten().reduce(nearer)?, &strides_m);
    let least_m = Least::new(start.pair.clearance_m);
    let valleys = on_all_cores(stretches.len(), |stretch| {
        let stretch_m = stretches[stretch];
        let mut valley = None;
        let mut search = ApproachSearch::new(dragon, Pairs::UnrepeatedSince(from_travel_m), stretch_m[0]);
        for &to_m in &stretch_m[1..] {
            search.walk(to_m, &|| least_m.get(), &mut |Piece { benches, travels_m: [from_m, to_m], .. }| {
                let found = ClosestApproach::between(dragon, benches, from_m, to_m);
                least_m.lower(found.pair.clearance_m);
                valley = Some(valley.map_or(found, |valley| nearer(valley, found)));
            });
        }
        progress(look);
        valley
    });
    Some(valleys.into_iter().flatten().fold(start, nearer))
}

/// The valley that the nearest approach at a stride's end lies in, so that the search begins with a low limit.
fn in_valley(dragon: &Dragon, nearest: ClosestApproach, strides_m: &[f64]) -> ClosestApproach {
    let behind = strides_m.partition_point(|&end_m| end_m < nearest.travel_m);
    let (from_m, to_m) = (strides_m[behind.saturating_sub(1)], strides_m[(behind + 1).min(strides_m.len() - 1)]);
    nearer(nearest, ClosestApproach::between(dragon, nearest.pair.benches, from_m, to_m))
}

/// The strides' ends in stretches for one core at a time, each of which begins where the one before it ends.
pub(super) fn stretches(strides_m: &[f64]) -> Vec<&[f64]> {
    let count = (strides_m.len() - 1).div_ceil(STRIDES_AT_A_TIME);
    let end = |stretch: usize| (stretch * STRIDES_AT_A_TIME).min(strides_m.len() - 1);
    (0..count).map(|stretch| &strides_m[end(stretch)..=end(stretch + 1)]).collect()
}

/// The nearer of two, the first where they are as near.
fn nearer(first: ClosestApproach, second: ClosestApproach) -> ClosestApproach {
    if second.pair.clearance_m < first.pair.clearance_m { second } else { first }
}

/// The least clearance that any core has found so far.
struct Least(AtomicU64);

impl Least {
    fn new(clearance_m: f64) -> Self {
        Self(AtomicU64::new(clearance_m.to_bits()))
    }

    fn get(&self) -> f64 {
        f64::from_bits(self.0.load(Ordering::Relaxed))
    }

    fn lower(&self, clearance_m: f64) {
        let lower = |least: u64| (clearance_m < f64::from_bits(least)).then_some(clearance_m.to_bits());
        // Where it is not lower, nothing is to be stored.
        let _ = self.0.fetch_update(Ordering::Relaxed, Ordering::Relaxed, lower);
    }
}
