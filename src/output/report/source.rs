//! The lines of the commands that publish frames, `serve` and `replay`, and of `timecode` and `verify`, which share them.

use std::fmt;
use std::net::SocketAddr;

use serde::{Deserialize, Serialize};

use crate::source::replay::verify::{FlawedFile, RunVerification};
use crate::source::replay::{PassSummary, ReplaySummary};
use crate::source::server::{ServerSummary, TimecodeNews};
use crate::source::timecode::{FollowerEvent, TimecodeCounts};

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
    /// Whether an operator's pause or hold keeps the show standing meanwhile.
    pub stopped: bool,
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
            FollowerEvent::Follows { position_s } => (TimecodeEvent::Follows, position_s),
            FollowerEvent::Stands { position_s } => (TimecodeEvent::Stands, position_s),
            FollowerEvent::Lost { position_s } => (TimecodeEvent::Lost, position_s),
        };
        Self { event, position_s, time_s: news.sim_time_s, stopped: news.is_stopped }
    }
}

impl fmt::Display for TimecodeLine {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { event, position_s, time_s, stopped } = self;
        let timecode = match event {
            TimecodeEvent::Follows => format!("timecode {position_s:.3} s runs"),
            TimecodeEvent::Stands => format!("timecode {position_s:.3} s stands"),
            TimecodeEvent::Lost => format!("timecode is lost, last at {position_s:.3} s"),
        };
        let show = match event {
            _ if *stopped => format!("the show stays paused or held at {time_s:.3} s"),
            TimecodeEvent::Follows => format!("the show follows from {time_s:.3} s"),
            TimecodeEvent::Stands => "so does the show".to_owned(),
            TimecodeEvent::Lost => format!("the show is by itself from {time_s:.3} s"),
        };
        write!(formatter, "{timecode}: {show}")
    }
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
    /// A run has been verified, or not.
    Run(RunVerification),
    /// The verification has ended.
    Verification(VerificationSummary),
}

/// What the verification of a recording came to.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct VerificationSummary {
    /// Whether every frame of the recording is as simulated.
    pub verified: bool,
    /// Runs in the recording.
    pub runs: u64,
    /// Their frames.
    pub frames: u64,
    /// Frames that are as simulated.
    pub frames_verified: u64,
    /// Whether it was broken off.
    pub interrupted: bool,
    /// The files that could not be read whole.
    pub flawed: Vec<FlawedFile>,
}
