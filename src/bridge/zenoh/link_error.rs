//! Why there is no way to other machines.

use std::fmt;
use std::io;
use std::path::PathBuf;

/// Why there is no session.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LinkError {
    /// The configuration file cannot be read.
    #[error("cannot read {}: {error}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        error: io::Error,
    },
    /// It is no JSON5, or not a configuration of zenoh's.
    #[error("{} is no configuration of zenoh's: {reason}", path.display())]
    Config {
        /// The file.
        path: PathBuf,
        /// zenoh's reason.
        reason: String,
    },
    /// The flags make no configuration.
    #[error("these settings are none for zenoh: {reason}")]
    Settings {
        /// zenoh's reason.
        reason: String,
    },
    /// A client has to be told of whom.
    #[error("a client needs somebody to connect to: --connect ENDPOINT, or connect.endpoints in the configuration")]
    Nowhere,
    /// Listening, or what that takes, did not work.
    #[error("zenoh cannot be opened: {reason}")]
    Open {
        /// zenoh's reason.
        reason: String,
    },
    /// The session has been closed, or takes no more.
    #[error("zenoh: {reason}")]
    Session {
        /// zenoh's reason.
        reason: String,
    },
}

impl LinkError {
    /// Whether the arguments or the configuration are to blame.
    pub fn is_bad_input(&self) -> bool {
        matches!(self, Self::Read { .. } | Self::Config { .. } | Self::Settings { .. } | Self::Nowhere)
    }

    pub(super) fn session(error: impl fmt::Display) -> Self {
        Self::Session { reason: one_line(error) }
    }
}

/// zenoh's errors name the place in its sources, and go over several lines.
pub(super) fn one_line(error: impl fmt::Display) -> String {
    let text = error.to_string();
    let text = text.split(" at /").next().unwrap_or_default();
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ").trim_end_matches('.').to_owned();
    let is_cut = line.matches('[').count() > line.matches(']').count();
    if is_cut { line + "]" } else { line }
}
