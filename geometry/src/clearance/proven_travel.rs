//! Proven travel: an interval of travel on which no two benches come nearer than a margin.
//!
//! *Method.* At the beginning, every pair's clearance is measured. From there the dragon walks stride by stride. On each
//! stride, the areas that two boards may cover bound their clearance from below. Intervals are bisected until the bound
//! exceeds the margin. Where this fails at [`RESOLUTION_M`], the proven travel ends.
//!
//! *Borders.* The proof can also be about the borders of a stage (see `proven_borders`). It then ends before a board passes one, or comes
//! nearer than the stage allows.
//!
//! *Loose hinges.* The proof is then about every pose that the play of the hinges allows (see `play`), and ends where the bracket
//! of a pole does. So is that about borders (see `proven_borders`).
//!
//! *Guarantee.* No clearance is under the margin on proven travel, up to the rounding of the poses, about 10⁻¹² m. Proven
//! travel ends at most [`RESOLUTION_M`] before the first violation that the bound detects.

use super::approach_search::{ApproachSearch, Pairs};
use super::border_search::Breach;
use super::play::{PlaySearch, PossibleTouch};
use super::pose::Pose;
use super::proven_borders::ProvenBorders;
use super::search::PairClearance;
use crate::dragon::Dragon;
use crate::stage::Stage;

/// Shortest interval that is bisected, in metres of travel.
const RESOLUTION_M: f64 = 1e-9;

/// An interval of proven travel, which can grow.
#[derive(Clone, Debug)]
pub struct ProvenTravel<'a> {
    dragon: &'a Dragon,
    search: ApproachSearch<'a>,
    /// The proof for loose hinges; `None` for hinges without play.
    play: Option<PlaySearch>,
    /// The proof about the borders of a stage, if there is one.
    borders: Option<ProvenBorders<'a>>,
    margin_m: f64,
    begin_m: f64,
    end_m: f64,
    /// Whether a violation follows the interval.
    is_ended: bool,
}

impl<'a> ProvenTravel<'a> {
    /// The interval that contains only one travel of the run.
    ///
    /// # Errors
    /// The nearest pair, if it is nearer than the margin. For loose hinges: a pair that may be nearer in some pose. If the bounds
    /// prove nothing about the poses, it is the nearest pair.
    pub fn at(dragon: &'a Dragon, margin_m: f64, travel_m: f64) -> Result<Self, PairClearance> {
        let mut search = ApproachSearch::new(dragon, Pairs::UnrepeatedSince(travel_m), travel_m);
        if let Some(nearest) = search.nearest().filter(|nearest| nearest.clearance_m < margin_m) {
            return Err(nearest);
        }
        let play = begin_play(dragon, margin_m, travel_m, &mut search)?;
        Ok(Self { dragon, search, play, borders: None, margin_m, begin_m: travel_m, end_m: travel_m, is_ended: false })
    }

    /// The same interval, which contains only one travel, with a proof that is also about the borders of a stage.
    ///
    /// # Errors
    /// A board that does not keep clear of a border.
    pub fn within_borders(self, stage: &'a Stage) -> Result<Self, Breach> {
        let borders = ProvenBorders::at(self.dragon, stage, self.begin_m)?;
        Ok(Self { borders: Some(borders), ..self })
    }

    /// Extends the proof up to `to_m`. One call walks at most one stride more than `handles` divided by the dragon's number of
    /// handles, rounded down. If the dragon's meter is spent within the first stride, the proven travel ends permanently before
    /// that stride.
    pub fn extend(&mut self, to_m: f64, handles: usize) {
        let to_m = to_m.min(self.dragon.end_travel_m());
        let stride_m = ApproachSearch::stride_m(self.dragon);
        self.dragon.meter().restart();
        for stride in 0..=handles / self.dragon.dimensions().handles() {
            if self.is_ended || self.end_m >= to_m {
                return;
            }
            let next_m = to_m.min(self.end_m + stride_m);
            match self.walk_over(next_m) {
                Ok(()) => self.end_m = next_m,
                Err(_) if self.dragon.meter().is_spent() && stride > 0 => return,
                Err(violation_m) => (self.end_m, self.is_ended) = (violation_m, true),
            }
        }
    }

    /// Extends the proof to a travel at most a stride ahead, or returns the travel at which it ends.
    fn walk_over(&mut self, to_m: f64) -> Result<(), f64> {
        let Some(borders) = &mut self.borders else { return self.walk_pairs_over(to_m) };
        let clear_to_m = borders.walk_over(to_m).map_err(|_| self.end_m)?;
        if clear_to_m > self.end_m {
            self.walk_pairs_over(clear_to_m)?;
        }
        if clear_to_m < to_m { Err(clear_to_m) } else { Ok(()) }
    }

    fn walk_pairs_over(&mut self, to_m: f64) -> Result<(), f64> {
        let Some(play) = &mut self.play else { return self.search.walk_over(to_m, self.margin_m, RESOLUTION_M) };
        match play.advance(to_m) {
            Ok(Some(touch)) => Err(touch.travel_m),
            Ok(None) if play.end_m() < to_m => Err(play.end_m().max(self.end_m)),
            Ok(None) => Ok(()),
            Err(_) => Err(self.end_m),
        }
    }

    /// Beginning of the interval, in metres of the head's travel.
    pub fn begin_m(&self) -> f64 {
        self.begin_m
    }

    /// Present end of the interval.
    pub fn end_m(&self) -> f64 {
        self.end_m
    }

    /// Whether the interval contains a travel.
    pub fn contains(&self, travel_m: f64) -> bool {
        (self.begin_m..=self.end_m).contains(&travel_m)
    }

    /// Whether the interval cannot grow further.
    pub fn is_whole(&self) -> bool {
        self.is_ended || self.end_m >= self.dragon.end_travel_m()
    }
}

/// Begins the proof for loose hinges; `None` for hinges without play, and for fewer than three benches, which have no pair.
///
/// # Errors
/// The pair that may be nearer than the margin in some pose. If the bounds prove nothing, it is the nearest pair.
fn begin_play(
    dragon: &Dragon,
    margin_m: f64,
    travel_m: f64,
    search: &mut ApproachSearch<'_>,
) -> Result<Option<PlaySearch>, PairClearance> {
    let benches = dragon.dimensions().benches();
    if dragon.dimensions().play_m() == 0.0 || benches < 3 {
        return Ok(None);
    }
    dragon.meter().restart();
    let begun = PlaySearch::at(dragon, margin_m, travel_m).ok().flatten().filter(PlaySearch::is_known_here);
    match begun.as_ref().map(PlaySearch::touch_here) {
        Some(None) => Ok(begun),
        Some(Some(PossibleTouch { benches, .. })) => {
            let pose = Pose::of(dragon, travel_m, benches[1] + 1);
            Err(PairClearance::of(&pose.boards, benches))
        }
        None => Err(search.nearest().expect("three benches have a pair")),
    }
}
