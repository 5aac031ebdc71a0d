//! `solve speed-limit`: finds the greatest speed of the head at which no handle exceeds a limit.

use std::sync::Arc;

use bench_dragon_geometry::dragon::{ChainSolver, Dragon};
use bench_dragon_geometry::number::Fixed;
use bench_dragon_geometry::planner::{Infeasible, LargestRatio, largest_speed_ratio, passage_through};
use bench_dragon_geometry::route::RouteShape;
use clap::Args;
use glam::DVec2;
use serde::Serialize;

use super::figure::even_travels;
use super::turn::{TurnPlanArgs, asks_for_turn, passage_time_s, planned_turn};
use super::{AnswerArgs, formation_survey, interrupt, load_any_plan, save_config};
use crate::cli::flags::{ConfigArgs, within};
use crate::cli::in_file;
use crate::cli::print::print_report;
use crate::config::{Config, PlanDocument};
use crate::output::figure::{HandleSpeed, LargestSpeed, SpeedRange, SpeedsOverTime};

/// Find the greatest speed of the head at which no handle exceeds a limit.
///
/// On a turnaround the whole passage of all benches counts. On another route (--config with another kind, without --pitch,
/// --turn-diameter, --radius-ratio and --turn-line) the whole run counts, on a spiral until the head reaches the centre.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon solve speed-limit --limit 2
  bench-dragon solve speed-limit --limit 2 --config stage.toml --save-config fast.toml")]
pub(crate) struct SpeedLimitArgs {
    /// Speed in m/s that no handle may exceed, 0.001 to 1000.
    #[arg(long, value_name = "MPS", allow_negative_numbers = true, value_parser = within(0.001..=1000.0))]
    pub(crate) limit: f64,
    #[command(flatten)]
    pub(crate) plan: TurnPlanArgs,
    #[command(flatten)]
    pub(crate) answer: AnswerArgs,
}

#[derive(Default, Serialize)]
struct SpeedLimitAnswer {
    head_speed_mps: Option<f64>,
    largest_ratio: Option<f64>,
    /// Show time of the largest ratio at the configured speed of the head, in seconds.
    time_s: Option<f64>,
    handle: Option<usize>,
    infeasible: Option<String>,
    /// The reason for which the answer is unknown: it took too much work.
    undecided: Option<String>,
}

pub(super) fn run(args: &SpeedLimitArgs) -> anyhow::Result<()> {
    let plan = &args.plan;
    let config_args = ConfigArgs { config: plan.config.clone() };
    let planned = if plan.config.is_some() && !asks_for_turn(plan) {
        match load_any_plan(&config_args, args.answer.work)? {
            PlanDocument::OneDragon(document) => Some(in_file(&config_args, document.build())?),
            PlanDocument::Formation(document) => return formation_survey::speed_limits(args, &document),
        }
    } else {
        None
    };
    let (config, passage) = passage(args, planned)?;
    args.answer.keep_files_apart(config.document())?;
    let largest = passage.as_ref().map_err(|infeasible| *infeasible).and_then(|dragon| largest_speed_ratio(dragon));
    let (answer, text) = answer(&largest, args.limit, &config);
    print_report(args.answer.format.format, &answer, text)?;
    if let (true, Ok(dragon), Ok(largest)) = (args.answer.figure.is_asked(), &passage, &largest) {
        let view = speeds_over_time(args, &config, dragon, largest);
        args.answer.figure.save_and_report(view.draw(), args.answer.format.format)?;
    }
    if let Some(reason) = answer.infeasible.as_ref().or(answer.undecided.as_ref()) {
        args.answer.figure.refuse(reason)?;
        return save_config(&args.answer, Err(reason));
    }
    match answer.head_speed_mps {
        Some(head_speed_mps) if args.answer.save_config.is_some() => {
            save_config(&args.answer, Ok(&config.with_head_speed(head_speed_mps)?))
        }
        _ => Ok(()),
    }
}

/// Returns the configuration, and its dragon on the whole passage through a turn, or on the planned run of another route.
fn passage(
    args: &SpeedLimitArgs,
    planned: Option<Config>,
) -> anyhow::Result<(Config, Result<Arc<Dragon>, Infeasible>)> {
    let plan = &args.plan;
    if let Some(config) = planned.filter(|config| config.route().as_turnaround().is_none()) {
        let dragon = Arc::new(config.lead().metered(&args.answer.work.meter()));
        return Ok((config, Ok(dragon)));
    }
    let (config, _, turn) = planned_turn(plan, args.answer.work)?;
    let passage = passage_through(turn, *config.lead().dimensions(), &args.answer.work.meter());
    Ok((config, passage.map(Arc::new)))
}

