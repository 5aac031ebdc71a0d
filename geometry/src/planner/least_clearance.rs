//! The least clearance of any two benches over an interval of travel.
//!
//! *Method.* The nearest benches at some travels, and the minimum beside them, bound the least clearance from above. Then the
//! contact search looks for the first pair that comes nearer than the least clearance found so far, goes on from the minimum
//! there, and ends when there is none. Of equal clearances up to rounding, the first counts: a last search finds it.
//!
//! Where benches touch, the least clearance is negative, and the contact search does not apply. There it is found by branch and
//! bound on all cores. The areas that the boards may cover on an interval bound each pair's clearance from below. Intervals
//! whose lower bound stays at or above the least clearance found so far are done. Other intervals are bisected, and Brent's
//! method refines the remaining pieces. Of the pairs that reach the same position one after the other, only the first is
//! evaluated.
//!
//! *Guarantee.* The result is the clearance of a pair at a travel, and a local minimum to rounding. Without a contact, no pair
//! comes nearer by more than rounding. With one, nothing outside the remaining pieces is below it. The assumption that no pair
//! has two minima within one piece rests on the length of the pieces: 1/256 of a link's length.

use std::cell::Cell;

use super::cores::on_all_cores;
use super::strides::Strides;
use crate::clearance::{ApproachSearch, Contact, ContactSearch, PairClearance, Pairs, ROUNDING_M, first_within};
use crate::dragon::{Dragon, Spent};
use crate::numerics::peak;

/// Tolerance of the travel of a least clearance, in metres. The clearance is then exact to rounding.
const TOLERANCE_M: f64 = 1e-11;

/// Number of strides from one look at all benches to the next, before the contact search.
const STRIDES_PER_LOOK: usize = 16;

/// Number of steps in which a contact search over the whole interval reports its progress.
const PROGRESS_STEPS: f64 = 64.0;

/// First step from a contact towards the minimum behind it, in strides. Each step is twice as long as the one before.
const FIRST_STEP: f64 = 1.0 / 64.0;

/// The closest approach of two benches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestApproach {
    /// Travel of the head.
    pub travel_m: f64,
    /// The benches, their clearance and its point.
    pub pair: PairClearance,
}

impl ClosestApproach {
    pub(super) fn at(dragon: &Dragon, benches: [usize; 2], travel_m: f64) -> Self {
        Self { travel_m, pair: PairClearance::new(benches, dragon.approach(benches, travel_m)) }
    }

    /// The minimum of a pair's clearance on a short interval.
    pub(super) fn between(dragon: &Dragon, benches: [usize; 2], from_m: f64, to_m: f64) -> Self {
        let nearness = |travel_m| -dragon.approach(benches, travel_m).clearance_m;
        Self::at(dragon, benches, peak(from_m, to_m, TOLERANCE_M, nearness).at)
    }
}

/// Finds the closest approach of any two benches with the head between two travels of the run; `None` with fewer than three
/// benches. Of equal clearances, the first is returned.
///
/// `progress` receives the share of the work that each step completes, from any thread.
///
/// # Errors
/// The dragon's meter is spent before the whole interval is evaluated.
pub fn least_clearance(
    dragon: &Dragon,
    from_travel_m: f64,
    to_travel_m: f64,
    progress: impl Fn(f64) + Sync,
) -> Result<Option<ClosestApproach>, Spent> {
    if dragon.dimensions().benches() < 3 {
        return Ok(None);
    }
    let strides = Strides::of(dragon, from_travel_m, to_travel_m);
    let descent = Descent { dragon, strides, interval_m: [from_travel_m, to_travel_m] };
    if let Some(least) = descent.least(&progress)? {
        return Ok(Some(least));
    }
    let search = LeastClearance { dragon, pairs: Pairs::UnrepeatedSince(from_travel_m), strides };
    // Each stretch is evaluated twice.
    let look = 0.5 / search.strides.stretches() as f64;
    let start = search.at_ends(&|| progress(look))?;
    search.in_between(start, &|| progress(look)).map(Some)
}

/// A search from one minimum to the next lower one.
struct Descent<'a> {
    dragon: &'a Dragon,
    strides: Strides,
    interval_m: [f64; 2],
}

