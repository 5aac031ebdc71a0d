//! `solve turn`: does the dragon get through a turn, and how near do its benches come to each other?

use std::ops::RangeInclusive;
use std::path::PathBuf;

use anyhow::{Context as _, bail};
use bench_dragon_geometry::dragon::Dimensions;
use bench_dragon_geometry::number::Number;
use bench_dragon_geometry::planner::{
    ClosestApproach, HeadTimetable, LargestRatio, ShortestTurn, Staging, TurnPassage, largest_speed_ratio,
    passage_through, shortest_turn, walk_through,
};
use bench_dragon_geometry::route::{CircularArc, RouteSpec, Turnaround, TurnaroundSpec};
use clap::{Args, ValueHint};
use glam::DVec2;
use serde::Serialize;

use super::figure::{on_turn, pair, plan_of};
use super::{AnswerArgs, CLEARANCE_M, save_config};
use crate::command::flags::{BadInput, ConfigArgs, finite, within};
use crate::command::load_config;
use crate::command::print::{Progress, complain, print_report};
use crate::config::Config;
use crate::output::figure::PlanView;

/// Does the dragon get through a turn, and how near do its benches come to each other?
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon solve turn
  bench-dragon solve turn --pitch 1.5 --radius-ratio 1.2
  bench-dragon solve turn --config spiral.toml --pitch 1.7 --turn-diameter 9
  bench-dragon solve turn --shortest --clearance 0.05 --max-ratio 2 --save-config short.toml")]
pub(crate) struct TurnArgs {
    /// Look for the shortest S inside the turning circle, over where it begins and the ratio of its radii.
    #[arg(long, conflicts_with = "radius_ratio")]
    pub(crate) shortest: bool,
    /// Metres that are to remain between any two boards [default: 0; with --shortest 0.05, or the configured margin if
    /// that is more].
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, value_parser = within(CLEARANCE_M))]
    pub(crate) clearance: Option<f64>,
    /// Largest speed of any handle ÷ the head's that is allowed, from 1 to 1000 [default: any; with --shortest 2].
    #[arg(long, value_name = "RATIO", allow_negative_numbers = true, value_parser = within(SPEED_RATIO))]
    pub(crate) max_ratio: Option<f64>,
    #[command(flatten)]
    pub(crate) plan: TurnPlanArgs,
    #[command(flatten)]
    pub(crate) answer: AnswerArgs,
}

/// Which turn.
#[derive(Clone, Debug, Args)]
pub(crate) struct TurnPlanArgs {
    /// Metres between neighbouring turns of the spiral, over the configuration's.
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, value_parser = finite)]
    pub(crate) pitch: Option<f64>,
    /// Diameter in metres of the circle that the S lies in, over the configuration's.
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, value_parser = finite)]
    pub(crate) turn_diameter: Option<f64>,
    /// Radius of the entry arc ÷ that of the exit arc, over the configuration's.
    #[arg(long, value_name = "RATIO", allow_negative_numbers = true, value_parser = finite)]
    pub(crate) radius_ratio: Option<f64>,
    /// The configuration, TOML; the paper's turnaround without one. Where its route is a spiral, any of the flags
    /// --pitch, --turn-diameter and --radius-ratio makes it a turnaround on that spiral.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) config: Option<PathBuf>,
}

/// Limits that may be set to a handle's speed, in speeds of the head: none is slower than the head, and a handle that is
/// faster than the greatest jumps.
const SPEED_RATIO: RangeInclusive<f64> = 1.0..=1000.0;

#[derive(Default, Serialize)]
struct TurnAnswer {
    radii_m: [f64; 2],
    length_m: f64,
    centres_m: [[f64; 2]; 2],
    entry_m: [f64; 2],
    exit_m: [f64; 2],
    /// By how much either arc turns, in radians.
    angles: [f64; 2],
    least_clearance: Option<Nearness>,
    /// Where two benches touch, or come within the clearance that is to remain.
    contact: Option<Touch>,
    #[serde(skip_serializing_if = "Option::is_none")]
    too_fast: Option<TooFast>,
    infeasible: Option<String>,
    /// Why it is not known, if the work for it was too much.
    #[serde(skip_serializing_if = "Option::is_none")]
    undecided: Option<String>,
    /// Largest speed of any handle ÷ the head's on the whole passage.
    largest_ratio: Option<f64>,
    /// The limits that the turn is held to, where there are any.
    #[serde(skip_serializing_if = "Option::is_none")]
    clearance_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    max_ratio: Option<f64>,
    #[serde(flatten)]
    shortest: Option<Shortest>,
}