/// The answer, for JSON and as text.
fn answer(largest: &Result<LargestRatio, Infeasible>, limit_mps: f64, config: &Config) -> (SpeedLimitAnswer, String) {
    match largest {
        &Ok(LargestRatio { ratio, travel_m, handle }) => {
            let head_speed_mps = limit_mps / ratio;
            let time_s = passage_time_s(config, config.tables().head.speed_mps, travel_m);
            let answer = SpeedLimitAnswer {
                head_speed_mps: Some(head_speed_mps),
                largest_ratio: Some(ratio),
                time_s: Some(time_s),
                handle: Some(handle),
                ..SpeedLimitAnswer::default()
            };
            let text = format!(
                "the head may walk at {head_speed_mps:.6} m/s: then no handle is faster than {limit_mps} m/s\n\
                 handle {handle} is the fastest, {ratio:.6} times as fast as the head, at {} s with the \
                 configured speed",
                Fixed::<6>(time_s)
            );
            (answer, text)
        }
        Err(reason @ Infeasible::TooMuchWork(_)) => {
            let answer = SpeedLimitAnswer { undecided: Some(reason.to_string()), ..SpeedLimitAnswer::default() };
            (answer, format!("{reason}{}", interrupt::allows_more()))
        }
        Err(reason) => {
            let of_what = match config.route().shape {
                RouteShape::Turnaround(_) => "on the passage through the turn",
                RouteShape::Spiral(_) => {
                    "on all of the planned run (--turn-diameter computes a passage through a turn instead)"
                }
                RouteShape::Path(_) => "on all of the planned run",
            };
            let answer = SpeedLimitAnswer { infeasible: Some(reason.to_string()), ..SpeedLimitAnswer::default() };
            (answer, format!("infeasible {of_what}: {reason}"))
        }
    }
}

/// Handles whose speeds are drawn, if the dragon has them: the first ones, whose speeds differ in a turn, and one far back.
const DRAWN_HANDLES: [usize; 5] = [0, 1, 2, 5, 51];

/// Seconds around the largest speed that are drawn enlarged, at a head speed of 1 m/s: about the head's passage of a turn.
const DETAIL_S: f64 = 16.0;

/// Speeds of some handles over time, with the head as fast as the limit allows, and enlarged around the largest speed.
fn speeds_over_time(args: &SpeedLimitArgs, config: &Config, dragon: &Dragon, largest: &LargestRatio) -> SpeedsOverTime {
    let limit_mps = args.limit;
    let (head_speed_mps, planned_speed_mps) = (limit_mps / largest.ratio, config.tables().head.speed_mps);
    let time_s = |travel_m| passage_time_s(config, head_speed_mps, travel_m);
    let (start_m, end_m) = (dragon.start_travel_m(), dragon.end_travel_m());
    let detail_m = [largest.travel_m - DETAIL_S, largest.travel_m + DETAIL_S].map(|at_m| at_m.clamp(start_m, end_m));
    let mut travels_m = even_travels(dragon, start_m, end_m);
    travels_m.extend(even_travels(dragon, detail_m[0], detail_m[1]));
    travels_m.sort_unstable_by(f64::total_cmp);
    let mut all = Vec::with_capacity(travels_m.len());
    let mut handles: Vec<HandleSpeed> = drawn_handles(dragon, largest.handle)
        .map(|handle| HandleSpeed { name: handle_name(handle), samples: Vec::with_capacity(travels_m.len()) })
        .collect();
    let mut solver = ChainSolver::new(dragon);
    for &travel_m in &travels_m {
        let chain = solver.solve(dragon, travel_m).expect("the travel lies within the run");
        for (speeds, handle) in handles.iter_mut().zip(drawn_handles(dragon, largest.handle)) {
            let speed_mps = head_speed_mps * chain[handle].speed_ratio;
            speeds.samples.push(DVec2::new(time_s(travel_m), speed_mps));
        }
        let [least, most] = chain.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], handle| {
            [least.min(handle.speed_ratio), most.max(handle.speed_ratio)]
        });
        let time_s = time_s(travel_m);
        all.push(SpeedRange { time_s, least_mps: head_speed_mps * least, most_mps: head_speed_mps * most });
    }
    let time_s = time_s(largest.travel_m);
    let detail_s = DETAIL_S / head_speed_mps;
    let title = format!("Speeds of handles, the head at {head_speed_mps:.6} m/s (planned: {planned_speed_mps} m/s)");
    SpeedsOverTime {
        caption: args.answer.figure.caption_at_speed(config, head_speed_mps, title),
        all,
        handles,
        largest: Some(LargestSpeed { time_s, speed_mps: limit_mps, handle: largest.handle }),
        limit_mps: Some(limit_mps),
        detail_s: Some(time_s - detail_s..=time_s + detail_s),
    }
}

/// The drawn handles, including the fastest.
fn drawn_handles(dragon: &Dragon, fastest: usize) -> impl Iterator<Item = usize> {
    let count = dragon.dimensions().handles();
    let mut drawn: Vec<usize> = DRAWN_HANDLES.into_iter().chain([fastest]).filter(|&handle| handle < count).collect();
    drawn.sort_unstable();
    drawn.dedup();
    drawn.into_iter()
}

fn handle_name(handle: usize) -> String {
    if handle == 0 { "head".to_owned() } else { format!("handle {handle}") }
}
