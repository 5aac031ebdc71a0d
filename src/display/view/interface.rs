//! The view's interface: every path beside the files of the page, and what answers it.

use std::convert::identity;
use std::net::IpAddr;
use std::sync::Arc;
use std::time::Duration;

use axum::body::to_bytes;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{FromRequestParts as _, Request as HttpRequest, State};
use axum::http::header::CACHE_CONTROL;
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderValue, StatusCode};
use axum::response::Response;
use axum::routing::{MethodRouter, any, get, post};
use bench_dragon_ipc::BusError;
use serde_json::json;
use tokio::sync::oneshot;
use tokio::time::timeout;

use super::messages::{read_command, status_message};
use super::page_stream::{FrameForm, MAX_MESSAGE_BYTES, NumberedSnapshot, PageStream};
use super::viewers::MAX_VIEWERS;
use super::{View, refuse_look};
use crate::command_queue::CommandQueueError;
use crate::config::Config;
use crate::display::metrics;
use crate::display::web::{Connection, JSON, Rights, json_reply, refuse, text};
use crate::system::clock::monotonic_ns;

/// The WebSocket protocols of a stream with binary frames, and of one with frames as JSON.
const BINARY_PROTOCOL: &str = "bench-dragon.view.v1";
const JSON_PROTOCOL: &str = "bench-dragon.json.v1";
/// The description of this interface.
const DESCRIPTION: &str = include_str!("../../../docs/reference/openapi.yaml");
/// Greatest length of a command's body, in bytes.
const MAX_COMMAND_BYTES: usize = 1 << 10;
/// Timeout for a command's body.
const BODY_TIMEOUT: Duration = Duration::from_secs(5);

type MakeHandler = fn() -> MethodRouter<View>;

/// The paths beside the page's files, in the order of their description, and what answers them.
pub(super) const INTERFACE: [(&str, MakeHandler); 7] = [
    ("/access", || get(report_access)),
    ("/frame", || get(report_frame)),
    ("/status", || get(report_status)),
    ("/stream", || any(open_stream)),
    ("/command", || post(take_command)),
    ("/metrics", || get(report_metrics)),
    ("/openapi.yaml", || get(report_interface)),
];

async fn report_access(State(View(view)): State<View>, headers: HeaderMap) -> Response {
    let Rights { has_token, may_view, may_control } = view.gate.rights(&headers);
    let report = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "instance": if may_view { &view.instance } else { "" },
        "read_only": view.gate.is_read_only(),
        "may_view": may_view,
        "may_control": may_control,
        "viewers": view.viewers.count(),
        "max_viewers": MAX_VIEWERS,
        "is_full": view.viewers.is_full(has_token),
    });
    unkept(json_reply(StatusCode::OK, &report))
}

async fn report_metrics(State(view): State<View>, headers: HeaderMap) -> Response {
    view.newest_for(&headers).map_or_else(identity, |newest| metrics::reply(&newest.snapshot))
}

async fn report_frame(State(view): State<View>, headers: HeaderMap) -> Response {
    let frame = |newest: Arc<NumberedSnapshot>| match newest.frame_text() {
        Some(frame) => unkept(text(StatusCode::OK, JSON, format!("{frame}\n"))),
        None => refuse(StatusCode::SERVICE_UNAVAILABLE, "no frame has arrived yet"),
    };
    view.newest_for(&headers).map_or_else(identity, frame)
}

async fn report_status(State(view): State<View>, headers: HeaderMap) -> Response {
    let status = |newest: Arc<NumberedSnapshot>| {
        unkept(json_reply(StatusCode::OK, &status_message(&newest.snapshot, 0, None, monotonic_ns())))
    };
    view.newest_for(&headers).map_or_else(identity, status)
}

async fn report_interface() -> Response {
    text(StatusCode::OK, "application/yaml", DESCRIPTION)
}

/// A reply that no browser keeps.
fn unkept(mut response: Response) -> Response {
    response.headers_mut().insert(CACHE_CONTROL, HeaderValue::from_static("no-store"));
    response
}

