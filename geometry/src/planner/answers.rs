//! The answers for one setting, each with its derivatives.

use std::fmt::{self, Display, Formatter};

use thiserror::Error;

use super::derivative::{self, Derivatives};
use super::local::VariedDragon;
use super::pitch::{PitchError, PitchLimit, SmallestPitch, smallest_pitch_on};
use super::{Infeasible, Parameter, PlannedTurn, Setting, largest_speed_ratio, least_clearance, passage_through};
use crate::clearance::{first_contact, first_possible_touch};
use crate::dragon::{DimensionsError, DragonError, FeasibleEnd, Meter, Spent};
use crate::number::Number;
use crate::route::{Route, RouteError, RouteFamily, RouteShape, SpiralSpec};

/// A quantity that the planner calculates for a setting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Show time of the first contact on the planned run.
    FirstContact,
    /// Show time up to which no pose that the play of the hinges allows touches on the planned run.
    EarliestContact,
    /// Show time of the first contact with all links as long as the play of the hinges allows.
    TautContact,
    /// Least clearance of any pair over the passage, below 0 if benches overlap.
    LeastClearance,
    /// Largest speed of any handle over the passage divided by the speed of the head.
    LargestSpeedRatio,
    /// Smallest pitch of a spiral on which the head reaches the turning circle without a contact, for hinges without play.
    SmallestPitch,
}

impl Quantity {
    const ALL: [Self; 6] = [
        Self::FirstContact,
        Self::EarliestContact,
        Self::TautContact,
        Self::LeastClearance,
        Self::LargestSpeedRatio,
        Self::SmallestPitch,
    ];

    /// The quantities of a plan: those about the play only with loose hinges.
    pub fn all_of(setting: &Setting) -> impl Iterator<Item = Self> {
        let has_play = setting.dimensions.play_m() > 0.0;
        let is_of_play = |quantity: &Self| matches!(quantity, Self::EarliestContact | Self::TautContact);
        Self::ALL.into_iter().filter(move |quantity| has_play || !is_of_play(quantity))
    }

    /// Key in answers, name in messages, and unit.
    fn words(self) -> [&'static str; 3] {
        match self {
            Self::FirstContact => ["first_contact_s", "first contact", "s"],
            Self::EarliestContact => ["earliest_s", "earliest possible contact", "s"],
            Self::TautContact => ["taut_contact_s", "first contact pulled taut", "s"],
            Self::LeastClearance => ["least_clearance_m", "least clearance", "m"],
            Self::LargestSpeedRatio => ["largest_speed_ratio", "largest speed ratio", ""],
            Self::SmallestPitch => ["smallest_pitch_m", "smallest pitch", "m"],
        }
    }

    /// Key of the quantity in answers, with the unit last.
    pub fn key(self) -> &'static str {
        self.words()[0]
    }

    /// Unit of the quantity; empty for a ratio.
    pub fn unit(self) -> &'static str {
        self.words()[2]
    }
}

impl Display for Quantity {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.words()[1])
    }
}

