//! Derivatives of the planner's answers, by the implicit function theorem.
//!
//! Let s be the head's travel, q any parameter, c(s, q) the clearance of the deciding pair, and R(s, q) the speed ratio of the
//! deciding handle:
//!
//! - *First contact.* c stays 0, so ds/dq = −(∂c/∂q) / (∂c/∂s). The head's timetable gives the time at s.
//! - *Least clearance.* At a minimum within the passage, ∂c/∂s = 0. So the least clearance changes by ∂c/∂q alone (envelope
//!   theorem). At an end of the passage, which moves by ds/dq, it changes by ∂c/∂q + ∂c/∂s·ds/dq.
//! - *Largest speed ratio.* At a smooth maximum it changes by ∂R/∂q, for the same reason. Where a handle passes a seam of the
//!   route, R has a kink, and a maximum at a kink moves with it. The handle's travel τ stays equal to that of the seam, τ'. So
//!   ds/dq = (dτ'/dq − ∂τ/∂q) / (∂τ/∂s), and R changes by ∂R/∂q + ∂R/∂s·ds/dq, which is the same on both sides.
//! - *Smallest pitch.* At the smallest pitch, the least clearance of the limiting pair is 0. With dc/dq the derivative of the
//!   least clearance, dp/dq = −(dc/dq) / (dc/dp).
//!
//! All of these are exact up to rounding and up to the travel at which they are taken. A smooth extremum is therefore first
//! refined to the travel at which ∂c/∂s or ∂R/∂s is 0.

use super::Parameter;
use super::board_variation::{TIE_M, Undefined};
use super::local::{Local, Rates, VariedDragon};
use super::pitch::PitchLimit;
use super::speed_limit::LargestRatio;
use crate::clearance::{ClearanceSearch, Contact};
use crate::dragon::FeasibleEnd;
use crate::formation::Timetable;
use crate::numerics::try_turning_point;

/// Largest distance in travel at which an extremum counts as at an end of the passage, or a handle as on a seam, in metres.
const TRAVEL_TOLERANCE_M: f64 = 1e-8;

/// Largest distance from a given travel at which the exact extremum is searched for, in metres. A clearance exact to 10⁻⁹ m
/// leaves an uncertainty of √(10⁻⁹ m ÷ the second derivative of c) in the travel. That derivative is seldom below 10⁻³ per
/// metre.
const LONGEST_REACH_M: f64 = 1e-2;

/// Tolerance of an extremum's travel, in metres. Rounding ends the search earlier, except near t = 0.
const FINEST_M: f64 = 1e-20;

/// The derivatives with respect to each parameter, in the order of the parameters.
pub(super) type Derivatives = [Result<f64, Undefined>; Parameter::ALL.len()];

/// Derivatives of the time of the first contact of a run.
pub(super) fn of_contact_time(varied: &VariedDragon, contact: &Contact, timetable: &Timetable) -> Derivatives {
    let rates = touching_rates(varied, contact);
    of_time(contact.travel_m, timetable, |parameter, speed_mps| {
        rates.map(|rates| -rates.of(parameter) / (rates.travel * speed_mps))
    })
}

/// Derivatives of the time of the first contact of the taut dragon of loose hinges, which `taut` is. Its links are longer than
/// without play by the difference of the two diameters, as if its holes were nearer to the ends by half of that.
pub(super) fn of_taut_time(taut: &VariedDragon, contact: &Contact, timetable: &Timetable) -> Derivatives {
    let rates = touching_rates(taut, contact);
    of_time(contact.travel_m, timetable, |parameter, speed_mps| {
        let rates = rates?;
        let rate = match parameter {
            Parameter::HoleDiameter => -0.5 * rates.of(Parameter::HoleOffset),
            Parameter::PoleDiameter => 0.5 * rates.of(Parameter::HoleOffset),
            _ => rates.of(parameter),
        };
        Ok(-rate / (rates.travel * speed_mps))
    })
}

/// Derivatives of the time up to which no contact is proved to be possible.
pub(super) fn of_proven_time(travel_m: f64, timetable: &Timetable) -> Derivatives {
    of_time(travel_m, timetable, |_, _| {
        Err(Undefined("it is the end of a proof, which is resolved to a millimetre of travel"))
    })
}

