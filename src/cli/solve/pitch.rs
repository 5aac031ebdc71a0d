//! `solve pitch`: finds the smallest pitch of a spiral on which the head reaches a circle without a contact.

use bench_dragon_geometry::number::{Fixed, Place};
use bench_dragon_geometry::planner::{PitchError, PitchLimit, SmallestPitch, guaranteed_pitch, smallest_pitch_on};
use bench_dragon_geometry::route::{RouteShape, SpiralSpec};
use clap::Args;
use serde::Serialize;

use super::figure::{pair, plan_of};
use super::{AnswerArgs, CLEARANCE_M, load_plan, save_config, work_default};
use crate::cli::flags::{BadInput, ConfigArgs, finite, within};
use crate::cli::in_file;
use crate::cli::print::print_report;
use crate::config::Config;
use crate::output::figure::{Circle, PlanView};

/// Find the smallest pitch of a spiral on which the head reaches a circle without a contact.
#[derive(Clone, Debug, Args)]
#[command(mut_arg("work", |arg| work_default(arg, "100; 300 on hills and for play in the hinges")))]
#[command(after_help = "Examples:
  bench-dragon solve pitch --turn-diameter 9 --figure pitch.svg
  bench-dragon solve pitch --turn-diameter 9 --clearance 0.05
  bench-dragon solve pitch --turn-diameter 9 --config stage.toml --save-config tightest.toml")]
pub(crate) struct PitchArgs {
    /// Diameter in metres of the circle that the head must reach [default: the configured turnaround's, else 9].
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, value_parser = finite)]
    pub(crate) turn_diameter: Option<f64>,
    /// Clearance in metres that any two boards must keep, 0 to 10 [default: 0].
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, value_parser = within(CLEARANCE_M))]
    pub(crate) clearance: Option<f64>,
    #[command(flatten)]
    pub(crate) config: ConfigArgs,
    #[command(flatten)]
    pub(crate) answer: AnswerArgs,
}

#[derive(Serialize)]
struct PitchAnswer {
    pitch_m: Option<f64>,
    /// The obstacle at a slightly smaller pitch.
    limit: Option<Limit>,
    /// With play in the hinges: the smallest pitch without it. `pitch_m` is then one at which no pose touches.
    nominal_pitch_m: Option<f64>,
    /// The requested clearance, in metres.
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
    let config = load_plan(&args.config, args.answer.work)?;
    args.answer.keep_files_apart(config.document())?;
    let Some(SpiralSpec { start_turns, .. }) = config.route().spiral() else {
        let error = BadInput(format!(
            "[route] kind is \"{}\", must be \"spiral\" or \"turnaround\" for a question about the pitch: a path has none",
            config.document().route_kind()
        ));
        return in_file(&args.config, Err(error));
    };
    let turn_diameter_m = args.turn_diameter.unwrap_or(config.route().turn_diameter_m());
    let (dimensions, clearance_m) = (config.lead().dimensions(), args.clearance.unwrap_or(0.0));
    let (rigid, plan) = (dimensions.without_play(), config.document().route_on_map());
    // On hills each pitch that is tried is searched.
    let meter = if plan.ground.is_some() { args.answer.work.long_meter() } else { args.answer.work.meter() };
    let found = smallest_pitch_on(&plan, &rigid, start_turns, turn_diameter_m, clearance_m, &meter);
    let found = match found {
        Err(error @ (PitchError::Route(_) | PitchError::TurnDiameter { .. })) => {
            return Err(BadInput(error.to_string()).into());
        }
        found => found.map_err(|error| error.to_string()),
    };
    let guaranteed = found.as_ref().ok().filter(|_| dimensions.play_m() > 0.0).map(|nominal| {
        let meter = args.answer.work.long_meter();
        let found = guaranteed_pitch(&plan, dimensions, start_turns, turn_diameter_m, clearance_m, nominal, &meter);
        found.map_err(|error| error.to_string())
    });
    let (answer, text) = answer(&found, guaranteed.as_ref(), turn_diameter_m, &config, args.clearance);
    print_report(args.answer.format.format, &answer, text)?;
    if args.answer.save_config.is_none() && !args.answer.figure.is_asked() {
        return Ok(());
    }
    let found = match guaranteed {
        None => found,
        Some(guaranteed) => found.and_then(|smallest| Ok(SmallestPitch { pitch_m: guaranteed?, ..smallest })),
    };
    match &found {
        Ok(smallest) => {
            let spiral = SpiralSpec { pitch_m: smallest.pitch_m, start_turns };
            let tightest = config.with_shape(&RouteShape::Spiral(spiral))?;
            let end_m = tightest.lead().route().in_space(spiral.to_circle(turn_diameter_m)?.end_travel_m());
            draw(args, &tightest, turn_diameter_m, end_m, smallest)?;
            save_config(&args.answer, Ok(&tightest))
        }
        Err(reason) => {
            args.answer.figure.refuse(reason)?;
            save_config(&args.answer, Err(reason))
        }
    }
}

