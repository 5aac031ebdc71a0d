//! The token, and the rights of a request that contains it.

use std::fmt;
use std::str::FromStr;

use axum::extract::Request;
use axum::http::HeaderMap;
use axum::http::header::{AUTHORIZATION, SEC_WEBSOCKET_PROTOCOL};
use rustix::rand::{GetRandomFlags, getrandom};
use subtle::ConstantTimeEq as _;

/// Prefix of the WebSocket protocol that contains the token. A page cannot set other headers when it opens its stream.
const TOKEN_PROTOCOL: &str = "bench-dragon.token.";
/// Header that contains the token in all other requests. So `Authorization` stays free for a proxy with a password.
const TOKEN_HEADER: &str = "x-bench-dragon-token";

/// The access rules of a view.
#[derive(Clone, Debug)]
pub(super) struct Access {
    pub(super) token: Token,
    pub(super) is_read_only: bool,
    /// Whether viewing needs the token too, because other machines can reach the address.
    pub(super) is_exposed: bool,
}

/// The token of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shown<'a> {
    /// The request shows none.
    Nothing,
    /// The request shows the right one.
    Right,
    /// The request shows this one, which is wrong.
    Wrong(&'a str),
}

/// The rights of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::display) struct Rights {
    pub(in crate::display) has_token: bool,
    pub(in crate::display) may_view: bool,
    pub(in crate::display) may_control: bool,
}

impl Access {
    /// Derives a request's rights from its headers.
    pub(super) fn rights(&self, headers: &HeaderMap) -> Rights {
        let has_token = self.token_of(headers) == Shown::Right;
        Rights { has_token, may_view: has_token || !self.is_exposed, may_control: has_token && !self.is_read_only }
    }

    /// Compares the tokens that a request shows.
    pub(super) fn token_of<'a>(&self, headers: &'a HeaderMap) -> Shown<'a> {
        let mut wrong = Shown::Nothing;
        for shown in shown(headers) {
            if self.token.is(shown) {
                return Shown::Right;
            }
            wrong = Shown::Wrong(shown);
        }
        wrong
    }
}

/// Whether a request shows a token, right or wrong.
pub(super) fn shows_token(headers: &HeaderMap) -> bool {
    shown(headers).next().is_some()
}

/// The tokens that a request contains.
fn shown(headers: &HeaderMap) -> impl Iterator<Item = &str> {
    let bearers = texts(headers, AUTHORIZATION.as_str()).filter_map(bearer);
    let offered = texts(headers, SEC_WEBSOCKET_PROTOCOL.as_str()).flat_map(|text| text.split(',')).map(str::trim);
    let protocols = offered.filter_map(|protocol| protocol.strip_prefix(TOKEN_PROTOCOL));
    texts(headers, TOKEN_HEADER).chain(bearers).chain(protocols)
}

/// Moves a token from the query of a request into a header. Some programs can only be given an address.
pub(super) fn take_token_of_query(request: &mut Request) {
    let parts = request.uri().query().into_iter().flat_map(|query| query.split('&'));
    let token = parts.filter_map(|part| part.strip_prefix("token=")).find_map(|token| token.parse().ok());
    if let Some(token) = token {
        request.headers_mut().append(TOKEN_HEADER, token);
    }
}

/// The values of a header that are text.
fn texts<'a>(headers: &'a HeaderMap, name: &'static str) -> impl Iterator<Item = &'a str> {
    headers.get_all(name).iter().filter_map(|value| value.to_str().ok())
}

/// The token of an `Authorization` header. The scheme's name may have any case.
fn bearer(authorization: &str) -> Option<&str> {
    let (scheme, token) = authorization.split_once(' ')?;
    scheme.eq_ignore_ascii_case("bearer").then(|| token.trim_start_matches(' '))
}

/// Random bytes in a token.
const RANDOM_BYTES: usize = size_of::<u128>();
/// Allowed lengths of a token that a user chooses.
const LENGTHS: std::ops::RangeInclusive<usize> = 16..=128;

