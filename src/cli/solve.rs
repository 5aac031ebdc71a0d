//! The planner's arguments.

use std::ops::RangeInclusive;
use std::path::PathBuf;

use bench_dragon_geometry::dragon::Meter;
use bench_dragon_geometry::planner::Parameter;
use clap::{ArgGroup, Args, Subcommand, ValueEnum, ValueHint};

use super::flags::{ConfigArgs, FormatArgs, finite, nanoseconds, step, within};
use crate::config::NEAR_M;
use crate::output::figure::{FigureFormat, Paper, missing_letter};

#[derive(Clone, Debug, Args)]
pub(crate) struct SolveArgs {
    /// The question.
    #[command(subcommand)]
    pub(crate) question: Question,
}

/// Questions to the planner.
#[derive(Clone, Debug, Subcommand)]
pub(crate) enum Question {
    /// Where is every handle, and how fast?
    #[command(after_help = "Examples:
  bench-dragon solve poses --at 0,60,300 --format json
  bench-dragon solve poses --from 0 --to 300 --xlsx poses.xlsx")]
    Poses(PosesArgs),
    /// When do two benches first touch, and where?
    #[command(after_help = "Examples:
  bench-dragon solve contact --config stage.toml --format json
  bench-dragon solve contact --clearance 0.05
  bench-dragon solve contact --figure contact.svg
  bench-dragon solve contact --figure poster.png --title \"Dragon of the North Gate\" --paper a2
  bench-dragon solve contact --profile --step 0.5 --figure clearance.svg")]
    Contact(ContactArgs),
    /// How tight may the spiral be if the head is to come to a circle with no contact on the way?
    #[command(after_help = "Examples:
  bench-dragon solve pitch --turn-diameter 9 --figure pitch.svg
  bench-dragon solve pitch --turn-diameter 9 --clearance 0.05
  bench-dragon solve pitch --turn-diameter 9 --config stage.toml --save-config tightest.toml")]
    Pitch(PitchArgs),
    /// Does the dragon get through a turn, and how near do its benches come to each other?
    #[command(after_help = "Examples:
  bench-dragon solve turn
  bench-dragon solve turn --pitch 1.5 --radius-ratio 1.2
  bench-dragon solve turn --config spiral.toml --pitch 1.7 --turn-diameter 9
  bench-dragon solve turn --shortest --clearance 0.05 --max-ratio 2 --save-config short.toml")]
    Turn(TurnArgs),
    /// How fast may the head walk if no handle is ever to be faster than a limit?
    ///
    /// On a turnaround the whole passage of all benches counts. On a spiral (--config with kind = "spiral", and none of
    /// --pitch, --turn-diameter and --radius-ratio) all of its run counts, to where the head comes to the centre.
    #[command(after_help = "Examples:
  bench-dragon solve speed-limit --limit 2
  bench-dragon solve speed-limit --limit 2 --config stage.toml --save-config fast.toml")]
    SpeedLimit(SpeedLimitArgs),
    /// How do first contact, least clearance, largest speed and smallest pitch change with each measure?
    #[command(after_help = "Examples:
  bench-dragon solve sensitivity
  bench-dragon solve sensitivity --range 10 --parameter pitch,width --xlsx sensitivity.xlsx --figure sensitivity.svg")]
    Sensitivity(SensitivityArgs),
}

#[derive(Clone, Debug, Args)]
pub(crate) struct PitchArgs {
    /// Diameter in metres of the circle that the head is to come to [default: the configured turnaround's, else 9].
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, value_parser = finite)]
    pub(crate) turn_diameter: Option<f64>,
    /// Metres that are to remain between any two boards [default: 0, they may all but touch].
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, value_parser = within(CLEARANCE_M))]
    pub(crate) clearance: Option<f64>,
    #[command(flatten)]
    pub(crate) config: ConfigArgs,
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

/// What becomes of an answer that may be a configuration, and how much work it may take.
#[derive(Clone, Debug, Args)]
pub(crate) struct AnswerArgs {
    /// Write the answer as a whole configuration, which `show --config` plays; a file of that name is replaced.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) save_config: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) figure: FigureArgs,
    #[command(flatten)]
    pub(crate) work: WorkArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

/// How much work an answer may take.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct WorkArgs {
    /// Most work for the answer, in millions of steps of some 50 ns; where it is not enough, the answer says how far it
    /// came [default: 100, for sensitivity and --shortest 300].
    #[arg(long, value_name = "MILLIONS", allow_negative_numbers = true, value_parser = within(1..=1_000_000_000_u64))]
    pub(crate) work: Option<u64>,
}

