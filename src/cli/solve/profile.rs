//! `solve profile`: finds the quickest show under limits, from rest to rest, as a list of planned speeds.

use std::collections::BTreeSet;
use std::sync::Arc;

use anyhow::Context as _;
use bench_dragon_geometry::dragon::Dragon;
use bench_dragon_geometry::formation::Timetable;
use bench_dragon_geometry::number::Fixed;
use bench_dragon_geometry::planner::{
    Infeasible, QuickestRun, RunLimits, SpeedCue, largest_speed_ratio, passage_through,
};
use clap::Args;
use glam::DVec2;
use serde::Serialize;

use super::figure::even_travels;
use super::turn::{TurnPlanArgs, asks_for_turn, planned_turn};
use super::{AnswerArgs, interrupt, load_any_plan, save_config, work_default};
use crate::cli::flags::{BadInput, ConfigArgs, within};
use crate::cli::in_file;
use crate::cli::print::print_report;
use crate::config::{Config, Cue, HEAD_ACCEL_MPS2, HEAD_SPEED_MPS, PlanDocument};
use crate::output::Counted;
use crate::output::figure::{SpeedLine, SpeedProfile};

/// Find the quickest show in which no handle exceeds a limit, from rest to rest, as a list of planned speeds.
///
/// The head's acceleration and speed are limited too. The answer has as few cues as --within allows. Between them the head
/// walks evenly, after a ramp. No handle exceeds the limit anywhere: this is proved, also between samples. With --config the planned
/// run counts, with a rest where a cue waits; without it, or with flags for a turn, the whole passage of all benches through the turn.
#[derive(Clone, Debug, Args)]
#[command(mut_arg("work", |arg| work_default(arg, "300")))]
#[command(after_help = "Examples:
  bench-dragon solve profile --limit 2 --accel 0.5
  bench-dragon solve profile --limit 2 --accel 0.5 --within 5% --figure profile.svg
  bench-dragon solve profile --limit 1.5 --speed 1.2 --config stage.toml --save-config quick.toml")]
pub(crate) struct ProfileArgs {
    /// Speed in m/s that no handle may exceed, 0.001 to 1000.
    #[arg(long, value_name = "MPS", allow_negative_numbers = true, value_parser = within(0.001..=1000.0))]
    pub(crate) limit: f64,
    /// Largest acceleration of the head in m/s², 0.001 to 1000 [default: the configured accel_mps2].
    #[arg(long, value_name = "MPS2", allow_negative_numbers = true, value_parser = within(HEAD_ACCEL_MPS2))]
    pub(crate) accel: Option<f64>,
    /// Largest speed of the head in m/s, 0.001 to 10 [default: --limit, at most 10].
    #[arg(long, value_name = "MPS", allow_negative_numbers = true, value_parser = within(HEAD_SPEED_MPS))]
    pub(crate) speed: Option<f64>,
    /// How much longer than the quickest show the answer may take, 0.1% to 100%; more time needs fewer cues.
    #[arg(long, value_name = "PERCENT", default_value = "1%", allow_negative_numbers = true, value_parser = percent)]
    pub(crate) within: f64,
    #[command(flatten)]
    pub(crate) plan: TurnPlanArgs,
    #[command(flatten)]
    pub(crate) answer: AnswerArgs,
}

/// Reads a percentage, with or without its sign. Returns the share.
fn percent(text: &str) -> Result<f64, String> {
    let percent: Option<f64> = text.trim_end_matches('%').trim_end().parse().ok();
    let share = percent.filter(|percent| (0.1..=100.0).contains(percent)).map(|percent| 0.01 * percent);
    share.ok_or_else(|| "must be from 0.1% to 100%".to_owned())
}

#[derive(Default, Serialize)]
struct ProfileAnswer {
    duration_s: Option<f64>,
    /// A speed that no handle exceeds.
    largest_speed_mps: Option<f64>,
    cues: Vec<CueRow>,
    /// Duration of the quickest show, and a time that none falls below.
    optimum_s: Option<f64>,
    least_s: Option<f64>,
    /// The greatest speed at which the head may walk throughout, and the duration with it.
    constant_speed_mps: Option<f64>,
    constant_s: Option<f64>,
    /// Share of that duration that the cues save.
    gain: Option<f64>,
    infeasible: Option<String>,
    /// The reason for which the answer is unknown: it took too much work.
    undecided: Option<String>,
}

/// A planned speed of the head.
#[derive(Serialize)]
struct CueRow {
    /// Plan time.
    at_s: f64,
    speed_mps: f64,
    /// Whether the show waits there until GO.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    waits: bool,
}

