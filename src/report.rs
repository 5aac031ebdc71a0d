//! What the processes say of themselves: the JSON lines that they print, and that `show` reads.
//!
//! Each line is one object whose `type` tells which. Times are seconds of show time, lengths metres.

use std::fmt;
use std::net::SocketAddr;
use std::path::PathBuf;

use bench_dragon_ipc::Alert;
use serde::{Deserialize, Serialize};

use crate::export::{ExportCounts, Flaws};
use crate::histogram::Percentiles;
use crate::replay::{PassSummary, ReplaySummary};
use crate::server::{ServerSummary, TimecodeNews};
use crate::timecode::{Event, TimecodeCounts};

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

/// What happened to the timecode that a show follows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimecodeLine {
    /// What.
    pub event: TimecodeEvent,
    /// The timecode's position.
    pub position_s: f64,
    /// Show time at which it was noticed.
    pub time_s: f64,
}

/// How a timecode is from now on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TimecodeEvent {
    /// It runs, and the show follows.
    Follows,
    /// It stands, and the show with it.
    Stands,
    /// It is lost: the show goes on by itself, unless it stood.
    Lost,
}

impl From<&TimecodeNews> for TimecodeLine {
    fn from(news: &TimecodeNews) -> Self {
        let (event, position_s) = match news.event {
            Event::Follows { position_s } => (TimecodeEvent::Follows, position_s),
            Event::Stands { position_s } => (TimecodeEvent::Stands, position_s),
            Event::Lost { position_s } => (TimecodeEvent::Lost, position_s),
        };
        Self { event, position_s, time_s: news.sim_time_s }
    }
}

impl fmt::Display for TimecodeLine {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { event, position_s, time_s } = self;
        match event {
            TimecodeEvent::Follows => {
                write!(formatter, "timecode {position_s:.3} s runs: the show follows from {time_s:.3} s")
            }
            TimecodeEvent::Stands => {
                write!(formatter, "timecode {position_s:.3} s stands: so does the show at {time_s:.3} s")
            }
            TimecodeEvent::Lost => {
                write!(
                    formatter,
                    "timecode is lost, last at {position_s:.3} s: the show is by itself from {time_s:.3} s"
                )
            }
        }
    }
}

/// A line of `monitor`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum MonitorLine {
    /// Something happened.
    Alert(AlertLine),
    /// How it stands.
    Progress(MonitorProgress),
    /// The guard holds the head where no further ground can ever be granted.
    Guard(GuardReport),
    /// The monitor has ended.
    Summary(MonitorSummary),
}

/// An alert.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AlertLine {
    /// What happened, in lower case.
    pub kind: String,
    /// Show time.
    pub time_s: f64,
    /// First tick at which it was so.
    pub tick: u64,
    /// The run's number.
    pub run_id: u64,
    /// The two benches, or null where it is about no pair.
    pub benches: Option<[u32; 2]>,
    /// Their clearance, or null.
    pub clearance_m: Option<f64>,
    /// Point midway between the two boards, or null.
    pub point_m: Option<[f64; 2]>,
    /// Show time of the forecast contact, or null.
    pub forecast_s: Option<f64>,
}

impl From<&Alert> for AlertLine {
    fn from(alert: &Alert) -> Self {
        let pair = alert.pair();
        Self {
            kind: alert.alert_kind().map_or_else(|| format!("kind {}", alert.kind), |kind| kind.to_string()),
            time_s: alert.sim_time_ns as f64 * 1e-9,
            tick: alert.tick,
            run_id: alert.run_id,
            benches: pair,
            clearance_m: pair.map(|_| alert.clearance_m),
            point_m: pair.map(|_| alert.point_m),
            forecast_s: alert.forecast(),
        }
    }
}

/// How a monitor stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MonitorProgress {
    /// Frames read.
    pub frames: u64,
    /// Frames lost between the first and the last one read.
    pub lost: u64,
    /// Least clearance in the last frame; null before the first one.
    pub clearance_m: Option<f64>,
    /// Show time of the forecast contact; null where none is known.
    pub forecast_s: Option<f64>,
}

/// What a monitor saw.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MonitorSummary {
    /// Frames read.
    pub frames: u64,
    /// Frames lost between the first and the last one read.
    pub lost: u64,
    /// First contact, or null.
    pub contact: Option<ContactReport>,
    /// Least clearance of all frames; null where there was no frame.
    pub least_clearance: Option<ClearanceReport>,
    /// Where its guard held the head for good; null where it did not.
    pub guard: Option<GuardReport>,
    /// Times at which a guard found that a frame did not agree with the published description.
    pub faults: u64,
    /// From the instant a frame was due to the instant it was read, in microseconds.
    pub latency_us: Percentiles,
}

/// Where a guard held the head for good.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GuardReport {
    /// Show time.
    pub held_at_s: f64,
    /// Least clearance there; null with fewer than three benches.
    pub clearance_m: Option<f64>,
    /// Show time at which two benches would have touched at the planned speed; null where they would not.
    pub forecast_contact_s: Option<f64>,
}

/// A contact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContactReport {
    /// Show time.
    pub time_s: f64,
    /// The two benches.
    pub benches: [u32; 2],
}

/// A clearance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClearanceReport {
    /// Show time.
    pub time_s: f64,
    /// The two benches.
    pub benches: [u32; 2],
    /// The clearance.
    pub clearance_m: f64,
}

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
    /// Bytes written.
    pub bytes: u64,
    /// Files that were removed to stay under the allowed total.
    pub removed: u64,
    /// The files that are there, oldest first.
    pub files: Vec<PathBuf>,
}

/// A line of `replay`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum ReplayLine {
    /// The services of a pass are there.
    Started {
        /// The number of the run that it is on the bus.
        run_id: u64,
        /// The number of the run that was recorded.
        recorded_run_id: u64,
    },
    /// A pass has ended.
    Pass(PassSummary),
    /// The replay has ended.
    Summary(ReplaySummary),
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
    /// From the instant a frame was due to the instant every handle had been read, in microseconds.
    pub due_us: Percentiles,
    /// From the instant a frame was sent to the instant every handle had been read, in microseconds.
    pub sent_us: Percentiles,
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
    /// From each release to the start of its tick, in microseconds.
    pub lateness_us: Percentiles,
    /// From the instant a frame was due to the instant the monitor had read it, in microseconds.
    pub latency_us: Percentiles,
    /// Releases that the server skipped.
    pub overruns: u64,
    /// Processes that were started again.
    pub restarts: Restarts,
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

/// How often each process was started again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Restarts {
    /// The server.
    pub serve: u32,
    /// The monitor.
    pub monitor: u32,
    /// The recorder.
    pub record: u32,
}