async fn open_stream(State(view): State<View>, request: HttpRequest) -> Response {
    let Rights { has_token, may_view, may_control } = view.rights(request.headers());
    if !may_view {
        return refuse_look();
    }
    let (mut parts, _) = request.into_parts();
    let Ok(upgrade) = WebSocketUpgrade::from_request_parts(&mut parts, &view).await else {
        return refuse(StatusCode::UPGRADE_REQUIRED, "the stream is a WebSocket: the request must be an upgrade");
    };
    let Some(place) = view.0.viewers.take(has_token) else {
        return refuse(StatusCode::SERVICE_UNAVAILABLE, "32 pages are open already, which is the limit");
    };
    let upgrade = upgrade
        .protocols([BINARY_PROTOCOL, JSON_PROTOCOL])
        .max_message_size(MAX_MESSAGE_BYTES)
        .max_frame_size(MAX_MESSAGE_BYTES);
    // A program that asks for no protocol gets what is easy to read.
    let is_binary = upgrade.selected_protocol().is_some_and(|protocol| protocol == BINARY_PROTOCOL);
    let form = if is_binary { FrameForm::Binary } else { FrameForm::Json };
    let sender = host(&parts).filter(|_| may_control);
    upgrade.on_upgrade(move |socket| PageStream::new(socket, form, &view, place, sender).run())
}

async fn take_command(State(view): State<View>, request: HttpRequest) -> Response {
    let (parts, body) = request.into_parts();
    // The body of a request without the right to send commands is not read.
    if let Err(refusal) = view.check_command(&parts.headers) {
        return refusal;
    }
    let Ok(body) = timeout(BODY_TIMEOUT, to_bytes(body, MAX_COMMAND_BYTES)).await else {
        return refuse(StatusCode::REQUEST_TIMEOUT, "the command has not arrived within 5 s");
    };
    let Ok(body) = body else {
        return refuse(StatusCode::PAYLOAD_TOO_LARGE, "the command is incomplete, or longer than 1024 bytes");
    };
    let newest = view.newest();
    let cues = newest.snapshot.config().map(Config::cues).unwrap_or_default();
    let request = match read_command(&body, cues) {
        Ok(request) => request,
        Err(reason) => return refuse(StatusCode::BAD_REQUEST, &reason),
    };
    let (answer, answered) = oneshot::channel();
    view.0.submit(request, host(&parts), |outcome| drop(answer.send(outcome)));
    match answered.await.expect("the queue answers each command") {
        Ok(reply) => {
            let mut report = json!({ "accepted": reply.outcome().is_ok(), "tick": reply.tick });
            if let Err(refusal) = reply.outcome() {
                report["reason"] = refusal.explain(&request).into();
            }
            json_reply(StatusCode::OK, &report)
        }
        Err(error) => refuse(status_of(&error), &error.to_string()),
    }
}

/// The machine of a request. The site adds the connection to each request.
fn host(parts: &Parts) -> Option<IpAddr> {
    parts.extensions.get::<Connection>().map(Connection::address)
}

fn status_of(error: &CommandQueueError) -> StatusCode {
    match error {
        CommandQueueError::Overtaken | CommandQueueError::Closed => StatusCode::CONFLICT,
        CommandQueueError::Crowded => StatusCode::TOO_MANY_REQUESTS,
        CommandQueueError::Bus(BusError::NoAnswer { .. }) => StatusCode::GATEWAY_TIMEOUT,
        CommandQueueError::Bus(error) if error.is_absent() => StatusCode::SERVICE_UNAVAILABLE,
        CommandQueueError::Bus(BusError::TooManyClients { .. }) => StatusCode::SERVICE_UNAVAILABLE,
        CommandQueueError::Bus(_) => StatusCode::INTERNAL_SERVER_ERROR,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_description_has_every_path() {
        let described: Vec<&str> = DESCRIPTION
            .lines()
            .filter_map(|line| line.strip_prefix("  /")?.strip_suffix(':'))
            .filter(|path| !path.contains(' '))
            .collect();
        let mut known = vec![""];
        known.extend(INTERFACE.iter().map(|(path, _)| &path[1..]));
        assert_eq!(described, known);
    }
}
