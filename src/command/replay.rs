//! `replay`: a recording back onto the bus, or with `--verify` simulated again.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use bench_dragon_geometry::dragon::Instructions;
use bench_dragon_ipc::Domain;

use crate::cli::{BadInput, Format, ReplayArgs};
use crate::command::exit_status::UNVERIFIABLE;
use crate::command::print::{
    Progress, complain, complain_of_flaws, percentiles, print_json, print_notice, print_report,
};
use crate::output::Counted;
use crate::output::report::{ReplayLine, VerificationSummary};
use crate::output::terminal_text::Printable;
use crate::source::replay::verify::{RunVerdict, RunVerification, Verification, verify};
use crate::source::replay::{Pass, PassSummary, Replay, ReplaySettings};
use crate::system::stop::StopFlag;

pub(crate) fn run(args: &ReplayArgs) -> anyhow::Result<ExitCode> {
    if args.verify {
        return verify_files(&args.files, args.format.format);
    }
    let [file] = &args.files[..] else {
        return Err(BadInput(format!("{} FILEs are given: only --verify takes several", args.files.len())).into());
    };
    let domain = Domain::new(args.bus.instance.clone())?;
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

/// Exit status where a frame differs.
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
        complain("interrupted: the frames behind were not verified");
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
    // What a recording lacks at its end was never there to be verified; what is damaged was.
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
