//! `solve poses`: prints the position and the speed of every handle at given times.

use std::ops::RangeInclusive;
use std::path::PathBuf;

use bench_dragon_geometry::number::Number;
use clap::{ArgGroup, Args, ValueEnum, ValueHint};

use super::figure::{FigureArgs, on_turn, plan_of};
use super::{WorkArgs, contest, formation, interrupt, load_any_plan, xlsx};
use crate::cli::flags::{BadInput, ConfigArgs, finite, nanoseconds, step};
use crate::cli::in_file;
use crate::cli::print::{print_bytes, print_json, print_line};
use crate::config::{Config, PlanDocument};
use crate::output::Counted;
use crate::output::figure::PlanView;
use crate::output::poses::{MAX_POSITIONS, Poses, travel_m};
use crate::output::table;
use crate::output::terminal_text::Printable;

/// Print the position and the speed of every handle at given show times.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon solve poses --at 0,60,300 --format json
  bench-dragon solve poses --from 0 --to 300 --xlsx poses.xlsx
  bench-dragon solve poses --from 0 --to 300 --contest result1.xlsx
  bench-dragon solve poses --config turnaround.toml --from -100 --to 100 --contest result4.xlsx")]
pub(crate) struct PosesArgs {
    #[command(flatten)]
    pub(crate) times: TimesArgs,
    /// Write a workbook with a sheet of positions and a sheet of speeds; an existing file is replaced.
    #[arg(long, value_name = "FILE.xlsx", value_hint = ValueHint::FilePath, value_parser = xlsx)]
    pub(crate) xlsx: Option<PathBuf>,
    /// Write a workbook as the contest of 2024 (CUMCM, problem A) asks for in result1.xlsx and result4.xlsx; an existing file is
    /// replaced.
    #[arg(long, value_name = "FILE.xlsx", value_hint = ValueHint::FilePath, value_parser = xlsx)]
    pub(crate) contest: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) figure: FigureArgs,
    #[command(flatten)]
    pub(crate) config: ConfigArgs,
    #[command(flatten)]
    pub(crate) work: WorkArgs,
    /// Format of the output.
    #[arg(long, value_enum, value_name = "FORMAT", default_value_t)]
    pub(crate) format: TableFormat,
}

impl PosesArgs {
    /// Whether the answer goes into a workbook.
    fn has_workbook(&self) -> bool {
        self.xlsx.is_some() || self.contest.is_some()
    }
}

/// The flags for the times: a list, or even steps.
#[derive(Clone, Debug, Args)]
#[command(group(ArgGroup::new("times").required(true).args(["at", "from"])))]
pub(crate) struct TimesArgs {
    /// Show times in seconds, separated by commas.
    #[arg(long, value_name = "SECONDS", value_delimiter = ',', allow_hyphen_values = true, value_parser = finite)]
    pub(crate) at: Vec<f64>,
    /// First show time in seconds, with at most nine decimals.
    #[arg(long, value_name = "SECONDS", requires = "to", allow_negative_numbers = true, value_parser = nanoseconds)]
    pub(crate) from: Option<i64>,
    /// Last show time in seconds, with at most nine decimals.
    #[arg(long, value_name = "SECONDS", requires = "from", conflicts_with = "at", allow_negative_numbers = true, value_parser = nanoseconds)]
    pub(crate) to: Option<i64>,
    /// Seconds between two times, above 0, with at most nine decimals.
    #[arg(long, value_name = "SECONDS", requires = "from", conflicts_with = "at", default_value = "1", allow_negative_numbers = true, value_parser = |text: &str| step(text, 1, "above 0 and at most"))]
    pub(crate) step: i64,
}

/// Format of an output with rows and columns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum TableFormat {
    /// Text for people.
    #[default]
    Text,
    /// JSON for programs, with stable keys.
    Json,
    /// Comma-separated values, with stable columns.
    Csv,
}

pub(super) fn run(args: &PosesArgs) -> anyhow::Result<()> {
    match load_any_plan(&args.config, args.work)? {
        PlanDocument::OneDragon(document) => of_one_dragon(args, &in_file(&args.config, document.build())?),
        PlanDocument::Formation(document) => print(&formation::poses(args, &document)?, args.format),
    }
}

