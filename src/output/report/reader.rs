//! The lines of the commands that read frames: `record`, `export`, `bridge psn` and `bridge osc`, `latency`.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::output::histogram::Percentiles;
use crate::recording::Flaws;
use crate::recording::export::ExportCounts;

/// A line of `record`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum RecordLine {
    /// The file is open.
    Started {
        /// The file.
        file: PathBuf,
    },
    /// Something that may go wrong later.
    Warning {
        /// What.
        message: String,
    },
    /// The recorder has ended.
    Summary(RecordSummary),
}

/// What a recorder wrote.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RecordSummary {
    /// Frames written.
    pub frames: u64,
    /// Frames lost between the first and the last one written.
    pub lost: u64,
    /// Alerts written.
    pub alerts: u64,
    /// Events of commands written.
    #[serde(default)]
    pub commands: u64,
    /// Events of commands lost, those from long before the recording began included.
    #[serde(default)]
    pub commands_lost: u64,
    /// Bytes written.
    pub bytes: u64,
    /// Files that were removed to stay under the allowed total.
    pub removed: u64,
    /// The files that are there, oldest first.
    pub files: Vec<PathBuf>,
}

/// What `export` wrote.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ExportReport {
    /// The file.
    pub file: PathBuf,
    /// How much of the recording is in it.
    #[serde(flatten)]
    pub counts: ExportCounts,
    /// What could not be read of the recording.
    #[serde(flatten)]
    pub flaws: Flaws,
}

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
