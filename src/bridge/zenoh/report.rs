//! Reports of a bridge: the JSON lines of `bridge zenoh`.

use serde::{Deserialize, Serialize};

use crate::output::histogram::Percentiles;

/// A line of `bridge zenoh`. `run_id` is a run's id on this host, and `remote_run_id` its id on the other host.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
#[expect(missing_docs, reason = "the docs of the type and of the variants explain the fields")]
pub enum ZenohReport {
    /// The session is open: the prefix of its keys, its own endpoints, and the endpoints that it connects to.
    Started { key: String, listens: Vec<String>, connects: Vec<String> },
    /// The bridge begins to send a run: the frames whose tick is a multiple of `every`, and those that change the state.
    Sending { run_id: u64, every: u64 },
    /// The other host has described a run. The bridge receives this run from its next frame on.
    Found { remote_run_id: u64, every: u64 },
    /// The bridge begins to receive a run.
    Receiving { run_id: u64, remote_run_id: u64 },
    /// The bridge cannot publish a run that the other host has described. The current run continues.
    Refused { remote_run_id: u64, reason: String },
    /// No peer is connected, so messages reach no host. The bridge still tries to connect to these endpoints.
    Alone { connects: Vec<String> },
    /// A peer is connected, for the first time or again. So far `unheard` frames have reached no peer.
    Connected { unheard: u64 },
    /// Frames have stopped, for the reason that is visible from this host. `run_id` is null before the first run.
    Silent { run_id: Option<u64>, reason: Silence },
    /// Frames arrive again. `lost` counts the frames of the run that were lost between the hosts so far; in a sending bridge,
    /// all frames that it lost on the bus.
    Resumed { run_id: u64, lost: u64 },
    /// A sending bridge has ended.
    Sent(SenderSummary),
    /// A receiving bridge has ended.
    Received(ReceiverSummary),
}

/// Reason why no frames arrive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Silence {
    /// A source exists according to its liveliness token, so the link is cut or the source has stopped.
    LinkOrSource,
    /// No source has a liveliness token.
    NoSource,
    /// No peer is connected.
    NoConnection,
}

/// Totals of a sending bridge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SenderSummary {
    /// Frames passed to zenoh while a peer was connected.
    pub frames: u64,
    /// Frames passed to zenoh while no peer was connected.
    pub unheard: u64,
    /// Frames of the bus that the bridge read too late: overwritten, or of a run that another run had already followed.
    pub lost: u64,
    /// Alerts passed to zenoh.
    pub alerts: u64,
    /// Commands forwarded to the server.
    pub commands: u64,
    /// Commands and other queries that were refused: malformed, too late, or above the rate limit.
    pub refused: u64,
}

/// Totals of a receiving bridge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReceiverSummary {
    /// Runs received.
    pub runs: u64,
    /// Frames published.
    pub frames: u64,
    /// Frames that the sender selected between the first and the last frame of each run, but that were not published.
    pub lost: u64,
    /// Those of the lost frames that arrived, but were dropped here because the thread of the bus was behind.
    pub dropped: u64,
    /// Payloads that were malformed, or that contradicted the description of their run.
    pub malformed: u64,
    /// Frames and alerts of runs that the bridge does not receive, or whose description had not arrived.
    pub foreign: u64,
    /// Frames that arrived twice, or after later frames.
    pub not_new: u64,
    /// Frames, descriptions and alerts that arrived faster than any source sends them.
    pub too_fast: u64,
    /// Alerts published.
    pub alerts: u64,
    /// Commands sent to the other host.
    pub commands: u64,
    /// Time from the arrival of each frame to its publication on the bus, in microseconds.
    pub handling_us: Percentiles,
}
