//! `solve`: the questions to the planner, one file per question.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf, absolute};
use std::process::ExitCode;

use anyhow::bail;
use bench_dragon_geometry::dragon::Meter;
use clap::{Arg, Args, Subcommand, ValueHint};
use serde::Serialize;

use self::figure::FigureArgs;
use crate::cli::flags::{BadInput, ConfigArgs, FormatArgs, within};
use crate::cli::{exit_status, in_file, load_document, print_error, reading};
use crate::config::{Config, ConfigDocument, Cue, FormationDocument, PlanDocument};
use crate::output::terminal_text::Printable;

mod check;
mod contact;
mod contest;
mod figure;
mod formation;
mod formation_survey;
mod interrupt;
mod list;
mod pitch;
mod play;
mod poses;
mod profile;
mod route;
mod schedule;
mod schedule_figure;
mod sensitivity;
mod shortest_turn;
mod speed_limit;
mod stage;
mod sweep;
mod turn;
mod turn_play;

pub(super) use figure::{keep_drawing, pair, title};

/// Answer a question about planning a show. Needs no server.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon solve poses --at 0,60,300 --format json
  bench-dragon solve contact --config stage.toml
  bench-dragon solve route --config eight.toml
  bench-dragon solve pitch --turn-diameter 9
  bench-dragon solve turn --shortest
  bench-dragon solve speed-limit --limit 2 --save-config fast.toml
  bench-dragon solve profile --limit 2 --accel 0.5 --save-config quick.toml
  bench-dragon solve sensitivity --figure sensitivity.svg
  bench-dragon solve schedule --config square.toml --clearance 0.5
  bench-dragon solve sweep --config square.toml --figure floor.dxf
  bench-dragon solve check result1.xlsx")]
#[command(subcommand_value_name = "QUESTION", subcommand_help_heading = "Questions")]
pub(crate) struct SolveArgs {
    /// The question to answer.
    #[command(subcommand)]
    pub(crate) question: Question,
}

/// The questions to the planner.
#[derive(Clone, Debug, Subcommand)]
pub(crate) enum Question {
    Poses(poses::PosesArgs),
    Contact(contact::ContactArgs),
    Route(route::RouteArgs),
    Pitch(pitch::PitchArgs),
    Turn(turn::TurnArgs),
    SpeedLimit(speed_limit::SpeedLimitArgs),
    Profile(profile::ProfileArgs),
    Sensitivity(sensitivity::SensitivityArgs),
    Schedule(schedule::ScheduleArgs),
    Sweep(sweep::SweepArgs),
    Check(check::CheckArgs),
}

/// Answers a question. After Ctrl-C the answer is what is known so far.
pub(crate) fn run(question: Question) -> anyhow::Result<ExitCode> {
    let answered = answer(question);
    if !interrupt::is_cancelled() {
        return answered.map(|()| ExitCode::SUCCESS);
    }
    if let Err(reason) = answered {
        print_error(&reason);
    }
    Ok(ExitCode::from(exit_status::CANCELLED))
}

fn answer(question: Question) -> anyhow::Result<()> {
    match question {
        Question::Poses(args) => poses::run(&args),
        Question::Contact(args) => contact::run(&args),
        Question::Route(args) => route::run(&args),
        Question::Pitch(args) => pitch::run(&args),
        Question::Turn(args) => turn::run(&args),
        Question::SpeedLimit(args) => speed_limit::run(&args),
        Question::Profile(args) => profile::run(&args),
        Question::Sensitivity(args) => sensitivity::run(&args),
        Question::Schedule(args) => schedule::run(&args),
        Question::Sweep(args) => sweep::run(&args),
        Question::Check(args) => check::run(&args),
    }
}

/// The flags of a question whose answer may be a configuration.
#[derive(Clone, Debug, Args)]
pub(crate) struct AnswerArgs {
    /// Write the answer as a complete configuration, which `show --config` plays; an existing file is replaced.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) save_config: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) figure: FigureArgs,
    #[command(flatten)]
    pub(crate) work: WorkArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

/// The flag for the work of an answer.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct WorkArgs {
    /// Most work for the answer, in millions of steps of about 50 ns, 1 to 1000000000; if it is not enough, the answer states
    /// how far it reached [default: 100].
    #[arg(long, value_name = "MILLIONS", allow_negative_numbers = true, value_parser = within(1..=1_000_000_000_u64))]
    pub(crate) work: Option<u64>,
}

/// The flag `--work` of a question with another default.
pub(super) fn work_default(arg: Arg, default: &str) -> Arg {
    let help = arg.get_help().map(ToString::to_string).unwrap_or_default();
    arg.help(help.replace("[default: 100]", &format!("[default: {default}]")))
}

impl WorkArgs {
    /// A meter for one part of an answer.
    pub(crate) fn meter(self) -> Meter {
        interrupt::question().meter(self.work.unwrap_or(DEFAULT_WORK) * STEPS)
    }

