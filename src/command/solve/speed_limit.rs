//! `solve speed-limit`: how fast may the head walk if no handle is ever to be faster than a limit?

use std::sync::Arc;

use bench_dragon_geometry::dragon::Dragon;
use bench_dragon_geometry::planner::{Infeasible, LargestRatio, largest_speed_ratio, passage_through};
use bench_dragon_geometry::route::RouteSpec;
use serde::Serialize;

use super::turn::{asks_for_turn, passage_time_s, planned_turn};
use super::{figures, save_config};
use crate::cli::{ConfigArgs, SpeedLimitArgs};
use crate::command::load_config;
use crate::command::print::print_report;
use crate::config::{Config, Overrides};

#[derive(Serialize)]
struct SpeedLimitAnswer {
    head_speed_mps: Option<f64>,
    largest_ratio: Option<f64>,
    /// At the configured head speed.
    time_s: Option<f64>,
    handle: Option<usize>,
    infeasible: Option<String>,
    /// Why it is not known, if the work for it was too much.
    #[serde(skip_serializing_if = "Option::is_none")]
    undecided: Option<String>,
}

pub(super) fn run(args: &SpeedLimitArgs) -> anyhow::Result<()> {
    let (config, passage) = passage(args)?;
    let largest = passage.as_ref().map_err(|infeasible| *infeasible).and_then(|dragon| largest_speed_ratio(dragon));
    let answer = SpeedLimitAnswer::of(&largest, args.limit, &config);
    print_report(args.answer.format.format, &answer, text(&answer, args.limit, config.route()))?;
    if let (Some(_), Ok(dragon), Ok(largest)) = (&args.answer.figure.figure, &passage, &largest) {
        let view = figures::speeds_over_time(&args.answer.figure, &config, dragon, largest, args.limit);
        figures::save_and_tell(view.draw(), &args.answer.figure, args.answer.format.format)?;
    }
    if let Some(reason) = answer.infeasible.as_ref().or(answer.undecided.as_ref()) {
        figures::refuse(&args.answer.figure, reason)?;
        return save_config(&args.answer, Err(reason));
    }
    match answer.head_speed_mps {
        Some(head_speed_mps) if args.answer.save_config.is_some() => {
            save_config(&args.answer, Ok(&config.with_head_speed(head_speed_mps)?))
        }
        _ => Ok(()),
    }
}

impl SpeedLimitAnswer {
    fn of(largest: &Result<LargestRatio, Infeasible>, limit_mps: f64, config: &Config) -> Self {
        let found = largest.as_ref().ok();
        Self {
            head_speed_mps: found.map(|largest| limit_mps / largest.ratio),
            largest_ratio: found.map(|largest| largest.ratio),
            time_s: found.map(|largest| passage_time_s(config, config.head_speed_mps(), largest.travel_m)),
            handle: found.map(|largest| largest.handle),
            infeasible: largest.err().filter(|reason| !is_undecided(reason)).map(|reason| reason.to_string()),
            undecided: largest.err().filter(is_undecided).map(|reason| reason.to_string()),
        }
    }
}

fn is_undecided(reason: &Infeasible) -> bool {
    matches!(reason, Infeasible::TooMuchWork(_))
}

/// The configuration and its dragon: on the whole passage through a turn, or on a spiral that the configuration names.
fn passage(args: &SpeedLimitArgs) -> anyhow::Result<(Config, Result<Arc<Dragon>, Infeasible>)> {
    let plan = &args.plan;
    if plan.config.is_some() && !asks_for_turn(plan) {
        let config = load_config(&ConfigArgs { config: plan.config.clone() }, Overrides::default())?;
        if let RouteSpec::Spiral(_) = config.route() {
            let dragon = Arc::new(config.dragon().metered(&args.answer.work.meter()));
            return Ok((config, Ok(dragon)));
        }
    }
    let (config, plan) = planned_turn(plan)?;
    let turnaround = plan.turnaround(config.head_speed_mps())?;
    let passage = passage_through(turnaround, *config.dragon().dimensions(), &args.answer.work.meter());
    Ok((config, passage.map(Arc::new)))
}

fn text(answer: &SpeedLimitAnswer, limit_mps: f64, route: RouteSpec) -> String {
    let of_what = match route {
        RouteSpec::Spiral(_) => {
            "on all of the spiral's run (--turn-diameter asks for a passage through a turn instead)"
        }
        RouteSpec::Turnaround(_) => "on the passage through the turn",
    };
    match answer {
        SpeedLimitAnswer {
            head_speed_mps: Some(head_speed_mps),
            largest_ratio: Some(ratio),
            time_s: Some(time_s),
            handle: Some(handle),
            ..
        } => format!(
            "the head may walk at {head_speed_mps:.6} m/s: no handle is faster than {limit_mps} m/s then\n\
             handle {handle} is the fastest, {ratio:.6} times as fast as the head, at {time_s:.6} s of the \
             configured speed"
        ),
        SpeedLimitAnswer { undecided: Some(reason), .. } => format!("{reason}, --work allows more"),
        SpeedLimitAnswer { infeasible, .. } => {
            format!("infeasible {of_what}: {}", infeasible.as_deref().unwrap_or_default())
        }
    }
}
