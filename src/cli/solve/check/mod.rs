//! `solve check`: compares a table of poses, such as one of the contest, with the exact poses, and names known mistakes.

mod difference;
mod given;
mod mistake;
mod sheet;

use std::path::PathBuf;

use bench_dragon_geometry::number::Fixed;
use clap::{Args, ValueHint};
use glam::DVec2;
use serde::Serialize;

use self::difference::AllDifferences;
use self::given::{GivenPose, GivenPoses};
use self::mistake::{CONTACT_TOLERANCE_S, Mistake};
use super::{WorkArgs, formation, load_any_plan};
use crate::cli::flags::{BadInput, ConfigArgs, FormatArgs};
use crate::cli::print::print_report;
use crate::cli::{in_file, reading};
use crate::config::{Config, PlanDocument};
use crate::output::Counted;
use crate::output::in_plan::handles;
use crate::output::poses::travel_m;
use crate::output::terminal_text::Printable;

/// Compare a table of poses with the exact poses: how many numbers are right, how far the worst is off, and which known mistakes
/// they show.
#[derive(Clone, Debug, Args)]
#[command(mut_arg("config", |arg| {
    arg.help("Configuration file, in TOML [default: the paper's dragon; its turnaround for a table with negative times]")
}))]
#[command(after_help = "Examples:
  bench-dragon solve check result1.xlsx
  bench-dragon solve check result2.xlsx --format json
  bench-dragon solve check result4.xlsx              the paper's turnaround, because of its negative times
  bench-dragon solve check poses.csv --config stage.toml

A table is a workbook as the contest of 2024 (CUMCM, problem A) asks for in result1.xlsx, result2.xlsx and result4.xlsx, or a file of \
`solve poses --format csv` or `--xlsx`. It may have some of the handles and times. A wrong table is an answer: the exit status is 0.")]
pub(crate) struct CheckArgs {
    /// The table, .xlsx or .csv.
    #[arg(value_name = "TABLE", value_hint = ValueHint::FilePath)]
    pub(crate) table: PathBuf,
    #[command(flatten)]
    pub(crate) config: ConfigArgs,
    #[command(flatten)]
    pub(crate) work: WorkArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

#[derive(Serialize)]
struct CheckAnswer {
    /// Whether every number is right to six decimals, and the first contact if the table has one.
    right: bool,
    handles: usize,
    times: usize,
    #[serde(flatten)]
    differences: AllDifferences,
    /// The first contact, for a table of one time.
    contact: Option<ContactCheck>,
    mistakes: Vec<NamedMistake>,
}

/// The time of a table of one time, beside the first contact.
#[derive(Serialize)]
struct ContactCheck {
    /// Time at which the head is where the table has it; null if it is far from the route.
    time_s: Option<f64>,
    /// Distance of the head from the route.
    off_route_m: f64,
    /// The first contact; null if there is none, or if it takes too much work to find it.
    exact_s: Option<f64>,
    /// The differences from the exact poses at the first contact. Those of the whole answer are at the table's own time, if it has one.
    at_contact: Option<AllDifferences>,
}

#[derive(Serialize)]
struct NamedMistake {
    mistake: Mistake,
    words: &'static str,
}

/// Greatest difference in seconds of the time of a head whose place is rounded to six decimals.
const ROUNDED_S: f64 = 2e-6;
/// A head that is this far from the route does not determine the time of its table, in metres.
const MOST_OFF_M: f64 = 0.01;

pub(super) fn run(args: &CheckArgs) -> anyhow::Result<()> {
    let configured = one_dragon(args)?;
    let handles = configured.lead().dimensions().handles();
    let given = reading::within_limits(Some(&args.table), || GivenPoses::read(&args.table, handles));
    let given = given.map_err(|error| BadInput(format!("{} {error:#}", Printable(&args.table))))?;
    let config =
        if args.config.config.is_none() && given.0.iter().any(|pose| pose.time_s.is_some_and(|time_s| time_s < 0.0)) {
            Config::from_toml("[route]\nkind = \"turnaround\"\n")?
        } else {
            configured
        };
    let answer = CheckAnswer::of(&given.0, &config, args)?;
    let text = answer.text(args, &config);
    print_report(args.format.format, &answer, text)
}

fn one_dragon(args: &CheckArgs) -> anyhow::Result<Config> {
    match load_any_plan(&args.config, args.work)? {
        PlanDocument::OneDragon(document) => in_file(&args.config, document.build()),
        PlanDocument::Formation(document) => {
            formation::refuse("solve check", true, &document)?;
            Err(BadInput("solve check is for one dragon".to_owned()).into())
        }
    }
}

impl CheckAnswer {
    fn of(given: &[GivenPose], config: &Config, args: &CheckArgs) -> anyhow::Result<Self> {
        let own = Own::of(given, config);
        let contact = own.map(|own| ContactCheck::of(&own, &given[0], config, args.work));
        let own_s = contact.as_ref().map(|contact| contact.time_s.or(contact.exact_s).unwrap_or(config.start_s()));
        // A table near the contact has the poses of the time that it states, or those of the contact.
        let is_right = |time_s: f64, pose: &GivenPose| AllDifferences::of(&[(time_s, pose)], config).are_right();
        let time_s = |pose: &GivenPose| match pose.time_s {
            Some(stated_s) if own_s.is_none() || is_right(stated_s, pose) => Some(stated_s),
            _ => own_s,
        };
        let known = given.iter().map(|pose| Some((time_s(pose)?, pose))).collect::<Option<Vec<_>>>();
        let no_time = || BadInput(format!("{} has no place of the head, which tells its time", Printable(&args.table)));
        let poses = known.ok_or_else(no_time)?;
        let run_s = config.start_s()..=config.end_s();
        if let Some((time_s, _)) = poses.iter().find(|(time_s, _)| !run_s.contains(time_s)) {
            let (table, start_s, end_s) = (Printable(&args.table), run_s.start(), run_s.end());
            return Err(BadInput(format!(
                "{table} has {time_s} s, must be from {start_s} to {end_s}, where the run ends"
            ))
            .into());
        }
        let differences = AllDifferences::of(&poses, config);
        let mut mistakes = mistake::of_positions(&poses, config);
        if mistake::has_differences(&poses, config) {
            mistakes.push(Mistake::SpeedsFromDifferences);
        }
        let is_at_contact = contact.as_ref().is_none_or(ContactCheck::is_right);
        if let Some(ContactCheck { time_s: Some(time_s), exact_s: Some(_), .. }) = contact
            && !is_at_contact
        {
            mistakes.extend(mistake::of_contact(time_s, config, args.work));
        }
        Ok(Self {
            right: differences.are_right() && is_at_contact,
            handles: config.lead().dimensions().handles(),
            times: poses.len(),
            differences,
            contact,
            mistakes: mistakes.into_iter().map(|mistake| NamedMistake { mistake, words: mistake.words() }).collect(),
        })
    }