#[derive(Serialize)]
struct Shortest {
    /// Radius at which the S begins and ends.
    entry_radius_m: f64,
    radius_ratio: f64,
    /// How much shorter it is than the configured one.
    saving_m: f64,
    /// What is in the way of a shorter one with a lower and with a higher ratio.
    limits: [Option<String>; 2],
}

#[derive(Serialize)]
struct Nearness {
    clearance_m: f64,
    #[serde(flatten)]
    at: Touch,
}

#[derive(Serialize)]
struct Touch {
    time_s: f64,
    benches: [usize; 2],
    point_m: [f64; 2],
}

#[derive(Serialize)]
struct TooFast {
    ratio: f64,
    time_s: f64,
    handle: usize,
}

/// Clearance that the shortest turn keeps where nothing else is asked for, in metres: what people need.
const SHORTEST_CLEARANCE_M: f64 = 0.05;
/// Largest speed of a handle ÷ the head's that it has.
const SHORTEST_MAX_RATIO: f64 = 2.0;

pub(super) fn run(args: &TurnArgs) -> anyhow::Result<()> {
    let (config, plan) = planned_turn(&args.plan)?;
    let speed_mps = config.tables().head.speed_mps;
    let dimensions = *config.dragon().dimensions();
    let planned = plan.turnaround(speed_mps)?;
    let margin_m = config.tables().monitor.margin_m;
    let default = |limit: f64| args.shortest.then_some(limit);
    // The guard stops the head where less than its margin remains: the shortest turn keeps that at least.
    let clearance_m = args.clearance.or(default(SHORTEST_CLEARANCE_M.max(margin_m)));
    let max_ratio = args.max_ratio.or(default(SHORTEST_MAX_RATIO));
    if let Some(clearance_m) = clearance_m.filter(|clearance_m| *clearance_m < margin_m) {
        complain(&format!(
            "warning: --clearance {clearance_m} is under margin_m {margin_m}: a guard may stop this turn"
        ));
    }
    let staging = Staging {
        clearance_m: clearance_m.unwrap_or(Staging::LIMITLESS.clearance_m),
        speed_ratio: max_ratio.unwrap_or(Staging::LIMITLESS.speed_ratio),
    };
    let (config, turnaround, passage, shortest) = if args.shortest {
        let (plan, passage, shortest) = find_shortest(args, &planned, dimensions, staging, plan)?;
        (config.with_route(RouteSpec::Turnaround(plan))?, plan.turnaround(speed_mps)?, passage, Some(shortest))
    } else {
        let progress = Progress::new("passage", 1.0);
        let passage =
            walk_through(planned, dimensions, staging, &args.answer.work.meter(), |share| progress.add(share));
        (config, planned, passage, None)
    };
    let largest_ratio = passage_through(turnaround, dimensions, &args.answer.work.meter())
        .and_then(|dragon| largest_speed_ratio(&dragon))
        .ok()
        .map(|largest| largest.ratio);
    let answer = TurnAnswer {
        largest_ratio,
        clearance_m,
        max_ratio,
        shortest,
        ..TurnAnswer::of(&turnaround, &passage, &config)
    };
    print_report(args.answer.format.format, &answer, answer.text())?;
    draw(args, &config, &turnaround, &passage)?;
    let reason = answer.infeasible.clone().or(answer.undecided.clone()).or_else(|| answer.broken_limit());
    save_config(&args.answer, reason.as_deref().map_or(Ok(&config), Err))
}

/// The shortest S inside the planned circle, as a plan of its own.
fn find_shortest(
    args: &TurnArgs,
    planned: &Turnaround,
    dimensions: Dimensions,
    staging: Staging,
    plan: TurnaroundSpec,
) -> anyhow::Result<(TurnaroundSpec, TurnPassage, Shortest)> {
    let progress = Progress::new("shortest turn", 1.0);
    let found =
        shortest_turn(*planned, dimensions, staging, &args.answer.work.long_meter(), |share| progress.add(share));
    let Some(found) = found.context("the shortest S is not known, --work allows more")? else {
        let Staging { clearance_m, speed_ratio } = staging;
        bail!(
            "the dragon gets through no S inside a circle of diameter {} m with {} m between boards and no handle over {} \
             times as fast as the head",
            Number(plan.turn_diameter_m),
            Number(clearance_m),
            Number(speed_ratio)
        );
    };
    let ShortestTurn { turnaround, radius_ratio, closest, limits } = found;
    let shortest = Shortest {
        entry_radius_m: 0.5 * turnaround.turn_diameter_m(),
        radius_ratio,
        saving_m: planned.turn_length_m() - turnaround.turn_length_m(),
        limits: limits.map(|limit| limit.map(|obstacle| obstacle.to_string())),
    };
    let plan = TurnaroundSpec { turn_diameter_m: turnaround.turn_diameter_m(), radius_ratio, ..plan };
    Ok((plan, TurnPassage::Clear { closest }, shortest))
}

