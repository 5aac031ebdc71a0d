//! Scheduling policy and priority of the server's loop.

use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// Allowed priorities of the kernel's real-time policies.
pub const REAL_TIME_PRIORITY: RangeInclusive<u8> = 1..=99;

/// Scheduling of the server's loop by the kernel. Its text form is `other`, `fifo:80` or `rr:80`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Priority {
    /// The policy of ordinary programs.
    #[default]
    Other,
    /// `SCHED_FIFO`: runs before every program of a lower priority, until it waits.
    Fifo(u8),
    /// `SCHED_RR`: the same, but takes turns with programs of the same priority.
    RoundRobin(u8),
}

/// Error of a text that is not a priority.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("must be other, fifo:N or rr:N, N from {} to {}", REAL_TIME_PRIORITY.start(), REAL_TIME_PRIORITY.end())]
pub struct PriorityError;

impl Priority {
    /// The real-time priority; `None` for [`Priority::Other`].
    pub fn real_time(self) -> Option<u8> {
        match self {
            Self::Other => None,
            Self::Fifo(level) | Self::RoundRobin(level) => Some(level),
        }
    }
}

impl FromStr for Priority {
    type Err = PriorityError;

    fn from_str(text: &str) -> Result<Self, PriorityError> {
        if text == "other" {
            return Ok(Self::Other);
        }
        let (policy, level) = text.split_once(':').ok_or(PriorityError)?;
        let level = level.parse().ok().filter(|level| REAL_TIME_PRIORITY.contains(level)).ok_or(PriorityError)?;
        match policy {
            "fifo" => Ok(Self::Fifo(level)),
            "rr" => Ok(Self::RoundRobin(level)),
            _ => Err(PriorityError),
        }
    }
}

impl fmt::Display for Priority {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Other => f.write_str("other"),
            Self::Fifo(level) => write!(f, "fifo:{level}"),
            Self::RoundRobin(level) => write!(f, "rr:{level}"),
        }
    }
}

impl TryFrom<String> for Priority {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse().map_err(|error| format!("priority is \"{text}\", {error}"))
    }
}

impl From<Priority> for String {
    fn from(priority: Priority) -> Self {
        priority.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_priority_reads_back_as_it_is_written() {
        for priority in [Priority::Other, Priority::Fifo(1), Priority::Fifo(99), Priority::RoundRobin(80)] {
            assert_eq!(priority.to_string().parse(), Ok(priority));
        }
    }

    #[test]
    fn any_other_text_is_not_a_priority() {
        for text in ["", "fifo", "fifo:", "fifo:0", "fifo:100", "rr:-1", "idle:5", "FIFO:80", "fifo:80 ", "80"] {
            assert_eq!(text.parse::<Priority>(), Err(PriorityError), "{text:?}");
        }
    }
}
