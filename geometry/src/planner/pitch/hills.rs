//! The smallest pitch on hills.
//!
//! On hills no witness at one pitch proves anything about the next: each pitch leads over other heights. So pitches are tried, from
//! the lowest possible one on, [`STEPS_PER_PITCH`] for each multiple of e. The step before the first feasible one is bisected, first
//! beside the pitch at which the pair of the last contact just touches. Most pitches have their contact where the pitch before had it, so
//! a search near that place comes first. A search of the last turn before the circle, where most contacts are, comes before that of the
//! whole lead-in. Both are of the foremost benches alone.
//!
//! *Guarantee.* The answer is feasible, and a pitch just below it is not. Feasible pitches between two that were tried are missed.

use std::f64::consts::TAU;
use std::sync::Arc;

use super::{LeadIn, MAX_PITCH_M, PitchError, PitchLimit, SmallestPitch, lead_in, smallest_pitch};
use crate::clearance::first_within;
use crate::dragon::{Dimensions, Dragon, DragonError, FeasibleEnd, Meter};
use crate::numerics::{crossing, try_turning_point};
use crate::planner::cores::on_all_cores;
use crate::planner::least_clearance::ClosestApproach;
use crate::route::{RouteError, RouteSpec, SpiralSpec};

/// Number of pitches tried while the pitch grows by a factor of e.
const STEPS_PER_PITCH: f64 = 512.0;
/// Pitches tried at a time. Those behind the first feasible one are tried in vain, and take longest.
const AT_A_TIME: usize = 4;
/// Turns before the circle that are searched first.
const LAST_TURNS: f64 = 1.0;
/// Distance from the last contact within which the next one is searched for first, in lengths of the head's link.
const NEAR_LINKS: f64 = 1.0;
/// The same while a step is bisected.
const NEARER_LINKS: f64 = 0.25;
/// Benches behind those of the last contact, or behind two turns, that take part in a search near it.
const FURTHER_BENCHES: usize = 4;
/// Tolerance of the answer, in metres.
const TOLERANCE_M: f64 = 1e-12;
/// Distance to either side of a guess that is tried first, in metres.
const BESIDE_M: f64 = 4e-12;

/// Finds the smallest pitch as [`smallest_pitch`], on the ground of a plan: of a spiral about the place of the plan, from
/// `start_turns` turns on. On hills it is the smallest one that was found: a smaller one may lie between two that were tried.
///
/// # Errors
/// The errors of [`smallest_pitch`]. On hills also: the ground ends before a feasible pitch is found.
pub fn smallest_pitch_on(
    plan: &RouteSpec,
    dimensions: &Dimensions,
    start_turns: f64,
    turn_diameter_m: f64,
    clearance_m: f64,
    meter: &Meter,
) -> Result<SmallestPitch, PitchError> {
    if plan.ground.is_none() {
        return smallest_pitch(dimensions, start_turns, turn_diameter_m, clearance_m, meter);
    }
    let lead_in = lead_in(dimensions, start_turns, turn_diameter_m, clearance_m, meter)?;
    let (start_m, width_m) = (lead_in.least_start_m(), dimensions.width_m());
    let least_m = start_m.max(width_m);
    let least_m = least_m + lead_in.tolerance_m(least_m);
    let hills = Hills { plan, lead_in };
    let pitch_m = |number: usize| least_m * (number as f64 / STEPS_PER_PITCH).exp();
    let limit = if start_m >= width_m { PitchLimit::Start } else { PitchLimit::Width };
    let mut last = Tried { pitch_m: least_m, limit, radius_m: 0.0 };
    let mut first = 0;
    loop {
        let count = (first..first + AT_A_TIME).take_while(|&number| pitch_m(number) <= MAX_PITCH_M).count();
        if count == 0 {
            return Err(PitchError::NoPitch { turn_diameter_m });
        }
        let found = on_all_cores(meter, count, |i, own| hills.trial(own, pitch_m(first + i), &last));
        let is_complete = found.len() == count;
        for (number, tried) in (first..).zip(found) {
            match tried.map_err(|error| error.undecided_above(last.pitch_m))? {
                Some(tried) => last = tried,
                None if number == 0 => return Ok(SmallestPitch { pitch_m: least_m, limit }),
                None => return hills.between(meter, last, pitch_m(number)),
            }
        }
        if !is_complete {
            return Err(PitchError::HillsUndecided { pitch_m: last.pitch_m, spent: meter.spent(0.0) });
        }
        first += AT_A_TIME;
    }
}

