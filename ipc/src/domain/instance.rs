//! Name of an instance.

use core::fmt;
use core::str::FromStr;

use super::domain_error::{DomainError, MAX_INSTANCE_LEN};

/// Name of an instance: 1 to 24 characters of a–z, 0–9 and -.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Instance(String);

impl Instance {
    /// Greatest length of a name, in characters.
    pub const MAX_LEN: usize = MAX_INSTANCE_LEN;

    /// Checks a name.
    ///
    /// # Errors
    /// [`DomainError::InvalidInstance`] where the name is not 1 to 24 characters of a–z, 0–9 and -.
    pub fn new(name: &str) -> Result<Self, DomainError> {
        let allowed = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'-';
        if name.is_empty() || name.len() > Self::MAX_LEN || !name.bytes().all(allowed) {
            return Err(DomainError::InvalidInstance { name: name.to_owned() });
        }
        Ok(Self(name.to_owned()))
    }

    /// The name as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl Default for Instance {
    fn default() -> Self {
        Self("dragon".to_owned())
    }
}

impl fmt::Display for Instance {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(&self.0)
    }
}

impl FromStr for Instance {
    type Err = DomainError;

    fn from_str(name: &str) -> Result<Self, DomainError> {
        Self::new(name)
    }
}
