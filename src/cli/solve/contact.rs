//! `solve contact`: finds the first time at which two benches touch, or come within a clearance.

use std::path::PathBuf;

use anyhow::{Context as _, ensure};
use bench_dragon_geometry::clearance::{Contact, first_within};
use bench_dragon_geometry::dragon::Spent;
use bench_dragon_geometry::number::{Fixed, Place};
use bench_dragon_geometry::planner::{ClosestApproach, LargestRatio, clearance_profile, first_faster, near_misses};
use clap::{Args, ValueHint};
use glam::DVec2;
use serde::Serialize;

use super::figure::{FigureArgs, even_travels, pair};
use super::play::PlayAnswer;
use super::poses::coarser_step_s;
use super::stage::StageAnswer;
use super::{CLEARANCE_M, SPEED_RATIO, TooFast, WorkArgs, contest, formation, interrupt, load_any_plan, xlsx};
use crate::cli::flags::{BadInput, ConfigArgs, Format, FormatArgs, step, within};
use crate::cli::in_file;
use crate::cli::print::{Progress, print_json, print_line, print_to_stderr};
use crate::config::{Config, NEAR_M, PlanDocument};
use crate::output::Counted;
use crate::output::figure::{ClearanceOverTime, ContactMark, ContactView, NearMissMark};
use crate::output::in_plan::in_plan;
use crate::output::poses::Poses;
use crate::output::table;
use crate::output::terminal_text::Printable;

/// Find the first contact: its time, the two benches and the point.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon solve contact --config stage.toml --format json
  bench-dragon solve contact --clearance 0.05 --max-ratio 1.5
  bench-dragon solve contact --figure contact.svg
  bench-dragon solve contact --figure poster.png --title \"Dragon of the North Gate\" --paper a2
  bench-dragon solve contact --profile --step 0.5 --figure clearance.svg
  bench-dragon solve contact --contest result2.xlsx")]
pub(crate) struct ContactArgs {
    /// Also print the clearance over time and its near misses, up to the contact or the run's end; with --figure, draw them
    /// instead of the boards at the contact.
    #[arg(long)]
    pub(crate) profile: bool,
    /// Find the first time at which a pair comes within this clearance in metres, 0 to 10, instead of a contact [default: 0].
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, value_parser = within(CLEARANCE_M))]
    pub(crate) clearance: Option<f64>,
    /// Also find the first time at which a handle is more than this many times as fast as the head, 1 to 1000, on the whole run.
    #[arg(long, value_name = "RATIO", allow_negative_numbers = true, value_parser = within(SPEED_RATIO))]
    pub(crate) max_ratio: Option<f64>,
    /// Seconds between two times of the profile, above 0.
    #[arg(long, value_name = "SECONDS", requires = "profile", default_value = "1", allow_negative_numbers = true, value_parser = |text: &str| step(text, 1, "above 0 and at most"))]
    pub(crate) step: i64,
    /// Clearance in metres under which a local minimum is a near miss, 0 to 10 [default: configured near_m, else 0.02].
    #[arg(long, value_name = "METRES", requires = "profile", allow_negative_numbers = true, value_parser = within(NEAR_M))]
    pub(crate) near: Option<f64>,
    /// Write the poses at that time into a workbook as the contest of 2024 (CUMCM, problem A) asks for in result2.xlsx; an existing
    /// file is replaced.
    #[arg(long, value_name = "FILE.xlsx", value_hint = ValueHint::FilePath, value_parser = xlsx)]
    pub(crate) contest: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) config: ConfigArgs,
    #[command(flatten)]
    pub(crate) figure: FigureArgs,
    #[command(flatten)]
    pub(crate) work: WorkArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

#[derive(Serialize)]
struct ContactAnswer {
    time_s: Option<f64>,
    benches: Option<[usize; 2]>,
    point_m: Option<[f64; 2]>,
    /// The requested clearance, in metres.
    clearance_m: Option<f64>,
    /// Show time at which the search ended early, because it took too much work.
    searched_to_s: Option<f64>,
    #[serde(flatten)]
    play: Option<PlayAnswer>,
    #[serde(flatten)]
    speed: Option<SpeedAnswer>,
    #[serde(flatten)]
    stage: Option<StageAnswer>,
    #[serde(flatten)]
    profile: Option<Profile>,
}