/// Derivatives of the time at which the head is at a travel that other parameters than those of times change.
fn of_time(
    travel_m: f64,
    timetable: &Timetable,
    of_travel: impl Fn(Parameter, f64) -> Result<f64, Undefined>,
) -> Derivatives {
    let there =
        timetable.time_rates(travel_m).ok_or(Undefined("the head brakes for the end of the run at the first contact"));
    Parameter::ALL.map(|parameter| match parameter {
        Parameter::Speed => Ok(there?.per_speed),
        Parameter::Accel => Ok(there?.per_accel),
        _ => of_travel(parameter, there?.speed_mps),
    })
}

fn touching_rates(varied: &VariedDragon, contact: &Contact) -> Result<Rates, Undefined> {
    let dragon = &varied.dragon;
    let handles: Vec<_> = dragon.chain(contact.travel_m).expect("a contact lies within the run").collect();
    let mut boards = Vec::new();
    dragon.place_boards(&handles, &mut boards);
    let mut search = ClearanceSearch::default();
    let touching = search.within(&boards, TIE_M);
    if touching.first().is_none_or(|pair| pair.clearance_m < -TIE_M) {
        return Err(Undefined("benches touch at the start already"));
    }
    if touching.len() > 1 {
        return Err(Undefined("more than one pair touches at once"));
    }
    let rates = at(varied, contact.travel_m, contact.benches).clearance(contact.benches)?;
    if rates.travel < 0.0 {
        Ok(rates)
    } else {
        Err(Undefined("the benches only graze each other: a small change can remove the contact"))
    }
}

/// Derivatives of the least clearance over a run, which `benches` have at `travel_m`.
pub(super) fn of_least_clearance(varied: &VariedDragon, travel_m: f64, benches: [usize; 2]) -> Derivatives {
    let extremum = Extremum::of_clearance(varied, travel_m, benches);
    let has_twin = has_twin(varied, travel_m, benches);
    Parameter::ALL.map(|parameter| match parameter {
        Parameter::HeadLength | Parameter::BodyLength if has_twin => {
            Err(Undefined("the head is as long as the other benches, so another pair comes as near"))
        }
        _ => extremum?.rate(parameter),
    })
}

/// Whether another pair has the same clearance elsewhere on the run, because all links are alike: the pair one bench behind at
/// a later travel, or the pair one bench ahead at an earlier one. The head's length changes only one of the two clearances.
fn has_twin(varied: &VariedDragon, travel_m: f64, [first, second]: [usize; 2]) -> bool {
    let (dragon, dimensions) = (&varied.dragon, varied.dragon.dimensions());
    let parameter = |travel_m: f64, handle: usize| {
        dragon.chain(travel_m).expect("the travel lies within the run").nth(handle).map(|handle| handle.parameter)
    };
    if dimensions.head_length_m() != dimensions.body_length_m() || first > 1 {
        return false;
    }
    if first == 1 {
        return parameter(travel_m, 1) >= parameter(dragon.start_travel_m(), 0);
    }
    second + 1 < dimensions.benches() && parameter(travel_m, 0) <= parameter(dragon.end_travel_m(), 1)
}

/// Derivatives of the smallest pitch if a contact limits it. `passage` is the passage at that pitch.
pub(super) fn of_touching_pitch(passage: &VariedDragon, contact: &Contact) -> Derivatives {
    let extremum = Extremum::of_clearance(passage, contact.travel_m, contact.benches);
    of_pitch(|parameter| Ok(-extremum?.rate(parameter)? / extremum?.rate(Parameter::Pitch)?))
}

/// Derivatives of the smallest pitch if no contact limits it.
pub(super) fn of_untouching_pitch(limit: &PitchLimit) -> Derivatives {
    of_pitch(|parameter| match limit {
        PitchLimit::Width => Ok(if parameter == Parameter::Width { 1.0 } else { 0.0 }),
        PitchLimit::Start => Err(Undefined("the start of the spiral determines the smallest pitch")),
        PitchLimit::Stop | PitchLimit::Contact(_) => {
            Err(Undefined("the stop of handle 1 determines the smallest pitch"))
        }
    })
}

fn of_pitch(of_measure: impl Fn(Parameter) -> Result<f64, Undefined>) -> Derivatives {
    Parameter::ALL.map(|parameter| match parameter {
        Parameter::Pitch => Err(Undefined("the pitch is the answer itself and does not depend on the planned pitch")),
        _ if parameter.is_of_times() || parameter.is_of_play() => Ok(0.0),
        _ if parameter.is_of_turn() => Err(Undefined("the smallest pitch is that of a spiral without a turn")),
        _ => of_measure(parameter),
    })
}