/// Draws the dragon where its benches come nearest, or where they touch.
fn draw(args: &TurnArgs, config: &Config, turnaround: &Turnaround, passage: &TurnPassage) -> anyhow::Result<()> {
    if !args.answer.figure.is_asked() {
        return Ok(());
    }
    let has_clearance = args.clearance.is_some_and(|clearance_m| clearance_m > 0.0);
    let meeting = if has_clearance { "too near to itself" } else { "touching itself" };
    let (what, travel_m, benches) = match passage {
        TurnPassage::Clear { closest: Some(closest) } => {
            ("nearest to itself", closest.travel_m, Some(closest.pair.benches))
        }
        TurnPassage::Clear { closest: None } => ("on its way out", turnaround.turn_length_m(), None),
        TurnPassage::Contact(contact) => (meeting, contact.travel_m, Some(contact.benches)),
        TurnPassage::TooFast(largest) => ("at its fastest", largest.travel_m, None),
        TurnPassage::TooMuchWork(spent) => bail!("--figure has nothing to show: {spent}"),
        TurnPassage::Infeasible(infeasible) => return args.answer.figure.refuse(&infeasible.to_string()),
    };
    let dragon = passage_through(*turnaround, *config.dragon().dimensions(), &args.answer.work.meter())?;
    let title = format!("The dragon {what}, at {:.6} s", time_s(config, travel_m));
    let plan = plan_of(&dragon, args.answer.figure.caption(config, title), travel_m);
    let view = PlanView { pair: pair(&dragon, travel_m, benches), ..on_turn(plan, turnaround) };
    args.answer.figure.save_and_tell(view.draw(), args.answer.format.format)
}

fn time_s(config: &Config, travel_m: f64) -> f64 {
    passage_time_s(config, config.tables().head.speed_mps, travel_m)
}

impl TurnAnswer {
    fn of(turnaround: &Turnaround, passage: &TurnPassage, config: &Config) -> Self {
        let arcs = turnaround.arcs();
        let touch = |travel_m, benches, point: DVec2| Touch {
            time_s: time_s(config, travel_m),
            benches,
            point_m: point.to_array(),
        };
        let mut answer = Self {
            radii_m: arcs.map(|arc| arc.radius_m()),
            length_m: turnaround.turn_length_m(),
            centres_m: arcs.map(|arc| arc.centre().to_array()),
            entry_m: turnaround.entry().to_array(),
            exit_m: turnaround.exit().to_array(),
            angles: arcs.map(|arc: CircularArc| arc.angle()),
            ..Self::default()
        };
        match passage {
            TurnPassage::Clear { closest } => {
                answer.least_clearance = closest.as_ref().map(|ClosestApproach { travel_m, pair }| Nearness {
                    clearance_m: pair.clearance_m,
                    at: touch(*travel_m, pair.benches, pair.point),
                });
            }
            TurnPassage::Contact(contact) => {
                answer.contact = Some(touch(contact.travel_m, contact.benches, contact.point));
            }
            TurnPassage::TooFast(LargestRatio { ratio, travel_m, handle }) => {
                answer.too_fast = Some(TooFast { ratio: *ratio, time_s: time_s(config, *travel_m), handle: *handle });
            }
            TurnPassage::Infeasible(infeasible) => answer.infeasible = Some(infeasible.to_string()),
            TurnPassage::TooMuchWork(spent) => {
                let reached_s = time_s(config, spent.reached_m);
                answer.undecided = Some(format!("no benches touch up to {reached_s:.6} s; more is not known: {spent}"));
            }
        }
        answer
    }

