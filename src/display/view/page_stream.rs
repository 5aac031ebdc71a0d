//! The stream to one page or one program: frames, as fast as it acknowledges them, and all other messages.

use std::collections::VecDeque;
use std::convert::Infallible;
use std::net::IpAddr;
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use axum::body::Bytes;
use axum::extract::ws::{Message, Utf8Bytes, WebSocket, close_code};
use serde_json::Value;
use tokio::sync::{mpsc, watch};
use tokio::time::{Instant, MissedTickBehavior, interval, timeout};

use super::frame_message::{encode_frame, frame_json};
use super::messages::{
    HeardAck, alert_message, command_message, plan_message, read_ack, read_command, refusal_message, reply_message,
    run_message, status_message,
};
use super::outcome::{KnownOutcome, last};
use super::page_senders::SenderHosts;
use super::viewers::Place;
use super::{Inner, View};
use crate::config::Config;
use crate::display::observe::{DescribedRun, FrameCopy, PlannedClearance, Snapshot};
use crate::display::web::{close, closed};
use crate::system::clock::monotonic_ns;

/// Greatest length of a page's message, in bytes.
pub(super) const MAX_MESSAGE_BYTES: usize = 256;
/// Greatest number of unacknowledged frames.
const MAX_UNACKNOWLEDGED: usize = 2;
/// Number of waiting replies from which on no message is read.
const MAX_REPLIES: usize = 16;
/// Period of the status messages.
const STATUS_PERIOD: Duration = Duration::from_millis(200);
/// Timeout for a page's acknowledgement, and for sending a message.
const PAGE_TIMEOUT: Duration = Duration::from_secs(30);

/// The form in which a stream has its frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FrameForm {
    /// Binary messages, which the page acknowledges in messages of its own.
    Binary,
    /// JSON. A ping follows each frame, and the pong acknowledges it: every WebSocket library answers pings by itself.
    Json,
}

/// The stream to one page.
#[derive(Debug)]
pub(super) struct PageStream {
    socket: WebSocket,
    form: FrameForm,
    snapshots: watch::Receiver<Arc<NumberedSnapshot>>,
    closing: watch::Receiver<bool>,
    outcome: watch::Receiver<KnownOutcome>,
    sent: SentState,
    /// Sequence numbers of the unacknowledged frames, oldest first.
    unacknowledged: VecDeque<u32>,
    /// Instant of the last acknowledgement, or of the first frame sent after all had been acknowledged.
    heard: Instant,
    /// The newest acknowledgement.
    heard_ack: Option<HeardAck>,
    /// Counts this stream among the viewers.
    place: Place,
    /// The view, and the machine of the program, if it may send commands.
    steers: Option<(Arc<Inner>, IpAddr)>,
    /// Replies to its commands that wait to be sent: at most one for each command that the queue holds, and [`MAX_REPLIES`] more.
    replies: (mpsc::UnboundedSender<Value>, mpsc::UnboundedReceiver<Value>),
}

/// The data that the page already has.
#[derive(Debug, Default)]
struct SentState {
    run: Option<Arc<DescribedRun>>,
    frame: Option<Arc<FrameCopy>>,
    chart_revision: u64,
    plan: Option<Arc<PlannedClearance>>,
    next_alert: u64,
    next_command: u64,
}

/// The reason for the end of a stream.
#[derive(Debug)]
enum StreamEnd {
    /// The page has disconnected, or is unreachable.
    Gone,
    /// The view closes the stream, with this code and reason.
    Closed(u16, &'static str),
}

impl PageStream {
    /// A stream. `sender`: the machine of a program that may send commands.
    pub(super) fn new(socket: WebSocket, form: FrameForm, view: &View, place: Place, sender: Option<IpAddr>) -> Self {
        let View(view) = view;
        let (mut snapshots, mut outcome) = (view.snapshots.subscribe(), view.outcome.subscribe());
        snapshots.mark_changed();
        outcome.mark_changed();
        Self {
            socket,
            form,
            snapshots,
            closing: view.closing.subscribe(),
            outcome,
            sent: SentState::default(),
            unacknowledged: VecDeque::with_capacity(MAX_UNACKNOWLEDGED),
            heard: Instant::now(),
            heard_ack: None,
            place,
            steers: sender.map(|host| (Arc::clone(view), host)),
            replies: mpsc::unbounded_channel(),
        }
    }

    /// Sends messages until the page or the view ends.
    pub(super) async fn run(mut self) {
        let Err(end) = self.stream().await;
        if let StreamEnd::Closed(code, reason) = end {
            close(self.socket, code, reason).await;
        }
    }

