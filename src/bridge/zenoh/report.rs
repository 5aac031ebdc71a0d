//! What a bridge reports: the JSON lines of `bridge zenoh`.

use serde::{Deserialize, Serialize};

use crate::output::histogram::Percentiles;

/// A line of `bridge zenoh`. `run_id` is a run's number here, and `remote_run_id` the one on the other side.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
#[expect(missing_docs, reason = "the type and the variants say what the fields are")]
pub enum ZenohReport {
    /// The session is open: what all its keys begin with, where others reach it, and whom it tries to reach.
    Started { key: String, listens: Vec<String>, connects: Vec<String> },
    /// A run is there to be sent. Of its frames, those are sent whose tick is a multiple of `every`, and those that change the state.
    Sending { run_id: u64, every: u64 },
    /// The other side has described a run, which is received from its next frame on.
    Found { remote_run_id: u64, every: u64 },
    /// A run begins to be received.
    Receiving { run_id: u64, remote_run_id: u64 },
    /// A run that the other side has described cannot be published here: what is received goes on.
    Refused { remote_run_id: u64, reason: String },
    /// Nobody is connected: whatever is sent reaches nobody. It goes on trying to reach these.
    Alone { connects: Vec<String> },
    /// Somebody is connected again, or at last; so many frames so far have reached nobody.
    Connected { unheard: u64 },
    /// Frames have stopped coming, for this reason as far as it can be known here. The run is null before the first one.
    Silent { run_id: Option<u64>, reason: Silence },
    /// Frames come again; so many of the run have been lost between the hosts so far.
    Resumed { run_id: u64, lost: u64 },
    /// A sending bridge has ended.
    Sent(SenderSummary),
    /// A receiving bridge has ended.
    Received(ReceiverSummary),
}

/// Why no frames come.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Silence {
    /// The other side says that there is a source: so the way is cut, or the source stands.
    LinkOrSource,
    /// Nobody says that there is a source, or not any more.
    NoSource,
    /// Nobody is connected.
    NoConnection,
}

/// What a sending bridge came to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SenderSummary {
    /// Frames handed to zenoh while somebody was connected.
    pub frames: u64,
    /// Frames that were to be sent while nobody was.
    pub unheard: u64,
    /// Frames of the bus that the bridge was too late for: overwritten, or of a run that another one had followed already.
    pub lost: u64,
    /// Alerts handed to zenoh.
    pub alerts: u64,
    /// Commands passed on to the server.
    pub commands: u64,
    /// Commands and other questions that were not: malformed, too late, or more than are taken at a time.
    pub refused: u64,
}

/// What a receiving bridge came to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReceiverSummary {
    /// Runs received.
    pub runs: u64,
    /// Frames published.
    pub frames: u64,
    /// Frames between the first and the last one of each run that were to come and did not.
    pub lost: u64,
    /// Of these, frames that came and were given up here, the bus being behind.
    pub dropped: u64,
    /// Payloads that were not what they should be, or not what their run is described as.
    pub malformed: u64,
    /// Frames and alerts of runs that are not the one that is received, or whose description had not come.
    pub foreign: u64,
    /// Frames that had come already, or that came after later ones.
    pub not_new: u64,
    /// Frames, descriptions and alerts that came faster than any source sends them.
    pub too_fast: u64,
    /// Alerts published.
    pub alerts: u64,
    /// Commands passed on to the other side.
    pub commands: u64,
    /// From the coming of each frame to its place on the bus, in microseconds.
    pub handling_us: Percentiles,
}
