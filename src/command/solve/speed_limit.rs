//! `solve speed-limit`: how fast may the head walk if no handle is ever to be faster than a limit?

use bench_dragon::config::{Config, Overrides, RoutePlan};
use bench_dragon::plan::{Infeasible, LargestRatio, largest_speed_ratio, passage_through};
use serde::Serialize;

use super::save_config::save_config;
use super::turn_plan::planned_turn;
use crate::cli::{ConfigArgs, Format, SpeedLimitArgs};
use crate::command::load_config;
use crate::command::output::{print_json, print_line};

#[derive(Serialize)]
struct Answer {
    head_speed_mps: Option<f64>,
    largest_ratio: Option<f64>,
    /// At the configured head speed.
    time_s: Option<f64>,
    handle: Option<usize>,
    infeasible: Option<String>,
}

pub(super) fn run(args: &SpeedLimitArgs) -> anyhow::Result<()> {
    let (config, largest) = largest(args)?;
    let head_speed_mps = largest.as_ref().map(|largest| args.limit / largest.ratio).map_err(ToString::to_string);
    let found = largest.as_ref().ok();
    let answer = Answer {
        head_speed_mps: head_speed_mps.as_ref().ok().copied(),
        largest_ratio: found.map(|largest| largest.ratio),
        time_s: found.map(|largest| largest.travel_m / config.head_speed_mps()),
        handle: found.map(|largest| largest.handle),
        infeasible: head_speed_mps.as_ref().err().cloned(),
    };
    match args.format.format {
        Format::Json => print_json(&answer)?,
        Format::Text => print_line(text(&answer, args.limit))?,
    }
    if args.save.save_config.is_none() {
        return Ok(());
    }
    match head_speed_mps {
        Ok(head_speed_mps) => save_config(&args.save, Ok(&config.with_head_speed(head_speed_mps)?)),
        Err(reason) => save_config(&args.save, Err(&reason)),
    }
}

/// The configuration and where a handle is fastest: on the whole passage through a turn, or on a spiral that the
/// configuration names.
fn largest(args: &SpeedLimitArgs) -> anyhow::Result<(Config, Result<LargestRatio, Infeasible>)> {
    let plan = &args.plan;
    let asks_for_turn = plan.pitch.or(plan.turn_diameter).or(plan.radius_ratio).is_some();
    if plan.config.is_some() && !asks_for_turn {
        let config = load_config(&ConfigArgs { config: plan.config.clone() }, Overrides::default())?;
        if let RoutePlan::Spiral(_) = config.route() {
            let largest = largest_speed_ratio(config.dragon());
            return Ok((config, largest));
        }
    }
    let (config, plan) = planned_turn(plan)?;
    let turnaround = plan.turnaround(config.head_speed_mps())?;
    let passage = passage_through(turnaround, *config.dragon().dimensions());
    Ok((config, passage.and_then(|dragon| largest_speed_ratio(&dragon))))
}

fn text(answer: &Answer, limit_mps: f64) -> String {
    match answer {
        Answer {
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
        Answer { infeasible, .. } => format!("infeasible: {}", infeasible.as_deref().unwrap_or_default()),
    }
}
