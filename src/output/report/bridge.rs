//! What a bridge to a desk says.

use serde::{Deserialize, Serialize};

/// A line of `bridge psn` and `bridge osc`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum BridgeLine {
    /// There is a server, and the first frame is about to be sent.
    Started {
        /// The receiver.
        to: String,
        /// The instant of `CLOCK_MONOTONIC` from which the bridge's own timestamps count.
        epoch_ns: u64,
    },
    /// Sending has begun to fail, or works again.
    Notice {
        /// What.
        message: String,
    },
    /// No frame has come for too long: the last one is sent as stale.
    Silent {
        /// How long ago it was sent by the server.
        age_s: f64,
    },
    /// Frames come again.
    Resumed,
    /// The bridge has ended.
    Summary(BridgeSummary),
}

/// What a bridge sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BridgeSummary {
    /// Frames sent.
    pub frames: u64,
    /// Those of them that told a frame of the bus again which was too old to be believed.
    pub stale: u64,
    /// Packets handed over to the network.
    pub packets: u64,
    /// Their bytes.
    pub bytes: u64,
    /// Sends that failed.
    pub errors: u64,
    /// Frames left out because the receiver had not taken the one before.
    pub dropped: u64,
    /// Releases that passed while the bridge was busy.
    pub missed: u64,
}