    fn text(&self, args: &CheckArgs, config: &Config) -> String {
        let Self { right, handles, times, differences, contact, mistakes } = self;
        let (handles, times) = (Counted(*handles as u64, "handle"), Counted(*times as u64, "time"));
        let beside = match &args.config.config {
            Some(file) => Printable(file).to_string(),
            None if config.route().as_turnaround().is_some() => "the paper's turnaround".to_owned(),
            None => "the paper's dragon".to_owned(),
        };
        let table = Printable(&args.table);
        let mut lines = vec![format!("{table} beside {beside}: {handles}, {times}"), differences.text()];
        lines.extend(contact.iter().map(ContactCheck::text));
        lines.extend(mistakes.iter().map(|NamedMistake { words, .. }| format!("mistake     {words}")));
        lines.push(match (right, mistakes.is_empty()) {
            (true, _) => "verdict     right".to_owned(),
            (false, true) => "verdict     wrong, by no known mistake".to_owned(),
            (false, false) => format!("verdict     wrong, by {}", Counted(mistakes.len() as u64, "known mistake")),
        });
        lines.join("\n")
    }
}

/// The time of a table that does not have it, from the place of its head.
#[derive(Clone, Copy)]
struct Own {
    time_s: f64,
    off_route_m: f64,
}

impl Own {
    /// `None` for a table with times, unless it has one that is not a whole second, as an event has.
    fn of(given: &[GivenPose], config: &Config) -> Option<Self> {
        let [GivenPose { time_s, handles }] = given else { return None };
        if let Some(time_s) = *time_s {
            return (time_s.fract() != 0.0).then_some(Self { time_s, off_route_m: 0.0 });
        }
        let [x, y, _] = handles[0];
        let head = DVec2::new(x?, y?);
        let found = Self::at(head, config);
        // A table that is walked the other way round has a time too.
        let mirrored = || Self::at(DVec2::new(head.x, -head.y), config).nearer(found);
        let found = if found.off_route_m > MOST_OFF_M { mirrored() } else { found };
        Some(found.refined(handles, config))
    }

