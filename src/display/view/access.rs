//! What a request may do, by what it shows.

use axum::http::HeaderMap;
use axum::http::header::{AUTHORIZATION, SEC_WEBSOCKET_PROTOCOL};

use super::token::Token;

/// How a page shows its token where it can set no header of its own, as it opens its stream.
const TOKEN_PROTOCOL: &str = "bench-dragon.token.";
/// How it shows it otherwise, so that `Authorization` is left to a proxy that asks for a password.
const TOKEN_HEADER: &str = "x-bench-dragon-token";

/// The rules of a view.
#[derive(Clone, Debug)]
pub(super) struct Access {
    token: Token,
    is_read_only: bool,
    /// Whether looking takes the token too: whoever can reach the address need not be on this machine.
    is_exposed: bool,
}

/// What a request may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Rights {
    pub(super) may_view: bool,
    pub(super) may_control: bool,
}

impl Access {
    pub(super) fn new(token: Token, is_read_only: bool, is_exposed: bool) -> Self {
        Self { token, is_read_only, is_exposed }
    }

    pub(super) fn is_read_only(&self) -> bool {
        self.is_read_only
    }

    /// Judges a request by its headers.
    pub(super) fn rights(&self, headers: &HeaderMap) -> Rights {
        let knows = shown(headers).any(|shown| self.token.is(shown));
        Rights { may_view: knows || !self.is_exposed, may_control: knows && !self.is_read_only }
    }
}

/// The tokens that a request shows.
fn shown(headers: &HeaderMap) -> impl Iterator<Item = &str> {
    let bearers = texts(headers, AUTHORIZATION.as_str()).filter_map(bearer);
    let offered = texts(headers, SEC_WEBSOCKET_PROTOCOL.as_str()).flat_map(|text| text.split(',')).map(str::trim);
    let protocols = offered.filter_map(|protocol| protocol.strip_prefix(TOKEN_PROTOCOL));
    texts(headers, TOKEN_HEADER).chain(bearers).chain(protocols)
}

/// What a header holds, each time that it is there.
fn texts<'a>(headers: &'a HeaderMap, name: &'static str) -> impl Iterator<Item = &'a str> {
    headers.get_all(name).iter().filter_map(|value| value.to_str().ok())
}

/// The token of an `Authorization` header; the scheme's name is written in any case.
fn bearer(authorization: &str) -> Option<&str> {
    let (scheme, token) = authorization.split_once(' ')?;
    scheme.eq_ignore_ascii_case("bearer").then(|| token.trim_start_matches(' '))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(name: &'static str, value: &str) -> HeaderMap {
        HeaderMap::from_iter([(name.parse().expect("a name"), value.parse().expect("a value"))])
    }

    #[test]
    fn steering_takes_the_token_and_so_does_looking_where_others_can_reach_the_view() {
        let token: Token = "0123456789abcdef".parse().expect("a token");
        let local = Access::new(token.clone(), false, false);
        let exposed = Access::new(token.clone(), false, true);
        let read_only = Access::new(token, true, false);
        let rights = |may_view, may_control| Rights { may_view, may_control };
        for known in [
            headers("authorization", "Bearer 0123456789abcdef"),
            headers("authorization", "bearer 0123456789abcdef"),
            headers("x-bench-dragon-token", "0123456789abcdef"),
            headers("sec-websocket-protocol", "bench-dragon.view.v1, bench-dragon.token.0123456789abcdef"),
        ] {
            assert_eq!(local.rights(&known), rights(true, true));
            assert_eq!(exposed.rights(&known), rights(true, true));
            assert_eq!(read_only.rights(&known), rights(true, false));
        }
        for unknown in [
            HeaderMap::new(),
            headers("authorization", "Bearer 0123456789abcdeF"),
            headers("authorization", "0123456789abcdef"),
            headers("authorization", "Basic 0123456789abcdef"),
            headers("x-bench-dragon-token", "0123456789abcdeF"),
            headers("sec-websocket-protocol", "0123456789abcdef"),
        ] {
            assert_eq!(local.rights(&unknown), rights(true, false));
            assert_eq!(exposed.rights(&unknown), rights(false, false));
        }
    }
}
