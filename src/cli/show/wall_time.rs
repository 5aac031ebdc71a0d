//! Wall times of a show's report, and of the lines of its log.

use std::fmt;

use bench_dragon_ipc::CommandEvent;
use jiff::tz::TimeZone;
use jiff::{Timestamp, Zoned};
use serde::{Serialize, Serializer};

use crate::cli::print::print_to_stderr;

/// A wall time. Printed, and in JSON, it is RFC 3339 in UTC with milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct WallTime(Timestamp);

impl WallTime {
    pub(super) fn now() -> Self {
        Self(Timestamp::now())
    }

    /// The time at which a source took a command.
    pub(super) fn of(event: &CommandEvent) -> Self {
        // Cannot fail: nanoseconds in an i64 span 292 years, a timestamp spans thousands.
        Self(Timestamp::from_nanosecond(event.wall_ns.into()).unwrap_or_default())
    }

    /// The time that a text names; `None` if it is no time.
    pub(super) fn parse(text: &str) -> Option<Self> {
        text.parse().ok().map(Self)
    }

    /// Seconds from another time to this one; negative if this one is earlier.
    pub(super) fn seconds_since(self, other: Self) -> f64 {
        self.0.duration_since(other.0).as_secs_f64()
    }

    /// The time in the time zone of this machine.
    pub(super) fn local(self) -> Zoned {
        self.0.to_zoned(TimeZone::system())
    }
}

impl fmt::Display for WallTime {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{:.3}", self.0)
    }
}

impl Serialize for WallTime {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// Prints a line of the show's log on stderr. It begins with the wall time in the time zone of this machine.
pub(super) fn log(line: &str) {
    print_to_stderr(&format!("{}  {line}", WallTime::now().local().strftime("%H:%M:%S")));
}
