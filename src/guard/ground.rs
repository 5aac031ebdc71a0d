//! Ground that is proved free: a stretch of travel on which no two benches come nearer than a margin.
//!
//! *Method.* The dragon is put up at the beginning, where every pair's clearance is measured, and walked on stride by
//! stride. On each stride the pairs that could come under the margin are followed by what their boards may cover on the
//! way, which bounds their clearance from below, and the way is halved until the bound is over the margin.
//!
//! *Guarantee.* Nowhere on the ground is a clearance under the margin, up to the rounding of the poses, some 10⁻¹² m.
//! Ground ends at most [`RESOLUTION_M`] of travel before it has to.

use crate::dragon::{ApproachSearch, Dragon, Fall, PairClearance, Pairs};

/// How near to a fall the ground reaches, in metres of travel.
const RESOLUTION_M: f64 = 1e-9;

/// A stretch of proved ground, which grows.
#[derive(Clone, Debug)]
pub(super) struct Ground<'a> {
    dragon: &'a Dragon,
    search: ApproachSearch<'a>,
    margin_m: f64,
    begin_m: f64,
    end_m: f64,
    fall: Option<Fall>,
}

impl<'a> Ground<'a> {
    /// The ground at one travel of the run.
    ///
    /// # Errors
    /// The nearest pair, where it is nearer than the margin already.
    pub(super) fn at(dragon: &'a Dragon, margin_m: f64, travel_m: f64) -> Result<Self, PairClearance> {
        let mut search = ApproachSearch::new(dragon, Pairs::UnrepeatedSince(travel_m), travel_m);
        match search.nearest() {
            Some(nearest) if nearest.clearance_m < margin_m => Err(nearest),
            _ => Ok(Self { dragon, search, margin_m, begin_m: travel_m, end_m: travel_m, fall: None }),
        }
    }

    /// Proves more, up to `to_m`, and places at most so many handles on the way, but for one stride. Where the dragon's meter
    /// is spent on one stride alone, the ground ends before it.
    pub(super) fn extend(&mut self, to_m: f64, handles: usize) {
        let to_m = to_m.min(self.dragon.end_travel_m());
        let stride_m = ApproachSearch::stride_m(self.dragon);
        self.dragon.meter().restart();
        for stride in 0..=handles / self.dragon.dimensions().handles() {
            if self.fall.is_some() || self.end_m >= to_m {
                return;
            }
            let next_m = to_m.min(self.end_m + stride_m);
            match self.search.walk_over(next_m, self.margin_m, RESOLUTION_M) {
                Ok(()) => self.end_m = next_m,
                Err(_) if self.dragon.meter().is_spent() && stride > 0 => return,
                Err(fall) => (self.end_m, self.fall) = (fall.travel_m, Some(fall)),
            }
        }
    }

    /// Where it begins, in metres of travel.
    pub(super) fn begin_m(&self) -> f64 {
        self.begin_m
    }

    /// Where it ends as yet.
    pub(super) fn end_m(&self) -> f64 {
        self.end_m
    }

    /// Whether a travel lies on it.
    pub(super) fn contains(&self, travel_m: f64) -> bool {
        (self.begin_m..=self.end_m).contains(&travel_m)
    }

    /// Whether it can grow no further.
    pub(super) fn is_whole(&self) -> bool {
        self.fall.is_some() || self.end_m >= self.dragon.end_travel_m()
    }
}
