//! `replay --verify`: the verification of a recording, in words and as JSON.

use std::path::PathBuf;
use std::process::ExitCode;

use bench_dragon_geometry::dragon::Instructions;
use serde::Serialize;

use crate::cli::exit_status::UNVERIFIABLE;
use crate::cli::flags::{BadInput, Format};
use crate::cli::parts::{find_parts, gap_lines, part_of, part_text};
use crate::cli::print::{Progress, print_json, print_line, print_report, print_to_stderr, warn_of_flaws};
use crate::output::Counted;
use crate::output::terminal_text::Printable;
use crate::recording::{Coverage, FlawedFile, PartOf, Parts};
use crate::source::replay::verify::{RunVerdict, RunVerification, Verification, verify};
use crate::system::stop::StopFlag;

/// A line that `replay --verify` prints.
#[derive(Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
enum VerificationLine {
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
    /// Files of the folder that cannot be read as recordings.
    unreadable: Vec<PathBuf>,
    /// The frames of the parts, and the gaps.
    #[serde(flatten)]
    coverage: Coverage,
    /// Published frames that neither a part nor a gap accounts for.
    unplaced: u64,
    /// The place of a single file among several parts; null for a whole recording.
    part: Option<PartReport>,
}

/// The place of a file among the parts of a recording.
#[derive(Serialize)]
struct PartReport {
    number: usize,
    of: usize,
    folder: PathBuf,
}

/// Exit status if a frame differs.
const DIFFERS: u8 = 1;

/// Verifies files and folders as one recording.
pub(super) fn run(files: &[PathBuf], format: Format) -> anyhow::Result<ExitCode> {
    let stop = StopFlag::on_signals()?;
    let parts = find_parts(files)?;
    let bar = Progress::new("verifying", 2.0 * parts.bytes() as f64);
    let verified = verify(&parts, stop.as_atomic(), |read| bar.set(read as f64));
    drop(bar);
    let verification = verified.map_err(|error| BadInput(format!("{:#}", anyhow::Error::from(error))))?;
    for run in &verification.runs {
        print_report(format, &VerificationLine::Run(run.clone()), run_text(run))?;
    }
    for flawed in &verification.flawed {
        warn_of_flaws(&flawed.file, flawed.flaws, "verified");
    }
    if verification.is_interrupted {
        print_to_stderr("interrupted: the remaining frames were not verified");
    }
    let (status, part) = (status(&verification, &parts), part_of(&parts));
    match format {
        Format::Json => print_json(&VerificationLine::Verification(summary(verification, status == 0, &parts, part)))?,
        Format::Text => whole_lines(&verification, &parts, part.as_ref()).into_iter().try_for_each(print_line)?,
    }
    Ok(ExitCode::from(status))
}

/// The lines about the recording as a whole: its gaps and its counts, or that it is only a part.
fn whole_lines(verification: &Verification, parts: &Parts, part: Option<&PartOf>) -> Vec<String> {
    if let Some(part) = part {
        return vec![format!(
            "{}; `bench-dragon replay {} --verify` verifies all parts",
            part_text(part),
            Printable(&part.folder)
        )];
    }
    if !parts.are_joined() {
        return Vec::new();
    }
    let coverage = &verification.coverage;
    let mut lines = gap_lines(coverage);
    let verified: u64 = verification.runs.iter().map(|run| run.verified).sum();
    let published = coverage.published.map_or(String::new(), |published| format!("{published} published, "));
    lines.push(format!(
        "{}: {} in {}: {published}{} recorded, {verified} as simulated, {} missing",
        Printable(&parts.named),
        Counted(verification.runs.len() as u64, "run"),
        Counted(parts.files.len() as u64, "part"),
        coverage.recorded,
        coverage.lacking(),
    ));
    lines
}

fn status(verification: &Verification, parts: &Parts) -> u8 {
    let Verification { runs, flawed, is_interrupted, .. } = verification;
    let is_unverifiable = |run: &RunVerification| matches!(run.verdict, RunVerdict::Unverifiable { .. });
    // A missing end is no failure, because it was never recorded. Damaged bytes are: they were recorded.
    let is_damaged = flawed.iter().any(|file| file.flaws.skipped_bytes > 0);
    if runs.iter().any(|run| matches!(run.verdict, RunVerdict::Differs { .. })) {
        DIFFERS
    } else if is_damaged || *is_interrupted || !parts.unreadable.is_empty() || runs.iter().any(is_unverifiable) {
        UNVERIFIABLE
    } else {
        0
    }
}

fn summary(verification: Verification, verified: bool, parts: &Parts, part: Option<PartOf>) -> VerificationSummary {
    let Verification { runs, coverage, flawed, is_interrupted } = verification;
    VerificationSummary {
        verified,
        runs: runs.len() as u64,
        frames: runs.iter().map(|run| run.frames).sum(),
        frames_verified: runs.iter().map(|run| run.verified).sum(),
        interrupted: is_interrupted,
        flawed,
        unreadable: parts.unreadable.iter().map(|(path, _)| path.clone()).collect(),
        unplaced: coverage.unplaced(),
        coverage,
        part: part.map(|PartOf { number, count, folder, .. }| PartReport { number, of: count, folder }),
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