/// The first handle over a ratio of speeds, on the whole run.
#[derive(Serialize)]
struct SpeedAnswer {
    /// The requested ratio.
    max_ratio: f64,
    too_fast: Option<TooFast>,
    /// The reason for which the answer is unknown: it took too much work.
    too_fast_undecided: Option<String>,
}

impl SpeedAnswer {
    fn of(config: &Config, max_ratio: f64, work: WorkArgs) -> Self {
        let searched = first_faster(&config.lead().metered(&work.meter()), max_ratio);
        let too_fast = |LargestRatio { ratio, travel_m, handle }| TooFast {
            ratio,
            time_s: config.timetable().time_s(travel_m),
            handle,
        };
        let too_fast_undecided = searched.as_ref().err().map(ToString::to_string);
        Self { max_ratio, too_fast: searched.ok().flatten().map(too_fast), too_fast_undecided }
    }

    fn text(&self) -> String {
        let Self { max_ratio, too_fast, too_fast_undecided } = self;
        let over = format!("over {max_ratio} times as fast as the head");
        match (too_fast, too_fast_undecided) {
            (Some(TooFast { time_s, handle, .. }), _) => {
                format!("first handle {over}: handle {handle} at {} s", Fixed::<6>(*time_s))
            }
            (None, Some(reason)) => {
                format!("whether a handle is {over} is unknown: {reason}{}", interrupt::allows_more())
            }
            (None, None) => format!("no handle is {over}"),
        }
    }
}

pub(super) fn run(args: &ContactArgs) -> anyhow::Result<()> {
    match load_any_plan(&args.config, args.work)? {
        PlanDocument::OneDragon(document) => of_one_dragon(args, &in_file(&args.config, document.build())?),
        PlanDocument::Formation(document) => formation::contact(args, &document),
    }
}

fn of_one_dragon(args: &ContactArgs, config: &Config) -> anyhow::Result<()> {
    args.figure.keep_drawing(config.document())?;
    let dragon = config.lead();
    let (start_m, end_m) = (dragon.start_travel_m(), dragon.end_travel_m());
    let clearance_m = args.clearance.unwrap_or(0.0);
    if let Some(fact) = args.clearance.and_then(|clearance_m| config.under_play("--clearance", clearance_m)) {
        print_to_stderr(&format!("warning: {fact}: boards this far apart may touch as they move in their hinges"));
    }
    let searched = first_within(&dragon.metered(&args.work.meter()), clearance_m, start_m, end_m);
    let contact = searched.ok().flatten();
    let spent = searched.err();
    let to_m = contact.map(|contact| contact.travel_m).or(spent.map(|spent| spent.reached_m)).unwrap_or(end_m);
    let answer = ContactAnswer {
        time_s: contact.map(|contact| config.timetable().time_s(contact.travel_m)),
        benches: contact.map(|contact| contact.benches),
        point_m: contact.map(|contact| contact.point.to_array()),
        clearance_m: args.clearance,
        searched_to_s: spent.map(|spent| config.timetable().time_s(spent.reached_m)),
        play: PlayAnswer::of(config, contact.as_ref(), clearance_m, args.work),
        speed: args.max_ratio.map(|max_ratio| SpeedAnswer::of(config, max_ratio, args.work)),
        stage: StageAnswer::of(config.stage(), &config.formation().dragons()[0], args.work),
        profile: args.profile.then(|| Profile::of(config, to_m, args)).transpose()?,
    };
    match args.format.format {
        Format::Json => print_json(&answer)?,
        Format::Text => {
            print_line(text(config, clearance_m, contact.as_ref(), spent))?;
            if let Some(play) = &answer.play {
                print_line(play.text(&what(clearance_m)))?;
            }
            answer.speed.iter().try_for_each(|speed| print_line(speed.text()))?;
            if let Some(stage) = &answer.stage {
                print_line(format_args!("stage: {}", stage.text()))?;
            }
            if let Some(profile) = &answer.profile {
                print_line(profile.text())?;
            }
        }
    }
    if let Some(path) = &args.contest {
        let time_s = answer.time_s.context("--contest has nothing to write: no benches touch before the run ends")?;
        let pose = &Poses::of(&[time_s], config).poses[0];
        interrupt::write(path, &table::workbook(&[contest::sheet_at_end(&pose.handles)])?)?;
        if args.format.format == Format::Text {
            print_line(format_args!("poses at {} s written to {}", Fixed::<6>(time_s), Printable(path)))?;
        }
    }
    draw(args, config, to_m, contact.as_ref(), answer.profile.as_ref())
}

