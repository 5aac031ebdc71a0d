//! `replay --verify`: a recording simulated again.

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;

use bench_dragon_geometry::dragon::Instructions;

use crate::cli::Format;
use crate::command::BadInput;
use crate::command::output::{complain, complain_of_flaws, print_json, print_line};
use crate::command::progress::Progress;
use crate::output::number::Counted;
use crate::output::report::{ReplayLine, VerificationSummary};
use crate::source::replay::verify::{RunVerification, Verdict, Verification, verify};
use crate::system::stop::StopFlag;

/// Exit status where a frame differs.
const DIFFERS: u8 = 1;
/// Exit status where something cannot be verified.
const UNVERIFIABLE: u8 = 2;

pub(super) fn run(files: &[PathBuf], format: Format) -> anyhow::Result<ExitCode> {
    let stop = StopFlag::on_signals()?;
    let bytes: u64 = files.iter().filter_map(|file| fs::metadata(file).ok()).map(|metadata| metadata.len()).sum();
    let bar = Progress::new("verifying", 2.0 * bytes as f64);
    let verified = verify(files, stop.as_atomic(), |read| bar.set(read as f64));
    drop(bar);
    let verification = verified.map_err(|error| BadInput(format!("{:#}", anyhow::Error::from(error))))?;
    for run in &verification.runs {
        match format {
            Format::Json => print_json(&ReplayLine::Run(run.clone()))?,
            Format::Text => print_line(run_text(run))?,
        }
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
    let is_unverifiable = |run: &RunVerification| matches!(run.verdict, Verdict::Unverifiable { .. });
    // What a recording lacks at its end was never there to be verified; what is damaged was.
    let is_damaged = flawed.iter().any(|file| file.flaws.skipped_bytes > 0);
    if runs.iter().any(|run| matches!(run.verdict, Verdict::Differs { .. })) {
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
        Verdict::Verified => {
            let ticks = format!("ticks {first_tick} to {last_tick}");
            format!("run {run_id}: every frame is as simulated: {frames} frames, {ticks}; {}", done_text(run))
        }
        Verdict::Differs { difference } => {
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
        Verdict::Unverifiable { from_tick, reason } => {
            format!(
                "run {run_id}: cannot be verified from tick {from_tick} on: {reason}; {verified} of {frames} frames are as \
                 simulated"
            )
        }
    }
}

/// What the simulation did.
fn done_text(run: &RunVerification) -> String {
    let RunVerification { missing, overruns, commands, grants, timecode, .. } = run;
    let missing =
        if *missing > 0 { format!("; {}, simulated", Counted(*missing, "missing frame")) } else { String::new() };
    let done = [(commands, "command"), (grants, "grant"), (timecode, "timecode event"), (overruns, "overrun")];
    done.map(|(count, noun)| Counted(*count, noun).to_string()).join(", ") + &missing
}
