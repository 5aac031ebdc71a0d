//! The show in Foxglove and Lichtblick, by the WebSocket protocol of both.
//!
//! - *Protocol:* `foxglove.sdk.v1` and `foxglove.websocket.v1`, which have the same messages. Source: the specification in the repository
//!   `foxglove/ws-protocol`.
//! - *Channels* (`channels`) have the messages of our recordings ([`crate::recording`]), and the status as numbers in JSON.
//! - *Clock:* the bridge publishes the Unix time of the newest frame, so a viewer on another machine has the clock of this one. It stands
//!   while no frames arrive. Show time would run backwards at a seek, and viewers then forget all that they have.
//! - *Back-pressure:* each batch of messages ends with a ping. At most two batches are unanswered, and the next one always has
//!   the newest frame. So a slow viewer gets fewer messages, and delays neither the bridge nor another viewer. Skipped
//!   messages are counted.
//! - *Access:* as for the page ([`super::web`]). A viewer shows the token in the query of the address, since it can set no headers. A
//!   page of another site, such as a viewer's in a browser, is served with the token alone.
//! - *Services* are the commands. They exist with `--steer`, and only for viewers with the token.

mod channels;
mod messages;
mod parameters;
mod published;
mod requests;
mod services;
mod viewer;

use std::fmt;
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use axum::Router;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{FromRequestParts as _, Request as HttpRequest, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::middleware;
use axum::response::Response;
use axum::routing::any;
use bench_dragon_ipc::{Domain, Request, Sender};
use serde::Serialize;
use tokio::sync::watch;

use self::published::{Published, Publisher};
use self::viewer::{Viewer, ViewerRights};
use super::observe::Snapshot;
use super::view::{Token, Viewers};
use super::web::{Connection, ForeignPage, Gate, judge_token, refuse};
use crate::command_queue::{CommandQueue, HOLD_PATIENCE};

/// The names of the protocol, the newer one first.
const PROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];
/// Greatest length of a viewer's message, in bytes.
const MAX_MESSAGE_BYTES: usize = 64 << 10;
/// Shortest time between two reports about refused pages.
const REFUSAL_PERIOD: Duration = Duration::from_secs(10);

/// A viewer has come or gone, or was refused.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum ViewerEvent {
    /// A viewer has opened its connection.
    Joined {
        /// Its address.
        from: IpAddr,
        /// Whether it may send commands.
        steers: bool,
        /// Number of open viewers.
        viewers: usize,
    },
    /// A viewer has ended.
    Left {
        /// Its address.
        from: IpAddr,
        /// Number of messages that it got.
        messages: u64,
        /// Number of messages that newer ones have replaced.
        dropped: u64,
    },
    /// A page of another site has no token, or a wrong one.
    Refused {
        /// The site.
        origin: String,
    },
}

/// Totals of a bridge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ViewerTotals {
    /// Viewers that were admitted.
    pub viewers: u64,
    /// Messages of channels that were sent.
    pub messages: u64,
    /// Messages that newer ones have replaced, because a viewer was slow.
    pub dropped: u64,
}

type Report = dyn Fn(ViewerEvent) + Send + Sync;

/// A bridge to viewers.
#[derive(Clone, Debug)]
pub struct Foxglove(Arc<Bridge>);

struct Bridge {
    instance: String,
    /// Number of this start of the bridge.
    session: String,
    gate: Arc<Gate>,
    /// `None` without `--steer`.
    commands: Option<CommandQueue>,
    publisher: Mutex<Publisher>,
    newest: watch::Sender<Arc<Published>>,
    closing: watch::Sender<bool>,
    viewers: Viewers,
    admitted: AtomicU64,
    messages: AtomicU64,
    dropped: AtomicU64,
    report: Box<Report>,
    /// Instant of the last report about a refused page.
    refused: Mutex<Option<Instant>>,
}

impl fmt::Debug for Bridge {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Bridge").field("instance", &self.instance).finish_non_exhaustive()
    }
}

impl Foxglove {
    /// Returns a bridge to viewers at an address. With `steers`, viewers with the token may send commands. `report` gets every event.
    ///
    /// # Errors
    /// As [`CommandQueue::open`], and the kernel's reason if it has no random bytes.
    pub fn open(
        domain: Domain,
        token: Token,
        steers: bool,
        address: IpAddr,
        report: impl Fn(ViewerEvent) + Send + Sync + 'static,
    ) -> io::Result<Self> {
        let instance = domain.instance().to_string();
        let open = || CommandQueue::open(domain, "bridge-foxglove-command", Sender::Foxglove);
        Ok(Self(Arc::new(Bridge {
            instance,
            session: Token::random()?.secret().to_owned(),
            gate: Arc::new(Gate::new(token, !steers, address)),
            commands: steers.then(open).transpose()?,
            publisher: Mutex::default(),
            newest: watch::Sender::new(Arc::default()),
            closing: watch::Sender::new(false),
            viewers: Viewers::default(),
            admitted: AtomicU64::new(0),
            messages: AtomicU64::new(0),
            dropped: AtomicU64::new(0),
            report: Box::new(report),
            refused: Mutex::default(),
        })))
    }