/// Draws the clearance over time if a profile is requested, else the boards at the contact.
fn draw(
    args: &ContactArgs,
    config: &Config,
    to_m: f64,
    contact: Option<&Contact>,
    profile: Option<&Profile>,
) -> anyhow::Result<()> {
    if !args.figure.is_asked() {
        return Ok(());
    }
    if let Some(profile) = profile {
        ensure!(profile.has_points(), "--figure has nothing to show: all benches of the dragon are neighbours");
        ensure!(
            to_m > config.lead().start_travel_m(),
            "--figure has nothing to show: benches touch at the start already"
        );
        let figure = clearance_over_time(args, config, to_m, contact, &profile.near_misses);
        return args.figure.save_and_report(figure.draw(), args.format.format);
    }
    let &Contact { travel_m, benches, .. } =
        contact.context("--figure has nothing to show: no benches touch before the run ends")?;
    let what = args.clearance.map_or("contact,".to_owned(), |clearance_m| format!("within {clearance_m} m,"));
    let (time_s, [first, second]) = (config.timetable().time_s(travel_m), benches);
    let title = format!("First {what} at {} s: benches {first} and {second}", Fixed::<6>(time_s));
    let caption = args.figure.caption(config, title);
    let dragon = config.lead();
    let pair = pair(dragon, travel_m, Some(benches)).expect("it is the pair of these benches");
    let view = ContactView { caption, dragon: in_plan(config, dragon, travel_m), pair };
    args.figure.save_and_report(view.draw(), args.format.format)
}

/// The clearance up to a travel, with its near misses.
fn clearance_over_time(
    args: &ContactArgs,
    config: &Config,
    to_m: f64,
    contact: Option<&Contact>,
    near_misses: &[NearMiss],
) -> ClearanceOverTime {
    let (dragon, timetable) = (config.lead().metered(&args.work.meter()), config.timetable());
    let points = clearance_profile(&dragon, &even_travels(&dragon, dragon.start_travel_m(), to_m), || ());
    let sample = |point: &ClosestApproach| DVec2::new(timetable.time_s(point.travel_m), point.pair.clearance_m);
    let near_miss = |&NearMiss { at: Point { time_s, clearance_m, benches }, .. }: &NearMiss| NearMissMark {
        time_s,
        clearance_m,
        benches,
    };
    ClearanceOverTime {
        caption: args.figure.caption(config, "Least clearance of all pairs of benches"),
        samples: points.approaches.iter().map(sample).collect(),
        near_misses: near_misses.iter().map(near_miss).collect(),
        contact: contact
            .map(|contact| ContactMark { time_s: timetable.time_s(contact.travel_m), benches: contact.benches }),
    }
}

/// The name of what is searched for, in words.
fn what(clearance_m: f64) -> String {
    if clearance_m == 0.0 { "contact".to_owned() } else { format!("clearance of {clearance_m} m") }
}

fn text(config: &Config, clearance_m: f64, contact: Option<&Contact>, spent: Option<Spent>) -> String {
    let what = what(clearance_m);
    if let Some(&Contact { travel_m, benches: [first, second], point }) = contact {
        let time_s = config.timetable().time_s(travel_m);
        return format!(
            "first {what} at {} s, benches {first} and {second}, at {}",
            Fixed::<6>(time_s),
            Place::<6>(point.to_array())
        );
    }
    if let Some(spent) = spent {
        let reached_s = config.timetable().time_s(spent.reached_m);
        return format!(
            "no {what} up to {} s; later times are unknown: {spent}{}",
            Fixed::<6>(reached_s),
            interrupt::allows_more()
        );
    }
    let end_s = config.end_s();
    let end = config.lead().feasible_end();
    match config.lead().tight_spot() {
        None => format!("no {what} before the run ends, at {} s", Fixed::<6>(end_s)),
        Some(spot) => {
            format!("no {what} before the run ends, at {} s, where {end}: {spot}", Fixed::<6>(end_s))
        }
    }
}

/// Most times of a profile. Each needs a solved chain and a search through all pairs.
const MAX_TIMES: usize = 1_000_000;

const NANOSECONDS: f64 = 1e9;

