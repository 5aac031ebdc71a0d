//! All poses, step by step, as tables.

use super::HandOver;
use crate::output::poses::{MAX_POSITIONS, Poses};
use crate::output::table::{self, MAX_COLUMNS};

pub(super) fn workbook(show: &HandOver<'_>) -> Result<Vec<u8>, String> {
    let poses = poses(show, MAX_COLUMNS - 1)?;
    table::workbook(&poses.sheets()).map_err(|error| error.to_string())
}

pub(super) fn csv(show: &HandOver<'_>) -> Result<Vec<u8>, String> {
    Ok(table::csv(&[poses(show, usize::MAX)?.by_time()]))
}

/// The poses from the start to the end, in even steps, and at the end.
fn poses(show: &HandOver<'_>, most: usize) -> Result<Poses, String> {
    let (start_s, end_s) = (show.config.start_s(), show.config.end_s());
    let most = most.min(MAX_POSITIONS / show.config.formation().layout().handles());
    let steps = ((end_s - start_s) / show.step_s).floor();
    if steps + 2.0 > most as f64 {
        return Err(format!("--step is {}, which makes more than {most} times, the most of this file", show.step_s));
    }
    let mut times_s: Vec<f64> = (0..=steps as u64).map(|step| start_s + step as f64 * show.step_s).collect();
    if times_s.last() != Some(&end_s) {
        times_s.push(end_s);
    }
    Ok(Poses::of(&times_s, show.config))
}
