//! `replay`: plays a recording back onto the bus, or with `--verify` simulates it again and compares.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use bench_dragon_geometry::dragon::Instructions;
use bench_dragon_ipc::service::MAX_READERS;
use clap::{Args, ValueHint};
use serde::Serialize;

use crate::command::exit_status::UNVERIFIABLE;
use crate::command::flags::{BadInput, BusArgs, Format, FormatArgs, IntervalArgs, count, within};
use crate::command::print::{
    Progress, complain, complain_of_flaws, percentiles, print_json, print_notice, print_report,
};
use crate::output::Counted;
use crate::output::terminal_text::Printable;
use crate::source::replay::verify::{FlawedFile, RunVerdict, RunVerification, Verification, verify};
use crate::source::replay::{Pass, PassSummary, RATE, Replay, ReplaySettings, ReplaySummary};
use crate::system::stop::StopFlag;

/// Play a recording back onto the bus, at its recorded pace or at another one.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon replay rehearsal.mcap
  bench-dragon replay rehearsal.mcap --instance archive --readers 2
  bench-dragon replay rehearsal.mcap --from 60 --to 90 --rate 0.5 --loop

Each pass of a recorded run gets a new run id. Its ticks count from 0, its frames are due now, and its time_scale is \
multiplied by the rate. All other values are as recorded. --from and --to select frames by show time, anywhere in the \
recording; the replay leaves out all other frames. It accepts only the command `ctl stop`.")]
pub(crate) struct ReplayArgs {
    /// Recording to play; with --verify all files of the recording, oldest first.
    #[arg(value_name = "FILE", required = true, num_args = 1.., value_hint = ValueHint::FilePath)]
    pub(crate) files: Vec<PathBuf>,
    /// Instead of playing, simulate the recorded runs again, compare every frame bit for bit, and report the first difference.
    /// Needs no server. Exit status: 0 all frames are as simulated, 1 a frame differs, 2 a part cannot be verified.
    #[arg(long, conflicts_with_all = ["from", "to", "rate", "repeat", "readers", "instance"])]
    pub(crate) verify: bool,
    #[command(flatten)]
    pub(crate) interval: IntervalArgs,
    /// Recorded seconds to play per wall-clock second, 0.01 to 100.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, allow_negative_numbers = true, value_parser = within(RATE))]
    pub(crate) rate: f64,
    /// Number of times to play the recording; without a number, until Ctrl-C [default: once].
    #[arg(long = "loop", value_name = "TIMES", num_args = 0..=1, allow_negative_numbers = true, value_parser = count())]
    #[allow(clippy::option_option, reason = "not given, given without a number, given with one")]
    pub(crate) repeat: Option<Option<u64>>,
    /// Wait for this many connected readers, 0 to 24, before the first frame, but at most ten seconds.
    #[arg(long, value_name = "COUNT", default_value_t = 0, allow_negative_numbers = true, value_parser = within(0..=MAX_READERS))]
    pub(crate) readers: usize,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

/// A line that `replay` prints.
#[derive(Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
enum ReplayLine {
    /// The services of a pass are open.
    Started {
        /// The run id of the pass on the bus.
        run_id: u64,
        /// The run id in the recording.
        recorded_run_id: u64,
    },
    Pass(PassSummary),
    Summary(ReplaySummary),
    /// The result of verifying a run.
    Run(RunVerification),
    Verification(VerificationSummary),
}

/// The result of verifying a recording.
#[derive(Serialize)]
struct VerificationSummary {
    /// Whether every frame of the recording is as simulated.
    verified: bool,
    runs: u64,
    frames: u64,
    frames_verified: u64,
    interrupted: bool,
    /// The files that could not be read completely.
    flawed: Vec<FlawedFile>,
}

pub(crate) fn run(args: &ReplayArgs) -> anyhow::Result<ExitCode> {
    if args.verify {
        return verify_files(&args.files, args.format.format);
    }
    let [file] = &args.files[..] else {
        return Err(BadInput(format!("{} FILEs are given, must be one without --verify", args.files.len())).into());
    };
    let domain = args.bus.domain()?;
    let stop = StopFlag::on_signals()?;
    let mut replay = Replay::open(&domain, settings(args, file)?)?;
    while let Some(pass) = replay.next_pass(stop.as_atomic())? {
        announce(args, file, &pass)?;
        print_pass(args.format.format, pass.play(stop.as_atomic())?)?;
    }
    let summary = replay.finish();
    complain_of_flaws(file, summary.flaws, "replayed");
    if args.format.format == Format::Json {
        print_json(&ReplayLine::Summary(summary))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn settings(args: &ReplayArgs, file: &Path) -> anyhow::Result<ReplaySettings> {
    let laps = match args.repeat {
        None => Some(1),
        Some(laps) => laps,
    };
    let interval = args.interval.interval()?;
    Ok(ReplaySettings { file: file.to_owned(), interval, rate: args.rate, laps, readers: args.readers })
}

fn announce(args: &ReplayArgs, file: &Path, pass: &Pass<'_>) -> anyhow::Result<()> {
    let (run_id, recorded_run_id) = (pass.run_id(), pass.recorded_run_id());
    let (file, instance) = (Printable(file), &args.bus.instance);
    let text = format!("replaying {file} on instance {instance}, run {run_id}; Ctrl-C ends it");
    print_notice(args.format.format, &ReplayLine::Started { run_id, recorded_run_id }, &text)
}

fn print_pass(format: Format, pass: PassSummary) -> anyhow::Result<()> {
    let PassSummary { frames, missing, sim_time_s, overruns, lateness_us, tick_us, .. } = pass;
    let missing = if missing > 0 { format!(" ({missing} missing in the recording)") } else { String::new() };
    let text = format!(
        "{}{missing} to {sim_time_s:.6} s, {}, lateness {}, tick {} \u{b5}s",
        Counted(frames, "frame"),
        Counted(overruns, "overrun"),
        percentiles(lateness_us),
        percentiles(tick_us)
    );
    print_report(format, &ReplayLine::Pass(pass), text)
}

/// Exit status if a frame differs.
const DIFFERS: u8 = 1;

fn verify_files(files: &[PathBuf], format: Format) -> anyhow::Result<ExitCode> {
    let stop = StopFlag::on_signals()?;
    let bytes: u64 = files.iter().filter_map(|file| fs::metadata(file).ok()).map(|metadata| metadata.len()).sum();
    let bar = Progress::new("verifying", 2.0 * bytes as f64);
    let verified = verify(files, stop.as_atomic(), |read| bar.set(read as f64));
    drop(bar);
    let verification = verified.map_err(|error| BadInput(format!("{:#}", anyhow::Error::from(error))))?;
    for run in &verification.runs {
        print_report(format, &ReplayLine::Run(run.clone()), run_text(run))?;
    }
    for flawed in &verification.flawed {
        complain_of_flaws(&flawed.file, flawed.flaws, "verified");
    }
    if verification.is_interrupted {
        complain("interrupted: the remaining frames were not verified");
    }
    let status = status(&verification);
    if format == Format::Json {
        print_json(&ReplayLine::Verification(summary(verification, status == 0)))?;
    }
    Ok(ExitCode::from(status))
}

fn status(verification: &Verification) -> u8 {
    let Verification { runs, flawed, is_interrupted } = verification;
    let is_unverifiable = |run: &RunVerification| matches!(run.verdict, RunVerdict::Unverifiable { .. });
    // A missing end is no failure, because it was never recorded. Damaged bytes are: they were recorded.
    let is_damaged = flawed.iter().any(|file| file.flaws.skipped_bytes > 0);
    if runs.iter().any(|run| matches!(run.verdict, RunVerdict::Differs { .. })) {
        DIFFERS
    } else if is_damaged || *is_interrupted || runs.iter().any(is_unverifiable) {
        UNVERIFIABLE
    } else {
        0
    }
}

fn summary(verification: Verification, verified: bool) -> VerificationSummary {
    let Verification { runs, flawed, is_interrupted } = verification;
    VerificationSummary {
        verified,
        runs: runs.len() as u64,
        frames: runs.iter().map(|run| run.frames).sum(),
        frames_verified: runs.iter().map(|run| run.verified).sum(),
        interrupted: is_interrupted,
        flawed,
    }
}

fn run_text(run: &RunVerification) -> String {
    let RunVerification { run_id, frames, verified, first_tick, last_tick, verdict, .. } = run;
    match verdict {
        RunVerdict::Verified => {
            let ticks = format!("ticks {first_tick} to {last_tick}");
            format!("run {run_id}: every frame is as simulated: {frames} frames, {ticks}; {}", done_text(run))
        }
        RunVerdict::Differs { difference } => {
            let rounding = if difference.may_be_rounding() {
                format!(
                    "; a difference this small may come from another processor or C library (here: {})",
                    Instructions::best().name()
                )
            } else {
                String::new()
            };
            format!(
                "run {run_id}: differs {difference}{rounding}; {verified} frames before it are as simulated; {}",
                done_text(run)
            )
        }
        RunVerdict::Unverifiable { from_tick, reason } => {
            format!(
                "run {run_id}: cannot be verified from tick {from_tick} on: {reason}; {verified} of {frames} frames are as \
                 simulated"
            )
        }
    }
}

fn done_text(run: &RunVerification) -> String {
    let RunVerification { missing, overruns, commands, grants, timecode, .. } = run;
    let missing =
        if *missing > 0 { format!("; {}, simulated", Counted(*missing, "missing frame")) } else { String::new() };
    let done = [(commands, "command"), (grants, "grant"), (timecode, "timecode event"), (overruns, "overrun")];
    done.map(|(count, noun)| Counted(*count, noun).to_string()).join(", ") + &missing
}
