//! The least clearance along a run, and its near misses.
//!
//! *Method.* A near miss is a local minimum of the least clearance of all pairs, so it is a local minimum of the clearance of
//! the deciding pair. Intervals on which the bounds of `clearance::approach_search` keep a pair above the limit are done. The
//! rest is in pieces of 1/256 of a link's length. On the pieces, Brent's method refines the minima of each pair. A minimum is
//! kept if no other pair is nearer there. The bounds of other pairs' pieces rule out most minima before.
//!
//! Once every handle has reached the place of the handle before it, pairs without a leading bench repeat earlier positions of other
//! pairs. These are evaluated only on the ground on which the others came under the limit. Where the bounds of a coil keep all
//! pairs above the limit, nothing is evaluated.
//!
//! On a line or an arc a clearance may stay at its minimum for a while. Such a plateau counts once, at its beginning, if no
//! pair is as near just before. So the plateaus of further pairs that come to the same place do not count again.
//!
//! *Guarantee.* Every interval on which a pair comes under the limit is evaluated, however short. A near miss is exact to
//! rounding, about 10⁻¹² m. Two minima of the same pair within one piece count as one. The travel at which a plateau begins is
//! exact to one piece.

use std::collections::BTreeMap;

use super::ceiling::Ceiling;
use super::cores::on_all_cores;
use super::least_clearance::ClosestApproach;
use super::strides::Strides;
use crate::clearance::{ApproachSearch, NearGround, Pairs, Piece, ROUNDING_M, clear_to_m};
use crate::dragon::{Dragon, Meter, Spent};

/// Travel in metres within which minima count as one. Pairs with equal clearances differ only by rounding.
const SAME_M: f64 = 1e-5;

/// Number of travels that a core takes at a time.
const TRAVELS_AT_A_TIME: usize = 16;

/// Approaches found on an interval, or on the part of it that the meter's limit allowed.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// The approaches, in order of travel.
    pub approaches: Vec<ClosestApproach>,
    /// Travel up to which the interval was evaluated; `None` if all of it was.
    pub ends_early_m: Option<f64>,
}

/// Finds the two nearest benches with the head at each of these travels of the run; none with fewer than three benches.
///
/// `progress` is called after every travel, from any thread.
pub fn clearance_profile(dragon: &Dragon, travels_m: &[f64], progress: impl Fn() + Sync) -> Found {
    let chunks: Vec<&[f64]> = travels_m.chunks(TRAVELS_AT_A_TIME).collect();
    let points = on_all_cores(dragon.meter(), chunks.len(), |chunk, meter| {
        let chunk = chunks[chunk];
        let dragon = dragon.metered(meter);
        let mut search = ApproachSearch::new(&dragon, Pairs::All, chunk[0]);
        let point = |&travel_m: &f64| {
            search.stand(travel_m);
            progress();
            Some(ClosestApproach { travel_m, pair: search.nearest()? })
        };
        // A chunk that ends early does not count.
        chunk.iter().take_while(|_| !meter.is_spent()).filter_map(point).collect::<Vec<_>>()
    });
    let looked_at = (points.len() * TRAVELS_AT_A_TIME).min(travels_m.len());
    let last = looked_at.checked_sub(1).map_or(dragon.start_travel_m(), |last| travels_m[last]);
    Found {
        approaches: points.into_iter().flatten().collect(),
        ends_early_m: (looked_at < travels_m.len()).then_some(last),
    }
}

