//! `solve route`: surveys a route of any kind, and how far the dragon gets on it.

use std::path::PathBuf;
use std::sync::Arc;

use bench_dragon_geometry::dragon::{Dragon, DragonError, TightSpot};
use bench_dragon_geometry::number::{Fixed, Place};
use bench_dragon_geometry::planner::RouteSurvey;
use bench_dragon_geometry::route::{Crossing, Route, RouteHeights, RouteShape, RouteSpec, TightestBend};
use clap::{Args, ValueHint};
use glam::DVec2;
use serde::Serialize;

use super::stage::StageAnswer;
use super::{AnswerArgs, formation_survey, interrupt, list, load_any_plan, save_config};
use crate::cli::flags::ConfigArgs;
use crate::cli::in_file;
use crate::cli::print::print_report;
use crate::config::{Config, ConfigDocument, DrawingFit, PlanDocument, unplaced};
use crate::output::Counted;
use crate::output::figure::{DragonInPlan, RouteView};
use crate::output::in_plan::{in_plan, polyline, stage_in_plan};

/// Survey the route: its length, end, tightest bend and crossings, and how far the dragon gets on it.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon solve route
  bench-dragon solve route --config eight.toml --format json
  bench-dragon solve route --config eight.toml --figure route.svg
  bench-dragon solve route --config street.toml --save-config segments.toml
  bench-dragon solve route --list street.svg

The length counts from the head's start to the end of the route, even if the dragon's run ends before. Travel is the length \
that the head has walked since t = 0. On ground that is not flat, both are along the ground; the tightest bend, the end and the \
crossings are seen from above.

A crossing is a point that the route passes twice, at an angle. A route that touches itself, or runs along itself, does not \
cross itself there. The crossings are those of the part that the head walks, and of the part on which the dragon stands at the \
start. For a closed path, they are those of one lap with itself.")]
pub(crate) struct RouteArgs {
    /// List the paths of a drawing, with their names, layers and lengths, instead of a survey. Lengths are those of its own
    /// units.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath, conflicts_with_all = ["config", "figure", "save_config"])]
    pub(crate) list: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) config: ConfigArgs,
    #[command(flatten)]
    pub(crate) answer: AnswerArgs,
}

#[derive(Debug, Serialize)]
pub(super) struct RouteAnswer {
    length_m: f64,
    end_m: [f64; 2],
    end_heading_deg: f64,
    /// Null if the head walks straight on.
    tightest_radius_m: Option<f64>,
    tightest_travel_m: Option<f64>,
    tightest_m: Option<[f64; 2]>,
    segments: usize,
    /// Distance of the route from the drawing; null for a route that is not a drawing.
    fit_error_m: Option<f64>,
    /// Width and height of the drawing; null for a route that is not a drawing.
    drawing_size_m: Option<[f64; 2]>,
    /// Null if the search took too much work.
    crossings: Option<usize>,
    #[serde(flatten)]
    heights: Option<HeightsAnswer>,
    crossing_points: Vec<CrossingPoint>,
    /// Travel of the head at the end of the run; null if the dragon cannot stand at the start.
    run_end_m: Option<f64>,
    run_end_s: Option<f64>,
    run_end_point_m: Option<[f64; 2]>,
    ends_because: Option<String>,
    /// The first place that a bench cannot follow; null if the dragon walks the whole route.
    cannot_follow: Option<TightPlace>,
    /// The reason for which the dragon cannot stand at the start.
    infeasible: Option<String>,
    #[serde(flatten)]
    stage: Option<StageAnswer>,
}

/// Heights of the handles along the route, on ground that is not flat.
#[derive(Clone, Copy, Debug, Serialize)]
struct HeightsAnswer {
    lowest_m: f64,
    highest_m: f64,
    /// Up or down, in metres per metre of the plan.
    steepest_slope: f64,
    steepest_travel_m: f64,
    steepest_m: [f64; 2],
}

#[derive(Clone, Copy, Debug, Serialize)]
struct CrossingPoint {
    point_m: [f64; 2],
    travels_m: [f64; 2],
}

#[derive(Clone, Copy, Debug, Serialize)]
struct TightPlace {
    bench: usize,
    /// Travel of the bench's front handle along the route.
    travel_m: f64,
    point_m: [f64; 2],
}

pub(super) fn run(args: &RouteArgs) -> anyhow::Result<()> {
    if let Some(file) = &args.list {
        return list::run(file, args.answer.format.format);
    }
    let document = match load_any_plan(&args.config, args.answer.work)? {
        PlanDocument::OneDragon(document) => *document,
        PlanDocument::Formation(document) => return formation_survey::routes(args, &document),
    };
    args.answer.keep_files_apart(&document)?;
    let route = in_file(&args.config, document.curve())?;
    let placed = place(&args.config, &document, &route)?;
    let standing_m = placed.as_ref().map_or(document.dimensions().links_m(), |config| standing_m(config.lead()));
    let survey = RouteSurvey::of(&route, document.route(), standing_m, &args.answer.work.meter());
    let stage = match &placed {
        Ok(config) => StageAnswer::of(config.stage(), &config.formation().dragons()[0], args.answer.work),
        Err(_) => document.stage().outline().map(|_| StageAnswer::default()),
    };
    let answer = RouteAnswer::of(&document, &survey, placed.as_ref()).on_stage(stage);
    print_report(args.answer.format.format, &answer, answer.text(document.route(), document.drawing()))?;
    draw(args, &document, &route, &survey, &placed, &answer)?;
    match &placed {
        Ok(config) => save_config(&args.answer, Ok(config)),
        Err(error) => save_config(&args.answer, Err(&error.to_string())),
    }
}