/// A pitch that is not feasible.
#[derive(Clone, Copy)]
struct Tried {
    pitch_m: f64,
    limit: PitchLimit,
    /// The head's distance from the centre at the contact; 0 without a contact.
    radius_m: f64,
}

impl PitchError {
    /// The error of a lead-in with this pitch.
    pub(super) fn on_route(pitch_m: f64, error: RouteError) -> Self {
        match error {
            RouteError::Ground(gap) => Self::Ground { pitch_m, gap },
            error => Self::Route(error),
        }
    }

    /// The same error, whose search has tried no feasible pitch up to `low_m`.
    fn undecided_above(self, low_m: f64) -> Self {
        if let Self::HillsUndecided { spent, .. } = self {
            Self::HillsUndecided { pitch_m: low_m, spent }
        } else {
            self
        }
    }
}

/// The lead-in on the ground of a plan.
struct Hills<'a> {
    plan: &'a RouteSpec,
    lead_in: LeadIn<'a>,
}

impl Hills<'_> {
    /// The smallest feasible pitch between one that is not and one that is. Between them, only the place of the last contact is
    /// searched, and the whole lead-in at the end.
    fn between(&self, meter: &Meter, mut low: Tried, feasible_m: f64) -> Result<SmallestPitch, PitchError> {
        loop {
            let (mut end_m, guess_m) = (feasible_m, self.guess(meter, &low, feasible_m)?);
            let is_clear = |low: &mut Tried, pitch_m| {
                let found = if matches!(low.limit, PitchLimit::Contact(_)) {
                    self.trial_near(meter, pitch_m, low, NEARER_LINKS)
                } else {
                    self.trial(meter, pitch_m, low)
                };
                let found = found.map_err(|error| error.undecided_above(low.pitch_m))?;
                *low = found.unwrap_or(*low);
                Ok(found.is_none())
            };
            for beside_m in guess_m.into_iter().flat_map(|guess_m| [guess_m - BESIDE_M, guess_m + BESIDE_M]) {
                if beside_m > low.pitch_m && beside_m < end_m && is_clear(&mut low, beside_m)? {
                    end_m = beside_m;
                }
            }
            let (_, high_m) =
                try_turning_point(low.pitch_m, end_m, TOLERANCE_M, |pitch_m| is_clear(&mut low, pitch_m))?;
            let whole = if high_m < feasible_m { self.trial(meter, high_m, &low) } else { Ok(None) };
            match whole.map_err(|error| error.undecided_above(low.pitch_m))? {
                Some(tried) => low = tried,
                None => return Ok(SmallestPitch { pitch_m: high_m, limit: low.limit }),
            }
        }
    }

    /// Estimate of the least pitch at which the pair of the last contact keeps the clearance near its place; `None` if its depth there
    /// does not change sign.
    fn guess(&self, meter: &Meter, low: &Tried, feasible_m: f64) -> Result<Option<f64>, PitchError> {
        let PitchLimit::Contact(contact) = low.limit else { return Ok(None) };
        let depth_m = |pitch_m: f64| {
            let dragon = self.dragon(meter, pitch_m, contact.benches[1] + FURTHER_BENCHES)?.ok();
            let clearance_m = dragon.map_or(f64::NEG_INFINITY, |dragon| {
                let [from_m, to_m] = self.around(&dragon, pitch_m, low, NEARER_LINKS);
                let [from_m, to_m] = [from_m.max(dragon.start_travel_m()), to_m.min(dragon.end_travel_m())];
                ClosestApproach::between(&dragon, contact.benches, from_m, to_m).pair.clearance_m
            });
            Ok::<_, PitchError>(self.lead_in.clearance_m - clearance_m)
        };
        let depths_m = [depth_m(low.pitch_m)?, depth_m(feasible_m)?];
        if !(depths_m[0] > 0.0 && depths_m[1] < 0.0) {
            return Ok(None);
        }
        let ends_m = [low.pitch_m, feasible_m];
        // A pitch without a dragon counts as too deep.
        let (_, guess_m) = crossing(ends_m, depths_m, TOLERANCE_M, |pitch_m| depth_m(pitch_m).unwrap_or(f64::INFINITY));
        Ok(Some(guess_m))
    }

    /// Tries a pitch on the whole lead-in; `None` if it is feasible. `last` is the last one that is not.
    fn trial(&self, meter: &Meter, pitch_m: f64, last: &Tried) -> Result<Option<Tried>, PitchError> {
        let LeadIn { dimensions, circle_radius_m, .. } = self.lead_in;
        if let Some(tried) = self.trial_near(meter, pitch_m, last, NEAR_LINKS)? {
            return Ok(Some(tried));
        }
        let last_m = LAST_TURNS * TAU * (circle_radius_m + LAST_TURNS * pitch_m);
        let benches = dimensions.benches();
        let front = 2 * (last_m / dimensions.link_m(1)) as usize + FURTHER_BENCHES;
        if front < benches {
            let on_last_turn = |dragon: &Dragon| [dragon.end_travel_m() - last_m, dragon.end_travel_m()];
            if let Some(tried) = self.contact(meter, pitch_m, front, on_last_turn)? {
                return Ok(Some(tried));
            }
        }
        self.contact(meter, pitch_m, benches, |dragon| [dragon.start_travel_m(), dragon.end_travel_m()])
    }

    /// Tries a pitch near the place of the last contact, with the benches up to its pair; nothing is tried if the last pitch had none.
    fn trial_near(&self, meter: &Meter, pitch_m: f64, last: &Tried, links: f64) -> Result<Option<Tried>, PitchError> {
        let PitchLimit::Contact(contact) = last.limit else { return Ok(None) };
        let around = |dragon: &Dragon| self.around(dragon, pitch_m, last, links);
        self.contact(meter, pitch_m, contact.benches[1] + FURTHER_BENCHES, around)
    }

    /// The travels around the place of the last contact, up to this many lengths of the head's link away.
    fn around(&self, dragon: &Dragon, pitch_m: f64, last: &Tried, links: f64) -> [f64; 2] {
        let travel_m = dragon.route().travel(LeadIn::parameter(pitch_m, last.radius_m));
        let reach_m = links * self.lead_in.dimensions.link_m(0);
        [travel_m - reach_m, travel_m + reach_m]
    }

    /// The first contact of the foremost benches between two travels of the lead-in, or the reason for which they cannot walk to the
    /// circle.
    fn contact(
        &self,
        meter: &Meter,
        pitch_m: f64,
        benches: usize,
        span_m: impl Fn(&Dragon) -> [f64; 2],
    ) -> Result<Option<Tried>, PitchError> {
        let dragon = match self.dragon(meter, pitch_m, benches)? {
            Ok(dragon) => dragon,
            Err(tried) => return Ok(Some(tried)),
        };
        let [from_m, to_m] = span_m(&dragon);
        let contact = first_within(&dragon, self.lead_in.clearance_m, from_m, to_m);
        let contact = contact.map_err(|spent| PitchError::HillsUndecided { pitch_m, spent })?;
        Ok(contact.map(|contact| {
            let radius_m = LeadIn::radius_m(pitch_m, dragon.route().parameter(contact.travel_m));
            Tried { pitch_m, limit: PitchLimit::Contact(contact), radius_m }
        }))
    }

    /// The foremost benches on their lead-in, or the reason for which they cannot walk to the circle.
    fn dragon(&self, meter: &Meter, pitch_m: f64, benches: usize) -> Result<Result<Dragon, Tried>, PitchError> {
        let LeadIn { dimensions, start_turns, circle_radius_m, .. } = self.lead_in;
        let dimensions = dimensions.with_benches(benches.min(dimensions.benches()));
        let spec = SpiralSpec { pitch_m, start_turns };
        let family = self.plan.lead_in(spec, 2.0 * circle_radius_m, dimensions.links_m());
        let family = family.map_err(|error| PitchError::on_route(pitch_m, error))?;
        meter.add(family.route().steps_of_heights());
        match Dragon::with_meter(dimensions, Arc::clone(family.route()), meter.clone()) {
            Ok(dragon) if dragon.feasible_end() == FeasibleEnd::RouteEnd => Ok(Ok(dragon)),
            Err(DragonError::TooMuchWork(spent)) => Err(PitchError::HillsUndecided { pitch_m, spent }),
            Err(DragonError::Ground(gap)) => Err(PitchError::Ground { pitch_m, gap }),
            _ => Ok(Err(Tried { pitch_m, limit: PitchLimit::Stop, radius_m: 0.0 })),
        }
    }
}