/// Finds the near misses between two travels of the head: every local minimum of the least clearance below `limit_m`, in order
/// of travel. No benches may touch in between.
///
/// If several pairs have equal clearances, as on an arc, the pair with the lowest indices is returned. `progress` receives the
/// share of the interval that each step completes, from any thread.
pub fn near_misses(
    dragon: &Dragon,
    from_travel_m: f64,
    to_travel_m: f64,
    limit_m: f64,
    progress: impl Fn(f64) + Sync,
) -> Found {
    if dragon.dimensions().benches() < 3 || from_travel_m == to_travel_m {
        return Found { approaches: Vec::new(), ends_early_m: None };
    }
    let meter = dragon.meter();
    // The work left of the other half is for refining the near misses.
    let looking = meter.half();
    let search = PieceSearch::new(dragon, [from_travel_m, to_travel_m], limit_m);
    let (pieces, mut reached_m) = search.pieces(&looking, &progress);
    meter.add(looking.done());
    let cancelled = Found { approaches: Vec::new(), ends_early_m: Some(from_travel_m) };
    let Some(ceiling) = Ceiling::of(&pieces, meter) else { return cancelled };
    let mut ways: BTreeMap<[usize; 2], Vec<Piece>> = BTreeMap::new();
    for piece in pieces {
        ways.entry(piece.benches).or_default().push(piece);
    }
    if meter.is_cancelled() {
        return cancelled;
    }
    let mut brackets: Vec<Bracket> = ways.values().flat_map(|way| brackets(way)).collect();
    brackets.retain(|bracket| ceiling.over(bracket.travels_m) >= bracket.least_m - 2.0 * ROUNDING_M);
    brackets.sort_by(|first, second| first.travels_m[0].total_cmp(&second.travels_m[0]));
    let valleys = on_all_cores(meter, brackets.len(), |bracket, meter| {
        brackets[bracket].near_miss(&dragon.metered(meter), limit_m)
    });
    // A near miss is reported only if everything before it was evaluated.
    reached_m = brackets.get(valleys.len()).map_or(reached_m, |bracket| bracket.travels_m[0].min(reached_m));
    let mut valleys: Vec<ClosestApproach> =
        valleys.into_iter().flatten().filter(|valley| valley.travel_m <= reached_m).collect();
    valleys.sort_by(|first, second| {
        let order = first.travel_m.total_cmp(&second.travel_m);
        order.then_with(|| first.pair.benches.cmp(&second.pair.benches))
    });
    valleys.dedup_by(|later, earlier| {
        let same = later.travel_m - earlier.travel_m <= SAME_M;
        if same {
            earlier.pair.benches = earlier.pair.benches.min(later.pair.benches);
        }
        same
    });
    Found { approaches: valleys, ends_early_m: (reached_m < to_travel_m).then_some(reached_m) }
}

/// A search for the pieces of an interval of travel on which a pair may come under a limit.
struct PieceSearch<'a> {
    dragon: &'a Dragon,
    strides: Strides,
    limit_m: f64,
    /// Travel before which no pair comes under the limit, by the bounds of the coil.
    clear_to_m: f64,
    pairs: Pairs,
}

impl<'a> PieceSearch<'a> {
    fn new(dragon: &'a Dragon, [from_m, to_m]: [f64; 2], limit_m: f64) -> Self {
        let clear_to_m = clear_to_m(dragon, limit_m);
        // If no pair comes under the limit up to the interval, none does that repeats a position from before.
        let since_m = if from_m <= clear_to_m { dragon.start_travel_m() } else { from_m };
        let strides = Strides::of(dragon, from_m, to_m);
        Self { dragon, strides, limit_m, clear_to_m, pairs: Pairs::UnrepeatedSince(since_m) }
    }

    /// The pieces, those of each pair in order of travel, and the travel up to which they are complete.
    fn pieces(&self, meter: &Meter, progress: &(impl Fn(f64) + Sync)) -> (Vec<Piece>, f64) {
        let part = 0.5 / self.strides.stretches() as f64;
        // The work left of the other half is for the pairs that repeat.
        let first = meter.half();
        let (mut pieces, reached_m) = self.on_stretches(&first, None, &|| progress(part));
        meter.add(first.done());
        let ground = NearGround::of(pieces.iter());
        if ground.is_empty() {
            progress(0.5);
            return (pieces, reached_m);
        }
        let (repeated, repeated_m) = self.on_stretches(meter, Some(&ground), &|| progress(part));
        pieces.extend(repeated);
        (pieces, reached_m.min(repeated_m))
    }

    /// The pieces of the pairs that do not repeat, or of those that do on a ground.
    fn on_stretches(
        &self,
        meter: &Meter,
        repeated: Option<&NearGround>,
        looked: &(impl Fn() + Sync),
    ) -> (Vec<Piece>, f64) {
        let stretches = on_all_cores(meter, self.strides.stretches(), |stretch, meter| {
            looked();
            self.of_stretch(&self.dragon.metered(meter), stretch, repeated)
        });
        let mut reached_m = self.strides.reached_m(stretches.len());
        let mut found = Vec::new();
        for pieces in stretches {
            let Ok(pieces) = pieces.map_err(|spent| reached_m = spent.reached_m) else { break };
            found.extend(pieces);
        }
        (found, reached_m)
    }

