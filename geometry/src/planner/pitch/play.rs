//! The smallest pitch for loose hinges: no pose that the play allows touches on the way to the circle.
//!
//! The search starts at the smallest pitch without play and widens it, in steps that double, until the bounds on all poses (see
//! `clearance::play`) rule out a contact; then it bisects the last step. A pitch is first examined from the places of known touches
//! to the circle, which is quick. A pitch that passes is then examined on the whole way. The pitches that the bounds rule
//! out need not be an interval. So the answer is a pitch without a possible contact, a step of [`TOLERANCE_M`] below which there is
//! none without; a smaller pitch further below is not ruled out.

use std::sync::Arc;

use super::{PitchError, SmallestPitch};
use crate::clearance::{PlayEnd, first_leading_touch, first_possible_touch};
use crate::dragon::{Dimensions, Dragon, DragonError, FeasibleEnd, Meter, Spent};
use crate::numerics::try_turning_point;
use crate::route::{RouteSpec, SpiralSpec};

/// Tolerance of the answer, in metres. The bounds are resolved to a millimetre of travel.
const TOLERANCE_M: f64 = 1e-5;
/// First step of the search, in lengths of the play.
const STEP_PER_PLAY: f64 = 1.0;
/// Greatest widening of the pitch, in metres.
const MOST_M: f64 = 10.0;

/// Finds a pitch on the ground of a plan, from the smallest one without play on, at which no pose that the play of the hinges allows
/// comes within `clearance_m` before the head is on the circle. Without play it is the smallest one.
///
/// # Errors
/// The meter is spent, no pitch up to 10 m wider is proved to be without a contact, or the ground ends.
pub fn guaranteed_pitch(
    plan: &RouteSpec,
    dimensions: &Dimensions,
    start_turns: f64,
    turn_diameter_m: f64,
    clearance_m: f64,
    nominal: &SmallestPitch,
    meter: &Meter,
) -> Result<f64, PitchError> {
    if dimensions.play_m() == 0.0 {
        return Ok(nominal.pitch_m);
    }
    let mut search = Widening { plan, dimensions, start_turns, turn_diameter_m, clearance_m, meter, left_m: 0.0 };
    let (mut low_m, mut step_m) = (nominal.pitch_m, STEP_PER_PLAY * dimensions.play_m());
    while !(search.may_be_clear(low_m + step_m)? && search.is_clear(low_m + step_m)?) {
        low_m += step_m;
        step_m *= 2.0;
        if step_m > MOST_M {
            return Err(PitchError::NoPitch { turn_diameter_m });
        }
    }
    let clear_m = low_m + step_m;
    loop {
        let (_, high_m) = try_turning_point(low_m, clear_m, TOLERANCE_M, |pitch_m| search.may_be_clear(pitch_m))?;
        if high_m == clear_m || search.is_clear(high_m)? {
            return Ok(high_m);
        }
        low_m = high_m;
    }
}

/// A search of pitches for one that is wide enough.
struct Widening<'a> {
    plan: &'a RouteSpec,
    dimensions: &'a Dimensions,
    start_turns: f64,
    turn_diameter_m: f64,
    clearance_m: f64,
    meter: &'a Meter,
    /// Most travel that was left to the circle at a touch on the whole way.
    left_m: f64,
}

impl Widening<'_> {
    /// Whether no benches touch on the whole way to the circle.
    fn is_clear(&mut self, pitch_m: f64) -> Result<bool, PitchError> {
        let left_m = self.left_at_touch(pitch_m, |dragon| {
            first_possible_touch(dragon, self.clearance_m, dragon.start_travel_m(), dragon.end_travel_m())
        })?;
        self.left_m = left_m.map_or(self.left_m, |left_m| left_m.max(self.left_m));
        Ok(left_m.is_none())
    }

    /// Whether the leading benches touch none on the last part of the way, from before the places of known touches.
    fn may_be_clear(&self, pitch_m: f64) -> Result<bool, PitchError> {
        let last_m = self.left_m + self.dimensions.link_m(0);
        let left_m = self.left_at_touch(pitch_m, |dragon| {
            let from_m = (dragon.end_travel_m() - last_m).max(dragon.start_travel_m());
            first_leading_touch(dragon, self.clearance_m, [from_m, dragon.end_travel_m()])
        })?;
        Ok(left_m.is_none())
    }

    /// The travel that is left to the circle at the touch that a search finds at a pitch; 0 if the dragon does not reach the circle.
    fn left_at_touch(
        &self,
        pitch_m: f64,
        search: impl Fn(&Dragon) -> Result<Option<PlayEnd>, Spent>,
    ) -> Result<Option<f64>, PitchError> {
        let spec = SpiralSpec { pitch_m, start_turns: self.start_turns };
        let family = self.plan.lead_in(spec, self.turn_diameter_m, self.dimensions.links_m());
        let family = family.map_err(|error| PitchError::on_route(pitch_m, error))?;
        let dragon = match Dragon::with_meter(*self.dimensions, Arc::clone(family.route()), self.meter.clone()) {
            Ok(dragon) => dragon,
            Err(DragonError::Ground(gap)) => return Err(PitchError::Ground { pitch_m, gap }),
            Err(DragonError::TooMuchWork(spent)) => return Err(PitchError::PlayUndecided { pitch_m, spent }),
            Err(_) => return Ok(Some(0.0)),
        };
        let touch = search(&dragon).map_err(|spent| PitchError::PlayUndecided { pitch_m, spent })?;
        let stops = (dragon.feasible_end() != FeasibleEnd::RouteEnd).then_some(0.0);
        Ok(touch.map(|touch| dragon.end_travel_m() - touch.travel_m).or(stops))
    }
}
