//! The name under which a desk lists a sender.

use std::fmt;
use std::str::FromStr;

/// 1 to 64 printable ASCII characters, blanks among them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SystemName(String);

/// Why a text is no system name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("must be 1 to {} printable ASCII characters", SystemName::MAX_LEN)]
pub struct SystemNameError;

impl SystemName {
    /// Most bytes of a name.
    pub const MAX_LEN: usize = 64;

    /// The name.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl FromStr for SystemName {
    type Err = SystemNameError;

    fn from_str(name: &str) -> Result<Self, SystemNameError> {
        let is_allowed =
            (1..=Self::MAX_LEN).contains(&name.len()) && name.bytes().all(|byte| (b' '..=b'~').contains(&byte));
        if is_allowed { Ok(Self(name.to_owned())) } else { Err(SystemNameError) }
    }
}

impl fmt::Display for SystemName {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(&self.0)
    }
}