/// Reason why a quantity has no value.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Unanswered {
    /// No benches touch on the planned run.
    #[error("no contact before the run ends: {0}")]
    NoContact(FeasibleEnd),
    /// The dragon has fewer than three benches.
    #[error("a dragon with fewer than three benches has no pair of benches that can touch")]
    NoPairs,
    /// The dimensions are invalid.
    #[error(transparent)]
    Dimensions(#[from] DimensionsError),
    /// The route is invalid.
    #[error(transparent)]
    Route(#[from] RouteError),
    /// The dragon cannot walk the route.
    #[error(transparent)]
    Dragon(#[from] DragonError),
    /// The dragon cannot walk the whole passage.
    #[error(transparent)]
    Infeasible(#[from] Infeasible),
    /// There is no smallest pitch.
    #[error(transparent)]
    Pitch(#[from] PitchError),
    /// The limit of work is reached.
    #[error("no answer: {0}")]
    TooMuchWork(#[from] Spent),
    /// The route is a path.
    #[error("a path has no pitch")]
    NoPitch,
    /// The spiral starts inside the turning circle.
    #[error("the spiral starts inside the turning circle of {} m diameter", Number(*.0))]
    StartsInside(f64),
    /// The quantity is about a spiral, the parameter about a turn.
    #[error("the smallest pitch is that of a spiral without a turn")]
    NoTurn,
    /// The quantity is the pitch itself.
    #[error("the pitch is the answer itself and does not depend on the planned pitch")]
    OwnPitch,
}

/// The value of a quantity in its unit, and functions for its derivatives with respect to each parameter, and for its value at
/// another speed or acceleration of the head.
pub(super) struct Answer {
    pub(super) value: f64,
    pub(super) derivatives: Box<dyn Fn() -> Derivatives + Send + Sync>,
    pub(super) timed: Box<dyn Fn(Parameter, f64) -> f64 + Send + Sync>,
}

impl Answer {
    /// The answer of a quantity that does not depend on times.
    fn at_any_time(value: f64, derivatives: impl Fn() -> Derivatives + Send + Sync + 'static) -> Self {
        Self { value, derivatives: Box::new(derivatives), timed: Box::new(move |_, _| value) }
    }

    /// The show time at which the head is at a travel. At another speed the walked interval, up to `end_m`, stays that of the plan.
    fn at_travel(
        travel_m: f64,
        setting: &Setting,
        end_m: f64,
        derivatives: impl Fn() -> Derivatives + Send + Sync + 'static,
    ) -> Self {
        let planned = setting.clone();
        let timed = move |parameter, value| planned.timed(parameter, value).timetable(end_m).time_s(travel_m);
        let value = setting.timetable(end_m).time_s(travel_m);
        Self { value, derivatives: Box::new(derivatives), timed: Box::new(timed) }
    }
}

/// Calculates one quantity. The meter counts the work.
pub(super) fn answer(
    quantity: Quantity,
    setting: &Setting,
    turn_diameter_m: f64,
    meter: &Meter,
) -> Result<Answer, Unanswered> {
    match quantity {
        Quantity::FirstContact => contact_time(setting, meter),
        Quantity::EarliestContact => earliest_time(setting, meter),
        Quantity::TautContact => taut_time(setting, meter),
        Quantity::LeastClearance => {
            let passage = passage(setting, turn_diameter_m, meter)?;
            let (start_m, end_m) = (passage.dragon.start_travel_m(), passage.dragon.end_travel_m());
            let closest = least_clearance(&passage.dragon, start_m, end_m, |_| ())?.ok_or(Unanswered::NoPairs)?;
            let (value, benches) = (closest.pair.clearance_m, closest.pair.benches);
            let derivatives = move || derivative::of_least_clearance(&passage, closest.travel_m, benches);
            Ok(Answer::at_any_time(value, derivatives))
        }
        Quantity::LargestSpeedRatio => {
            let passage = passage(setting, turn_diameter_m, meter)?;
            let largest = largest_speed_ratio(&passage.dragon)?;
            let derivatives = move || derivative::of_largest_ratio(&passage, &largest);
            Ok(Answer::at_any_time(largest.ratio, derivatives))
        }
        Quantity::SmallestPitch => pitch(setting, turn_diameter_m, meter),
    }
}

fn contact_time(setting: &Setting, meter: &Meter) -> Result<Answer, Unanswered> {
    let run = VariedDragon::new(setting.dimensions, family(setting)?, meter)?;
    let (start_m, end_m) = (run.dragon.start_travel_m(), run.dragon.end_travel_m());
    let contact =
        first_contact(&run.dragon, start_m, end_m)?.ok_or(Unanswered::NoContact(run.dragon.feasible_end()))?;
    let timetable = setting.timetable(end_m);
    let derivatives = move || derivative::of_contact_time(&run, &contact, &timetable);
    Ok(Answer::at_travel(contact.travel_m, setting, end_m, derivatives))
}

/// The end of the proof that no pose of loose hinges touches.
fn earliest_time(setting: &Setting, meter: &Meter) -> Result<Answer, Unanswered> {
    let run = VariedDragon::new(setting.dimensions, family(setting)?, meter)?.dragon;
    let (start_m, end_m) = (run.start_travel_m(), run.end_travel_m());
    let touch =
        first_possible_touch(&run, 0.0, start_m, end_m)?.ok_or_else(|| Unanswered::NoContact(run.feasible_end()))?;
    let timetable = setting.timetable(end_m);
    let derivatives = move || derivative::of_proven_time(touch.travel_m, &timetable);
    Ok(Answer::at_travel(touch.travel_m, setting, end_m, derivatives))
}

/// The first contact of the dragon that is pulled. The walked interval is that of the loose dragon.
fn taut_time(setting: &Setting, meter: &Meter) -> Result<Answer, Unanswered> {
    let run = VariedDragon::new(setting.dimensions, family(setting)?, meter)?;
    let end_m = run.dragon.end_travel_m();
    let dragon = run.dragon.taut().expect("the quantity is asked for with play only").clone();
    let no_contact = Unanswered::NoContact(dragon.feasible_end());
    let contact = first_contact(&dragon, dragon.start_travel_m(), dragon.end_travel_m())?.ok_or(no_contact)?;
    let (taut, timetable) = (VariedDragon { dragon, ..run }, setting.timetable(end_m));
    let derivatives = move || derivative::of_taut_time(&taut, &contact, &timetable);
    Ok(Answer::at_travel(contact.travel_m, setting, end_m, derivatives))
}

/// The smallest pitch without play. For a turnaround: that of a spiral with the paper's number of turns at the start.
fn pitch(setting: &Setting, turn_diameter_m: f64, meter: &Meter) -> Result<Answer, Unanswered> {
    let start_turns = setting.route.spiral().ok_or(Unanswered::NoPitch)?.start_turns;
    let rigid = Setting { dimensions: setting.dimensions.without_play(), ..setting.clone() };
    let SmallestPitch { pitch_m, limit } =
        smallest_pitch_on(&rigid.route, &rigid.dimensions, start_turns, turn_diameter_m, 0.0, meter)?;
    let PitchLimit::Contact(contact) = limit else {
        return Ok(Answer::at_any_time(pitch_m, move || derivative::of_untouching_pitch(&limit)));
    };
    let plan = SpiralSpec { pitch_m, start_turns };
    let passage = spiral_passage(&rigid, plan, turn_diameter_m, meter)?;
    Ok(Answer::at_any_time(pitch_m, move || derivative::of_touching_pitch(&passage, &contact)))
}

fn family(setting: &Setting) -> Result<RouteFamily, RouteError> {
    setting.route.family(setting.speed_mps, setting.dimensions.links_m())
}

/// The passage. On a spiral: from the start until the head is on the circle. On a turnaround: the passage of all benches. On a path:
/// the planned run.
fn passage(setting: &Setting, turn_diameter_m: f64, meter: &Meter) -> Result<VariedDragon, Unanswered> {
    if let Some(turnaround) = setting.route.planned_turnaround(setting.speed_mps)? {
        let ground = setting.route.ground.clone();
        let dragon = passage_through(PlannedTurn::on(turnaround, ground.clone()), setting.dimensions, meter)?;
        let family = RouteFamily::of_turnaround(turnaround, dragon.route().clone()).on_ground(ground);
        return Ok(VariedDragon { dragon, family });
    }
    match setting.route.shape {
        RouteShape::Spiral(spiral) => spiral_passage(setting, spiral, turn_diameter_m, meter),
        _ => Ok(VariedDragon::new(setting.dimensions, family(setting)?, meter)?),
    }
}

fn spiral_passage(
    setting: &Setting,
    spec: SpiralSpec,
    turn_diameter_m: f64,
    meter: &Meter,
) -> Result<VariedDragon, Unanswered> {
    Route::spiral(spec.pitch_m, spec.start_turns)?;
    if spec.starts_inside(turn_diameter_m) {
        return Err(Unanswered::StartsInside(turn_diameter_m));
    }
    let family = setting.route.lead_in(spec, turn_diameter_m, setting.dimensions.links_m())?;
    let passage = VariedDragon::new(setting.dimensions, family, meter)?;
    Infeasible::check(&passage.dragon)?;
    Ok(passage)
}