/// The run that counts: a dragon, and the configured cues with the travels of the head at which they are.
struct PlannedRun {
    dragon: Arc<Dragon>,
    cues: Vec<(f64, Cue)>,
}

/// The quickest run of a dragon, and its run at a constant speed.
struct Profile {
    quickest: QuickestRun,
    constant_mps: f64,
    constant_s: f64,
}

pub(super) fn run(args: &ProfileArgs) -> anyhow::Result<()> {
    let (config, planned) = planned(args)?;
    args.answer.keep_files_apart(config.document())?;
    let limits = limits(args, &config)?;
    let found = planned.and_then(|run| Ok((profile(&run, &limits, args.within)?, run)));
    let answer = answer(found.as_ref().map(|(profile, _)| profile));
    print_report(args.answer.format.format, &answer, text(args, &limits, &answer))?;
    let (profile, run) = match &found {
        Ok(found) => found,
        Err(reason) => {
            args.answer.figure.refuse(&reason.to_string())?;
            return save_config(&args.answer, Err(&reason.to_string()));
        }
    };
    if args.answer.figure.is_asked() {
        let view = speeds(args, &config, &run.dragon, &limits, profile);
        args.answer.figure.save_and_report(view.draw(), args.answer.format.format)?;
    }
    let Some(path) = &args.answer.save_config else { return Ok(()) };
    interrupt::write(path, saved(&config, run, &limits, &profile.quickest)?.as_bytes())
}

/// The configuration, and its dragon on the planned run or on the whole passage through a turn.
fn planned(args: &ProfileArgs) -> anyhow::Result<(Config, Result<PlannedRun, Infeasible>)> {
    let (plan, meter) = (&args.plan, args.answer.work.long_meter());
    let file = ConfigArgs { config: plan.config.clone() };
    let Some(path) = plan.config.as_ref().filter(|_| !asks_for_turn(plan)) else {
        let (config, _, turn) = planned_turn(plan, args.answer.work)?;
        in_file(&file, require_level_ground(&config))?;
        let passage = passage_through(turn, *config.lead().dimensions(), &meter);
        return Ok((config, passage.map(|dragon| PlannedRun { dragon: Arc::new(dragon), cues: Vec::new() })));
    };
    let config = match load_any_plan(&file, args.answer.work)? {
        PlanDocument::OneDragon(document) => in_file(&file, document.build())?,
        PlanDocument::Formation(document) => {
            let count = Counted(document.dragons().len() as u64, "dragon");
            let error = BadInput(format!("[[dragons]] has {count}, must be absent for solve profile"));
            return Err(error).with_context(|| path.display().to_string());
        }
    };
    in_file(&file, require_level_ground(&config))?;
    in_file(&file, require_waits(config.cues()))?;
    let timetable = config.timetable();
    let cues = config.cues().iter().map(|cue| (timetable.travel_m(cue.at_s), cue.clone())).collect();
    let dragon = Arc::new(config.lead().metered(&meter));
    Ok((config, Ok(PlannedRun { dragon, cues })))
}

/// Fails for ground that is not flat: links turn in space there.
fn require_level_ground(config: &Config) -> Result<(), BadInput> {
    if config.route().ground.is_none() {
        return Ok(());
    }
    Err(BadInput("[ground] is present, must be absent for solve profile".to_owned()))
}

/// Fails for a cue at which the dragon is to stand for a planned time: the answer has other times.
fn require_waits(cues: &[Cue]) -> Result<(), BadInput> {
    match cues.iter().find(|cue| cue.speed_mps == Some(0.0)) {
        Some(Cue { name, .. }) => Err(BadInput(format!(
            "[[cues]] \"{name}\": speed_mps is 0, must be above 0 for solve profile; `wait = true` lets the show stand there"
        ))),
        None => Ok(()),
    }
}

impl PlannedRun {
    /// The cues that wait within the run, with their travels.
    fn waits(&self) -> impl Iterator<Item = &(f64, Cue)> {
        let within_m = self.dragon.start_travel_m() + LEAST_PIECE_M..=self.dragon.end_travel_m() - LEAST_PIECE_M;
        self.cues.iter().filter(move |(travel_m, cue)| cue.waits && within_m.contains(travel_m))
    }
}

