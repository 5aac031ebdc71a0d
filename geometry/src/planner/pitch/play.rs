//! The smallest pitch for loose hinges: no pose that the play allows touches on the way to the circle.
//!
//! The search starts at the smallest pitch without play and widens it, in steps that double, until the bounds on all poses (see
//! `clearance::play`) rule out a contact; then it bisects the last step. The pitches that the bounds rule out need not be an
//! interval. So the answer is a pitch without a possible contact, a step of [`TOLERANCE_M`] below which there is none without;
//! a smaller pitch further below is not ruled out.

use std::sync::Arc;

use super::{PitchError, SmallestPitch};
use crate::clearance::first_possible_touch;
use crate::dragon::{Dimensions, Dragon, DragonError, FeasibleEnd, Meter};
use crate::numerics::try_turning_point;
use crate::route::SpiralSpec;

/// Tolerance of the answer, in metres. The bounds are resolved to a millimetre of travel.
const TOLERANCE_M: f64 = 1e-5;
/// First step of the search, in lengths of the play.
const STEP_PER_PLAY: f64 = 1.0;
/// Greatest widening of the pitch, in metres.
const MOST_M: f64 = 10.0;

/// Finds a pitch, from the smallest one without play on, at which no pose that the play of the hinges allows comes within
/// `clearance_m` before the head is on the circle. Without play it is the smallest one.
///
/// # Errors
/// The meter is spent, or no pitch up to 10 m wider is proved to be without a contact.
pub fn guaranteed_pitch(
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
    let is_clear = |pitch_m: f64| {
        let route = SpiralSpec { pitch_m, start_turns }.to_circle(turn_diameter_m).map_err(PitchError::Route)?;
        let dragon = match Dragon::with_meter(*dimensions, Arc::new(route), meter.clone()) {
            Ok(dragon) => dragon,
            Err(DragonError::TooMuchWork(spent)) => return Err(PitchError::PlayUndecided { pitch_m, spent }),
            Err(_) => return Ok(false),
        };
        let end_m = dragon.end_travel_m();
        let touch = first_possible_touch(&dragon, clearance_m, dragon.start_travel_m(), end_m)
            .map_err(|spent| PitchError::PlayUndecided { pitch_m, spent })?;
        Ok(touch.is_none() && dragon.feasible_end() == FeasibleEnd::RouteEnd)
    };
    let (mut low_m, mut step_m) = (nominal.pitch_m, STEP_PER_PLAY * dimensions.play_m());
    while !is_clear(low_m + step_m)? {
        low_m += step_m;
        step_m *= 2.0;
        if step_m > MOST_M {
            return Err(PitchError::NoPitch { turn_diameter_m });
        }
    }
    Ok(try_turning_point(low_m, low_m + step_m, TOLERANCE_M, is_clear)?.1)
}