    async fn stream(&mut self) -> Result<Infallible, StreamEnd> {
        const ENDED: StreamEnd = StreamEnd::Closed(close_code::AWAY, "the view has ended");
        const REPLACED: StreamEnd = StreamEnd::Closed(close_code::AGAIN, "a page with the token has taken this place");
        let mut status_due = interval(STATUS_PERIOD);
        status_due.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            let has_room = self.unacknowledged.len() < MAX_UNACKNOWLEDGED;
            tokio::select! {
                message = self.socket.recv(), if self.replies.1.len() < MAX_REPLIES => self.take(message)?,
                _ = status_due.tick() => self.send_status().await?,
                Ok(()) = self.snapshots.changed(), if has_room => self.send_frame().await?,
                Ok(()) = self.outcome.changed() => self.send_outcome().await?,
                Some(reply) = self.replies.1.recv() => self.send_json(&reply).await?,
                () = self.place.lost() => return Err(REPLACED),
                () = closed(&mut self.closing) => {
                    // The page also gets the last status of the show, and its outcome.
                    self.send_status().await?;
                    if let Some(outcome) = last(&mut self.outcome).await {
                        self.send_json(&outcome.message()).await?;
                    }
                    return Err(ENDED);
                }
            }
        }
    }

    /// Handles a message of the page.
    fn take(&mut self, message: Option<Result<Message, axum::Error>>) -> Result<(), StreamEnd> {
        const MALFORMED: StreamEnd = StreamEnd::Closed(
            close_code::POLICY,
            "a message must acknowledge a frame, or with the token be a command, in at most 256 bytes",
        );
        let text = match message {
            None | Some(Ok(Message::Close(_))) => return Err(StreamEnd::Gone),
            Some(Ok(Message::Ping(_))) => return Ok(()),
            // A pong without a ping is allowed (RFC 6455, section 5.5.3).
            Some(Ok(Message::Pong(payload))) => {
                let _ = sequence_in(&payload).is_some_and(|sequence| self.acknowledge(sequence));
                return Ok(());
            }
            Some(Ok(Message::Text(text))) => text,
            // The message is too long, or the connection is broken. In the second case the close frame is lost.
            Some(Ok(Message::Binary(_)) | Err(_)) => return Err(MALFORMED),
        };
        let is_taken = match (read_ack(&text), &self.steers) {
            (Some(sequence), _) => self.acknowledge(sequence),
            (None, Some((view, host))) if text.contains(r#""command""#) => {
                self.submit(view, *host, &text);
                true
            }
            (None, _) => false,
        };
        if is_taken { Ok(()) } else { Err(MALFORMED) }
    }

    /// Submits a command. Its reply is sent later.
    fn submit(&self, view: &Arc<Inner>, host: IpAddr, text: &str) {
        let replies = self.replies.0.clone();
        // A stream that has ended has no more use for a reply.
        let reply = move |message| drop(replies.send(message));
        let newest = Arc::clone(&view.snapshots.borrow());
        let cues = newest.snapshot.config().map(Config::cues).unwrap_or_default();
        match read_command(text.as_bytes(), cues) {
            Ok(request) => view.submit(request, Some(host), move |outcome| reply(reply_message(request, outcome))),
            Err(reason) => reply(refusal_message(&reason)),
        }
    }

    /// Counts a frame as acknowledged, and all frames before it. Returns whether it was unacknowledged.
    fn acknowledge(&mut self, sequence: u32) -> bool {
        let Some(known) = self.unacknowledged.iter().position(|&sent| sent == sequence) else { return false };
        self.unacknowledged.drain(..=known);
        self.heard = Instant::now();
        self.heard_ack = Some(HeardAck { sequence, at_ns: monotonic_ns() });
        true
    }

    /// Sends the newest frame, unless the page already has it. The run is sent before it; the plan, alerts and commands after
    /// it.
    async fn send_frame(&mut self) -> Result<(), StreamEnd> {
        let newest = Arc::clone(&self.snapshots.borrow_and_update());
        let is_known = match (&self.sent.frame, &newest.snapshot.frame) {
            (Some(sent), Some(newest)) => Arc::ptr_eq(sent, newest),
            (_, newest) => newest.is_none(),
        };
        if is_known {
            return Ok(());
        }
        self.send_run(&newest).await?;
        let Some(frame) = newest.frame(self.form) else { return Ok(()) };
        self.sent.frame.clone_from(&newest.snapshot.frame);
        if self.unacknowledged.is_empty() {
            self.heard = Instant::now();
        }
        self.unacknowledged.push_back(newest.sequence);
        self.send(frame).await?;
        if self.form == FrameForm::Json {
            self.send(Message::Ping(Bytes::copy_from_slice(&newest.sequence.to_be_bytes()))).await?;
        }
        self.send_plan(&newest).await?;
        self.send_alerts(&newest).await?;
        let commands = &newest.snapshot.commands.log;
        for command in commands.since(std::mem::replace(&mut self.sent.next_command, commands.total)) {
            let host = newest.senders.host(command.number);
            self.send_json(&command_message(command, host)).await?;
        }
        Ok(())
    }

