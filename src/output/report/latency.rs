//! What was measured of a bus.

use serde::{Deserialize, Serialize};

use crate::output::histogram::Percentiles;

/// What `latency` measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LatencyReport {
    /// Frames read.
    pub frames: u64,
    /// Frames lost between the first and the last one read.
    pub lost: u64,
    /// How often another run followed.
    pub restarts: u64,
    /// How long it measured.
    pub seconds: f64,
    /// How it came to know of a frame.
    pub mode: ReadMode,
    /// From the instant a frame was due to the instant every handle had been read, in microseconds; none where no frame
    /// was read.
    pub due_us: Option<Percentiles>,
    /// The same from the instant a frame was sent.
    pub sent_us: Option<Percentiles>,
}

/// How a reader comes to know of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ReadMode {
    /// It looks all the time.
    Polling,
    /// It sleeps until it is woken.
    Woken,
}
