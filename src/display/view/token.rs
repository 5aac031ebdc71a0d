//! The word that a page has to know to steer.

use std::fmt;
use std::str::FromStr;

use rustix::rand::{GetRandomFlags, getrandom};
use subtle::ConstantTimeEq as _;

/// Bytes of chance in a token.
const RANDOM_BYTES: usize = size_of::<u128>();
/// Lengths that a token of one's own may have.
const LENGTHS: std::ops::RangeInclusive<usize> = 16..=128;

/// A secret of letters and digits, which fits into an address and into a header.
#[derive(Clone)]
pub struct Token(String);

/// Why a text is no token.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("must be {} to {} of A-Z, a-z, 0-9, - and _", LENGTHS.start(), LENGTHS.end())]
pub struct TokenError;

impl Token {
    /// A new one, of 128 bits of chance.
    ///
    /// # Errors
    /// The kernel's reason for having none.
    pub fn random() -> std::io::Result<Self> {
        let mut bytes = [0; RANDOM_BYTES];
        let mut filled = 0;
        while filled < bytes.len() {
            filled += getrandom(&mut bytes[filled..], GetRandomFlags::empty())?;
        }
        Ok(Self(format!("{:032x}", u128::from_be_bytes(bytes))))
    }

    /// Whether this is what somebody has shown. Takes as long for a word that is nearly right as for any other.
    pub fn is(&self, shown: &str) -> bool {
        self.0.as_bytes().ct_eq(shown.as_bytes()).into()
    }

    /// The token itself, to be told to whoever may steer.
    pub fn secret(&self) -> &str {
        &self.0
    }
}

impl FromStr for Token {
    type Err = TokenError;

    fn from_str(text: &str) -> Result<Self, TokenError> {
        let is_plain = text.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'-' || byte == b'_');
        if is_plain && LENGTHS.contains(&text.len()) { Ok(Self(text.to_owned())) } else { Err(TokenError) }
    }
}

impl fmt::Debug for Token {
    /// Without the secret.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("Token")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_new_token_is_another_one_and_is_recognised_by_itself_alone() {
        let [one, other] = [(); 2].map(|()| Token::random().expect("chance"));
        assert_ne!(one.secret(), other.secret());
        assert!(one.is(one.secret()) && !one.is(other.secret()) && !one.is("") && !one.is(&one.secret()[1..]));
        assert_eq!(one.secret().parse::<Token>().map(|token| one.is(token.secret())), Ok(true));
    }

    #[test]
    fn a_token_of_ones_own_is_long_and_fits_into_an_address() {
        for bad in ["", "short", "0123456789abcde", "0123456789abcdef#", "0123456789abcdeé", &"a".repeat(129)] {
            assert_eq!(bad.parse::<Token>().map(|_| ()), Err(TokenError), "{bad}");
        }
        assert_eq!(TokenError.to_string(), "must be 16 to 128 of A-Z, a-z, 0-9, - and _");
    }

    #[test]
    fn a_token_is_not_printed_by_mistake() {
        let token = Token::random().expect("chance");
        assert!(!format!("{token:?}").contains(token.secret()));
    }
}
