//! How the first contact of two dragons changes with their starts, speeds and measures.
//!
//! Let c(s, t) be the clearance of the pair that touches, over the travels of both heads, and v and w their speeds. At the
//! contact c = 0. So a parameter q changes its time T by dT/dq = −(∂c/∂q) / (∂c/∂s·v + ∂c/∂t·w), where ∂c/∂q is at a fixed time (implicit
//! function theorem). A later start of the first dragon takes v per second from its travel, and a greater speed adds the growth of
//! its travel at this time, and so does a greater acceleration.

use super::board_variation::{BoardVariation, TIE_M, Undefined, Witness};
use super::chain_variation::{Change, handle_variations};
use super::{Parameter, Setting};
use crate::clearance::{ClearanceSearch, Meeting, Unfinished, first_between};
use crate::dragon::{Board, Handle};
use crate::formation::{Formation, Planned, Timetable};
use crate::route::RouteFamily;

/// What changes the contact of two dragons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeetingParameter {
    /// Plan time at which the dragon leaves.
    Start,
    /// A parameter of its plan.
    Plan(Parameter),
}

impl MeetingParameter {
    /// The configuration's key of the parameter.
    pub fn key(self) -> &'static str {
        match self {
            Self::Start => "start_s",
            Self::Plan(parameter) => parameter.key(),
        }
    }
}

/// The change of the contact's time with one parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeetingRate {
    /// Index of the dragon.
    pub dragon: usize,
    /// Its parameter.
    pub parameter: MeetingParameter,
    /// Planned value of the parameter.
    pub value: f64,
    /// Change of the time per unit of the parameter.
    pub derivative: Result<f64, Undefined>,
}

/// A contact of two dragons, and how its time changes.
#[derive(Clone, Debug, PartialEq)]
pub struct MeetingSensitivity {
    /// The first contact between two dragons.
    pub meeting: Meeting,
    /// The changes with all parameters of both dragons.
    pub rates: Vec<MeetingRate>,
}

/// A dragon at the contact.
struct Touching<'a> {
    planned: &'a Planned,
    setting: &'a Setting,
    family: RouteFamily,
    /// Index of the bench that touches.
    bench: usize,
    handles: Vec<Handle>,
    board: Board,
    speed_mps: f64,
}

/// The first contact between two dragons up to a plan time, and its sensitivity; `None` without a contact. `settings` are the plans
/// of all dragons.
///
/// # Errors
/// The errors of [`first_between`].
///
/// # Panics
/// Panics if there is not one setting for each dragon, or if its route is not that of the dragon.
pub fn meeting_sensitivity(
    formation: &Formation,
    settings: &[Setting],
    [from_s, to_s]: [f64; 2],
) -> Result<Option<MeetingSensitivity>, Unfinished> {
    assert_eq!(settings.len(), formation.dragons().len(), "the settings of a formation");
    let Some(meeting) = first_between(formation, 0.0, from_s, to_s)? else { return Ok(None) };
    let places = meeting.benches.map(|bench| formation.layout().place(bench));
    let touching = places
        .map(|(dragon, bench)| Touching::new(&formation.dragons()[dragon], &settings[dragon], bench, meeting.time_s));
    let witness = witness(formation, &touching, meeting.time_s);
    let closing_mps = witness.and_then(|witness| closing_mps(&touching, &witness));
    let mut rates = Vec::new();
    for (i, (dragon, _)) in places.into_iter().enumerate() {
        let setting = &settings[dragon];
        let plans = Parameter::ALL.into_iter().filter(|parameter| setting.has(*parameter));
        for parameter in std::iter::once(MeetingParameter::Start).chain(plans.map(MeetingParameter::Plan)) {
            let derivative = witness.and_then(|witness| {
                Ok(-touching[i].rate(i, parameter, &touching, &witness, meeting.time_s)? / closing_mps?)
            });
            rates.push(MeetingRate { dragon, parameter, value: touching[i].value(parameter), derivative });
        }
    }
    Ok(Some(MeetingSensitivity { meeting, rates }))
}

