//! The gate of a site: the rights of a request by its token. Wrong tokens are slowed and reported.

use std::net::IpAddr;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode};
use axum::middleware::Next;
use axum::response::Response;
use tokio::time::sleep;

use super::access::{Access, Rights, Shown, Token, shows_token};
use super::connection_limit::Connection;
use super::guesses::{ANSWER_DELAY, Guesses, Wrong};
use super::site::refuse;
use crate::output::Counted;

/// The access rules of a site, and the wrong tokens that it was shown.
#[derive(Debug)]
pub(in crate::display) struct Gate {
    access: Access,
    guesses: Mutex<Guesses>,
}

impl Gate {
    /// The gate of a site at an address. Changes need the token. Off loopback, viewing needs it too.
    pub(in crate::display) fn new(token: Token, is_read_only: bool, address: IpAddr) -> Self {
        let access = Access { token, is_read_only, is_exposed: !address.is_loopback() };
        Self { access, guesses: Mutex::default() }
    }

    pub(in crate::display) fn rights(&self, headers: &HeaderMap) -> Rights {
        self.access.rights(headers)
    }

    /// Whether no token allows a change.
    pub(in crate::display) fn is_read_only(&self) -> bool {
        self.access.is_read_only
    }

    fn judge(&self, connection: &Connection, headers: &HeaderMap, now: Instant) -> Judgement {
        let address = connection.address();
        // The counts are consistent even after a panic.
        let mut guesses = self.guesses.lock().unwrap_or_else(PoisonError::into_inner);
        if !guesses.allows(address, now) {
            return Judgement::NotCompared;
        }
        let Shown::Wrong(token) = self.access.token_of(headers) else { return Judgement::Operator };
        match guesses.note(address, token, now) {
            Wrong::Known => Judgement::Known,
            Wrong::Guess(unreported) => {
                if let Some(count) = unreported {
                    tracing::warn!(
                        "{} from {address}: a guess, or a page of an earlier view",
                        Counted(count, "wrong token")
                    );
                }
                Judgement::Guess
            }
        }
    }
}

/// Whether a media type is that of JSON, with or without a character set.
pub(in crate::display) fn is_json(media_type: &HeaderValue) -> bool {
    let media_type = media_type.to_str().unwrap_or_default();
    media_type.split(';').next().is_some_and(|essence| essence.trim().eq_ignore_ascii_case("application/json"))
}

/// Protects the connections of operators from being replaced by others. Slows and reports wrong tokens.
pub(in crate::display) async fn judge_token(State(gate): State<Arc<Gate>>, request: Request, next: Next) -> Response {
    let Some(connection) = request.extensions().get::<Connection>().filter(|_| shows_token(request.headers())) else {
        return next.run(request).await;
    };
    if !connection.is_kept() {
        match gate.judge(connection, request.headers(), Instant::now()) {
            Judgement::Operator => connection.keep(),
            Judgement::Known => {}
            Judgement::Guess => sleep(ANSWER_DELAY).await,
            Judgement::NotCompared => {
                return refuse(
                    StatusCode::TOO_MANY_REQUESTS,
                    "too many wrong tokens have come from this address: wait a minute",
                );
            }
        }
    }
    next.run(request).await
}

/// The judgement of a request with a token.
enum Judgement {
    Operator,
    /// The address has shown this wrong token before.
    Known,
    Guess,
    /// The address has shown too many wrong tokens.
    NotCompared,
}
