//! The replies: text, JSON, and refusals of one line.

use axum::body::Body;
use axum::http::header::CONTENT_TYPE;
use axum::http::{HeaderValue, StatusCode};
use axum::response::Response;
use serde::Serialize;

/// A refusal, as JSON, for a page reads it too.
#[derive(Serialize)]
struct Refused<'a> {
    error: &'a str,
}

/// Text of this media type.
pub fn text(status: StatusCode, media_type: &'static str, body: impl Into<Body>) -> Response {
    let mut response = Response::new(body.into());
    *response.status_mut() = status;
    response.headers_mut().insert(CONTENT_TYPE, HeaderValue::from_static(media_type));
    response
}

/// A value as JSON.
pub fn json(status: StatusCode, value: &impl Serialize) -> Response {
    let body = serde_json::to_string(value).expect("what is told has no keys but strings");
    text(status, "application/json", body + "\n")
}

/// A refusal and its reason, in one line.
pub fn refuse(status: StatusCode, reason: &str) -> Response {
    json(status, &Refused { error: reason })
}