/// The points that decide the clearance, if only one pair touches.
fn witness(formation: &Formation, touching: &[Touching<'_>; 2], time_s: f64) -> Result<Witness, Undefined> {
    let handles: Vec<Handle> = formation.dragons().iter().flat_map(|planned| planned.chain_at(time_s)).collect();
    let mut boards = Vec::new();
    formation.place_boards(&handles, Handle::in_space, &mut boards);
    let mut search = ClearanceSearch::of(&formation.layout().between_dragons());
    let near = search.within(&boards, TIE_M);
    if near.first().is_none_or(|pair| pair.clearance_m < -TIE_M) {
        return Err(Undefined("benches touch at the start already"));
    }
    if near.len() > 1 {
        return Err(Undefined("more than one pair touches at once"));
    }
    Witness::of(&touching[0].board, &touching[1].board)
}

/// Growth of the clearance per second of plan time, which is below 0.
fn closing_mps(touching: &[Touching<'_>; 2], witness: &Witness) -> Result<f64, Undefined> {
    let own_mps = |i: usize| touching[i].growth(i, Change::Travel, touching, witness) * touching[i].speed_mps;
    let closing_mps = own_mps(0) + own_mps(1);
    if closing_mps < 0.0 {
        Ok(closing_mps)
    } else {
        Err(Undefined("the benches only graze each other: a small change can remove the contact"))
    }
}

impl<'a> Touching<'a> {
    fn new(planned: &'a Planned, setting: &'a Setting, bench: usize, time_s: f64) -> Self {
        let handles: Vec<Handle> = planned.chain_at(time_s).take(bench + 2).collect();
        let board = planned.dragon.board(bench, &handles[bench], &handles[bench + 1]);
        let family = setting.route.family(setting.speed_mps, planned.dragon.dimensions().links_m());
        let family = family.expect("the route is planned");
        Self { planned, setting, family, bench, handles, board, speed_mps: planned.speed_mps(time_s) }
    }

    /// Growth of the clearance at a fixed plan time, per unit of a parameter of this dragon, which is number `i`.
    fn rate(
        &self,
        i: usize,
        parameter: MeetingParameter,
        touching: &[Self; 2],
        witness: &Witness,
        time_s: f64,
    ) -> Result<f64, Undefined> {
        let along = |walked_m: f64| Ok(walked_m * self.growth(i, Change::Travel, touching, witness));
        match parameter {
            MeetingParameter::Start => along(-self.speed_mps),
            MeetingParameter::Plan(timing) if timing.is_of_times() => along(self.walked_per(timing, time_s)?),
            MeetingParameter::Plan(measure) => Ok(self.growth(i, Change::Measure(measure), touching, witness)),
        }
    }

    /// Growth of the clearance per unit of a change of this dragon.
    fn growth(&self, i: usize, change: Change, touching: &[Self; 2], witness: &Witness) -> f64 {
        let dragon = &self.planned.dragon;
        let variations = handle_variations(dragon.dimensions(), &self.family, &self.handles, change);
        let own = BoardVariation::new(dragon, self.bench, &self.board, &variations[self.bench..], change);
        let fixed = BoardVariation::default();
        let both = if i == 0 { [&own, &fixed] } else { [&fixed, &own] };
        witness.variation([&touching[0].board, &touching[1].board], both)
    }

    /// Growth of the travel at a fixed time per unit of the planned speed or acceleration.
    fn walked_per(&self, timing: Parameter, time_s: f64) -> Result<f64, Undefined> {
        let dragon = &self.planned.dragon;
        let start_s = self.planned.timetable.start_s();
        let travel_m = |value: f64| {
            let (from_m, to_m) = (dragon.start_travel_m(), dragon.end_travel_m());
            let Setting { speed_mps, accel_mps2, .. } = self.setting.timed(timing, value);
            let timetable = Timetable::leaving(start_s, from_m, speed_mps, accel_mps2, to_m);
            Planned { dragon: dragon.clone(), timetable }.travel_m(time_s)
        };
        // The travel is linear or quadratic in the speed, and linear in the acceleration or in 1 ÷ it: such a difference is exact
        // but for rounding.
        let planned = self.setting.value(timing);
        let step = STEP * planned;
        let [less, same, more] = [-step, 0.0, step].map(|by| travel_m(planned + by));
        let [before, after] = [same - less, more - same];
        if (after - before).abs() > 0.01 * before.abs().max(after.abs()) {
            return Err(Undefined("the head changes its ramp at the first contact"));
        }
        Ok((more - less) / (2.0 * step))
    }

    fn value(&self, parameter: MeetingParameter) -> f64 {
        match parameter {
            MeetingParameter::Start => self.planned.timetable.start_s(),
            MeetingParameter::Plan(parameter) => self.setting.value(parameter),
        }
    }
}

/// Part of a speed or an acceleration by which it is varied.
const STEP: f64 = 1e-5;
