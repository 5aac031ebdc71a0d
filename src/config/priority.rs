//! The scheduling policy and priority that the server's loop asks for.

use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// Priorities of the kernel's real-time policies.
pub const REAL_TIME_PRIORITY: RangeInclusive<u8> = 1..=99;

/// How the kernel is to schedule the server's loop. Written `other`, `fifo:80` or `rr:80`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Priority {
    /// As any other program.
    #[default]
    Other,
    /// `SCHED_FIFO`: before every program of a lower priority, until it waits.
    Fifo(u8),
    /// `SCHED_RR`: the same, taking turns with programs of the same priority.
    RoundRobin(u8),
}

/// Text that is no priority.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("must be other, fifo:N or rr:N, N from {} to {}", REAL_TIME_PRIORITY.start(), REAL_TIME_PRIORITY.end())]
pub struct PriorityError;

impl Priority {
    /// The priority among real-time programs; `None` where it is not one of them.
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
    fn what_the_kernel_does_not_know_is_no_priority() {
        for text in ["", "fifo", "fifo:", "fifo:0", "fifo:100", "rr:-1", "idle:5", "FIFO:80", "fifo:80 ", "80"] {
            assert_eq!(text.parse::<Priority>(), Err(PriorityError), "{text:?}");
        }
    }
}
