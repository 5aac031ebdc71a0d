//! Everything that is to be seen at one instant.

use std::sync::Arc;

use bench_dragon_ipc::{FrameHeader, HandleState, Status};

use super::alert_log::AlertLog;
use super::clearance_chart::ClearanceChart;
use super::link::Link;
use super::outlook::Outlook;
use super::reader_log::ReaderLog;
use super::run::Run;
use super::traffic::Traffic;
use crate::dragon::PairClearance;

/// A frame, copied out of shared memory, so that whoever draws holds on to nothing of the server's.
#[derive(Clone, Debug, PartialEq)]
pub struct Still {
    /// The frame's header.
    pub header: FrameHeader,
    /// The handles, head first, one more than there are benches.
    pub handles: Vec<HandleState>,
}

/// What an observer shows.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Whether there is a source, and whether it says anything.
    pub link: Link,
    /// The newest frame; after the source's end its last one.
    pub frame: Option<Arc<Still>>,
    /// The run that the frame is of. `None` until its description has come.
    pub run: Option<Arc<Run>>,
    /// The pair of benches that are nearest to each other in the frame, neighbours left out.
    pub nearest: Option<PairClearance>,
    /// The least clearance of all scenes of this run, and its show time, both in metres and seconds.
    pub least: Option<(f64, f64)>,
    /// What lies ahead.
    pub outlook: Outlook,
    /// The clearance so far.
    pub chart: Option<Arc<ClearanceChart>>,
    /// The server's account of itself; of the run that the frame is of.
    pub status: Option<Arc<Status>>,
    /// The frames that arrive.
    pub traffic: Traffic,
    /// The alerts that have come.
    pub alerts: Arc<AlertLog>,
    /// What the readers have reported of themselves.
    pub readers: Arc<ReaderLog>,
}
