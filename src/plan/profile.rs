//! How near benches are to each other as the dragon walks on.
//!
//! *Method.* A near miss is a local minimum of the least clearance of all pairs, and so one of the clearance of the pair
//! that decides it. Ways on which the bounds of `dragon::approach_search` keep a pair over the limit are done; on what
//! is left, pieces of 1/256 of a link's length, the minima of each pair are refined by Brent's method, and those stay at
//! which no other pair is nearer.
//!
//! *Guarantee.* Every time that any pair comes under the limit, however shortly, is looked at. A near miss is right to
//! rounding, some 10⁻¹² m. Two of the same pair that lie within one piece are taken for one.

use std::collections::BTreeMap;

use super::cores::on_all_cores;
use super::least_clearance::{ClosestApproach, stretches};
use crate::dragon::{ApproachSearch, Dragon, Pairs, Piece};

/// Rounding of a clearance in metres: valleys that are not this deep are none.
const ROUNDING_M: f64 = 1e-12;

/// Travel in metres within which valleys are one: that of pairs as near as each other, told apart by rounding alone.
const SAME_M: f64 = 1e-5;

/// Travels that a core takes at a time.
const TRAVELS_AT_A_TIME: usize = 16;

/// The nearest two benches with the head at each of these travels of the run; none with fewer than three benches.
///
/// `progress` hears of every travel that is done, from any thread.
pub fn clearance_profile(dragon: &Dragon, travels_m: &[f64], progress: impl Fn() + Sync) -> Vec<ClosestApproach> {
    let chunks: Vec<&[f64]> = travels_m.chunks(TRAVELS_AT_A_TIME).collect();
    let points = on_all_cores(chunks.len(), |chunk| {
        let chunk = chunks[chunk];
        let mut search = ApproachSearch::new(dragon, Pairs::All, chunk[0]);
        let point = |&travel_m: &f64| {
            search.stand(travel_m);
            progress();
            Some(ClosestApproach { travel_m, pair: search.nearest()? })
        };
        chunk.iter().filter_map(point).collect::<Vec<_>>()
    });
    points.into_iter().flatten().collect()
}

/// The near misses with the head between two travels of the run, between which no benches touch: every local minimum of
/// the least clearance under `limit_m`, in order of travel.
///
/// Where several pairs are as near as each other, as they are on an arc, the one with the lowest indices counts.
/// `progress` hears of the share of the way that is done, from any thread.
pub fn near_misses(
    dragon: &Dragon,
    from_travel_m: f64,
    to_travel_m: f64,
    limit_m: f64,
    progress: impl Fn(f64) + Sync,
) -> Vec<ClosestApproach> {
    if dragon.dimensions().benches() < 3 {
        return Vec::new();
    }
    let strides_m = ApproachSearch::strides(dragon, from_travel_m, to_travel_m);
    let stretches = stretches(&strides_m);
    let pieces = on_all_cores(stretches.len(), |stretch| {
        let stretch_m = stretches[stretch];
        let mut pieces = Vec::new();
        let mut search = ApproachSearch::new(dragon, Pairs::All, stretch_m[0]);
        for &to_m in &stretch_m[1..] {
            search.walk(to_m, &|| limit_m, &mut |piece| pieces.push(piece));
        }
        progress(1.0 / stretches.len() as f64);
        pieces
    });
    let mut ways: BTreeMap<[usize; 2], Vec<Piece>> = BTreeMap::new();
    for piece in pieces.into_iter().flatten() {
        ways.entry(piece.benches).or_default().push(piece);
    }
    let brackets: Vec<Bracket> = ways.values().flat_map(|way| brackets(way)).collect();
    let valleys = on_all_cores(brackets.len(), |bracket| brackets[bracket].near_miss(dragon, limit_m));
    let mut valleys: Vec<ClosestApproach> = valleys.into_iter().flatten().collect();
    valleys.sort_by(|first, second| first.travel_m.total_cmp(&second.travel_m));
    valleys.dedup_by(|later, earlier| {
        let same = later.travel_m - earlier.travel_m <= SAME_M;
        if same {
            earlier.pair.benches = earlier.pair.benches.min(later.pair.benches);
        }
        same
    });
    valleys
}

/// A short way on which the clearance of a pair has a minimum, perhaps at an end.
struct Bracket {
    benches: [usize; 2],
    travels_m: [f64; 2],
}

/// The brackets of a pair's minima, from its pieces in order of travel.
fn brackets(way: &[Piece]) -> Vec<Bracket> {
    let mut brackets = Vec::new();
    for (i, piece) in way.iter().enumerate() {
        let [low_m, high_m] = piece.travels_m;
        let after = way.get(i + 1).filter(|after| after.travels_m[0] == high_m);
        let follows = i > 0 && way[i - 1].travels_m[1] == low_m;
        let falls = piece.clearances_m[1] < piece.clearances_m[0];
        if !follows && !falls {
            brackets.push(Bracket { benches: piece.benches, travels_m: piece.travels_m });
        }
        if falls && after.is_none_or(|after| after.clearances_m[1] >= after.clearances_m[0]) {
            let end_m = after.map_or(high_m, |after| after.travels_m[1]);
            brackets.push(Bracket { benches: piece.benches, travels_m: [low_m, end_m] });
        }
    }
    brackets
}

impl Bracket {
    /// The minimum, if it lies within, is under the limit, and no other pair is nearer there.
    fn near_miss(&self, dragon: &Dragon, limit_m: f64) -> Option<ClosestApproach> {
        let [from_m, to_m] = self.travels_m;
        let valley = ClosestApproach::between(dragon, self.benches, from_m, to_m);
        let floor_m = valley.pair.clearance_m;
        let deep =
            |travel_m| ClosestApproach::at(dragon, self.benches, travel_m).pair.clearance_m > floor_m + ROUNDING_M;
        if floor_m >= limit_m || !deep(from_m) || !deep(to_m) {
            return None;
        }
        let nearest = ApproachSearch::new(dragon, Pairs::All, valley.travel_m).nearest()?;
        (nearest.clearance_m >= floor_m - ROUNDING_M).then_some(valley)
    }
}