    /// Which limit that was asked for the turn does not keep.
    fn broken_limit(&self) -> Option<String> {
        if let (Some(TooFast { ratio, handle, .. }), Some(max_ratio)) = (&self.too_fast, self.max_ratio) {
            return Some(format!(
                "handle {handle} is {ratio:.6} times as fast as the head, over --max-ratio {max_ratio}"
            ));
        }
        let (Touch { benches: [first, second], .. }, clearance_m) = (self.contact.as_ref()?, self.clearance_m?);
        Some(format!("benches {first} and {second} come within --clearance {clearance_m} m"))
    }

    fn text(&self) -> String {
        let mut lines = Vec::new();
        let mut line = |name: &str, text: String| lines.push(format!("{name:<16} {text}"));
        for (i, name) in ["entry arc", "exit arc"].into_iter().enumerate() {
            let (radius_m, [x, y], degrees) = (self.radii_m[i], self.centres_m[i], self.angles[i].to_degrees());
            line(name, format!("radius {radius_m:.6} m, centre ({x:.6}, {y:.6}) m, turns {degrees:.3}°"));
        }
        let point = |[x, y]: [f64; 2]| format!("({x:.6}, {y:.6}) m");
        let place = |&Touch { time_s, benches: [first, second], point_m }: &Touch| {
            format!("at {time_s:.6} s, benches {first} and {second}, at {}", point(point_m))
        };
        line("entry", point(self.entry_m));
        line("exit", point(self.exit_m));
        line("length", format!("{:.6} m", self.length_m));
        if let Some(Nearness { clearance_m, at }) = &self.least_clearance {
            line("least clearance", format!("{clearance_m:.6} m {}", place(at)));
        }
        if let Some(contact) = &self.contact {
            let is_near = self.clearance_m.is_some_and(|clearance_m| clearance_m > 0.0);
            line(if is_near { "first too near" } else { "first contact" }, place(contact));
        }
        if let Some(TooFast { time_s, handle, .. }) = self.too_fast {
            line("too fast", format!("handle {handle} at {time_s:.6} s"));
        }
        if let Some(ratio) = self.largest_ratio {
            line("speed", format!("{ratio:.6} times as fast as the head, the fastest handle"));
        }
        for (limit, unit) in [(self.clearance_m, "m between boards"), (self.max_ratio, "times the head's speed")] {
            if let Some(limit) = limit {
                line("held to", format!("{limit} {unit}"));
            }
        }
        if let Some(Shortest { entry_radius_m, radius_ratio, saving_m, limits }) = &self.shortest {
            line("begins", format!("on the radius {entry_radius_m:.6} m, ratio {radius_ratio:.6}"));
            line("saving", format!("{saving_m:.6} m"));
            for (side, limit) in ["lower ratio", "higher ratio"].iter().zip(limits) {
                let limit = limit.as_deref().unwrap_or("nothing");
                line("limit", format!("{limit}, if it began any further in with a {side}"));
            }
        }
        self.infeasible.iter().for_each(|reason| line("infeasible", reason.clone()));
        self.undecided.iter().for_each(|reason| line("undecided", format!("{reason}, --work allows more")));
        lines.join("\n")
    }
}

/// Whether flags ask for a turn, whatever the file has.
pub(super) fn asks_for_turn(args: &TurnPlanArgs) -> bool {
    args.pitch.or(args.turn_diameter).or(args.radius_ratio).is_some()
}

/// The configuration with its turnaround, and the flags over it; the paper's turnaround where no file is named. A file with a
/// spiral gives the turn its pitch, where flags ask for one.
pub(super) fn planned_turn(args: &TurnPlanArgs) -> anyhow::Result<(Config, TurnaroundSpec)> {
    let config = load_config(&ConfigArgs { config: args.config.clone() }, |_| ())?;
    let plan = match (config.route().as_turnaround(), &args.config) {
        (Some(plan), _) => plan,
        (None, None) => TurnaroundSpec::default(),
        (None, Some(_)) if asks_for_turn(args) => {
            TurnaroundSpec { pitch_m: config.route().pitch_m(), ..TurnaroundSpec::default() }
        }
        (None, Some(path)) => {
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
    let timetable = |start_s, end_m| HeadTimetable::new(speed_mps, config.tables().head.accel_mps2, start_s, end_m);
    let (start_s, end_m) = (config.start_s(), config.dragon().end_travel_m());
    if (speed_mps * start_s..=end_m).contains(&travel_m) {
        timetable(start_s, end_m).time_s(travel_m)
    } else {
        timetable(start_s.min(travel_m / speed_mps), f64::INFINITY).time_s(travel_m)
    }
}
