//! The four answers for one setting, each with its derivatives.

use std::fmt::{self, Display, Formatter};
use std::sync::Arc;

use thiserror::Error;

use super::derivative::{self, Derivatives};
use super::local::VariedDragon;
use super::pitch::{PitchError, PitchLimit, SmallestPitch, smallest_pitch};
use super::{
    ClosestApproach, Infeasible, LargestRatio, Setting, largest_speed_ratio, least_clearance, passage_through,
};
use crate::clearance::{Contact, first_contact};
use crate::dragon::{Dimensions, DimensionsError, Dragon, DragonError, Meter, RunEnd, Spent};
use crate::number::Number;
use crate::planner::HeadTimetable;
use crate::route::{PitchFamily, Route, RouteError, RouteSpec, SpiralSpec};

/// What is asked of a setting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Show time of the first contact of the planned run.
    FirstContact,
    /// Least clearance of any pair over the passage, below 0 where benches overlap.
    LeastClearance,
    /// Largest speed of any handle over the passage ÷ speed of the head.
    LargestSpeedRatio,
    /// Smallest pitch at which the head reaches the turning circle on a spiral with no contact on the way.
    SmallestPitch,
}

impl Quantity {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::FirstContact, Self::LeastClearance, Self::LargestSpeedRatio, Self::SmallestPitch];

    /// Its name in answers, the unit last.
    pub fn key(self) -> &'static str {
        match self {
            Self::FirstContact => "first_contact_s",
            Self::LeastClearance => "least_clearance_m",
            Self::LargestSpeedRatio => "largest_speed_ratio",
            Self::SmallestPitch => "smallest_pitch_m",
        }
    }

    /// The unit that it is given in; none for a ratio.
    pub fn unit(self) -> &'static str {
        match self {
            Self::FirstContact => "s",
            Self::LeastClearance | Self::SmallestPitch => "m",
            Self::LargestSpeedRatio => "",
        }
    }
}

impl Display for Quantity {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::FirstContact => "first contact",
            Self::LeastClearance => "least clearance",
            Self::LargestSpeedRatio => "largest speed ratio",
            Self::SmallestPitch => "smallest pitch",
        })
    }
}