/// Derivatives of the largest speed ratio over a run.
pub(super) fn of_largest_ratio(varied: &VariedDragon, largest: &LargestRatio) -> Derivatives {
    let extremum = Extremum::of_ratio(varied, largest);
    Parameter::ALL.map(|parameter| extremum?.rate(parameter))
}

/// An extremum over the travel, and the motion of its travel.
#[derive(Clone, Copy, Debug)]
struct Extremum {
    value: Rates,
    motion: Motion,
}

/// Motion of an extremum's travel when a parameter changes.
#[derive(Clone, Copy, Debug)]
enum Motion {
    /// The travel is fixed, or the extremum is smooth. In both cases the motion does not change the value.
    Held,
    /// This quantity stays 0.
    Bound(Rates),
    /// The extremum is at the end of a passage. Its motion is unknown.
    PassageEnd,
}

impl Extremum {
    fn of_clearance(varied: &VariedDragon, travel_m: f64, benches: [usize; 2]) -> Result<Self, Undefined> {
        if let Some(motion) = end_motion(varied, travel_m) {
            return Ok(Self { value: at(varied, travel_m, benches).clearance(benches)?, motion });
        }
        let closing = |travel_m| at(varied, travel_m, benches).closing(benches);
        let travel_m = stationary(varied, travel_m, closing)?;
        Ok(Self { value: at(varied, travel_m, benches).clearance(benches)?, motion: Motion::Held })
    }

    fn of_ratio(varied: &VariedDragon, largest: &LargestRatio) -> Result<Self, Undefined> {
        let at = |travel_m| Local::new(varied, travel_m, largest.handle + 1);
        let local = at(largest.travel_m);
        let value = local.speed_ratio();
        if largest.handle == 0 {
            return Ok(Self { value, motion: Motion::Held });
        }
        if let Some(motion) = end_motion(varied, largest.travel_m) {
            return Ok(Self { value, motion });
        }
        match *local.on_seams(TRAVEL_TOLERANCE_M) {
            [] => {
                let travel_m = stationary(varied, largest.travel_m, |travel_m| Ok(-at(travel_m).speed_ratio().travel))?;
                Ok(Self { value: at(travel_m).speed_ratio(), motion: Motion::Held })
            }
            [(handle, seam)] => {
                let moved = |measure| varied.family.seam_variations(measure)[seam];
                Ok(Self { value, motion: Motion::Bound(local.handle_travel(handle).less_on_route(moved)) })
            }
            _ => Err(Undefined("more than one handle passes a seam of the route at once")),
        }
    }

    /// Derivative of the value with respect to a parameter.
    fn rate(&self, parameter: Parameter) -> Result<f64, Undefined> {
        let held = self.value.of(parameter);
        match self.motion {
            Motion::Held => Ok(held),
            Motion::Bound(bound) => Ok(held - self.value.travel * bound.of(parameter) / bound.travel),
            Motion::PassageEnd => Err(Undefined("the end of the passage determines the extremum")),
        }
    }
}

/// The motion of an extremum at an end of the run; `None` if it is at neither end.
fn end_motion(varied: &VariedDragon, travel_m: f64) -> Option<Motion> {
    let (start_m, end_m) = (varied.dragon.start_travel_m(), varied.dragon.end_travel_m());
    if travel_m <= start_m + TRAVEL_TOLERANCE_M {
        Some(Motion::Held)
    } else if travel_m < end_m - TRAVEL_TOLERANCE_M {
        None
    } else if varied.family.centre().is_some() {
        // A spiral ends at the travel at which the head is on the circle.
        Some(Motion::Bound(Local::new(varied, travel_m, 1).head_radius()))
    } else if varied.family.is_fixed() && varied.dragon.feasible_end() == FeasibleEnd::RouteEnd {
        Some(Motion::Held)
    } else {
        Some(Motion::PassageEnd)
    }
}