impl WorkArgs {
    /// A meter for a part of an answer.
    pub(crate) fn meter(self) -> Meter {
        Meter::of(self.work.unwrap_or(DEFAULT_WORK) * STEPS)
    }

    /// A meter for an answer that is put together of many.
    pub(crate) fn long_meter(self) -> Meter {
        Meter::of(self.work.unwrap_or(DEFAULT_LONG_WORK) * STEPS)
    }
}

/// Work that is allowed where nothing else was asked for, in millions of steps: a few seconds on one core.
const DEFAULT_WORK: u64 = 100;
/// The same for what is asked of many dragons.
const DEFAULT_LONG_WORK: u64 = 300;
/// Steps to the million.
const STEPS: u64 = 1_000_000;

/// Clearances that may be asked for, in metres.
const CLEARANCE_M: RangeInclusive<f64> = 0.0..=10.0;
/// Limits that may be set to a handle's speed, in speeds of the head: none is slower than the head, and a handle that is
/// faster than the greatest jumps.
const SPEED_RATIO: RangeInclusive<f64> = 1.0..=1000.0;

#[derive(Clone, Debug, Args)]
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

#[derive(Clone, Debug, Args)]
pub(crate) struct SpeedLimitArgs {
    /// Speed in m/s that no handle may exceed.
    #[arg(long, value_name = "MPS", allow_negative_numbers = true, value_parser = within(0.001..=1000.0))]
    pub(crate) limit: f64,
    #[command(flatten)]
    pub(crate) plan: TurnPlanArgs,
    #[command(flatten)]
    pub(crate) answer: AnswerArgs,
}

#[derive(Clone, Debug, Args)]
pub(crate) struct SensitivityArgs {
    /// By how much each value is varied to either side, in percent.
    #[arg(long, value_name = "PERCENT", default_value = "5", allow_negative_numbers = true, value_parser = range_percent)]
    pub(crate) range: f64,
    /// Values to either side of the planned one.
    #[arg(long, value_name = "COUNT", default_value_t = 2, allow_negative_numbers = true, value_parser = within(1..=100_u32))]
    pub(crate) steps: u32,
    /// What to vary, with commas in between: pitch, head-length, body-length, width, hole-offset, speed [default: all].
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = parameter)]
    pub(crate) parameter: Vec<Parameter>,
    /// Diameter in metres of the circle that a spiral is walked to [default: the configured turning circle, else 9].
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, value_parser = diameter)]
    pub(crate) turn_diameter: Option<f64>,
    /// Write a workbook with a sheet of what is printed and one of all values; a file of that name is replaced.
    #[arg(long, value_name = "FILE.xlsx", value_hint = ValueHint::FilePath, value_parser = xlsx)]
    pub(crate) xlsx: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) figure: FigureArgs,
    #[command(flatten)]
    pub(crate) config: ConfigArgs,
    #[command(flatten)]
    pub(crate) work: WorkArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

#[derive(Clone, Debug, Args)]
pub(crate) struct PosesArgs {
    #[command(flatten)]
    pub(crate) times: TimesArgs,
    /// Write a workbook with a sheet of positions and one of speeds; a file of that name is replaced.
    #[arg(long, value_name = "FILE.xlsx", value_hint = ValueHint::FilePath, value_parser = xlsx)]
    pub(crate) xlsx: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) figure: FigureArgs,
    #[command(flatten)]
    pub(crate) config: ConfigArgs,
    /// How to print.
    #[arg(long, value_enum, value_name = "FORMAT", default_value_t)]
    pub(crate) format: TableFormat,
}

#[derive(Clone, Debug, Args)]
pub(crate) struct ContactArgs {
    /// Also tell the clearance over time and its near misses, up to the contact or the run's end; with --figure, draw
    /// them instead of the boards at the contact.
    #[arg(long)]
    pub(crate) profile: bool,
    /// When some pair first comes within this clearance, in metres, instead of touching.
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, value_parser = within(CLEARANCE_M))]
    pub(crate) clearance: Option<f64>,
    /// Seconds from one time of the profile to the next.
    #[arg(long, value_name = "SECONDS", requires = "profile", default_value = "1", allow_negative_numbers = true, value_parser = |text: &str| step(text, 1, "above 0 and at most"))]
    pub(crate) step: i64,
    /// Clearance in metres under which a local minimum is a near miss [default: the configured one].
    #[arg(long, value_name = "METRES", requires = "profile", allow_negative_numbers = true, value_parser = within(NEAR_M))]
    pub(crate) near: Option<f64>,
    #[command(flatten)]
    pub(crate) config: ConfigArgs,
    #[command(flatten)]
    pub(crate) figure: FigureArgs,
    #[command(flatten)]
    pub(crate) work: WorkArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

