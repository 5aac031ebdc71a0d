//! Proven travel: an interval of travel on which no two benches come nearer than a margin.
//!
//! *Method.* The search for the first travel at which a pair comes within the margin (see [`ContactSearch`]) goes on from the end of the
//! interval. It proves that no pair comes so near before that travel. The proven travel ends [`RESERVE_M`] before it.
//!
//! *Borders.* The proof can also be about the borders of a stage (see `proven_borders`). It then ends before a board passes one, or comes
//! nearer than the stage allows.
//!
//! *Loose hinges.* The proof is then about every pose that the play of the hinges allows (see `play`), and ends where the bracket
//! of a pole does. So is that about borders (see `proven_borders`).
//!
//! *Guarantee.* No clearance is under the margin on proven travel, up to the rounding of the poses, about 10⁻¹² m.

use super::approach_search::ApproachSearch;
use super::border_search::Breach;
use super::contact_search::ContactSearch;
use super::play::{PlaySearch, PossibleTouch};
use super::pose::Pose;
use super::proven_borders::ProvenBorders;
use super::search::{ClearanceSearch, PairClearance};
use crate::dragon::{Dragon, Spent};
use crate::stage::Stage;

/// Travel from the end of a proof to the first pair that is too near: more than the resolution of its travel, 10⁻¹¹ m.
const RESERVE_M: f64 = 1e-9;
/// A pair whose clearance is the margin less this keeps it: clearances are exact to their rounding.
const ROUNDING_M: f64 = 2e-12;

/// An interval of proven travel, which can grow.
#[derive(Clone, Debug)]
pub struct ProvenTravel<'a> {
    dragon: &'a Dragon,
    pairs: ProvenPairs,
    /// The proof about the borders of a stage, if there is one.
    borders: Option<ProvenBorders<'a>>,
    begin_m: f64,
    end_m: f64,
    /// Whether a violation follows the interval.
    is_ended: bool,
}

/// The search for pairs that are too near.
#[derive(Clone, Debug)]
enum ProvenPairs {
    /// For hinges without play.
    Tight(ContactSearch),
    /// For loose hinges.
    Loose(PlaySearch),
}

/// How far a proof has got.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Reached {
    pub(super) travel_m: f64,
    /// Whether a violation follows. If none does, the travel is the requested one, or that at which the dragon's meter was spent.
    pub(super) is_end: bool,
}

impl<'a> ProvenTravel<'a> {
    /// The interval that contains only one travel of the run.
    ///
    /// # Errors
    /// The nearest pair, if it is nearer than the margin. For loose hinges: a pair that may be nearer in some pose. If the bounds
    /// prove nothing about the poses, it is the nearest pair.
    ///
    /// # Panics
    /// Panics for a travel that does not lie within the run.
    pub fn at(dragon: &'a Dragon, margin_m: f64, travel_m: f64) -> Result<Self, PairClearance> {
        dragon.require_travel(travel_m).expect("the travel lies within the run");
        let mut search = ContactSearch::within(dragon, (margin_m - ROUNDING_M).max(0.0));
        if let Ok(Some(nearest)) = search.first(travel_m, travel_m) {
            return Err(clearance_of(dragon, travel_m, nearest.benches));
        }
        let pairs = match begin_play(dragon, margin_m, travel_m)? {
            Some(play) => ProvenPairs::Loose(play),
            None => ProvenPairs::Tight(search),
        };
        Ok(Self { dragon, pairs, borders: None, begin_m: travel_m, end_m: travel_m, is_ended: false })
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
    /// handles, rounded down. If the dragon's meter is spent before the proof advances, the proven travel ends permanently.
    pub fn extend(&mut self, to_m: f64, handles: usize) {
        let strides = 1 + handles / self.dragon.dimensions().handles();
        let stride_m = ApproachSearch::stride_m(self.dragon);
        let to_m = to_m.min(self.end_m + strides as f64 * stride_m).min(self.dragon.end_travel_m());
        if self.is_ended || self.end_m >= to_m {
            return;
        }
        self.dragon.meter().restart();
        let borders_from_m = self.borders.as_ref().map_or(to_m, ProvenBorders::travel_m);
        let clear = match &mut self.borders {
            Some(borders) => borders.extend(to_m, stride_m),
            None => Reached { travel_m: to_m, is_end: false },
        };
        let apart = self.pairs.extend(self.end_m, clear.travel_m);
        // The proven travel ends where the first of the two proofs does.
        let is_end = apart.is_end || clear.is_end && apart.travel_m == clear.travel_m;
        let has_advanced = apart.travel_m > self.end_m || clear.travel_m > borders_from_m;
        self.is_ended = is_end || !has_advanced;
        self.end_m = self.end_m.max(apart.travel_m);
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

impl ProvenPairs {
    /// Searches on from the end of the search before to `to_m`.
    fn extend(&mut self, from_m: f64, to_m: f64) -> Reached {
        let (known_to_m, touch) = match self {
            Self::Tight(search) => {
                let touch = search.first(from_m, to_m);
                (to_m, touch.map(|touch| touch.map(|contact| contact.travel_m - RESERVE_M)))
            }
            Self::Loose(search) => {
                let touch = search.advance(to_m);
                (search.end_m(), touch.map(|touch| touch.map(|touch| touch.travel_m)))
            }
        };
        match touch {
            Ok(Some(travel_m)) => Reached { travel_m, is_end: true },
            Ok(None) => Reached { travel_m: to_m.min(known_to_m), is_end: known_to_m < to_m },
            Err(Spent { reached_m, .. }) => Reached { travel_m: reached_m, is_end: false },
        }
    }
}

/// Begins the proof for loose hinges; `None` for hinges without play, and for fewer than three benches, which have no pair.
///
/// # Errors
/// The pair that may be nearer than the margin in some pose. If the bounds prove nothing, it is the nearest pair.
fn begin_play(dragon: &Dragon, margin_m: f64, travel_m: f64) -> Result<Option<PlaySearch>, PairClearance> {
    let benches = dragon.dimensions().benches();
    if dragon.dimensions().play_m() == 0.0 || benches < 3 {
        return Ok(None);
    }
    dragon.meter().restart();
    let begun = PlaySearch::at(dragon, margin_m, travel_m).ok().flatten().filter(PlaySearch::is_known_here);
    match begun.as_ref().map(PlaySearch::touch_here) {
        Some(None) => Ok(begun),
        Some(Some(PossibleTouch { benches, .. })) => Err(clearance_of(dragon, travel_m, benches)),
        None => {
            let nearest = ClearanceSearch::default().nearest(&Pose::of(dragon, travel_m, usize::MAX).boards);
            Err(nearest.expect("three benches have a pair"))
        }
    }
}

fn clearance_of(dragon: &Dragon, travel_m: f64, benches: [usize; 2]) -> PairClearance {
    PairClearance::of(&Pose::of(dragon, travel_m, benches[1] + 1).boards, benches)
}
