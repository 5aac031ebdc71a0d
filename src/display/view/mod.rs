//! The live view: one page in a browser, drawn from a stream of frames.
//!
//! - *Frames* are sent as binary messages over a WebSocket (`frame_message`). At most two are unacknowledged, and the next one
//!   is always the newest. So a slow browser or a slow network gets fewer frames, and never older ones.
//! - *Commands* are requests that contain the token. A queue ([`CommandQueue`]) sends them to the server in their order; a hold
//!   overtakes all others.
//! - *Access:* commands need the token. Off loopback, viewing needs the token too. A page with the token takes the place of one
//!   without (`viewers`). Wrong tokens are slowed and reported.
//!
//! The page's files are in `page/` and are embedded in the program; the page loads nothing from elsewhere. The page sends
//! `{"ack":N}` for each frame, with its sequence number, and commands. The view sends frames, and JSON with a `type`. A program
//! with the token may also send its commands through the stream.
//!
//! Other programs get the frames as JSON. `docs/reference/openapi.yaml` describes every path and message.

mod frame_message;
mod interface;
mod messages;
mod outcome;
mod page_senders;
mod page_stream;
mod viewers;

use std::io;
use std::net::IpAddr;
use std::sync::Arc;

use axum::Router;
use axum::http::header::CONTENT_TYPE;
use axum::http::{HeaderMap, StatusCode};
use axum::middleware;
use axum::response::Response;
use bench_dragon_ipc::{Domain, Request, Sender};
use include_dir::{Dir, include_dir};
use tokio::sync::watch;

use self::interface::INTERFACE;
use self::outcome::KnownOutcome;
use self::page_senders::PageSenders;
use self::page_stream::NumberedSnapshot;
use super::observe::Snapshot;
use super::web::{Gate, Rights, add_page_file, is_json, judge_token, refuse};
use crate::command_queue::{CommandQueue, HOLD_PATIENCE, Outcome};

pub(super) use self::messages::{read_command, run_message, shown};
pub use self::outcome::ShowOutcome;
pub use self::viewers::MAX_VIEWERS;
pub(super) use self::viewers::{Place, Viewers};
pub use super::web::{Token, TokenError};

/// The page's files, embedded in the program.
pub(super) static PAGE: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/src/display/view/page");

/// A view of one instance.
#[derive(Clone, Debug)]
pub struct View(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    instance: String,
    gate: Arc<Gate>,
    commands: CommandQueue,
    senders: PageSenders,
    snapshots: watch::Sender<Arc<NumberedSnapshot>>,
    closing: watch::Sender<bool>,
    outcome: watch::Sender<KnownOutcome>,
    viewers: Viewers,
}

impl View {
    /// Returns a view of a domain's instance, to which it sends commands. Commands need the token; with `is_read_only`, the
    /// view accepts none. Off loopback, viewing needs the token too.
    ///
    /// # Errors
    /// As [`CommandQueue::open`].
    pub fn open(domain: Domain, token: Token, is_read_only: bool, address: IpAddr) -> io::Result<Self> {
        Ok(Self(Arc::new(Inner {
            instance: domain.instance().to_string(),
            gate: Arc::new(Gate::new(token, is_read_only, address)),
            commands: CommandQueue::open(domain, "view-command", Sender::Page)?,
            senders: PageSenders::default(),
            snapshots: watch::Sender::new(Arc::default()),
            closing: watch::Sender::new(false),
            outcome: watch::Sender::default(),
            viewers: Viewers::default(),
        })))
    }

    /// Stops accepting commands, and waits until every submitted hold is answered.
    pub fn close(&self) {
        self.0.commands.close(HOLD_PATIENCE, |request| request == Request::Hold);
    }

    /// Sends a snapshot to all pages, without waiting for any of them.
    pub fn show(&self, snapshot: Snapshot) {
        let sequence = self.0.snapshots.borrow().sequence.wrapping_add(1);
        let senders = self.0.senders.name(&snapshot.commands);
        self.0.snapshots.send_replace(NumberedSnapshot::new(sequence, snapshot, senders));
    }

    /// Announces that [`View::end_show`] will be called before the view ends. So a closing view waits for it a moment.
    pub fn await_outcome(&self) {
        self.0.outcome.send_replace(KnownOutcome::Awaited);
    }

    /// Sends the outcome of the show to all pages, also to those that open later.
    pub fn end_show(&self, outcome: ShowOutcome) {
        self.0.outcome.send_replace(KnownOutcome::Known(outcome));
    }

    /// A flag that becomes true when the view ends.
    pub fn closing(&self) -> &watch::Sender<bool> {
        &self.0.closing
    }

    /// The router of the view's requests.
    pub fn router(&self) -> Router {
        let pages = PAGE.files().fold(Router::new(), add_page_file);
        INTERFACE
            .iter()
            .fold(pages, |router, (path, handler)| router.route(path, handler()))
            .fallback(async || refuse(StatusCode::NOT_FOUND, "there is no such page"))
            .method_not_allowed_fallback(async || {
                refuse(StatusCode::METHOD_NOT_ALLOWED, "this method is not allowed here")
            })
            .with_state(self.clone())
            .layer(middleware::from_fn_with_state(Arc::clone(&self.0.gate), judge_token))
    }

    fn rights(&self, headers: &HeaderMap) -> Rights {
        self.0.gate.rights(headers)
    }

    fn newest(&self) -> Arc<NumberedSnapshot> {
        Arc::clone(&self.0.snapshots.borrow())
    }

    /// The newest snapshot, for a request that may see it.
    #[expect(clippy::result_large_err, reason = "the error is the reply")]
    fn newest_for(&self, headers: &HeaderMap) -> Result<Arc<NumberedSnapshot>, Response> {
        if self.rights(headers).may_view { Ok(self.newest()) } else { Err(refuse_look()) }
    }

    /// Checks a command's headers, before its body is read.
    #[expect(clippy::result_large_err, reason = "the error is the reply")]
    fn check_command(&self, headers: &HeaderMap) -> Result<(), Response> {
        if self.0.gate.is_read_only() {
            return Err(refuse(
                StatusCode::FORBIDDEN,
                "this view accepts no commands: it was started with --read-only",
            ));
        }
        if !self.rights(headers).may_control {
            return Err(refuse(StatusCode::UNAUTHORIZED, "a command needs the token that `bench-dragon view` printed"));
        }
        if !headers.get(CONTENT_TYPE).is_some_and(is_json) {
            return Err(refuse(
                StatusCode::UNSUPPORTED_MEDIA_TYPE,
                "a command must have the Content-Type application/json",
            ));
        }
        Ok(())
    }
}

fn refuse_look() -> Response {
    refuse(StatusCode::UNAUTHORIZED, "this view needs the token that `bench-dragon view` printed")
}

impl Inner {
    /// Submits a command of a page or a program on a machine. It is sent even if that one has gone by then.
    fn submit(self: &Arc<Self>, request: Request, host: Option<IpAddr>, answer: impl FnOnce(Outcome) + Send + 'static) {
        let sent = host.map(|host| self.senders.submit(request, host));
        let inner = Arc::clone(self);
        self.commands.submit(request, move |outcome| {
            if let (Err(error), Some(sent)) = (&outcome, sent) {
                inner.senders.fail(sent, error);
            }
            answer(outcome);
        });
    }
}
