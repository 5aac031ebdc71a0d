//! The keys of a source.

use std::fmt;
use std::str::FromStr;

use bench_dragon_ipc::Instance;
use zenoh::key_expr::KeyExpr;

/// Prefix of all keys of one source: a key expression without wildcards.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeyPrefix(String);

/// Error for a text that is not a prefix.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("must be words separated by /, such as bench-dragon/stage-left, without * $ ? #, at most 200 bytes")]
pub struct KeyPrefixError;

impl KeyPrefix {
    const MAX_LEN: usize = 200;

    /// Returns the default prefix of an instance's source.
    pub fn of(instance: &Instance) -> Self {
        Self(format!("bench-dragon/{instance}"))
    }

    /// Returns the key of the frames.
    pub fn frames(&self) -> String {
        format!("{self}/frames")
    }

    /// Returns the key of the alerts.
    pub fn alerts(&self) -> String {
        format!("{self}/alerts")
    }

    /// Returns the key of the description. The sender publishes each new description, and replies to queries with it.
    pub fn description(&self) -> String {
        format!("{self}/description")
    }

    /// Returns the key of the commands, which are queries.
    pub fn commands(&self) -> String {
        format!("{self}/commands")
    }

    /// Returns the key of the liveliness token, which exists while a source exists.
    pub fn source(&self) -> String {
        format!("{self}/source")
    }
}

impl FromStr for KeyPrefix {
    type Err = KeyPrefixError;

    fn from_str(text: &str) -> Result<Self, KeyPrefixError> {
        let is_plain = text.len() <= Self::MAX_LEN && !text.contains(['*', '$', '?', '#']);
        match KeyExpr::try_from(text) {
            Ok(_) if is_plain => Ok(Self(text.to_owned())),
            _ => Err(KeyPrefixError),
        }
    }
}

impl fmt::Display for KeyPrefix {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(&self.0)
    }
}