/// Finds the travel near a given one at which a slope changes from negative to positive, to rounding, by bisection.
fn stationary(
    varied: &VariedDragon,
    near_m: f64,
    slope: impl Fn(f64) -> Result<f64, Undefined>,
) -> Result<f64, Undefined> {
    let (start_m, end_m) = (varied.dragon.start_travel_m(), varied.dragon.end_travel_m());
    let mut reach_m = TRAVEL_TOLERANCE_M;
    let (low_m, high_m) = loop {
        let (low_m, high_m) = ((near_m - reach_m).max(start_m), (near_m + reach_m).min(end_m));
        if slope(low_m)? <= 0.0 && slope(high_m)? >= 0.0 {
            break (low_m, high_m);
        }
        if reach_m > LONGEST_REACH_M {
            return Err(Undefined("the extremum is at a kink"));
        }
        reach_m *= 4.0;
    };
    let steepest = slope(low_m)?.abs().max(slope(high_m)?.abs());
    let (low_m, high_m) =
        try_turning_point(low_m, high_m, FINEST_M, |middle_m| slope(middle_m).map(|slope| slope >= 0.0))?;
    // If the slope jumps over 0, bisection does not make it small.
    let left = slope(low_m)?.abs().min(slope(high_m)?.abs());
    if left <= steepest.mul_add(1e-3, 1e-9) { Ok(low_m) } else { Err(Undefined("the extremum is at a kink")) }
}

fn at(varied: &VariedDragon, travel_m: f64, benches: [usize; 2]) -> Local<'_> {
    Local::new(varied, travel_m, benches[1] + 2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dragon::{Dimensions, Meter};
    use crate::numerics::turning_point;
    use crate::planner::Setting;
    use crate::route::{RouteSpec, TurnaroundSpec};

    /// Half of a difference in metres. The error of a difference is of the order of its square, about 10⁻⁸. The rounding of a
    /// speed ratio divided by it is far below that.
    const STEP_M: f64 = 1e-4;

    fn walk(setting: &Setting) -> VariedDragon {
        let family = setting.route.family(setting.speed_mps, setting.dimensions.links_m()).expect("a valid turnaround");
        VariedDragon::new(setting.dimensions, family, &Meter::unlimited()).expect("the dragon stands on its way in")
    }

    /// Travel of the head at which a handle is on a seam.
    fn crossing_m(varied: &VariedDragon, handle: usize, seam: usize) -> f64 {
        let dragon = &varied.dragon;
        let parameter = dragon.route().seams()[seam];
        let (from_m, to_m) = (dragon.start_travel_m(), dragon.end_travel_m());
        let reached =
            |travel_m| dragon.chain(travel_m).expect("within the run").nth(handle).expect("the handle exists");
        turning_point(from_m, to_m, FINEST_M, |travel_m| reached(travel_m).parameter >= parameter).0
    }

    fn ratio(varied: &VariedDragon, handle: usize, travel_m: f64) -> f64 {
        varied.dragon.chain(travel_m).expect("within the run").nth(handle).expect("the handle exists").speed_ratio
    }

    /// The paper's dragon has many such maxima, but none of them is the largest.
    #[test]
    fn a_maximum_at_a_kink_moves_with_the_seam() {
        let dimensions = Dimensions::new(12, 3.41, 2.20, 0.30, 0.275).expect("the paper's benches are valid");
        let setting =
            Setting { dimensions, route: RouteSpec::from(TurnaroundSpec::default()), speed_mps: 1.0, accel_mps2: None };
        let planned = walk(&setting);
        let mut kinks = 0;
        for (crossing, seam, handle) in (0..12)
            .flat_map(|crossing| (0..3).flat_map(move |seam| (1..12).map(move |handle| (crossing, seam, handle))))
        {
            let travel_m = crossing_m(&planned, crossing, seam);
            let here = ratio(&planned, handle, travel_m);
            let largest = LargestRatio { ratio: here, travel_m, handle };
            if crossing > handle || [-1e-6, 1e-6].iter().any(|by| ratio(&planned, handle, travel_m + by) >= here) {
                continue;
            }
            kinks += 1;
            let derivatives = of_largest_ratio(&planned, &largest);
            let has = |parameter: &Parameter| setting.has(*parameter) && !parameter.is_of_times();
            for parameter in Parameter::ALL.into_iter().filter(has) {
                let moved = |by_m: f64| {
                    let setting = setting.with(parameter, setting.value(parameter) + by_m).expect("a small change");
                    let varied = walk(&setting);
                    ratio(&varied, handle, crossing_m(&varied, crossing, seam))
                };
                let expected = (moved(STEP_M) - moved(-STEP_M)) / (2.0 * STEP_M);
                let actual = derivatives[parameter as usize].expect("one handle is on a seam");
                assert!(
                    (actual - expected).abs() <= 1e-5 * (1.0 + expected.abs()),
                    "handle {handle} with handle {crossing} on seam {seam}, {parameter}: {actual}, not {expected}"
                );
            }
        }
        assert!(kinks > 0, "there are maxima at kinks");
    }
}
