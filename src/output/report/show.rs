//! What a show says in the end.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::{ContactReport, GuardReport};
use crate::output::histogram::Percentiles;

/// `summary.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShowSummary {
    /// Number of the last run.
    pub run_id: u64,
    /// Who got how many.
    pub frames: FrameCounts,
    /// First contact, or null.
    pub contact: Option<ContactReport>,
    /// Where the guard held the head for good; null where it did not.
    pub guard: Option<GuardReport>,
    /// From each release to the start of its tick, in microseconds, over all servers of the show.
    pub lateness_us: Percentiles,
    /// From the instant a frame was due to the instant the monitor had read it, in microseconds, over all monitors of the show.
    pub latency_us: Percentiles,
    /// Releases that the server skipped.
    pub overruns: u64,
    /// How far the show was behind the clock at the end, in seconds of wall time.
    pub behind_s: f64,
    /// The furthest that it was behind.
    pub most_behind_s: f64,
    /// Processes that were started again.
    pub restarts: Restarts,
    /// Each process that ended before the show did, oldest first.
    #[serde(default)]
    pub restart_log: Vec<RestartReport>,
    /// The recording; where the recorder was started again, the first one.
    pub recording: PathBuf,
    /// All recordings, oldest first.
    pub recordings: Vec<PathBuf>,
}

/// Frames over the whole show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FrameCounts {
    /// Published by the server.
    pub published: u64,
    /// Read by the monitor.
    pub monitored: u64,
    /// Written by the recorder.
    pub recorded: u64,
    /// Published and not read by the monitor.
    pub missed_by_monitor: u64,
    /// Published and not written by the recorder.
    pub missed_by_recorder: u64,
}

/// A process that ended before the show did.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RestartReport {
    /// Its name in [`Restarts`].
    pub role: String,
    /// Why it ended: its exit status, the signal, or that it gave no sign of life.
    pub reason: String,
    /// Show time of the last frame before that was noticed; null before the first frame.
    pub show_time_s: Option<f64>,
    /// Wall time at which that was noticed, as RFC 3339 has it, in UTC.
    pub at: String,
    /// Whether it was started again; false where it had ended too often.
    pub restarted: bool,
}

/// How often each process was started again.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Restarts {
    /// The server.
    pub serve: u32,
    /// The monitor.
    pub monitor: u32,
    /// The recorder.
    pub record: u32,
    /// The page; absent in what shows without one have said.
    #[serde(default)]
    pub view: u32,
    /// The commands of `[[show.also]]`, each under its own name.
    #[serde(flatten)]
    pub also: BTreeMap<String, u32>,
}