#[derive(Serialize)]
struct Profile {
    #[serde(rename = "profile")]
    points: Vec<Point>,
    near_misses: Vec<NearMiss>,
    /// Show time at which the profile ends early, because it took too much work.
    #[serde(rename = "profile_to_s")]
    points_to_s: Option<f64>,
    /// Show time at which the near misses end early, because they took too much work.
    near_misses_to_s: Option<f64>,
}

#[derive(Serialize)]
struct Point {
    time_s: f64,
    clearance_m: f64,
    benches: [usize; 2],
}

#[derive(Serialize)]
struct NearMiss {
    #[serde(flatten)]
    at: Point,
    point_m: [f64; 2],
}

impl Profile {
    /// The profile up to a travel: the contact, the run's end, or the early end of the search. This travel is its last time.
    fn of(config: &Config, to_m: f64, args: &ContactArgs) -> Result<Self, BadInput> {
        let (dragon, timetable) = (config.lead(), config.timetable());
        let from_m = dragon.start_travel_m();
        let step_s = args.step as f64 / NANOSECONDS;
        let count = ((timetable.time_s(to_m) - config.start_s()) / step_s).ceil();
        if count >= MAX_TIMES as f64 {
            let coarser_s = coarser_step_s(count * step_s, MAX_TIMES);
            return Err(BadInput(format!(
                "--step is {step_s}, which makes {count} times, must make at most {MAX_TIMES}: try --step {coarser_s}"
            )));
        }
        let time_s = |i: usize| config.start_s() + (i as f64 * args.step as f64) / NANOSECONDS;
        let times_m = (0..count as usize).map(|i| timetable.travel_m(time_s(i))).filter(|&travel_m| travel_m < to_m);
        let travels_m: Vec<f64> = times_m.chain([to_m]).collect();
        let progress = Progress::new("near misses", 1.0);
        let limit_m = args.near.unwrap_or_else(|| config.tables().monitor.near_m);
        let metered = dragon.metered(&args.work.meter());
        let misses = near_misses(&metered, from_m, to_m, limit_m, |share| progress.add(share));
        drop(progress);
        let progress = Progress::new("profile", travels_m.len() as f64);
        let metered = dragon.metered(&args.work.meter());
        let points = clearance_profile(&metered, &travels_m, || progress.add(1.0));
        let point = |&ClosestApproach { travel_m, pair }: &ClosestApproach| Point {
            time_s: timetable.time_s(travel_m),
            clearance_m: pair.clearance_m,
            benches: pair.benches,
        };
        let near_miss =
            |approach: &ClosestApproach| NearMiss { at: point(approach), point_m: approach.pair.point.to_array() };
        Ok(Self {
            points_to_s: points.ends_early_m.map(|travel_m| timetable.time_s(travel_m)),
            near_misses_to_s: misses.ends_early_m.map(|travel_m| timetable.time_s(travel_m)),
            points: points.approaches.iter().map(point).collect(),
            near_misses: misses.approaches.iter().map(near_miss).collect(),
        })
    }

    /// Whether the profile has a clearance. A dragon with fewer than three benches has none.
    fn has_points(&self) -> bool {
        !self.points.is_empty()
    }

    /// The near misses, followed by the profile.
    fn text(&self) -> String {
        let row = |&Point { time_s, clearance_m, benches: [first, second] }: &Point| {
            format!("{:>12} {:>14} {first:>6} {second:>7}", Fixed::<6>(time_s), Fixed::<9>(clearance_m))
        };
        let near_miss = |NearMiss { at, point_m }: &NearMiss| format!("{}  at {}", row(at), Place::<6>(*point_m));
        let ends = |what: &str, to_s: Option<f64>| {
            to_s.map(|to_s| format!("{what} complete up to {} s: {}", Fixed::<6>(to_s), interrupt::early_end()))
        };
        let mut lines = vec![Counted(self.near_misses.len() as u64, "near miss").to_string()];
        lines.extend(self.near_misses.iter().map(near_miss));
        lines.extend(ends("near misses are", self.near_misses_to_s));
        lines.extend([String::new(), format!("{:>12} {:>14} {:>14}", "s", "clearance m", "benches")]);
        // At a contact, rounding may make the last clearance slightly negative.
        let shown_m = |clearance_m: f64| if clearance_m.abs() < 5e-10 { 0.0 } else { clearance_m };
        lines.extend(self.points.iter().map(|at| row(&Point { clearance_m: shown_m(at.clearance_m), ..*at })));
        lines.extend(ends("the profile is", self.points_to_s));
        lines.join("\n")
    }
}