/// Places the dragon on its route. A dragon that does not fit there is an answer. Fails for any other fault of the configuration.
fn place(config: &ConfigArgs, document: &ConfigDocument, route: &Route) -> anyhow::Result<Result<Config, DragonError>> {
    let built = document.clone().build();
    if let (Err(_), Err(error)) = (&built, document.place(Arc::new(route.clone()))) {
        return Ok(Err(error));
    }
    in_file(config, built).map(Ok)
}

/// Length of the route on which the dragon stands at the start.
pub(super) fn standing_m(dragon: &Dragon) -> f64 {
    let start_m = dragon.start_travel_m();
    let chain = dragon.chain(start_m).expect("the run has a start");
    chain.last().map_or(0.0, |tail| start_m - dragon.route().travel(tail.parameter))
}

impl RouteAnswer {
    pub(super) fn of(document: &ConfigDocument, survey: &RouteSurvey, placed: Result<&Config, &DragonError>) -> Self {
        let RouteSurvey { length_m, end, tightest, heights, crossings } = survey;
        let config = placed.ok();
        let dragon = config.map(Config::lead);
        let run_end_m = dragon.map(|dragon| dragon.end_travel_m());
        let head = dragon.map(|dragon| dragon.route().point(dragon.end_parameter()).position);
        Self {
            length_m: *length_m,
            end_m: end.position.to_array(),
            end_heading_deg: end.tangent.to_angle().to_degrees(),
            tightest_radius_m: tightest.map(|tightest| tightest.radius_m),
            tightest_travel_m: tightest.map(|tightest| tightest.travel_m),
            tightest_m: tightest.map(|tightest| tightest.point.to_array()),
            segments: document.route().shape.segments(),
            fit_error_m: document.drawing().map(|drawing| drawing.fit_error_m),
            drawing_size_m: document.drawing().map(|drawing| drawing.size_m),
            heights: heights.map(HeightsAnswer::of),
            crossings: crossings.is_complete.then_some(crossings.found.len()),
            crossing_points: crossings.found.iter().map(CrossingPoint::of).collect(),
            run_end_m,
            run_end_s: config.map(Config::end_s),
            run_end_point_m: head.map(|head| head.to_array()),
            ends_because: dragon.map(|dragon| dragon.feasible_end().to_string()),
            cannot_follow: tight_spot(placed).map(|spot| TightPlace::of(&spot)),
            infeasible: placed.err().map(unplaced),
            stage: None,
        }
    }

    /// The same answer, of a run that ends at another time.
    pub(super) fn ending_at(self, run_end_s: f64) -> Self {
        Self { run_end_s: Some(run_end_s), ..self }
    }

    /// The same answer, with that about the stage.
    pub(super) fn on_stage(self, stage: Option<StageAnswer>) -> Self {
        Self { stage, ..self }
    }

    pub(super) fn text(&self, plan: &RouteSpec, drawing: Option<&DrawingFit>) -> String {
        let mut lines = Vec::new();
        let mut line = |name: &str, text: String| lines.push(format!("{name:<16} {text}"));
        line("route", kind(plan));
        line("length", format!("{:.6} m", self.length_m));
        line("end", format!("at {}, heading {}°", Place::<6>(self.end_m), Fixed::<6>(self.end_heading_deg)));
        match (self.tightest_radius_m, self.tightest_travel_m, self.tightest_m) {
            (Some(radius_m), Some(travel_m), Some(at)) => {
                line(
                    "tightest bend",
                    format!("radius {radius_m:.6} m, at {} m of travel, at {}", Fixed::<6>(travel_m), Place::<6>(at)),
                );
            }
            _ => line("tightest bend", "none: the head walks straight on".to_owned()),
        }
        if let Some(DrawingFit { file, fit_error_m, tolerance_m, corners, size_m: [width_m, height_m], .. }) = drawing {
            let size = format!("{width_m:.3} m x {} m", Fixed::<3>(*height_m));
            let near = format!("at most {fit_error_m:.6} m from {}, allowed are {tolerance_m} m", file.display());
            line("drawing", format!("{size}, {near}; {}", Counted(*corners as u64, "rounded corner")));
        }
        if let Some(heights) = self.heights {
            line("heights", heights.text());
        }
        match self.crossings {
            Some(count) => line("crossings", count.to_string()),
            None => line("crossings", format!("unknown: {}", interrupt::early_end())),
        }
        for CrossingPoint { point_m, travels_m: [one, other] } in self.crossing_points.iter().take(SHOWN_CROSSINGS) {
            line("crossing", format!("at {}, after {one:.6} m and {other:.6} m of travel", Place::<6>(*point_m)));
        }
        let hidden = self.crossing_points.len().saturating_sub(SHOWN_CROSSINGS);
        if hidden > 0 {
            line("crossing", format!("{hidden} more; --format json has all"));
        }
        if let (Some(end_m), Some(end_s), Some(at), Some(reason)) =
            (self.run_end_m, self.run_end_s, self.run_end_point_m, &self.ends_because)
        {
            line(
                "run ends",
                format!(
                    "after {} m of travel, at {} s, at {}: {reason}",
                    Fixed::<6>(end_m),
                    Fixed::<6>(end_s),
                    Place::<6>(at)
                ),
            );
        }
        if let Some(TightPlace { bench, travel_m, point_m }) = self.cannot_follow {
            line(
                "cannot follow",
                format!("bench {bench}, at {} m of travel, at {}", Fixed::<6>(travel_m), Place::<6>(point_m)),
            );
        }
        if let (Some(stage), None) = (&self.stage, &self.infeasible) {
            line("stage", stage.text());
        }
        self.infeasible.iter().for_each(|reason| line("infeasible", reason.clone()));
        lines.join("\n")
    }
}