/// A secret of letters, digits, - and _, which is valid in an address and in a header.
#[derive(Clone)]
pub struct Token(String);

/// The error of a text that is no valid token.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("must be {} to {} characters of A-Z, a-z, 0-9, - and _", LENGTHS.start(), LENGTHS.end())]
pub struct TokenError;

impl Token {
    /// Returns a new token of 128 random bits.
    ///
    /// # Errors
    /// The kernel's reason if it has no random bytes.
    pub fn random() -> std::io::Result<Self> {
        let mut bytes = [0; RANDOM_BYTES];
        let mut filled = 0;
        while filled < bytes.len() {
            filled += getrandom(&mut bytes[filled..], GetRandomFlags::empty())?;
        }
        Ok(Self(format!("{:032x}", u128::from_be_bytes(bytes))))
    }

    /// Whether a text equals this token. The comparison takes the same time for every text of the same length.
    pub fn is(&self, shown: &str) -> bool {
        self.0.as_bytes().ct_eq(shown.as_bytes()).into()
    }

    /// The token itself, for operators.
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
    /// Omits the secret.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("Token")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(name: &'static str, value: &str) -> HeaderMap {
        HeaderMap::from_iter([(name.parse().expect("a name"), value.parse().expect("a value"))])
    }

    #[test]
    fn commands_need_the_token_and_viewing_needs_it_on_an_exposed_address() {
        let token: Token = "0123456789abcdef".parse().expect("a token");
        let local = Access { token, is_read_only: false, is_exposed: false };
        let exposed = Access { is_exposed: true, ..local.clone() };
        let read_only = Access { is_read_only: true, ..local.clone() };
        let rights = |has_token, may_view, may_control| Rights { has_token, may_view, may_control };
        for known in [
            headers("authorization", "Bearer 0123456789abcdef"),
            headers("authorization", "bearer 0123456789abcdef"),
            headers("x-bench-dragon-token", "0123456789abcdef"),
            headers("sec-websocket-protocol", "bench-dragon.view.v1, bench-dragon.token.0123456789abcdef"),
        ] {
            assert_eq!(local.rights(&known), rights(true, true, true));
            assert_eq!(exposed.rights(&known), rights(true, true, true));
            assert_eq!(read_only.rights(&known), rights(true, true, false));
        }
        for unknown in [
            HeaderMap::new(),
            headers("authorization", "Bearer 0123456789abcdeF"),
            headers("authorization", "0123456789abcdef"),
            headers("authorization", "Basic 0123456789abcdef"),
            headers("x-bench-dragon-token", "0123456789abcdeF"),
            headers("sec-websocket-protocol", "0123456789abcdef"),
        ] {
            assert_eq!(local.rights(&unknown), rights(false, true, false));
            assert_eq!(exposed.rights(&unknown), rights(false, false, false));
        }
    }

    #[test]
    fn each_new_token_is_different_and_equals_only_itself() {
        let [one, other] = [(); 2].map(|()| Token::random().expect("random bytes"));
        assert_ne!(one.secret(), other.secret());
        assert!(one.is(one.secret()) && !one.is(other.secret()) && !one.is("") && !one.is(&one.secret()[1..]));
        assert_eq!(one.secret().parse::<Token>().map(|token| one.is(token.secret())), Ok(true));
    }

    #[test]
    fn a_chosen_token_is_long_and_valid_in_an_address() {
        for bad in ["", "short", "0123456789abcde", "0123456789abcdef#", "0123456789abcdeé", &"a".repeat(129)] {
            assert_eq!(bad.parse::<Token>().map(|_| ()), Err(TokenError), "{bad}");
        }
        assert_eq!(TokenError.to_string(), "must be 16 to 128 characters of A-Z, a-z, 0-9, - and _");
    }

    #[test]
    fn debug_output_omits_the_token() {
        let token = Token::random().expect("random bytes");
        assert!(!format!("{token:?}").contains(token.secret()));
    }
}
