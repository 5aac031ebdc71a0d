//! The file that keeps the measured clearance of a run while no observer runs, so that a restarted view still shows it.
//!
//! It lies in the directory of the instance, beside the bus, and its name begins with the prefix of the instance. So the last
//! process that leaves the bus removes it. It has the least clearance of each part of the run, a few kilobytes. An observer that
//! ends suddenly loses at most the last second.

use std::fs;
use std::path::PathBuf;

use bench_dragon_ipc::Domain;
use serde::{Deserialize, Serialize};

use super::described_run::ClearanceChart;
use super::snapshot::LeastClearance;

/// Name of the file, after the prefix of the instance.
const NAME: &str = "measured.json";
/// Period at which the file is written, in nanoseconds.
const PERIOD_NS: u64 = 1_000_000_000;
/// Greatest length of a file that is read, in bytes.
const MAX_BYTES: u64 = 1 << 20;

/// The file of an instance.
#[derive(Debug)]
pub(super) struct ClearanceMemory {
    path: PathBuf,
    written_ns: u64,
    written_revision: u64,
    has_warned: bool,
}

/// The content of the file.
#[derive(Debug, Serialize, Deserialize)]
struct Measured {
    run_id: u64,
    start_s: f64,
    step_s: f64,
    least: Option<LeastClearance>,
    least_m: Vec<Option<f64>>,
}

impl ClearanceMemory {
    pub(super) fn of(domain: &Domain) -> Self {
        Self::at(domain.root().join(format!("{}{NAME}", domain.prefix())))
    }

    fn at(path: PathBuf) -> Self {
        Self { path, written_ns: 0, written_revision: 0, has_warned: false }
    }

    /// Adds what an earlier observer has measured in this run to an empty chart. Returns that observer's least clearance.
    pub(super) fn recall(&self, run_id: u64, chart: &mut ClearanceChart) -> Option<LeastClearance> {
        let is_short = fs::metadata(&self.path).is_ok_and(|metadata| metadata.is_file() && metadata.len() <= MAX_BYTES);
        let text = is_short.then(|| fs::read(&self.path).ok()).flatten()?;
        let measured: Measured = serde_json::from_slice(&text).ok()?;
        let is_of_run = measured.run_id == run_id
            && (measured.start_s, measured.step_s) == (chart.start_s, chart.step_s)
            && measured.least_m.len() == chart.least_m.len();
        if !is_of_run {
            return None;
        }
        chart.recall(&measured.least_m);
        measured.least
    }

    /// Writes the chart if it has changed, at most once per second.
    pub(super) fn keep(&mut self, run_id: u64, chart: &ClearanceChart, least: Option<LeastClearance>, now_ns: u64) {
        if chart.revisions == self.written_revision || now_ns.saturating_sub(self.written_ns) < PERIOD_NS {
            return;
        }
        (self.written_ns, self.written_revision) = (now_ns, chart.revisions);
        let ClearanceChart { start_s, step_s, ref least_m, .. } = *chart;
        let measured = Measured { run_id, start_s, step_s, least, least_m: least_m.clone() };
        let text = serde_json::to_vec(&measured).expect("numbers are valid JSON");
        // Several observers may write at once.
        let unfinished = self.path.with_extension(format!("json.{}", std::process::id()));
        let written = fs::write(&unfinished, text).and_then(|()| fs::rename(&unfinished, &self.path));
        if let Err(error) = written
            && !std::mem::replace(&mut self.has_warned, true)
        {
            tracing::warn!(
                "a restarted view will not show the clearance measured so far: cannot write {}: {error}",
                unfinished.display()
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_observer_recalls_what_another_one_measured_in_the_same_run_only() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut chart = ClearanceChart::new(0.0, 480.0);
        chart.note(10.5, 0.125);
        chart.note(20.5, -0.01);
        let least = Some(LeastClearance { clearance_m: -0.01, time_s: 20.5 });
        ClearanceMemory::at(folder.path().join(NAME)).keep(7, &chart, least, PERIOD_NS);

        let mut recalled = ClearanceChart::new(0.0, 480.0);
        assert_eq!(ClearanceMemory::at(folder.path().join(NAME)).recall(7, &mut recalled), least);
        assert_eq!(recalled.least_m, chart.least_m);
        assert_eq!(recalled.since(0).collect::<Vec<_>>(), [(10, 0.125), (20, -0.01)]);

        let mut empty = ClearanceChart::new(0.0, 480.0);
        assert_eq!(ClearanceMemory::at(folder.path().join(NAME)).recall(8, &mut empty), None, "another run");
        let mut longer = ClearanceChart::new(0.0, 960.0);
        assert_eq!(ClearanceMemory::at(folder.path().join(NAME)).recall(7, &mut longer), None, "another length");
        fs::write(folder.path().join(NAME), b"{\"run_id\":7").expect("a file");
        assert_eq!(ClearanceMemory::at(folder.path().join(NAME)).recall(7, &mut empty), None, "a damaged file");
        assert_eq!((empty.revisions, longer.revisions), (0, 0));
    }

    #[test]
    fn the_file_is_written_once_per_second_and_only_after_changes() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut chart = ClearanceChart::new(0.0, 480.0);
        let mut memory = ClearanceMemory::at(folder.path().join(NAME));
        let path = folder.path().join(NAME);
        chart.note(1.0, 0.1);
        memory.keep(7, &chart, None, PERIOD_NS);
        fs::remove_file(&path).expect("it was written");
        memory.keep(7, &chart, None, 3 * PERIOD_NS);
        assert!(!path.exists(), "without a change");
        chart.note(2.0, 0.1);
        memory.keep(7, &chart, None, 2 * PERIOD_NS - 1);
        assert!(!path.exists(), "within a second");
        memory.keep(7, &chart, None, 2 * PERIOD_NS);
        assert!(path.exists());
    }
}