    /// Sends the planned clearance, unless the page already has it: once per run, and a few times before it is complete.
    async fn send_plan(&mut self, newest: &NumberedSnapshot) -> Result<(), StreamEnd> {
        let (Some(run), Some(plan)) = (&newest.snapshot.run, &newest.snapshot.plan) else { return Ok(()) };
        if self.sent.plan.as_ref().is_some_and(|sent| Arc::ptr_eq(sent, plan)) {
            return Ok(());
        }
        self.sent.plan = Some(Arc::clone(plan));
        self.send_json(&plan_message(run.run_id, plan)).await
    }

    /// Sends the status and the new alerts.
    async fn send_status(&mut self) -> Result<(), StreamEnd> {
        if !self.unacknowledged.is_empty() && self.heard.elapsed() > PAGE_TIMEOUT {
            return Err(StreamEnd::Closed(close_code::POLICY, "no frame has been acknowledged for 30 s"));
        }
        let newest = Arc::clone(&self.snapshots.borrow());
        self.send_run(&newest).await?;
        self.send_json(&status_message(&newest.snapshot, self.sent.chart_revision, self.heard_ack, monotonic_ns()))
            .await?;
        self.sent.chart_revision = newest.snapshot.chart.as_ref().map_or(0, |chart| chart.revisions);
        self.send_alerts(&newest).await
    }

    /// Sends the new alerts.
    async fn send_alerts(&mut self, newest: &NumberedSnapshot) -> Result<(), StreamEnd> {
        let alerts = &newest.snapshot.alerts.log;
        for alert in alerts.since(std::mem::replace(&mut self.sent.next_alert, alerts.total)) {
            self.send_json(&alert_message(alert, newest.snapshot.config())).await?;
        }
        Ok(())
    }

    /// Sends the outcome of the show, if it is known.
    async fn send_outcome(&mut self) -> Result<(), StreamEnd> {
        let known = self.outcome.borrow_and_update().clone();
        match known {
            KnownOutcome::Known(outcome) => self.send_json(&outcome.message()).await,
            KnownOutcome::Unreported | KnownOutcome::Awaited => Ok(()),
        }
    }

    /// Sends the run, unless the page already has it.
    async fn send_run(&mut self, newest: &NumberedSnapshot) -> Result<(), StreamEnd> {
        let Some(run) = &newest.snapshot.run else { return Ok(()) };
        if self.sent.run.as_ref().is_some_and(|sent| Arc::ptr_eq(sent, run)) {
            return Ok(());
        }
        self.sent.run = Some(Arc::clone(run));
        self.sent.chart_revision = 0;
        self.sent.plan = None;
        self.send_json(&run_message(run)).await
    }

    async fn send_json(&mut self, value: &Value) -> Result<(), StreamEnd> {
        self.send(Message::Text(value.to_string().into())).await
    }

    async fn send(&mut self, message: Message) -> Result<(), StreamEnd> {
        match timeout(PAGE_TIMEOUT, self.socket.send(message)).await {
            Ok(Ok(())) => Ok(()),
            Ok(Err(_)) | Err(_) => Err(StreamEnd::Gone),
        }
    }
}

/// A snapshot and its number. Its frame, if any, is encoded once for all streams.
#[derive(Debug, Default)]
pub(super) struct NumberedSnapshot {
    /// Number of the snapshot. It increases by one, and wraps around to 0.
    pub(super) sequence: u32,
    pub(super) snapshot: Snapshot,
    /// The machines of the pages that sent the commands.
    senders: SenderHosts,
    binary: OnceLock<Bytes>,
    json: OnceLock<Utf8Bytes>,
}

impl NumberedSnapshot {
    pub(super) fn new(sequence: u32, snapshot: Snapshot, senders: SenderHosts) -> Arc<Self> {
        Arc::new(Self { sequence, snapshot, senders, binary: OnceLock::new(), json: OnceLock::new() })
    }

    /// Returns the snapshot's frame as a message, if any.
    fn frame(&self, form: FrameForm) -> Option<Message> {
        let frame = self.snapshot.frame.as_ref()?;
        let encode = || encode_frame(self.sequence, frame, self.snapshot.nearest).into();
        Some(match form {
            FrameForm::Binary => Message::Binary(self.binary.get_or_init(encode).clone()),
            FrameForm::Json => Message::Text(self.frame_text()?),
        })
    }

    /// Returns the snapshot's frame as JSON, if any.
    pub(super) fn frame_text(&self) -> Option<Utf8Bytes> {
        let frame = self.snapshot.frame.as_ref()?;
        let encode =
            || frame_json(self.sequence, frame, self.snapshot.nearest, self.snapshot.config()).to_string().into();
        Some(self.json.get_or_init(encode).clone())
    }
}

/// The sequence number of a frame in the payload of a pong.
fn sequence_in(payload: &[u8]) -> Option<u32> {
    payload.try_into().ok().map(u32::from_be_bytes)
}
