//! `solve turn`: checks whether the dragon passes a turnaround, and finds its least clearance and largest speed.

use std::path::PathBuf;

use anyhow::{Context as _, bail};
use bench_dragon_geometry::number::{Fixed, Place};
use bench_dragon_geometry::planner::{
    ClosestApproach, LargestRatio, PlannedTurn, Staging, TurnPassage, largest_speed_ratio, passage_through,
    walk_through,
};
use bench_dragon_geometry::route::{CircularArc, RouteShape, Turnaround, TurnaroundSpec};
use clap::{Args, ValueHint};
use glam::DVec2;
use serde::Serialize;

use super::figure::{on_turn, pair, plan_of};
use super::shortest_turn::{Shortest, find_shortest_for_play};
use super::turn_play::{TurnPlay, earliest_on_passage};
use super::{AnswerArgs, CLEARANCE_M, SPEED_RATIO, TooFast, WorkArgs, interrupt, load_plan, save_config, work_default};
use crate::cli::flags::{BadInput, ConfigArgs, finite, within};
use crate::cli::print::{Progress, print_report, print_to_stderr};
use crate::config::{Config, HeadTable};
use crate::output::figure::PlanView;

/// Check whether the dragon passes a turnaround, and find its least clearance and its largest speed.
#[derive(Clone, Debug, Args)]
#[command(mut_arg("work", |arg| work_default(arg, "100; 300 with --shortest")))]
#[command(after_help = "Examples:
  bench-dragon solve turn
  bench-dragon solve turn --pitch 1.5 --radius-ratio 1.2
  bench-dragon solve turn --turn-line 0.65 --radius-ratio 1
  bench-dragon solve turn --config spiral.toml --pitch 1.7 --turn-diameter 9
  bench-dragon solve turn --shortest --clearance 0.05 --max-ratio 2 --save-config short.toml")]
pub(crate) struct TurnArgs {
    /// Find the shortest S inside the turning circle, by varying the radius at which it begins, the ratio of its radii, and
    /// the line between its arcs.
    #[arg(long, conflicts_with_all = ["radius_ratio", "turn_line"])]
    pub(crate) shortest: bool,
    /// Clearance in metres that any two boards must keep, 0 to 10 [default: 0; with --shortest 0.05 or the configured
    /// margin_m, whichever is larger].
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, value_parser = within(CLEARANCE_M))]
    pub(crate) clearance: Option<f64>,
    /// Largest allowed speed of any handle ÷ the speed of the head, 1 to 1000 [default: any; with --shortest 2].
    #[arg(long, value_name = "RATIO", allow_negative_numbers = true, value_parser = within(SPEED_RATIO))]
    pub(crate) max_ratio: Option<f64>,
    #[command(flatten)]
    pub(crate) plan: TurnPlanArgs,
    #[command(flatten)]
    pub(crate) answer: AnswerArgs,
}

/// The flags that plan a turnaround.
#[derive(Clone, Debug, Args)]
pub(crate) struct TurnPlanArgs {
    /// Pitch of the spiral in metres: the distance of neighbouring turns [default: configured, else 1.7].
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, value_parser = finite)]
    pub(crate) pitch: Option<f64>,
    /// Diameter in metres of the turning circle, which contains the S [default: configured, else 9].
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, value_parser = finite)]
    pub(crate) turn_diameter: Option<f64>,
    /// Radius of the entry arc ÷ radius of the exit arc [default: configured, else 2].
    #[arg(long, value_name = "RATIO", allow_negative_numbers = true, value_parser = finite)]
    pub(crate) radius_ratio: Option<f64>,
    /// Length in metres of a straight line between the two arcs, under the turning circle's diameter [default: configured,
    /// else 0].
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, value_parser = finite)]
    pub(crate) turn_line: Option<f64>,
    /// Configuration file, in TOML; if its route is a spiral, --pitch, --turn-diameter, --radius-ratio or --turn-line makes it
    /// a turnaround on that spiral [default: the paper's turnaround].
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) config: Option<PathBuf>,
}

