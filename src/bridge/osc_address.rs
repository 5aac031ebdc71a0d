//! Addresses of OSC messages.

use std::fmt;
use std::str::FromStr;

use rosc::address::verify_address;

use crate::config::NamedLayout;

/// Placeholder for a bench's number.
const INDEX: &str = "{index}";
/// Placeholder for the dragon's name.
const DRAGON: &str = "{dragon}";
/// The name of a dragon that has none.
const NAMELESS: &str = "dragon";
/// Longest address in bytes, without a dragon's name of at most 24. It ensures that a message fits into any datagram.
const MAX_LEN: usize = 200;

/// The address of a bench's message, with `{index}` for the bench's number and `{dragon}` for the dragon's name.
///
/// Of several dragons, `{index}` is the bench's number within its dragon. A pattern without `{dragon}` then has the name as its
/// second part.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AddressPattern {
    pattern: String,
    dragons: NamedLayout,
}

/// The address of the show's message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShowAddress(String);

/// Error for a text that is not an address.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AddressError {
    /// The text is not a valid OSC address.
    #[error("must begin with /, have no space and none of #*,?[]{{}} in its parts, and at most {MAX_LEN} characters")]
    Address,
    /// All benches would have the same address.
    #[error("must contain {INDEX} for the bench's number, such as /dragon/bench/{INDEX}")]
    NoIndex,
}

impl AddressPattern {
    /// The same pattern for these dragons.
    #[must_use]
    pub fn of(&self, dragons: &NamedLayout) -> Self {
        let mut pattern = self.pattern.clone();
        if dragons.are_named() && !pattern.contains(DRAGON) {
            let second = pattern[1..].find('/').map_or(pattern.len(), |length| length + 1);
            pattern.insert_str(second, &format!("/{DRAGON}"));
        }
        Self { pattern, dragons: dragons.clone() }
    }

    /// Returns the address of a bench's message.
    ///
    /// ```
    /// use bench_dragon::bridge::osc::AddressPattern;
    ///
    /// let pattern: AddressPattern = "/stage/{index}/pose".parse()?;
    /// assert_eq!(pattern.of_bench(7), "/stage/7/pose");
    /// let dragons = bench_dragon::config::NamedLayout::of_toml("[[dragons]]\nname = \"gold\"\nbenches = 40\n");
    /// assert_eq!(pattern.of(&dragons).of_bench(7), "/stage/gold/7/pose");
    /// # Ok::<(), bench_dragon::bridge::osc::AddressError>(())
    /// ```
    pub fn of_bench(&self, index: usize) -> String {
        let (dragon, index) = self.dragons.place(index).unwrap_or((NAMELESS, index));
        self.pattern.replace(INDEX, &index.to_string()).replace(DRAGON, dragon)
    }

    /// Whether `show` is also the address of some bench's message.
    pub fn is_bench(&self, show: &ShowAddress) -> bool {
        let mut numbers =
            show.0.split(|character: char| !character.is_ascii_digit()).filter_map(|part| part.parse().ok());
        numbers.any(|index| self.of_bench(index) == show.0)
    }
}

impl FromStr for AddressPattern {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        if !text.contains(INDEX) {
            return Err(AddressError::NoIndex);
        }
        check(&text.replace(INDEX, &usize::MAX.to_string()).replace(DRAGON, NAMELESS))?;
        Ok(Self { pattern: text.to_owned(), dragons: NamedLayout::default() })
    }
}

impl FromStr for ShowAddress {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        check(text)?;
        Ok(Self(text.to_owned()))
    }
}

impl fmt::Display for AddressPattern {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(&self.pattern)
    }
}

impl fmt::Display for ShowAddress {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(&self.0)
    }
}

fn check(address: &str) -> Result<(), AddressError> {
    let is_address = address.len() <= MAX_LEN && verify_address(address).is_ok();
    if is_address { Ok(()) } else { Err(AddressError::Address) }
}