impl Descent<'_> {
    /// The closest approach; `None` if benches touch.
    fn least(&self, progress: &impl Fn(f64)) -> Result<Option<ClosestApproach>, Spent> {
        let [from_m, to_m] = self.interval_m;
        let mut least = self.some_approach()?;
        let mut reached_m = from_m;
        'lower: loop {
            // A pair is within a clearance already at 10⁻¹² m over it.
            let limit_m = least.pair.clearance_m - 2.0 * ROUNDING_M;
            if limit_m < 0.0 {
                return Ok(None);
            }
            let mut search = ContactSearch::within(self.dragon, limit_m);
            while reached_m < to_m {
                let next_m = (reached_m + (to_m - from_m) / PROGRESS_STEPS).min(to_m);
                if let Some(contact) = search.first(reached_m, next_m)? {
                    reached_m = contact.travel_m;
                    least = nearer(least, self.minimum_behind(&contact));
                    continue 'lower;
                }
                progress((next_m - reached_m) / (to_m - from_m));
                reached_m = next_m;
            }
            break;
        }
        let first = first_within(self.dragon, least.pair.clearance_m + ROUNDING_M, from_m, least.travel_m)?;
        let first = first.map(|contact| self.minimum_behind(&contact));
        Ok(first.filter(|first| first.pair.clearance_m <= least.pair.clearance_m + ROUNDING_M).or(Some(least)))
    }

    /// The nearest of the approaches at some travels, and at the minimum beside it.
    fn some_approach(&self) -> Result<ClosestApproach, Spent> {
        let [from_m, to_m] = self.interval_m;
        let looks = self.strides.count().div_ceil(STRIDES_PER_LOOK);
        let mut search = ApproachSearch::new(self.dragon, Pairs::All, from_m);
        let mut nearest = None;
        for look in 0..=looks {
            let travel_m = if look == looks { to_m } else { self.strides.end_m(look * STRIDES_PER_LOOK) };
            search.stand(travel_m);
            let pair = search.nearest().expect("three benches have a pair");
            self.dragon.meter().check(from_m)?;
            let here = ClosestApproach { travel_m, pair };
            nearest = Some(nearest.map_or(here, |nearest| nearer(nearest, here)));
        }
        let nearest = nearest.expect("an interval has an end");
        let [from_m, to_m] = self.strides.around(nearest.travel_m);
        Ok(nearer(nearest, ClosestApproach::between(self.dragon, nearest.pair.benches, from_m, to_m)))
    }

    /// The minimum of a pair's clearance behind a travel at which it falls.
    fn minimum_behind(&self, contact: &Contact) -> ClosestApproach {
        let to_m = self.interval_m[1];
        let at = |travel_m| ClosestApproach::at(self.dragon, contact.benches, travel_m);
        let mut step_m = FIRST_STEP * ApproachSearch::stride_m(self.dragon);
        let (mut before_m, mut lowest) = (contact.travel_m, at(contact.travel_m));
        loop {
            let next = at((lowest.travel_m + step_m).min(to_m));
            if next.pair.clearance_m >= lowest.pair.clearance_m {
                let minimum = ClosestApproach::between(self.dragon, contact.benches, before_m, next.travel_m);
                return nearer(minimum, lowest);
            }
            (before_m, lowest) = (lowest.travel_m, next);
            step_m *= 2.0;
        }
    }
}

struct LeastClearance<'a> {
    dragon: &'a Dragon,
    pairs: Pairs,
    strides: Strides,
}

impl LeastClearance<'_> {
    /// The nearest approach at the ends of all strides, refined to the minimum nearby. It gives the search between the ends a
    /// low limit.
    fn at_ends(&self, looked: &(impl Fn() + Sync)) -> Result<ClosestApproach, Spent> {
        let nearest = self.on_stretches(|dragon, search, ends_m| {
            let nearest = ends_m.iter().filter_map(|&travel_m| {
                // A stretch that ends early does not count.
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
        let nearest = nearest.into_iter().reduce(nearer).expect("an interval has an end");
        let [from_m, to_m] = self.strides.around(nearest.travel_m);
        Ok(nearer(nearest, ClosestApproach::between(self.dragon, nearest.pair.benches, from_m, to_m)))
    }

    /// The nearest approach on the whole interval. `start` is one of its approaches. Results of other cores are not used, so
    /// the work is the same on every run.
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

    /// Runs `work` on every stretch, on all cores.
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

/// The nearer of two approaches; the first if they are equal.
fn nearer(first: ClosestApproach, second: ClosestApproach) -> ClosestApproach {
    if second.pair.clearance_m < first.pair.clearance_m { second } else { first }
}