    /// Steps for finding the end of the dragon's run, if the flag is given.
    fn placing_steps(self) -> Option<u64> {
        self.work.map(|millions| millions * STEPS)
    }

    /// A meter for an answer about every two of many dragons.
    pub(crate) fn longest_meter(self) -> Meter {
        interrupt::question().meter(self.work.unwrap_or(DEFAULT_LONGEST_WORK) * STEPS)
    }

    /// A meter for an answer that consists of many answers.
    pub(crate) fn long_meter(self) -> Meter {
        interrupt::question().meter(self.work.unwrap_or(DEFAULT_LONG_WORK) * STEPS)
    }
}

/// Default work, in millions of steps: a few seconds on one core.
const DEFAULT_WORK: u64 = 100;

/// Default work for a question about many dragons, in millions of steps.
const DEFAULT_LONG_WORK: u64 = 300;

/// Default work for a question about every two dragons of a formation, in millions of steps.
const DEFAULT_LONGEST_WORK: u64 = 1000;

/// Steps in a million.
const STEPS: u64 = 1_000_000;

/// Allowed values of `--clearance`, in metres.
const CLEARANCE_M: RangeInclusive<f64> = 0.0..=10.0;

/// Allowed values of `--max-ratio`: a handle's speed ÷ the head's speed. Under 1 every run would fail, because the head itself
/// has 1. A handle with a greater ratio than the upper limit jumps.
const SPEED_RATIO: RangeInclusive<f64> = 1.0..=1000.0;

/// A handle that exceeds `--max-ratio`, in an answer.
#[derive(Serialize)]
struct TooFast {
    /// Its speed ÷ the head's speed.
    ratio: f64,
    time_s: f64,
    handle: usize,
}

impl AnswerArgs {
    /// Fails if an output would replace the drawing of the route, or another output.
    fn keep_files_apart(&self, document: &ConfigDocument) -> Result<(), BadInput> {
        self.figure.keep_drawing(document)?;
        let Some(saved) = &self.save_config else { return Ok(()) };
        let absolute = |path: &Path| absolute(path).unwrap_or_else(|_| path.to_owned());
        if self.figure.figure.as_ref().is_some_and(|figure| absolute(&figure.path) == absolute(saved)) {
            let file = Printable(saved);
            return Err(BadInput(format!("--save-config is {file}, the file of --figure, must be another file")));
        }
        keep_drawing("--save-config", saved, document)
    }
}

/// Reads the configuration of a question. `--work` limits the search for the end of the dragon's run.
fn load_plan(args: &ConfigArgs, work: WorkArgs) -> anyhow::Result<Config> {
    in_file(args, load_plan_document(args, work)?.build())
}

/// Reads the configuration of a question about one dragon or several.
fn load_any_plan(args: &ConfigArgs, work: WorkArgs) -> anyhow::Result<PlanDocument> {
    let file = args.config.as_deref();
    in_file(args, reading::within_limits(file, || PlanDocument::load(file, |_| (), work.placing_steps())))
}

/// Reads the configuration of a question without a dragon on its route.
fn load_plan_document(args: &ConfigArgs, work: WorkArgs) -> anyhow::Result<ConfigDocument> {
    let document = load_document(args)?;
    Ok(match work.placing_steps() {
        Some(steps) => document.with_placing_steps(steps),
        None => document,
    })
}

/// Fails for a plan with cues, which the question does not take into account.
fn require_no_cues(cues: &[Cue], question: &str) -> Result<(), BadInput> {
    if cues.is_empty() {
        return Ok(());
    }
    Err(BadInput(format!("[[cues]] is present, must be absent for {question}")))
}

/// The dragons of a question about several.
fn require_several<'a>(document: &'a PlanDocument, question: &str) -> Result<&'a FormationDocument, BadInput> {
    match document {
        PlanDocument::Formation(formation) if formation.dragons().len() > 1 => Ok(formation),
        _ => Err(BadInput(format!("[[dragons]] has 1 dragon or is absent, must have 2 or more for {question}"))),
    }
}

fn xlsx(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let is_xlsx = path.extension().is_some_and(|suffix| suffix.eq_ignore_ascii_case("xlsx"));
    if is_xlsx { Ok(path) } else { Err("must end in .xlsx".to_owned()) }
}

/// Writes the answer as a configuration, if the arguments request it. Fails with the reason if there is no such answer.
pub(super) fn save_config(args: &AnswerArgs, answer: Result<&Config, &str>) -> anyhow::Result<()> {
    let Some(path) = &args.save_config else { return Ok(()) };
    match answer {
        Ok(config) => interrupt::write(path, config.to_toml().as_bytes()),
        Err(reason) => bail!("--save-config has nothing to save: {reason}"),
    }
}
