//! What a server says.

use std::net::SocketAddr;

use serde::{Deserialize, Serialize};

use super::TimecodeLine;
use crate::source::server::ServerSummary;
use crate::source::timecode::TimecodeCounts;

/// A line of `serve`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum ServeLine {
    /// The services are there.
    Started {
        /// The run's number.
        run_id: u64,
    },
    /// The server listens for timecode.
    Listening {
        /// Where.
        listen: SocketAddr,
    },
    /// Something happened to the timecode that it follows.
    Timecode(TimecodeLine),
    /// What came of timecode, at the end.
    TimecodeSummary(TimecodeCounts),
    /// The server has ended.
    Summary(ServerSummary),
}
