//! `solve pitch`: how tight may the spiral be if the head is to come to a circle with no contact on the way?

use bench_dragon_geometry::planner::{PitchError, PitchLimit, SmallestPitch, smallest_pitch};
use bench_dragon_geometry::route::{Route, RouteSpec, SpiralSpec, TurnaroundSpec};
use serde::Serialize;

use super::caption::caption;
use super::{figures, save_config};
use crate::cli::{BadInput, PitchArgs};
use crate::command::load_config;
use crate::command::print::print_report;
use crate::config::{Config, Overrides};

#[derive(Serialize)]
struct PitchAnswer {
    pitch_m: Option<f64>,
    /// What goes wrong at a pitch just under it.
    limit: Option<Limit>,
    /// The clearance that was asked for, if one was.
    #[serde(skip_serializing_if = "Option::is_none")]
    clearance_m: Option<f64>,
    infeasible: Option<String>,
}

#[derive(Serialize)]
struct Limit {
    kind: &'static str,
    benches: Option<[usize; 2]>,
    point_m: Option<[f64; 2]>,
}

pub(super) fn run(args: &PitchArgs) -> anyhow::Result<()> {
    let config = load_config(&args.config, Overrides::default())?;
    let (start_turns, planned_diameter_m) = match config.route() {
        RouteSpec::Spiral(plan) => (plan.start_turns, TurnaroundSpec::default().turn_diameter_m),
        RouteSpec::Turnaround(plan) => (SpiralSpec::default().start_turns, plan.turn_diameter_m),
    };
    let turn_diameter_m = args.turn_diameter.unwrap_or(planned_diameter_m);
    let (dimensions, clearance_m) = (config.dragon().dimensions(), args.clearance.unwrap_or(0.0));
    let found = smallest_pitch(dimensions, start_turns, turn_diameter_m, clearance_m, &args.answer.work.meter());
    let found = match found {
        Err(error @ (PitchError::Route(_) | PitchError::TurnDiameter { .. })) => {
            return Err(BadInput(error.to_string()).into());
        }
        found => found.map_err(|error| error.to_string()),
    };
    print_report(
        args.answer.format.format,
        &PitchAnswer::of(&found, args.clearance),
        text(&found, turn_diameter_m, &config, clearance_m),
    )?;
    if args.answer.save_config.is_none() && args.answer.figure.figure.is_none() {
        return Ok(());
    }
    match &found {
        Ok(smallest) => {
            let plan = SpiralSpec { pitch_m: smallest.pitch_m, start_turns };
            let tightest = config.with_route(RouteSpec::Spiral(plan))?;
            let end_m = Route::spiral(plan.pitch_m, plan.start_turns)?.to_circle(turn_diameter_m)?.end_travel_m();
            draw(args, &tightest, turn_diameter_m, end_m, smallest)?;
            save_config(&args.answer, Ok(&tightest))
        }
        Err(reason) => {
            figures::refuse(&args.answer.figure, reason)?;
            save_config(&args.answer, Err(reason))
        }
    }
}

/// Draws the dragon where the pair that binds is nearest, or with its head on the circle, at the end of its way.
fn draw(
    args: &PitchArgs,
    tightest: &Config,
    turn_diameter_m: f64,
    end_m: f64,
    SmallestPitch { pitch_m, limit }: &SmallestPitch,
) -> anyhow::Result<()> {
    if args.answer.figure.figure.is_none() {
        return Ok(());
    }
    let (travel_m, benches) = match limit {
        PitchLimit::Contact(contact) => (contact.travel_m.clamp(0.0, end_m), Some(contact.benches)),
        PitchLimit::Stop | PitchLimit::Start | PitchLimit::Width => (end_m, None),
    };
    let time_s = tightest.timetable().time_s(travel_m);
    let caption =
        caption(&args.answer.figure, tightest, format!("The tightest spiral, pitch {pitch_m:.6} m, at {time_s:.6} s"));
    let view = figures::pitch_view(caption, tightest.dragon(), turn_diameter_m, travel_m, benches);
    figures::save_and_tell(view.draw(), &args.answer.figure, args.answer.format.format)
}

impl PitchAnswer {
    fn of(found: &Result<SmallestPitch, String>, clearance_m: Option<f64>) -> Self {
        let SmallestPitch { pitch_m, limit } = match found {
            Ok(smallest) => *smallest,
            Err(reason) => return Self { pitch_m: None, limit: None, clearance_m, infeasible: Some(reason.clone()) },
        };
        let (kind, contact) = match limit {
            PitchLimit::Contact(contact) => ("contact", Some(contact)),
            PitchLimit::Stop => ("stop", None),
            PitchLimit::Start => ("start", None),
            PitchLimit::Width => ("width", None),
        };
        let benches = contact.map(|contact| contact.benches);
        let limit = Limit { kind, benches, point_m: contact.map(|contact| contact.point.to_array()) };
        Self { pitch_m: Some(pitch_m), limit: Some(limit), clearance_m, infeasible: None }
    }
}

fn text(found: &Result<SmallestPitch, String>, turn_diameter_m: f64, config: &Config, clearance_m: f64) -> String {
    let SmallestPitch { pitch_m, limit } = match found {
        Ok(smallest) => *smallest,
        Err(reason) => return format!("infeasible: {reason}"),
    };
    let limit = match limit {
        PitchLimit::Contact(contact) => {
            let ([first, second], point) = (contact.benches, contact.point);
            let how = if clearance_m == 0.0 { "touch".to_owned() } else { format!("come within {clearance_m} m") };
            format!("benches {first} and {second} would {how}, at ({:.6}, {:.6}) m", point.x, point.y)
        }
        PitchLimit::Stop => "handle 1 would stop before the head is there".to_owned(),
        PitchLimit::Start => "the spiral would start inside the circle, or too near to its centre".to_owned(),
        PitchLimit::Width => {
            let width_m = config.dragon().dimensions().width_m();
            format!("it would not be above width_m, {width_m}: that rule binds, not a pair of benches")
        }
    };
    format!("smallest pitch {pitch_m:.6} m for a circle of diameter {turn_diameter_m} m\nany tighter, {limit}")
}
