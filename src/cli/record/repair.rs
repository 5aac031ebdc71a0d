//! The repair of recordings that killed recorders left.

use std::fs;
use std::path::Path;
use std::process::ExitCode;

use super::RecordArgs;
use crate::cli::flags::BadInput;
use crate::cli::print::{Progress, print_report, print_to_stderr};
use crate::output::Counted;
use crate::output::terminal_text::Printable;
use crate::recording::{BackgroundRepair, Repair, RepairError, recordings_in, repair, repair_checked};

/// Repairs all recordings of a folder. A failure does not stop the other repairs; the last one is the error of the subcommand.
pub(super) fn repair_all(args: &RecordArgs) -> anyhow::Result<ExitCode> {
    let mut failure = None;
    for file in recordings_in(&args.file).map_err(|error| BadInput(format!("{:#}", anyhow::Error::from(error))))? {
        if let Err(error) = repair_one(args, &file)
            && let Some(earlier) = failure.replace(error)
        {
            print_to_stderr(&format!("error: {earlier:#}"));
        }
    }
    failure.map_or(Ok(ExitCode::SUCCESS), Err)
}

pub(super) fn repair_one(args: &RecordArgs, file: &Path) -> anyhow::Result<ExitCode> {
    let repaired = if args.check { check_one(file) } else { repair(file) };
    let Repair { path, frames, was_unfinished, skipped_bytes, kept } = repaired?;
    let done = if was_unfinished { "finished" } else { "was finished already" };
    let found = match &kept {
        Some(kept) => kept_text(skipped_bytes, kept),
        None if args.check => "; every chunk was read and is sound".to_owned(),
        None => String::new(),
    };
    let text = format!("{} {done}: {}{found}", Printable(&path), Counted(frames, "frame"));
    let value = serde_json::json!({ "file": path, "frames": frames, "repaired": was_unfinished,
            "skipped_bytes": skipped_bytes, "kept": kept });
    print_report(args.format.format, &value, text)?;
    Ok(ExitCode::SUCCESS)
}

fn check_one(file: &Path) -> Result<Repair, RepairError> {
    let bar = Progress::new("checking", fs::metadata(file).map_or(0, |metadata| metadata.len()) as f64);
    repair_checked(file, |bytes| bar.set(bytes as f64))
}

/// The part of the report about a damaged file that the repair kept.
fn kept_text(skipped_bytes: u64, kept: &Path) -> String {
    let damage = match skipped_bytes {
        0 => "its records or its indexes are damaged".to_owned(),
        bytes => format!("{bytes} bytes are damaged and were skipped"),
    };
    format!("; {damage}, so the old file is kept as {}", Printable(kept))
}

/// Starts a thread that finishes the recordings that killed recorders left in a folder. It reports each file in one line. A
/// failure to start it does not stop the recording.
pub(super) fn begin_repairs(folder: &Path) -> Option<BackgroundRepair> {
    let repairs = BackgroundRepair::start(report_repair);
    let repairs =
        repairs.inspect_err(|error| tracing::warn!("cannot finish recordings of killed recorders: {error}")).ok()?;
    // The recorder itself reports a missing folder.
    if folder.is_dir() {
        repairs.repair(folder.into());
    }
    Some(repairs)
}

fn report_repair(repaired: Result<Repair, RepairError>) {
    match repaired {
        Ok(Repair { path, frames, .. }) => {
            print_to_stderr(&format!(
                "finished {}, which a killed recorder left: {}",
                Printable(&path),
                Counted(frames, "frame")
            ));
        }
        Err(error) => tracing::warn!("{:#}", anyhow::Error::from(error)),
    }
}
