//! Result of one reader in one turn, and its encoding for the parent process.

use serde::{Deserialize, Serialize};

use crate::arrival::Arrival;

/// Latencies in nanoseconds, in the order of arrival.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Outcome {
    pub(crate) due_ns: Vec<u64>,
    pub(crate) sent_ns: Vec<u64>,
    /// Frames of the turn that did not arrive.
    pub(crate) lost: u64,
}

impl Outcome {
    pub(crate) fn of(arrivals: &[Arrival], frames: u64) -> Self {
        Self {
            due_ns: arrivals.iter().map(|arrival| arrival.read_ns - arrival.header.scheduled_ns).collect(),
            sent_ns: arrivals.iter().map(|arrival| arrival.read_ns - arrival.header.published_ns).collect(),
            lost: frames - arrivals.len() as u64,
        }
    }

    pub(crate) fn to_json(&self) -> String {
        serde_json::to_string(self).expect("numbers are valid JSON")
    }

    pub(crate) fn from_json(text: &str) -> Self {
        serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
    }
}