#[derive(Default, Serialize)]
struct TurnAnswer {
    radii_m: [f64; 2],
    length_m: f64,
    /// Length of the S along the ground; `None` on level ground.
    length_on_ground_m: Option<f64>,
    /// Length of the line between the arcs.
    line_m: f64,
    centres_m: [[f64; 2]; 2],
    entry_m: [f64; 2],
    exit_m: [f64; 2],
    /// Angle of each arc, in radians.
    angles: [f64; 2],
    least_clearance: Option<Nearness>,
    /// The first contact of two benches, or the first pair within the required clearance.
    contact: Option<Touch>,
    too_fast: Option<TooFast>,
    infeasible: Option<String>,
    /// The reason for which the answer is unknown: it took too much work.
    undecided: Option<String>,
    /// Largest speed of any handle ÷ the head's speed, on the whole passage.
    largest_ratio: Option<f64>,
    /// The required limits of the turn: this clearance in metres, and the ratio of speeds below.
    clearance_m: Option<f64>,
    max_ratio: Option<f64>,
    #[serde(flatten)]
    shortest: Option<Shortest>,
    /// With play in the hinges. All other answers are for the dragon without it.
    #[serde(flatten)]
    play: Option<TurnPlay>,
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

/// Default clearance of the shortest turn, in metres: enough for people.
const SHORTEST_CLEARANCE_M: f64 = 0.05;
/// Default limit for the speed of a handle ÷ the head's speed on the shortest turn.
const SHORTEST_MAX_RATIO: f64 = 2.0;

pub(super) fn run(args: &TurnArgs) -> anyhow::Result<()> {
    let (config, plan, planned) = planned_turn(&args.plan, args.answer.work)?;
    args.answer.keep_files_apart(config.document())?;
    let dimensions = *config.lead().dimensions();
    let margin_m = config.tables().monitor.margin_m;
    let default = |limit: f64| args.shortest.then_some(limit);
    // The guard stops the head where the clearance falls under its margin. So the shortest turn keeps at least the margin.
    let clearance_m = args.clearance.or(default(SHORTEST_CLEARANCE_M.max(margin_m)));
    let max_ratio = args.max_ratio.or(default(SHORTEST_MAX_RATIO));
    if let Some(clearance_m) = clearance_m.filter(|clearance_m| *clearance_m < margin_m) {
        print_to_stderr(&format!(
            "warning: --clearance {clearance_m} is under margin_m {margin_m}: a guard may stop this turn"
        ));
    }
    let staging = Staging {
        clearance_m: clearance_m.unwrap_or(Staging::LIMITLESS.clearance_m),
        speed_ratio: max_ratio.unwrap_or(Staging::LIMITLESS.speed_ratio),
    };
    let rigid = dimensions.without_play();
    let (config, turn, passage, shortest) = if args.shortest {
        let (plan, passage, shortest) = find_shortest_for_play(args, &planned, dimensions, staging, plan)?;
        let (config, turn) = with_turnaround(&config, plan)?;
        (config, turn, passage, Some(shortest))
    } else {
        let progress = Progress::new("passage", 1.0);
        let meter = args.answer.work.meter();
        let passage = walk_through(planned.clone(), rigid, staging, &meter, |share| progress.add(share));
        (config, planned, passage, None)
    };
    let play = (dimensions.play_m() > 0.0).then(|| {
        let end = earliest_on_passage(turn.clone(), dimensions, staging.clearance_m, &args.answer.work.meter());
        TurnPlay::of(end, |travel_m| time_s(&config, travel_m))
    });
    let largest_ratio = passage_through(turn.clone(), rigid, &args.answer.work.meter())
        .and_then(|dragon| largest_speed_ratio(&dragon))
        .ok()
        .map(|largest| largest.ratio);
    let answer = TurnAnswer {
        largest_ratio,
        clearance_m,
        max_ratio,
        shortest,
        play,
        ..TurnAnswer::of(turn.turnaround(), &passage, &config)
    };
    print_report(args.answer.format.format, &answer, answer.text())?;
    draw(args, &config, &turn, &passage)?;
    let reason = answer.infeasible.clone().or(answer.undecided.clone()).or_else(|| answer.broken_limit());
    save_config(&args.answer, reason.as_deref().map_or(Ok(&config), Err))
}

/// Draws the dragon at its least clearance, or at its contact.
fn draw(args: &TurnArgs, config: &Config, turn: &PlannedTurn, passage: &TurnPassage) -> anyhow::Result<()> {
    if !args.answer.figure.is_asked() {
        return Ok(());
    }
    let has_clearance = args.clearance.is_some_and(|clearance_m| clearance_m > 0.0);
    let meeting = if has_clearance { "too near to itself" } else { "touching itself" };
    let (what, travel_m, benches) = match passage {
        TurnPassage::Clear { closest: Some(closest) } => {
            ("nearest to itself", closest.travel_m, Some(closest.pair.benches))
        }
        TurnPassage::Clear { closest: None } => ("on its way out", turn.turnaround().turn_length_m(), None),
        TurnPassage::Contact(contact) => (meeting, contact.travel_m, Some(contact.benches)),
        TurnPassage::TooFast(largest) => ("at its fastest", largest.travel_m, None),
        TurnPassage::TooMuchWork(spent) => bail!("--figure has nothing to show: {spent}"),
        TurnPassage::Infeasible(infeasible) => return args.answer.figure.refuse(&infeasible.to_string()),
    };
    let dragon = passage_through(turn.clone(), *config.lead().dimensions(), &args.answer.work.meter())?;
    let title = format!("The dragon {what}, at {} s", Fixed::<6>(time_s(config, travel_m)));
    let plan = plan_of(config, &dragon, args.answer.figure.caption(config, title), travel_m);
    let view = PlanView { pair: pair(&dragon, travel_m, benches), ..on_turn(plan, turn.turnaround()) };
    args.answer.figure.save_and_report(view.draw(), args.answer.format.format)
}

fn time_s(config: &Config, travel_m: f64) -> f64 {
    passage_time_s(config, config.tables().head.speed_mps, travel_m)
}

impl TurnAnswer {
    fn of(turnaround: &Turnaround, passage: &TurnPassage, config: &Config) -> Self {
        let (arcs, route) = (turnaround.arcs(), config.lead().route());
        let touch = |travel_m, benches, point: DVec2| Touch {
            time_s: time_s(config, travel_m),
            benches,
            point_m: point.to_array(),
        };
        let mut answer = Self {
            radii_m: arcs.map(|arc| arc.radius_m()),
            length_m: turnaround.turn_length_m(),
            length_on_ground_m: route.is_on_ground().then(|| route.in_space(turnaround.turn_length_m())),
            line_m: turnaround.line_m(),
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
                let reason =
                    format!("no benches touch up to {} s; later times are unknown: {spent}", Fixed::<6>(reached_s));
                answer.undecided = Some(reason);
            }
        }
        answer
    }