/// Draws the dragon where the limiting pair is nearest, or else with its head on the circle, at the end of the run.
fn draw(
    args: &PitchArgs,
    tightest: &Config,
    turn_diameter_m: f64,
    end_m: f64,
    SmallestPitch { pitch_m, limit }: &SmallestPitch,
) -> anyhow::Result<()> {
    if !args.answer.figure.is_asked() {
        return Ok(());
    }
    let (travel_m, benches) = match limit {
        PitchLimit::Contact(contact) => (contact.travel_m.clamp(0.0, end_m), Some(contact.benches)),
        PitchLimit::Stop | PitchLimit::Start | PitchLimit::Width => (end_m, None),
    };
    let time_s = tightest.timetable().time_s(travel_m);
    let title = format!("The tightest spiral, pitch {pitch_m:.6} m, at {} s", Fixed::<6>(time_s));
    let caption = args.answer.figure.caption(tightest, title);
    let name = format!("circle of diameter {turn_diameter_m} m");
    let centre = tightest.route().placement.position;
    let circle = Circle { centre, radius_m: 0.5 * turn_diameter_m, name };
    let pair = pair(tightest.lead(), travel_m, benches);
    let view = PlanView { circle: Some(circle), pair, ..plan_of(tightest, tightest.lead(), caption, travel_m) };
    args.answer.figure.save_and_report(view.draw(), args.answer.format.format)
}

/// The answer, for JSON and as text.
fn answer(
    found: &Result<SmallestPitch, String>,
    guaranteed: Option<&Result<f64, String>>,
    turn_diameter_m: f64,
    config: &Config,
    clearance_m: Option<f64>,
) -> (PitchAnswer, String) {
    let SmallestPitch { pitch_m, limit } = match found {
        Ok(smallest) => *smallest,
        Err(reason) => {
            let infeasible = Some(reason.clone());
            let answer = PitchAnswer { pitch_m: None, nominal_pitch_m: None, limit: None, clearance_m, infeasible };
            return (answer, format!("infeasible: {reason}"));
        }
    };
    let (kind, contact, words) = match limit {
        PitchLimit::Contact(contact) => {
            let ([first, second], point) = (contact.benches, contact.point);
            let how = match clearance_m {
                None | Some(0.0) => "touch".to_owned(),
                Some(clearance_m) => format!("come within {clearance_m} m"),
            };
            let words = format!("benches {first} and {second} would {how}, at {}", Place::<6>(point.to_array()));
            ("contact", Some(contact), words)
        }
        PitchLimit::Stop => ("stop", None, "handle 1 would stop before the head reaches the circle".to_owned()),
        PitchLimit::Start => {
            ("start", None, "the spiral would start inside the circle, or too near to its centre".to_owned())
        }
        PitchLimit::Width => {
            let width_m = config.lead().dimensions().width_m();
            let words =
                format!("it would not exceed width_m, {width_m}: this rule is the limit, not a pair of benches");
            ("width", None, words)
        }
    };
    let (benches, point_m) = (contact.map(|contact| contact.benches), contact.map(|contact| contact.point.to_array()));
    let limit = Some(Limit { kind, benches, point_m });
    let (nominal_pitch_m, infeasible) = (guaranteed.map(|_| pitch_m), guaranteed.and_then(|found| found.clone().err()));
    let answer = PitchAnswer {
        pitch_m: guaranteed.map_or(Some(pitch_m), |found| found.as_ref().ok().copied()),
        nominal_pitch_m,
        limit,
        clearance_m,
        infeasible,
    };
    let nominal = format!("smallest pitch {pitch_m:.6} m for a circle of diameter {turn_diameter_m} m");
    let text = match guaranteed {
        None => format!("{nominal}\nwith a smaller pitch, {words}"),
        Some(found) => {
            let play_mm = 1000.0 * config.lead().dimensions().play_m();
            let widened = match found {
                Ok(widened_m) => format!(
                    "at pitch {widened_m:.6} m, no pose that play of {play_mm:.3} mm allows touches before the head reaches the circle"
                ),
                Err(reason) => format!("unknown with play of {play_mm:.3} mm: {reason}"),
            };
            format!("{widened}\nwithout play: {nominal}; with a smaller pitch, {words}")
        }
    };
    (answer, text)
}