fn of_one_dragon(args: &PosesArgs, config: &Config) -> anyhow::Result<()> {
    args.figure.keep_drawing(config.document())?;
    let mut most = MAX_POSITIONS / config.lead().dimensions().handles();
    if args.has_workbook() {
        // The first column has the row's name.
        most = most.min(table::MAX_COLUMNS - 1);
    }
    let times_s = times_s(&args.times, &(config.start_s()..=config.end_s()), most)?;
    let figure_s = args.figure.figure.as_ref().map(|_| one_time(&times_s)).transpose()?;
    let answer = Poses::of(&times_s, config);
    if args.format != TableFormat::Text || !args.has_workbook() {
        print(&answer, args.format)?;
    }
    if let Some(path) = &args.xlsx {
        interrupt::write(path, &table::workbook(&answer.sheets())?)?;
    }
    if let Some(path) = &args.contest {
        interrupt::write(path, &table::workbook(&contest::sheets_by_time(&answer))?)?;
    }
    if let Some(time_s) = figure_s {
        args.figure.save(plan_view(&args.figure, config, time_s)?.draw())?;
    }
    if args.format == TableFormat::Text { print_files(&answer, args) } else { Ok(()) }
}

/// The dragon on its route, which may be a turnaround.
fn plan_view(args: &FigureArgs, config: &Config, time_s: f64) -> anyhow::Result<PlanView> {
    let caption = args.caption(config, format!("The dragon at {time_s} s"));
    let plan = plan_of(config, config.lead(), caption, travel_m(time_s, config));
    let turnaround = config.route().planned_turnaround(config.tables().head.speed_mps)?;
    Ok(match turnaround {
        Some(turnaround) => on_turn(plan, &turnaround),
        None => plan,
    })
}

/// The time of a figure, which shows exactly one.
pub(super) fn one_time(times_s: &[f64]) -> Result<f64, BadInput> {
    match times_s {
        [time_s] => Ok(*time_s),
        _ => Err(BadInput(format!("--figure shows one time, not {}: give one with --at", times_s.len()))),
    }
}

/// Prints poses in a format.
fn print(poses: &Poses, format: TableFormat) -> anyhow::Result<()> {
    match format {
        TableFormat::Json => print_json(poses),
        TableFormat::Csv => print_bytes(table::csv(&[poses.by_time()])),
        TableFormat::Text => print_bytes(table::text(&poses.tables())),
    }
}

/// Prints the names of the written files. With a workbook, nothing else is printed.
fn print_files(poses: &Poses, args: &PosesArgs) -> anyhow::Result<()> {
    for path in args.xlsx.iter().chain(&args.contest) {
        let handles = poses.poses.first().map_or(0, |pose| pose.handles.len());
        let times = poses.poses.len();
        let (handles, times) = (Counted(handles as u64, "handle"), Counted(times as u64, "time"));
        let path = Printable(path);
        print_line(format_args!("positions and speeds of {handles} at {times} written to {path}"))?;
    }
    if let Some(file) = &args.figure.figure {
        print_line(format_args!("the dragon at {} s drawn to {}", poses.poses[0].time_s, Printable(&file.path)))?;
    }
    Ok(())
}

/// The requested times, in seconds. They must lie within `run_s`; there may be at most `most`.
///
/// Steps are counted in whole nanoseconds, so each time is the `f64` nearest to its decimal.
pub(super) fn times_s(args: &TimesArgs, run_s: &RangeInclusive<f64>, most: usize) -> Result<Vec<f64>, BadInput> {
    let (Some(from_ns), Some(to_ns)) = (args.from, args.to) else {
        args.at.iter().try_for_each(|&at_s| require_within("--at", at_s, run_s))?;
        return match args.at.len() {
            count if count <= most => Ok(args.at.clone()),
            count => Err(BadInput(format!("--at has {count} times, must be at most {most}"))),
        };
    };
    let (from_s, to_s) = (seconds(from_ns), seconds(to_ns));
    require_within("--from", from_s, run_s)?;
    require_within("--to", to_s, run_s)?;
    if to_ns < from_ns {
        return Err(BadInput(format!("--to is {to_s}, must be at least --from, which is {from_s}")));
    }
    let steps = (to_ns - from_ns) / args.step;
    if steps >= most as i64 {
        let step_s = seconds(args.step);
        return Err(BadInput(format!(
            "--step is {step_s}, which makes {} times from {from_s} to {to_s}, must make at most {most}: try --step {}",
            steps + 1,
            coarser_step_s(to_s - from_s, most)
        )));
    }
    Ok((0..=steps).map(|step| seconds(from_ns + step * args.step)).collect())
}

