//! The turn that a question is about.

use anyhow::Context as _;
use bench_dragon_geometry::planner::HeadTimetable;
use bench_dragon_geometry::route::{RouteSpec, TurnaroundSpec};

use crate::cli::{ConfigArgs, TurnPlanArgs};
use crate::command::{BadInput, load_config};
use crate::config::{Config, Overrides};

/// Whether flags ask for a turn, whatever the file has.
pub(super) fn asks_for_turn(args: &TurnPlanArgs) -> bool {
    args.pitch.or(args.turn_diameter).or(args.radius_ratio).is_some()
}

/// The configuration with its turnaround, and the flags over it; the paper's turnaround where no file is named. A file with a
/// spiral gives the turn its pitch, where flags ask for one.
pub(super) fn planned_turn(args: &TurnPlanArgs) -> anyhow::Result<(Config, TurnaroundSpec)> {
    let config = load_config(&ConfigArgs { config: args.config.clone() }, Overrides::default())?;
    let plan = match (config.route(), &args.config) {
        (RouteSpec::Turnaround(plan), _) => plan,
        (RouteSpec::Spiral(_), None) => TurnaroundSpec::default(),
        (RouteSpec::Spiral(spiral), Some(_)) if asks_for_turn(args) => {
            TurnaroundSpec { pitch_m: spiral.pitch_m, ..TurnaroundSpec::default() }
        }
        (RouteSpec::Spiral(_), Some(path)) => {
            let error = "[route] kind is \"spiral\", must be \"turnaround\" for a question about a turn; \
                         --turn-diameter, --radius-ratio or --pitch makes it one";
            return Err(BadInput(error.to_owned())).with_context(|| path.display().to_string());
        }
    };
    let plan = TurnaroundSpec {
        pitch_m: args.pitch.unwrap_or(plan.pitch_m),
        turn_diameter_m: args.turn_diameter.unwrap_or(plan.turn_diameter_m),
        radius_ratio: args.radius_ratio.unwrap_or(plan.radius_ratio),
        ..plan
    };
    Ok((config.with_route(RouteSpec::Turnaround(plan))?, plan))
}

/// Show time at which a head of this planned speed comes to a travel of a passage. Beyond the ends of the planned run, where a
/// passage may reach, it is the time at which the head would be there if the run went on.
pub(super) fn passage_time_s(config: &Config, speed_mps: f64, travel_m: f64) -> f64 {
    let timetable = |start_s, end_m| HeadTimetable::new(speed_mps, config.head_accel_mps2(), start_s, end_m);
    let (start_s, end_m) = (config.start_s(), config.dragon().end_travel_m());
    if (speed_mps * start_s..=end_m).contains(&travel_m) {
        timetable(start_s, end_m).time_s(travel_m)
    } else {
        timetable(start_s.min(travel_m / speed_mps), f64::INFINITY).time_s(travel_m)
    }
}