/// Where to draw.
#[derive(Clone, Debug, Args)]
pub(crate) struct FigureArgs {
    /// Draw a figure into this file, .svg or .png; a file of that name is replaced.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath, value_parser = figure)]
    pub(crate) figure: Option<FigureFile>,
    /// Words in large letters over the figure, such as the name of the show.
    #[arg(long, value_name = "TEXT", requires = "figure", value_parser = title)]
    pub(crate) title: Option<String>,
    /// Fill a sheet of this size, upright or across, whichever shows more: a0 to a4, letter, tabloid [default: 160 mm
    /// wide, to go into a document].
    #[arg(long, value_name = "SIZE", requires = "figure")]
    pub(crate) paper: Option<Paper>,
}

/// A file to draw into.
#[derive(Clone, Debug)]
pub(crate) struct FigureFile {
    pub(crate) path: PathBuf,
    pub(crate) format: FigureFormat,
}

/// Which times: a list, or even steps.
#[derive(Clone, Debug, Args)]
#[command(group(ArgGroup::new("times").required(true).args(["at", "from"])))]
pub(crate) struct TimesArgs {
    /// Show times in seconds, with commas between them.
    #[arg(long, value_name = "SECONDS", value_delimiter = ',', allow_hyphen_values = true, value_parser = finite)]
    pub(crate) at: Vec<f64>,
    /// First show time in seconds, with at most nine decimals.
    #[arg(long, value_name = "SECONDS", requires = "to", allow_negative_numbers = true, value_parser = nanoseconds)]
    pub(crate) from: Option<i64>,
    /// Last show time in seconds.
    #[arg(long, value_name = "SECONDS", requires = "from", conflicts_with = "at", allow_negative_numbers = true, value_parser = nanoseconds)]
    pub(crate) to: Option<i64>,
    /// Seconds from one time to the next.
    #[arg(long, value_name = "SECONDS", requires = "from", conflicts_with = "at", default_value = "1", allow_negative_numbers = true, value_parser = |text: &str| step(text, 1, "above 0 and at most"))]
    pub(crate) step: i64,
}

/// How to print what has rows and columns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum TableFormat {
    /// For people.
    #[default]
    Text,
    /// For machines; stable.
    Json,
    /// Comma-separated values; stable.
    Csv,
}

fn range_percent(text: &str) -> Result<f64, String> {
    let value: Option<f64> = text.parse().ok().filter(|value| *value > 0.0 && *value < 100.0);
    value.ok_or_else(|| "must be above 0 and under 100".to_owned())
}

fn diameter(text: &str) -> Result<f64, String> {
    let value: Option<f64> = text.parse().ok().filter(|value: &f64| *value > 0.0 && value.is_finite());
    value.ok_or_else(|| "must be above 0 and finite".to_owned())
}

fn parameter(text: &str) -> Result<Parameter, String> {
    let name = |parameter: &Parameter| parameter.to_string().replace(' ', "-");
    let found = Parameter::ALL.into_iter().find(|parameter| name(parameter) == text);
    found.ok_or_else(|| format!("must be one of {}", Parameter::ALL.each_ref().map(name).join(", ")))
}

fn xlsx(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let is_xlsx = path.extension().is_some_and(|suffix| suffix.eq_ignore_ascii_case("xlsx"));
    if is_xlsx { Ok(path) } else { Err("must end in .xlsx".to_owned()) }
}

fn figure(text: &str) -> Result<FigureFile, String> {
    let path = PathBuf::from(text);
    let format = FigureFormat::of(&path).ok_or("must end in .svg or .png")?;
    Ok(FigureFile { path, format })
}

/// Most letters of a title: more would be too small to read.
const MOST_LETTERS: usize = 80;

fn title(text: &str) -> Result<String, String> {
    if text.trim().is_empty() || text.chars().count() > MOST_LETTERS {
        return Err(format!("must have 1 to {MOST_LETTERS} letters"));
    }
    match missing_letter(text) {
        Some(letter) => Err(format!("{letter:?} cannot be drawn: use letters, digits and signs of ASCII")),
        None => Ok(text.trim().to_owned()),
    }
}