/// Why there is no answer.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Unanswered {
    /// No benches touch on the planned run.
    #[error("no contact before the run ends: {0}")]
    NoContact(RunEnd),
    /// Fewer than three benches.
    #[error("there are no two benches that could touch")]
    NoPairs,
    /// Impossible benches.
    #[error(transparent)]
    Dimensions(#[from] DimensionsError),
    /// An impossible route.
    #[error(transparent)]
    Route(#[from] RouteError),
    /// Benches and route that do not go together.
    #[error(transparent)]
    Dragon(#[from] DragonError),
    /// A passage that cannot be walked.
    #[error(transparent)]
    Infeasible(#[from] Infeasible),
    /// No pitch is right.
    #[error(transparent)]
    Pitch(#[from] PitchError),
    /// The work that was allowed is done.
    #[error("not known: {0}")]
    TooMuchWork(#[from] Spent),
    /// The spiral begins inside of the circle.
    #[error("the spiral starts inside of the turning circle, of {} m", Number(*.0))]
    StartsInside(f64),
    /// The pitch is what is asked for.
    #[error("the pitch is the answer, whatever is planned")]
    OwnPitch,
}

/// An answer, and what decides it.
#[derive(Debug)]
pub(super) struct Answer {
    value: f64,
    decided_by: Decision,
}

/// What decides an answer.
#[derive(Debug)]
enum Decision {
    Contact { run: VariedDragon, contact: Contact, timetable: HeadTimetable },
    Clearance { passage: VariedDragon, closest: ClosestApproach },
    Ratio { passage: VariedDragon, largest: LargestRatio },
    TouchingPitch { passage: VariedDragon, contact: Contact },
    UntouchingPitch(PitchLimit),
}

impl Answer {
    /// In the quantity's unit.
    pub(super) fn value(&self) -> f64 {
        self.value
    }

    /// Of the value, per unit of each parameter.
    pub(super) fn derivatives(&self) -> Derivatives {
        match &self.decided_by {
            Decision::Contact { run, contact, timetable } => derivative::of_contact_time(run, contact, timetable),
            Decision::Clearance { passage, closest } => {
                derivative::of_least_clearance(passage, closest.travel_m, closest.pair.benches)
            }
            Decision::Ratio { passage, largest } => derivative::of_largest_ratio(passage, largest),
            Decision::TouchingPitch { passage, contact } => derivative::of_touching_pitch(passage, contact),
            Decision::UntouchingPitch(limit) => derivative::of_untouching_pitch(limit),
        }
    }
}

/// The answer to one question, whose work counts on the meter.
pub(super) fn answer(
    quantity: Quantity,
    setting: &Setting,
    turn_diameter_m: f64,
    meter: &Meter,
) -> Result<Answer, Unanswered> {
    match quantity {
        Quantity::FirstContact => contact_time(setting, meter),
        Quantity::LeastClearance => {
            let passage = passage(setting, turn_diameter_m, meter)?;
            let (start_m, end_m) = (passage.dragon.start_travel_m(), passage.dragon.end_travel_m());
            let closest = least_clearance(&passage.dragon, start_m, end_m, |_| ())?.ok_or(Unanswered::NoPairs)?;
            Ok(Answer { value: closest.pair.clearance_m, decided_by: Decision::Clearance { passage, closest } })
        }
        Quantity::LargestSpeedRatio => {
            let passage = passage(setting, turn_diameter_m, meter)?;
            let largest = largest_speed_ratio(&passage.dragon)?;
            Ok(Answer { value: largest.ratio, decided_by: Decision::Ratio { passage, largest } })
        }
        Quantity::SmallestPitch => pitch(setting, turn_diameter_m, meter),
    }
}

fn contact_time(setting: &Setting, meter: &Meter) -> Result<Answer, Unanswered> {
    let run = planned(setting, meter)?;
    let (start_m, end_m) = (run.dragon.start_travel_m(), run.dragon.end_travel_m());
    let contact = first_contact(&run.dragon, start_m, end_m)?.ok_or(Unanswered::NoContact(run.dragon.run_end()))?;
    let timetable = setting.timetable(end_m);
    let value = timetable.time_s(contact.travel_m);
    Ok(Answer { value, decided_by: Decision::Contact { run, contact, timetable } })
}

/// On a turnaround, that of the spiral which starts as far out as the paper's.
fn pitch(setting: &Setting, turn_diameter_m: f64, meter: &Meter) -> Result<Answer, Unanswered> {
    let start_turns = match setting.route {
        RouteSpec::Spiral(plan) => plan.start_turns,
        RouteSpec::Turnaround(_) => SpiralSpec::default().start_turns,
    };
    let SmallestPitch { pitch_m, limit } =
        smallest_pitch(&setting.dimensions, start_turns, turn_diameter_m, 0.0, meter)?;
    let decided_by = match limit {
        PitchLimit::Contact(contact) => {
            let plan = SpiralSpec { pitch_m, start_turns };
            let passage = spiral_passage(plan, setting.dimensions, turn_diameter_m, meter)?;
            Decision::TouchingPitch { passage, contact }
        }
        limit => Decision::UntouchingPitch(limit),
    };
    Ok(Answer { value: pitch_m, decided_by })
}

/// The run as planned.
fn planned(setting: &Setting, meter: &Meter) -> Result<VariedDragon, Unanswered> {
    varied(setting.dimensions, setting.route.family(setting.speed_mps)?, meter)
}

/// The passage: on a spiral from the start until the head is on the circle, on a turnaround that of all benches.
fn passage(setting: &Setting, turn_diameter_m: f64, meter: &Meter) -> Result<VariedDragon, Unanswered> {
    match setting.route {
        RouteSpec::Spiral(spec) => spiral_passage(spec, setting.dimensions, turn_diameter_m, meter),
        RouteSpec::Turnaround(spec) => {
            let turnaround = spec.turnaround(setting.speed_mps)?;
            let dragon = passage_through(turnaround, setting.dimensions, meter)?;
            Ok(VariedDragon { dragon, family: PitchFamily::of_turnaround(turnaround) })
        }
    }
}

fn spiral_passage(
    spec: SpiralSpec,
    dimensions: Dimensions,
    turn_diameter_m: f64,
    meter: &Meter,
) -> Result<VariedDragon, Unanswered> {
    let spiral = Route::spiral(spec.pitch_m, spec.start_turns)?;
    let spiral = spiral.to_circle(turn_diameter_m).map_err(|_| Unanswered::StartsInside(turn_diameter_m))?;
    let passage = varied(dimensions, PitchFamily::of_spiral(spiral), meter)?;
    Infeasible::check(&passage.dragon)?;
    Ok(passage)
}

fn varied(dimensions: Dimensions, family: PitchFamily, meter: &Meter) -> Result<VariedDragon, Unanswered> {
    Ok(VariedDragon { dragon: Dragon::with_meter(dimensions, Arc::clone(family.route()), meter.clone())?, family })
}