/// A step, in seconds, that divides a span into at most `most` times: 1, 2 or 5 times a power of ten.
pub(super) fn coarser_step_s(span_s: f64, most: usize) -> f64 {
    // One time fewer, because the span's end may be an additional time.
    let least_s = span_s / most.saturating_sub(1).max(1) as f64;
    let exponent = least_s.log10().floor() as i32;
    let nice = (exponent..=exponent + 1).flat_map(|exponent| {
        // Parsed from text, so that it is the number nearest to the decimal.
        [1, 2, 5].map(|digit| format!("{digit}e{exponent}").parse::<f64>().expect("a decimal is a number"))
    });
    nice.into_iter().find(|step_s| *step_s > least_s).expect("ten times the power exceeds the least step")
}

fn require_within(flag: &str, time_s: f64, run_s: &RangeInclusive<f64>) -> Result<(), BadInput> {
    if run_s.contains(&time_s) {
        return Ok(());
    }
    let (start_s, end_s) = (run_s.start(), run_s.end());
    Err(BadInput(format!("{flag} is {}, must be from {start_s} to {end_s}, where the run ends", Number(time_s))))
}

/// Converts nanoseconds to the nearest `f64` of seconds: both operands are exact, and the quotient is rounded once.
fn seconds(time_ns: i64) -> f64 {
    time_ns as f64 / 1e9
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_proposed_step_is_round_and_coarse_enough_but_less_than_ten_times_too_coarse() {
        for span_s in [1e-3, 0.9, 1.0, 412.473_838, 9.99e5, 3e8] {
            for most in [2, 17, 1000, 1_000_000] {
                let step_s = coarser_step_s(span_s, most);
                assert!((span_s / step_s).floor() + 2.0 <= most as f64 + 1.0, "{span_s} s: {step_s}");
                assert!(span_s / step_s >= 0.19 * (most - 1) as f64, "{span_s} s: {step_s}");
                let digits = format!("{step_s:e}");
                assert!(["1e", "2e", "5e"].iter().any(|start| digits.starts_with(start)), "{digits}");
            }
        }
    }

    fn steps(from: i64, to: i64, step: i64, most: usize) -> Result<Vec<f64>, BadInput> {
        let args = TimesArgs { at: Vec::new(), from: Some(from), to: Some(to), step };
        times_s(&args, &(0.0..=432.5), most)
    }

    #[test]
    fn steps_of_a_second_make_301_times_of_300_seconds() {
        let times = steps(0, 300_000_000_000, 1_000_000_000, 301).expect("all lie in the run");
        assert_eq!(times, (0..=300).map(f64::from).collect::<Vec<_>>());
    }

    #[test]
    fn every_step_is_the_number_nearest_to_its_decimal() {
        let times = steps(0, 432_500_000_000, 100_000_000, 5_000).expect("all lie in the run");
        assert_eq!(times.len(), 4326);
        for (step, time_s) in times.iter().enumerate() {
            let decimal = format!("{}.{}", step / 10, step % 10);
            assert_eq!(Ok(*time_s), decimal.parse(), "step {step}");
        }
    }

    #[test]
    fn steps_that_miss_the_end_stop_before_it() {
        assert_eq!(steps(0, 1_000_000_000, 400_000_000, 9).expect("all lie in the run"), [0.0, 0.4, 0.8]);
        assert_eq!(steps(5_000_000_000, 5_000_000_000, 1, 1).expect("one time"), [5.0]);
    }

    #[test]
    fn contradictory_times_are_refused_in_one_line() {
        for (result, message) in [
            (steps(2_000_000_000, 1_000_000_000, 1, 9), "--to is 1, must be at least --from, which is 2"),
            (steps(-1, 1, 1, 9), "--from is -1e-9, must be from 0 to 432.5, where the run ends"),
            (steps(0, 433_000_000_000, 1, 9), "--to is 433, must be from 0 to 432.5, where the run ends"),
            (
                steps(0, 300_000_000_000, 10_000_000, 4464),
                "--step is 0.01, which makes 30001 times from 0 to 300, must make at most 4464: try --step 0.1",
            ),
        ] {
            assert_eq!(result.expect_err(message).to_string(), message);
        }
    }
}