    /// The required limit that the turn does not keep, in words.
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
            let (radius_m, degrees) = (self.radii_m[i], self.angles[i].to_degrees());
            line(
                name,
                format!(
                    "radius {radius_m:.6} m, centre {}, turns {}°",
                    Place::<6>(self.centres_m[i]),
                    Fixed::<3>(degrees)
                ),
            );
        }
        let place = |&Touch { time_s, benches: [first, second], point_m }: &Touch| {
            format!("at {} s, benches {first} and {second}, at {}", Fixed::<6>(time_s), Place::<6>(point_m))
        };
        line("entry", Place::<6>(self.entry_m).to_string());
        line("exit", Place::<6>(self.exit_m).to_string());
        if self.line_m > 0.0 {
            line("line", format!("{:.6} m between the arcs", self.line_m));
        }
        let on_ground = self.length_on_ground_m.map(|length_m| format!(" in the plan, {length_m:.6} m on the ground"));
        line("length", format!("{:.6} m{}", self.length_m, on_ground.unwrap_or_default()));
        if let Some(Nearness { clearance_m, at }) = &self.least_clearance {
            line("least clearance", format!("{} m {}", Fixed::<6>(*clearance_m), place(at)));
        }
        if let Some(contact) = &self.contact {
            let is_near = self.clearance_m.is_some_and(|clearance_m| clearance_m > 0.0);
            line(if is_near { "too near" } else { "first contact" }, place(contact));
        }
        if let Some(TooFast { time_s, handle, .. }) = self.too_fast {
            line("too fast", format!("handle {handle} at {} s", Fixed::<6>(time_s)));
        }
        if let Some(ratio) = self.largest_ratio {
            line("speed", format!("the fastest handle is {ratio:.6} times as fast as the head"));
        }
        if let Some(clearance_m) = self.clearance_m {
            line("required", format!("at least {clearance_m} m between boards"));
        }
        if let Some(max_ratio) = self.max_ratio {
            line("required", format!("at most {max_ratio} times the head's speed"));
        }
        self.shortest.iter().flat_map(Shortest::lines).for_each(|(name, text)| line(name, text));
        self.play.iter().for_each(|play| line("with play", play.text()));
        self.infeasible.iter().for_each(|reason| line("infeasible", reason.clone()));
        self.undecided.iter().for_each(|reason| line("undecided", format!("{reason}{}", interrupt::allows_more())));
        lines.join("\n")
    }
}