fn limits(args: &ProfileArgs, config: &Config) -> Result<RunLimits, BadInput> {
    let accel_mps2 = args.accel.or(config.tables().head.accel_mps2).ok_or_else(|| {
        BadInput("--accel is absent, must be present: [head] accel_mps2 is not configured either".to_owned())
    })?;
    let head_mps = args.speed.unwrap_or(args.limit).min(*HEAD_SPEED_MPS.end());
    Ok(RunLimits { handle_mps: args.limit, head_mps, accel_mps2 })
}

fn profile(run: &PlannedRun, limits: &RunLimits, within: f64) -> Result<Profile, Infeasible> {
    let dragon = &run.dragon;
    let largest = largest_speed_ratio(dragon)?;
    let constant_mps = limits.head_mps.min(limits.handle_mps / largest.ratio);
    let rests_m: Vec<f64> = run.waits().map(|&(travel_m, _)| travel_m).collect();
    let places_m = [&[dragon.start_travel_m()], &*rests_m, &[dragon.end_travel_m()]].concat();
    let walk_s =
        |ends_m: &[f64]| Timetable::leaving(0.0, ends_m[0], constant_mps, Some(limits.accel_mps2), ends_m[1]).end_s();
    let constant_s = places_m.windows(2).map(walk_s).sum();
    Ok(Profile { quickest: QuickestRun::of(dragon, limits, &rests_m, within)?, constant_mps, constant_s })
}

impl CueRow {
    fn of(&SpeedCue { at_s, speed_mps, leaves_rest: waits }: &SpeedCue) -> Self {
        Self { at_s, speed_mps, waits }
    }
}

fn answer(found: Result<&Profile, &Infeasible>) -> ProfileAnswer {
    match found {
        Ok(Profile { quickest, constant_mps, constant_s }) => ProfileAnswer {
            duration_s: Some(quickest.duration_s),
            largest_speed_mps: Some(quickest.largest_mps),
            cues: quickest.cues.iter().map(CueRow::of).collect(),
            optimum_s: Some(quickest.optimum_s),
            least_s: Some(quickest.least_s),
            constant_speed_mps: Some(*constant_mps),
            constant_s: Some(*constant_s),
            gain: Some(1.0 - quickest.duration_s / constant_s),
            ..ProfileAnswer::default()
        },
        Err(reason @ Infeasible::TooMuchWork(_)) => {
            ProfileAnswer { undecided: Some(reason.to_string()), ..ProfileAnswer::default() }
        }
        Err(reason) => ProfileAnswer { infeasible: Some(reason.to_string()), ..ProfileAnswer::default() },
    }
}

fn text(args: &ProfileArgs, limits: &RunLimits, answer: &ProfileAnswer) -> String {
    let durations = answer.duration_s.zip(answer.optimum_s).zip(answer.least_s).zip(answer.constant_s);
    let Some((((duration_s, optimum_s), least_s), constant_s)) = durations else {
        let undecided = answer.undecided.as_ref().map(|reason| format!("{reason}{}", interrupt::allows_more()));
        let infeasible = answer.infeasible.as_ref().map(|reason| format!("infeasible on all of the run: {reason}"));
        return undecided.or(infeasible).unwrap_or_default();
    };
    let RunLimits { handle_mps, head_mps, accel_mps2 } = limits;
    let above = 100.0 * (duration_s / optimum_s - 1.0);
    let wanted = if duration_s <= optimum_s * (1.0 + args.within) {
        ""
    } else {
        ", over --within: the search found none nearer"
    };
    let mut lines = vec![
        format!(
            "{duration_s:.6} s from rest to rest: no handle is faster than {handle_mps} m/s, the head at most {head_mps} m/s, \
             its acceleration at most {accel_mps2} m/s²"
        ),
        format!(
            "the quickest show takes {optimum_s:.3} s, and none under {least_s:.3} s: the cues take {} % more{wanted}",
            Fixed::<2>(above)
        ),
        format!(
            "at the best constant speed, {:.6} m/s, it takes {constant_s:.3} s: the cues {} {} s, {} %",
            answer.constant_speed_mps.unwrap_or_default(),
            if duration_s <= constant_s { "save" } else { "cost" },
            Fixed::<3>((constant_s - duration_s).abs()),
            Fixed::<1>(100.0 * answer.gain.unwrap_or_default().abs())
        ),
        format!("{}, at show time in s, to m/s:", Counted(answer.cues.len() as u64, "cue")),
    ];
    lines.extend(answer.cues.iter().map(|&CueRow { at_s, speed_mps, waits }| {
        format!("{:>14} {speed_mps}{}", Fixed::<6>(at_s), if waits { ", after GO" } else { "" })
    }));
    lines.join("\n")
}

