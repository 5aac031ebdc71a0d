//! The parts of a recording for the subcommands that read one: finding them, and messages about gaps.

use std::path::PathBuf;

use crate::cli::flags::BadInput;
use crate::cli::print::print_to_stderr;
use crate::output::Counted;
use crate::output::terminal_text::Printable;
use crate::recording::{Coverage, PartOf, Parts};

/// Greatest number of gaps that are listed one by one.
const MOST_LISTED: usize = 20;

/// Finds the parts of a recording in files and folders. Complains of files that cannot be read as recordings.
pub(crate) fn find_parts(files: &[PathBuf]) -> anyhow::Result<Parts> {
    let parts = Parts::find_all(files).map_err(|error| BadInput(format!("{:#}", anyhow::Error::from(error))))?;
    for (_, reason) in &parts.unreadable {
        print_to_stderr(&format!("{reason}: left out"));
    }
    Ok(parts)
}

/// The place of a single named file among the parts of its recording; `None` for a whole recording. Files beside it that cannot
/// be read do not matter.
pub(crate) fn part_of(parts: &Parts) -> Option<PartOf> {
    if parts.are_joined() { None } else { PartOf::find(&parts.named).ok().flatten() }
}

/// A sentence about a single part.
pub(crate) fn part_text(PartOf { file, number, count, folder }: &PartOf) -> String {
    format!("{} is part {number} of {count} of the recording in {}", Printable(file), Printable(folder))
}

/// Complains if a single named file is one of several parts.
pub(crate) fn warn_of_part(parts: &Parts) {
    if let Some(part) = part_of(parts) {
        print_to_stderr(&format!("{}: name the folder for all parts", part_text(&part)));
    }
}

/// The gaps of a recording, one in a line.
pub(crate) fn gap_lines(coverage: &Coverage) -> Vec<String> {
    let mut lines: Vec<String> = coverage.gaps.iter().take(MOST_LISTED).map(ToString::to_string).collect();
    let listed: u64 = coverage.gaps.iter().take(MOST_LISTED).map(|gap| gap.frames).sum();
    if coverage.missing > listed {
        lines.push(format!("further gaps: {} are missing", Counted(coverage.missing - listed, "frame")));
    }
    let unplaced = coverage.unplaced();
    if unplaced > 0 {
        lines.push(format!(
            "gap: {} that the show has published, by its summary.json, are in no part: of the end of a run, or of a run \
             without any part",
            Counted(unplaced, "frame")
        ));
    }
    lines
}

/// Complains of the gaps of a recording.
pub(crate) fn warn_of_gaps(coverage: &Coverage) {
    for line in gap_lines(coverage) {
        print_to_stderr(&line);
    }
}