    /// The time at which all handles together are nearest, by the method of least squares, unless it differs by more than rounding.
    fn refined(self, given: &[[Option<f64>; 3]], config: &Config) -> Self {
        let exact = handles(config.lead(), travel_m(self.time_s, config));
        let head_mps = config.timetable().speed_mps(self.time_s);
        let (mut along, mut squares) = (0.0, 0.0);
        for (given, exact) in given.iter().zip(&exact) {
            if let [Some(x), Some(y), _] = *given {
                let velocity = exact.tangent * (exact.speed_ratio * head_mps);
                along += (DVec2::new(x, y) - exact.position).dot(velocity);
                squares += velocity.length_squared();
            }
        }
        let later_s = along / squares;
        if later_s.abs() <= ROUNDED_S { Self { time_s: self.time_s + later_s, ..self } } else { self }
    }

    fn nearer(self, other: Self) -> Self {
        if self.off_route_m <= MOST_OFF_M { self } else { other }
    }

    /// The time at which the head is nearest to a place: the nearest of many, and then by thirds.
    fn at(place: DVec2, config: &Config) -> Self {
        /// Distance of two travels in metres. The route is nearly straight between them.
        const STEP_M: f64 = 0.05;
        const MOST_STEPS: f64 = 1e6;
        let dragon = config.lead();
        let (start_m, end_m) = (dragon.start_travel_m(), dragon.end_travel_m());
        let off_m = |travel_m: f64| mistake::at(dragon.route(), travel_m).distance(place);
        let steps = ((end_m - start_m) / STEP_M).ceil().clamp(1.0, MOST_STEPS);
        let step_m = (end_m - start_m) / steps;
        let nearest = (0..=steps as u64).map(|step| start_m + step as f64 * step_m);
        let nearest_m = nearest.min_by(|one, other| off_m(*one).total_cmp(&off_m(*other))).unwrap_or(start_m);
        let mut ends = [(nearest_m - step_m).max(start_m), (nearest_m + step_m).min(end_m)];
        for _ in 0..100 {
            let thirds = [1.0, 2.0].map(|third| ends[0] + third / 3.0 * (ends[1] - ends[0]));
            if off_m(thirds[0]) <= off_m(thirds[1]) { ends[1] = thirds[1] } else { ends[0] = thirds[0] }
        }
        let travel_m = ends[0].midpoint(ends[1]);
        let time_s = config.timetable().time_s(travel_m).clamp(config.start_s(), config.end_s());
        Self { time_s, off_route_m: off_m(travel_m) }
    }
}

impl ContactCheck {
    fn of(own: &Own, given: &GivenPose, config: &Config, work: WorkArgs) -> Self {
        let exact_s = mistake::contact_s(config, work, 0.0);
        let rounded_s = exact_s.filter(|exact_s| (own.time_s - exact_s).abs() <= ROUNDED_S);
        let at_contact = exact_s.map(|exact_s| AllDifferences::of(&[(exact_s, given)], config));
        let time_s = (own.off_route_m <= MOST_OFF_M).then_some(rounded_s.unwrap_or(own.time_s));
        Self { time_s, off_route_m: own.off_route_m, exact_s, at_contact }
    }

    fn is_right(&self) -> bool {
        let is_near = |exact_s: f64| self.time_s.is_some_and(|time_s| (time_s - exact_s).abs() <= CONTACT_TOLERANCE_S);
        self.exact_s.is_none_or(is_near)
    }

    fn text(&self) -> String {
        let Self { time_s, off_route_m, exact_s, .. } = self;
        let Some(time_s) = time_s else {
            return format!("time        unknown: the head is {} m from the route", Fixed::<6>(*off_route_m));
        };
        let own = format!("time        {} s by the head", Fixed::<6>(*time_s));
        match exact_s {
            Some(exact_s) => format!(
                "{own}; the first contact is at {} s, {} s from it",
                Fixed::<6>(*exact_s),
                Fixed::<6>((time_s - exact_s).abs())
            ),
            None => format!("{own}; no first contact is known"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_head_tells_the_time_of_a_table() {
        let config = Config::from_toml("").expect("the paper's dragon");
        for time_s in [0.0, 1.25, 300.0, 412.849_997, 430.0] {
            let place = mistake::at(config.lead().route(), time_s);
            let own = Own::at(place, &config);
            assert!((own.time_s - time_s).abs() < 1e-7 && own.off_route_m < 1e-7, "{} is not {time_s}", own.time_s);
        }
    }
}