    /// Publishes a snapshot to all viewers, without waiting for any of them.
    pub fn show(&self, snapshot: Snapshot) {
        // The publisher is consistent even after a panic.
        let published = self.0.publisher.lock().unwrap_or_else(PoisonError::into_inner).publish(snapshot);
        self.0.newest.send_replace(Arc::new(published));
    }

    /// Stops accepting commands, and waits until every submitted hold is answered.
    pub fn close(&self) {
        if let Some(commands) = &self.0.commands {
            commands.close(HOLD_PATIENCE, |request| request == Request::Hold);
        }
    }

    /// A flag that becomes true when the bridge ends.
    pub fn closing(&self) -> &watch::Sender<bool> {
        &self.0.closing
    }

    /// The totals so far.
    pub fn totals(&self) -> ViewerTotals {
        let load = |count: &AtomicU64| count.load(Ordering::Relaxed);
        let Bridge { admitted, messages, dropped, .. } = &*self.0;
        ViewerTotals { viewers: load(admitted), messages: load(messages), dropped: load(dropped) }
    }

    /// The router of viewers. The path does not matter to them, so every path is that of the stream.
    pub fn router(&self) -> Router {
        Router::new()
            .fallback(any(open_stream))
            .with_state(self.clone())
            .layer(middleware::from_fn_with_state(Arc::clone(&self.0.gate), judge_token))
    }
}

impl Bridge {
    /// Reports that a page was refused, unless that was reported a moment ago: viewers try again and again.
    fn note_refused(&self, headers: &HeaderMap) {
        let now = Instant::now();
        let mut refused = self.refused.lock().unwrap_or_else(PoisonError::into_inner);
        if refused.is_some_and(|last| now.duration_since(last) < REFUSAL_PERIOD) {
            return;
        }
        *refused = Some(now);
        let origin = headers.get(header::ORIGIN).map(|origin| String::from_utf8_lossy(origin.as_bytes()));
        (self.report)(ViewerEvent::Refused { origin: origin.unwrap_or_default().into_owned() });
    }
}

/// The address that a viewer is given.
pub fn viewer_url(reached: SocketAddr, token: &Token) -> String {
    format!("ws://{reached}/?token={}", token.secret())
}

async fn open_stream(State(Foxglove(bridge)): State<Foxglove>, request: HttpRequest) -> Response {
    let rights = bridge.gate.rights(request.headers());
    let is_foreign = request.extensions().get::<ForeignPage>().is_some();
    if is_foreign && !rights.has_token {
        bridge.note_refused(request.headers());
    }
    if !rights.may_view || (is_foreign && !rights.has_token) {
        return refuse(
            StatusCode::UNAUTHORIZED,
            "use the address with the token that `bench-dragon bridge foxglove` printed",
        );
    }
    let (mut parts, _) = request.into_parts();
    let Ok(upgrade) = WebSocketUpgrade::from_request_parts(&mut parts, &()).await else {
        return refuse(
            StatusCode::UPGRADE_REQUIRED,
            "this is no page: open the address in Foxglove or Lichtblick, as a Foxglove WebSocket",
        );
    };
    let upgrade = upgrade.protocols(PROTOCOLS).max_message_size(MAX_MESSAGE_BYTES).max_frame_size(MAX_MESSAGE_BYTES);
    if upgrade.selected_protocol().is_none() {
        return refuse(
            StatusCode::BAD_REQUEST,
            "the viewer must offer the protocol foxglove.sdk.v1 or foxglove.websocket.v1",
        );
    }
    let Some(place) = bridge.viewers.take(rights.has_token) else {
        return refuse(StatusCode::SERVICE_UNAVAILABLE, "32 viewers are open already, which is the limit");
    };
    let from = parts.extensions.get::<Connection>().map_or(IpAddr::from([0; 4]), Connection::address);
    let rights = ViewerRights { steers: rights.may_control && bridge.commands.is_some(), from };
    upgrade.on_upgrade(move |socket| Viewer::new(socket, bridge, place, rights).run())
}
