//! Addresses of OSC messages.

use std::fmt;
use std::str::FromStr;

use rosc::address::verify_address;

/// What stands for a bench's number.
const INDEX: &str = "{index}";
/// Most bytes of an address, so that a message fits into any datagram.
const MAX_LEN: usize = 200;

/// The address of a bench's message, with `{index}` for the bench's number.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AddressPattern(String);

/// The address of the show's message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShowAddress(String);

/// Why a text is no address.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AddressError {
    /// It is not what OSC calls an address.
    #[error("must begin with /, have no blank and none of #*,?[]{{}} in its parts, and at most {MAX_LEN} characters")]
    Address,
    /// All benches would have the same address.
    #[error("must have {INDEX} in it, for the bench's number, as /dragon/bench/{INDEX}")]
    NoIndex,
}

impl AddressPattern {
    /// The address of a bench.
    ///
    /// ```
    /// use bench_dragon::bridge::osc::AddressPattern;
    ///
    /// let pattern: AddressPattern = "/stage/{index}/pose".parse()?;
    /// assert_eq!(pattern.of_bench(7), "/stage/7/pose");
    /// # Ok::<(), bench_dragon::bridge::osc::AddressError>(())
    /// ```
    pub fn of_bench(&self, index: usize) -> String {
        self.0.replace(INDEX, &index.to_string())
    }

    /// Whether the show's message would have the address of a bench's.
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
        check(&text.replace(INDEX, &usize::MAX.to_string()))?;
        Ok(Self(text.to_owned()))
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
        formatter.pad(&self.0)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_osc_calls_an_address_is_one() {
        let long = format!("/{{index}}/{}", "a".repeat(MAX_LEN));
        let bad = [
            "{index}",
            "/a b/{index}",
            "/{index}/",
            "//{index}",
            "/a#/{index}",
            "/*/{index}",
            "/\u{e9}/{index}",
            &long,
        ];
        for text in bad {
            assert_eq!(text.parse::<AddressPattern>(), Err(AddressError::Address), "{text}");
        }
        assert_eq!("/dragon/bench".parse::<AddressPattern>(), Err(AddressError::NoIndex));
        assert!("/dragon/show".parse::<ShowAddress>().is_ok());
        let benches: AddressPattern = "/{index}/dragon2/bench{index}".parse().expect("an address");
        for (show, is_bench) in [("/7/dragon2/bench7", true), ("/7/dragon2/bench8", false), ("/dragon/show", false)] {
            assert_eq!(benches.is_bench(&show.parse().expect("an address")), is_bench, "{show}");
        }
        assert_eq!("/dragon/{index}".parse::<ShowAddress>(), Err(AddressError::Address));
        assert_eq!(
            "/{index}/{index}".parse::<AddressPattern>().map(|pattern| pattern.of_bench(2)),
            Ok("/2/2".to_owned())
        );
    }
}