/// Whether flags request a turn, for any route of the configuration.
pub(super) fn asks_for_turn(args: &TurnPlanArgs) -> bool {
    args.pitch.or(args.turn_diameter).or(args.radius_ratio).or(args.turn_line).is_some()
}

/// Returns the configuration with this turnaround, and the turn.
fn with_turnaround(config: &Config, plan: TurnaroundSpec) -> anyhow::Result<(Config, PlannedTurn)> {
    let config = config.with_shape(&RouteShape::Turnaround(plan))?;
    let route = config.document().route_on_map();
    let turnaround = route.planned_turnaround(config.tables().head.speed_mps)?;
    Ok((config, PlannedTurn::on(turnaround.expect("the route is a turnaround"), route.ground)))
}

/// Returns the configuration and its turn, after the flags have overridden it. Without a file it is the paper's
/// turnaround. With flags for a turn, a file with a spiral gives the turn its pitch.
pub(super) fn planned_turn(
    args: &TurnPlanArgs,
    work: WorkArgs,
) -> anyhow::Result<(Config, TurnaroundSpec, PlannedTurn)> {
    let file = ConfigArgs { config: args.config.clone() };
    let config = load_plan(&file, work)?;
    let plan = match (config.route().as_turnaround(), &args.config) {
        (Some(plan), _) => plan,
        (None, Some(path)) if config.route().as_path().is_some() => {
            let error = format!(
                "[route] kind is \"{}\", must be \"turnaround\" or \"spiral\" for a question about a turn",
                config.document().route_kind()
            );
            return Err(BadInput(error)).with_context(|| path.display().to_string());
        }
        (None, None) => TurnaroundSpec::default(),
        (None, Some(_)) if asks_for_turn(args) => {
            let paper = TurnaroundSpec::default();
            TurnaroundSpec { pitch_m: config.route().pitch_m().unwrap_or(paper.pitch_m), ..paper }
        }
        (None, Some(path)) => {
            let error = format!(
                "[route] kind is \"{}\", must be \"turnaround\" for a question about a turn; \
                 --turn-diameter, --radius-ratio or --pitch makes it one",
                config.route().shape.kind()
            );
            return Err(BadInput(error)).with_context(|| path.display().to_string());
        }
    };
    let plan = TurnaroundSpec {
        pitch_m: args.pitch.unwrap_or(plan.pitch_m),
        turn_diameter_m: args.turn_diameter.unwrap_or(plan.turn_diameter_m),
        radius_ratio: args.radius_ratio.unwrap_or(plan.radius_ratio),
        line_m: args.turn_line.unwrap_or(plan.line_m),
    };
    let (config, turn) = with_turnaround(&config, plan)?;
    Ok((config, plan, turn))
}

/// Show time, in seconds, at which a head of this planned speed reaches a travel of a passage. A passage may extend beyond the
/// planned run. There it is the time at which the head would reach the travel if the run continued.
pub(super) fn passage_time_s(config: &Config, speed_mps: f64, travel_m: f64) -> f64 {
    let head = HeadTable { speed_mps, accel_mps2: config.tables().head.accel_mps2 };
    let (start_s, end_m) = (config.start_s(), config.lead().end_travel_m());
    if (speed_mps * start_s..=end_m).contains(&travel_m) {
        head.timetable(start_s, end_m).time_s(travel_m)
    } else {
        head.timetable(start_s.min(travel_m / speed_mps), f64::INFINITY).time_s(travel_m)
    }
}