/// The configuration that walks the cues. The first one is the planned speed of the head. The configured cues stay at their travels;
/// those that change the speed become marks.
fn saved(config: &Config, run: &PlannedRun, limits: &RunLimits, quickest: &QuickestRun) -> anyhow::Result<String> {
    let ends_m = [run.dragon.start_travel_m(), run.dragon.end_travel_m()];
    // The speeds of an earlier answer are replaced.
    let is_earlier = |cue: &Cue| {
        let number = cue.name.strip_prefix(SAVED_NAME).and_then(|number| number.parse::<u32>().ok());
        number.is_some() && cue.note.is_none() && !cue.waits
    };
    let kept = run.cues.iter().filter(|(_, cue)| !is_earlier(cue));
    let mut cues: Vec<Cue> = kept
        .map(|(travel_m, cue)| Cue { at_s: quickest.time_s(*travel_m), dragon: None, speed_mps: None, ..cue.clone() })
        .collect();
    let names: BTreeSet<String> = cues.iter().map(|cue| cue.name.clone()).collect();
    let mut free = (1..).map(|number| format!("{SAVED_NAME}{number}")).filter(|name| !names.contains(name));
    let mut waits = run.waits();
    for &SpeedCue { at_s, speed_mps, leaves_rest } in &quickest.cues[1..] {
        let waiting = if leaves_rest { waits.next() } else { None };
        if let Some(cue) = waiting.and_then(|(_, wait)| cues.iter_mut().find(|cue| cue.name == wait.name)) {
            (cue.at_s, cue.speed_mps) = (at_s, Some(speed_mps));
        } else {
            let name = free.next().expect("there is always another number");
            cues.push(Cue { name, at_s, dragon: None, speed_mps: Some(speed_mps), waits: false, note: None });
        }
    }
    cues.sort_by(|one, next| one.at_s.total_cmp(&next.at_s));
    Ok(config.with_run(quickest.cues[0].speed_mps, limits.accel_mps2, ends_m, &cues)?.to_toml())
}

/// Names of saved speeds, before their number.
const SAVED_NAME: &str = "profile ";

/// Travel from a rest to an end of the run, in metres, below which the rest is that end.
const LEAST_PIECE_M: f64 = 1e-6;

/// Metres of travel, before and behind the slowest place, that are drawn enlarged.
const DETAIL_M: f64 = 12.0;

/// The head's speed over its travel: the largest allowed, in the quickest show, and with the cues.
fn speeds(
    args: &ProfileArgs,
    config: &Config,
    dragon: &Dragon,
    limits: &RunLimits,
    Profile { quickest, constant_mps, constant_s }: &Profile,
) -> SpeedProfile {
    let [start_m, end_m] = [dragon.start_travel_m(), dragon.end_travel_m()];
    let travels_m = even_travels(dragon, start_m, end_m);
    let slowest = |one: &f64, other: &f64| quickest.cap_mps(*one).total_cmp(&quickest.cap_mps(*other));
    let slowest_m = travels_m.iter().copied().min_by(slowest).unwrap_or(start_m);
    let detail_m = [slowest_m - DETAIL_M, slowest_m + DETAIL_M].map(|travel_m| travel_m.clamp(start_m, end_m));
    let line = |name: String, speed_mps: &dyn Fn(f64) -> f64| {
        let points = |travels_m: &[f64]| travels_m.iter().map(|&at_m| DVec2::new(at_m, speed_mps(at_m))).collect();
        let detail = points(&even_travels(dragon, detail_m[0], detail_m[1]));
        SpeedLine { name, points: points(&travels_m), detail }
    };
    let RunLimits { handle_mps, head_mps, accel_mps2 } = limits;
    let lines = vec![
        line(format!("limit of the head, for handles at {handle_mps} m/s"), &|travel_m| {
            quickest.cap_mps(travel_m).min(*head_mps)
        }),
        line(format!("quickest, {:.1} s", quickest.optimum_s), &|travel_m| quickest.optimum_mps(travel_m)),
        line(format!("{}, {:.1} s", Counted(quickest.cues.len() as u64, "cue"), quickest.duration_s), &|travel_m| {
            quickest.walk_mps(travel_m)
        }),
    ];
    let title = format!(
        "The quickest show with {accel_mps2} m/s²; at {constant_mps:.6} m/s throughout it takes {constant_s:.1} s"
    );
    let caption = args.answer.figure.caption_of(config.document(), title);
    SpeedProfile { caption, lines, detail_m: detail_m[0]..=detail_m[1] }
}
