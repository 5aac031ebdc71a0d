//! The keys under which a source is found.

use std::fmt;
use std::str::FromStr;

use bench_dragon_ipc::Instance;
use zenoh::key_expr::KeyExpr;

/// What all keys of one source begin with: a key expression without wildcards.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeyPrefix(String);

/// A text that is no prefix.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("must be words with / between them, as bench-dragon/stage-left, of any letters but * $ ? #, 200 bytes at most")]
pub struct KeyPrefixError;

impl KeyPrefix {
    const MAX_LEN: usize = 200;

    /// The usual one of an instance's source.
    pub fn of(instance: &Instance) -> Self {
        Self(format!("bench-dragon/{instance}"))
    }

    /// Every frame, or as many as are sent.
    pub fn frames(&self) -> String {
        format!("{self}/frames")
    }

    /// Every alert.
    pub fn alerts(&self) -> String {
        format!("{self}/alerts")
    }

    /// The description: put where it changes, and answered to whoever asks.
    pub fn description(&self) -> String {
        format!("{self}/description")
    }

    /// Commands, which are asked for and answered.
    pub fn commands(&self) -> String {
        format!("{self}/commands")
    }

    /// The liveliness token that is there while a source is.
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
