//! What a server says of the timecode that it follows.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::source::server::TimecodeNews;
use crate::source::timecode::FollowerEvent;

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