    fn of_stretch(&self, dragon: &Dragon, stretch: usize, repeated: Option<&NearGround>) -> Result<Vec<Piece>, Spent> {
        let ends_m = self.strides.stretch(stretch, dragon);
        let first = ends_m.partition_point(|&end_m| end_m <= self.clear_to_m).saturating_sub(1);
        let [from_m, to_m @ ..] = &ends_m[first..] else { return Ok(Vec::new()) };
        let mut pieces = Vec::new();
        if to_m.is_empty() {
            return Ok(pieces);
        }
        let mut search = ApproachSearch::new(dragon, self.pairs, *from_m);
        if let Some(ground) = repeated {
            search = search.of_repeated(ground);
        }
        for &to_m in to_m {
            search.walk(to_m, &|| self.limit_m, &mut |piece| pieces.push(piece))?;
        }
        Ok(pieces)
    }
}

/// An interval on which the clearance of a pair has a minimum, possibly at an end.
struct Bracket {
    benches: [usize; 2],
    travels_m: [f64; 2],
    /// Lower bound on the clearance.
    least_m: f64,
    /// Travel at which the clearance begins to stay at the minimum, if it stays there.
    plateau_m: Option<f64>,
}

/// The brackets of one pair's minima. `way` contains the pair's pieces in order of travel. Minima less deep than rounding do
/// not count.
fn brackets(way: &[Piece]) -> Vec<Bracket> {
    let mut brackets = Vec::new();
    for (i, piece) in way.iter().enumerate() {
        let (benches, [low_m, high_m]) = (piece.benches, piece.travels_m);
        let follows = i > 0 && way[i - 1].travels_m[1] == low_m;
        if !falls(piece) {
            if !follows && !piece.is_rigid {
                brackets.push(Bracket {
                    benches,
                    travels_m: piece.travels_m,
                    least_m: piece.bounds_m[0],
                    plateau_m: None,
                });
            }
            continue;
        }
        let contiguous = way[i..].windows(2).take_while(|ends| ends[1].travels_m[0] == ends[0].travels_m[1]);
        let mut behind = contiguous.map(|ends| &ends[1]).peekable();
        let (mut end_m, mut least_m, mut stays) = (high_m, piece.bounds_m[0], false);
        while let Some(level) = behind.next_if(|next| !falls(next) && !rises(next)) {
            end_m = level.travels_m[1];
            least_m = least_m.min(level.bounds_m[0]);
            stays |= level.is_rigid;
        }
        if behind.peek().is_none_or(|next| rises(next)) {
            if let Some(next) = behind.next() {
                (end_m, least_m) = (next.travels_m[1], least_m.min(next.bounds_m[0]));
            }
            let plateau_m = stays.then_some(high_m);
            brackets.push(Bracket { benches, travels_m: [low_m, end_m], least_m, plateau_m });
        }
    }
    brackets
}

fn falls(piece: &Piece) -> bool {
    piece.clearances_m[1] < piece.clearances_m[0] - ROUNDING_M
}

fn rises(piece: &Piece) -> bool {
    piece.clearances_m[1] > piece.clearances_m[0] + ROUNDING_M
}

impl Bracket {
    /// The minimum in the bracket; `None` if it is at an end, not below the limit, or if another pair is nearer there.
    fn near_miss(&self, dragon: &Dragon, limit_m: f64) -> Option<ClosestApproach> {
        let [from_m, to_m] = self.travels_m;
        let valley = match self.plateau_m {
            Some(plateau_m) => ClosestApproach::at(dragon, self.benches, plateau_m),
            None => ClosestApproach::between(dragon, self.benches, from_m, to_m),
        };
        let floor_m = valley.pair.clearance_m;
        let deep =
            |travel_m| ClosestApproach::at(dragon, self.benches, travel_m).pair.clearance_m > floor_m + ROUNDING_M;
        if floor_m >= limit_m || !deep(from_m) || !deep(to_m) {
            return None;
        }
        let nearest_m =
            |travel_m| ApproachSearch::new(dragon, Pairs::All, travel_m).nearest().map(|nearest| nearest.clearance_m);
        if self.plateau_m.is_some() && nearest_m(from_m)? <= floor_m + ROUNDING_M {
            return None;
        }
        (nearest_m(valley.travel_m)? >= floor_m - ROUNDING_M).then_some(valley)
    }
}