/// Most crossings that the text lists.
const SHOWN_CROSSINGS: usize = 20;

impl HeightsAnswer {
    fn of(RouteHeights { lowest_m, highest_m, slope, travel_m, point }: RouteHeights) -> Self {
        let steepest_m = point.to_array();
        Self { lowest_m, highest_m, steepest_slope: slope, steepest_travel_m: travel_m, steepest_m }
    }

    fn text(&self) -> String {
        let Self { lowest_m, highest_m, steepest_slope, steepest_travel_m, steepest_m } = *self;
        let (percent, travel_m) = (100.0 * steepest_slope, Fixed::<6>(steepest_travel_m));
        format!(
            "from {} m to {} m, steepest {} % at {travel_m} m of travel, at {}",
            Fixed::<3>(lowest_m),
            Fixed::<3>(highest_m),
            Fixed::<1>(percent),
            Place::<6>(steepest_m)
        )
    }
}

impl CrossingPoint {
    fn of(&Crossing { point, travels_m }: &Crossing) -> Self {
        Self { point_m: point.to_array(), travels_m }
    }
}

impl TightPlace {
    fn of(&TightSpot { bench, travel_m, point }: &TightSpot) -> Self {
        Self { bench, travel_m, point_m: point.to_array() }
    }
}

/// The first place that a bench cannot follow, at the start or at the end of the run.
fn tight_spot(placed: Result<&Config, &DragonError>) -> Option<TightSpot> {
    match placed {
        Ok(config) => config.lead().tight_spot(),
        Err(DragonError::CannotStand { at, .. }) => Some(*at),
        Err(_) => None,
    }
}

fn kind(plan: &RouteSpec) -> String {
    let segments = Counted(plan.shape.segments() as u64, "segment");
    match &plan.shape {
        RouteShape::Path(path) if path.laps.is_some() => {
            let laps = Counted(u64::from(path.laps.unwrap_or(1)), "lap");
            format!("closed path of {segments}, {:.6} m, {laps}", path.lap_m())
        }
        shape => format!("{} of {segments}", shape.kind()),
    }
}

/// Draws the route, and the dragon at the end of its run.
fn draw(
    args: &RouteArgs,
    document: &ConfigDocument,
    route: &Route,
    survey: &RouteSurvey,
    placed: &Result<Config, DragonError>,
    answer: &RouteAnswer,
) -> anyhow::Result<()> {
    let figure = &args.answer.figure;
    if !figure.is_asked() {
        return Ok(());
    }
    let (start_m, end_m) = (route.start_travel_m(), route.end_travel_m());
    let walked_to_m = placed.as_ref().map_or(start_m, |config| config.lead().end_travel_m());
    let title = format!("The route, {:.3} m from the head's start", survey.length_m);
    let dragon = placed.as_ref().map(|config| in_plan(config, config.lead(), config.lead().end_travel_m()));
    let view = RouteView {
        caption: figure.caption_of(document, title),
        dragon: DragonInPlan {
            route: polyline(route, start_m - document.dimensions().links_m(), start_m),
            stage: stage_in_plan(document.stage()),
            ..dragon.unwrap_or_default()
        },
        walked: polyline(route, start_m, walked_to_m),
        beyond: polyline(route, walked_to_m, end_m),
        crossings: survey.crossings.found.iter().map(|crossing| crossing.point).collect::<Vec<DVec2>>(),
        tightest: survey.tightest.map(|TightestBend { point, .. }| point),
        tight_spot: tight_spot(placed.as_ref()).map(|spot| spot.point),
        leaving: answer.stage.as_ref().and_then(StageAnswer::point_m).map(DVec2::from),
    };
    figure.save_and_report(view.draw(), args.answer.format.format)
}
