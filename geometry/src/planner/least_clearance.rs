//! How near any two benches ever come.
//!
//! *Method.* Branch and bound on all cores: the clearances at the ends of all strides bound the least one from above, and
//! what the boards may cover in between bounds each pair's from below. Ways on which the lower bound stays over the least
//! clearance found so far are done, others are halved, and what is left of them is refined by Brent's method. Of the
//! pairs that stand one after the other in the same parameter only the first is looked at.
//!
//! *Guarantee.* The result is the clearance of a pair at a travel, the least of that valley to rounding, and nothing
//! outside the pieces left over falls under it. That no pair has two valleys within one piece rests on the pieces being
//! 1/256 of a link's length.

use std::cell::Cell;

use super::cores::on_all_cores;
use super::strides::Strides;
use crate::clearance::{ApproachSearch, PairClearance, Pairs};
use crate::dragon::{Dragon, Spent};
use crate::numerics::peak;

/// Travel to which a least clearance is refined, in metres; the clearance is then right to rounding.
const TOLERANCE_M: f64 = 1e-11;

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
        Self { travel_m, pair: PairClearance::new(benches, dragon.approach(benches, travel_m)) }
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
///
/// # Errors
/// The dragon's meter is spent before all of the way is looked at.
pub fn least_clearance(
    dragon: &Dragon,
    from_travel_m: f64,
    to_travel_m: f64,
    progress: impl Fn(f64) + Sync,
) -> Result<Option<ClosestApproach>, Spent> {
    if dragon.dimensions().benches() < 3 {
        return Ok(None);
    }
    let search = LeastClearance {
        dragon,
        pairs: Pairs::UnrepeatedSince(from_travel_m),
        strides: Strides::of(dragon, from_travel_m, to_travel_m),
    };
    // Each stretch is looked at twice.
    let look = 0.5 / search.strides.stretches() as f64;
    let start = search.at_ends(&|| progress(look))?;
    search.in_between(start, &|| progress(look)).map(Some)
}

struct LeastClearance<'a> {
    dragon: &'a Dragon,
    pairs: Pairs,
    strides: Strides,
}

impl LeastClearance<'_> {
    /// The nearest approach at the ends of all strides, and the valley that it lies in, so that the search between them
    /// begins with a low limit.
    fn at_ends(&self, looked: &(impl Fn() + Sync)) -> Result<ClosestApproach, Spent> {
        let nearest = self.on_stretches(|dragon, search, ends_m| {
            let nearest = ends_m.iter().filter_map(|&travel_m| {
                // A stretch that is broken off does not count.
                if search.meter().is_spent() {
                    return None;
                }
                search.stand(travel_m);
                Some(ClosestApproach { travel_m, pair: search.nearest()? })
            });
            let nearest = nearest.reduce(nearer).ok_or(dragon.meter().spent(ends_m[0]))?;
            looked();
            Ok(nearest)
        })?;
        let nearest = nearest.into_iter().reduce(nearer).expect("a way has an end");
        let [from_m, to_m] = self.strides.around(nearest.travel_m);
        Ok(nearer(nearest, ClosestApproach::between(self.dragon, nearest.pair.benches, from_m, to_m)))
    }

    /// The nearest approach anywhere on the way, one of which is known. What other cores have found meanwhile is not asked,
    /// so that the work is the same every time.
    fn in_between(&self, start: ClosestApproach, looked: &(impl Fn() + Sync)) -> Result<ClosestApproach, Spent> {
        let valleys = self.on_stretches(|dragon, search, ends_m| {
            let least = Cell::new(start);
            for &to_m in &ends_m[1..] {
                search.walk(to_m, &|| least.get().pair.clearance_m, &mut |piece| {
                    let [from_m, to_m] = piece.travels_m;
                    least.set(nearer(least.get(), ClosestApproach::between(dragon, piece.benches, from_m, to_m)));
                })?;
            }
            looked();
            Ok(least.get())
        })?;
        Ok(valleys.into_iter().fold(start, nearer))
    }

    /// The results of work on every stretch, on all cores.
    fn on_stretches<Answer: Send>(
        &self,
        work: impl Fn(&Dragon, &mut ApproachSearch<'_>, &[f64]) -> Result<Answer, Spent> + Sync,
    ) -> Result<Vec<Answer>, Spent> {
        let (meter, count) = (self.dragon.meter(), self.strides.stretches());
        let answers = on_all_cores(meter, count, |stretch, meter| {
            let dragon = self.dragon.metered(meter);
            let ends_m = self.strides.stretch(stretch, &dragon);
            let mut search = ApproachSearch::new(&dragon, self.pairs, ends_m[0]);
            work(&dragon, &mut search, &ends_m)
        });
        if answers.len() < count {
            return Err(meter.spent(self.strides.reached_m(answers.len())));
        }
        answers.into_iter().collect()
    }
}

/// The nearer of two, the first where they are as near.
fn nearer(first: ClosestApproach, second: ClosestApproach) -> ClosestApproach {
    if second.pair.clearance_m < first.pair.clearance_m { second } else { first }
}
