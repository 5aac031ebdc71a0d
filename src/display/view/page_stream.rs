//! The stream to one page.

use std::collections::VecDeque;
use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use axum::extract::ws::{CloseFrame, Message, Utf8Bytes, WebSocket, close_code};
use serde::Serialize;
use tokio::sync::watch;
use tokio::time::{Instant, MissedTickBehavior, interval, timeout};

use super::seats::Seat;
use super::shown::Shown;
use super::wire::{AlertMessage, CommandMessage, PlanMessage, RunMessage, StatusMessage, read_ack};
use crate::display::observe::{PlannedClearance, Run, Still};
use crate::display::web::closed;
use crate::system::clock::monotonic_ns;

/// Longest message of a page in bytes.
pub(super) const MAX_MESSAGE_BYTES: usize = 256;
/// Frames that a page has not acknowledged, at most.
const MAX_UNACKNOWLEDGED: usize = 2;
/// How often a page is told how it goes.
const STATUS_PERIOD: Duration = Duration::from_millis(200);
/// How long a page may take to acknowledge a frame, and the network to take a message.
const PATIENCE: Duration = Duration::from_secs(30);

/// What one page has been told.
#[derive(Debug)]
pub(super) struct PageStream {
    socket: WebSocket,
    scenes: watch::Receiver<Arc<Shown>>,
    closing: watch::Receiver<bool>,
    told: Told,
    /// Sequence numbers of the frames that it has not acknowledged, oldest first.
    unacknowledged: VecDeque<u32>,
    /// When it last acknowledged one, or was sent one after it had acknowledged all.
    heard: Instant,
    _seat: Seat,
}

/// What the page knows already.
#[derive(Debug, Default)]
struct Told {
    run: Option<Arc<Run>>,
    still: Option<Arc<Still>>,
    chart_revision: u64,
    plan: Option<Arc<PlannedClearance>>,
    next_alert: u64,
    next_command: u64,
}

/// What a stream waits for.
enum Event {
    Message(Option<Result<Message, axum::Error>>),
    StatusDue,
    Scene,
    Ended,
}

/// Why a stream ends.
#[derive(Debug)]
enum End {
    /// The page has gone, or cannot be reached.
    Gone,
    /// The view closes it.
    Closed(u16, &'static str),
}

impl PageStream {
    pub(super) fn new(
        socket: WebSocket,
        scenes: watch::Receiver<Arc<Shown>>,
        closing: watch::Receiver<bool>,
        seat: Seat,
    ) -> Self {
        Self {
            socket,
            scenes,
            closing,
            told: Told::default(),
            unacknowledged: VecDeque::with_capacity(MAX_UNACKNOWLEDGED),
            heard: Instant::now(),
            _seat: seat,
        }
    }

    /// Streams until the page or the view ends.
    pub(super) async fn run(mut self) {
        let Err(end) = self.stream().await;
        if let End::Closed(code, reason) = end {
            let frame = CloseFrame { code, reason: Utf8Bytes::from_static(reason) };
            // A page that is gone meanwhile needs no farewell.
            let _ = self.send(Message::Close(Some(frame))).await;
        }
    }

    async fn stream(&mut self) -> Result<Infallible, End> {
        const ENDED: End = End::Closed(close_code::AWAY, "the view has ended");
        let mut status_due = interval(STATUS_PERIOD);
        status_due.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            let has_room = self.unacknowledged.len() < MAX_UNACKNOWLEDGED;
            let event = tokio::select! {
                message = self.socket.recv() => Event::Message(message),
                () = closed(&mut self.closing) => Event::Ended,
                _ = status_due.tick() => Event::StatusDue,
                changed = self.scenes.changed(), if has_room => changed.map_or(Event::Ended, |()| Event::Scene),
            };
            match event {
                Event::Message(message) => self.take(message)?,
                Event::StatusDue => self.send_status().await?,
                Event::Scene => self.send_frame().await?,
                Event::Ended => {
                    // The last word of a show comes with its end.
                    self.send_status().await?;
                    return Err(ENDED);
                }
            }
        }
    }

    /// Takes what the page says.
    fn take(&mut self, message: Option<Result<Message, axum::Error>>) -> Result<(), End> {
        const MALFORMED: End = End::Closed(close_code::POLICY, "a page only acknowledges frames, in a few bytes");
        let text = match message {
            None | Some(Ok(Message::Close(_))) => return Err(End::Gone),
            Some(Ok(Message::Ping(_) | Message::Pong(_))) => return Ok(()),
            Some(Ok(Message::Text(text))) => text,
            // Too long, or torn: to a page that is gone the farewell is lost.
            Some(Ok(Message::Binary(_)) | Err(_)) => return Err(MALFORMED),
        };
        let sequence = read_ack(&text).ok_or(MALFORMED)?;
        let known = self.unacknowledged.iter().position(|&sent| sent == sequence).ok_or(MALFORMED)?;
        self.unacknowledged.drain(..=known);
        self.heard = Instant::now();
        Ok(())
    }

    /// Sends the newest frame, unless the page has it already, before it the run that it is of, and behind it what it has set off.
    async fn send_frame(&mut self) -> Result<(), End> {
        let shown = Arc::clone(&self.scenes.borrow_and_update());
        let is_known = match (&self.told.still, &shown.scene.frame) {
            (Some(told), Some(still)) => Arc::ptr_eq(told, still),
            (_, still) => still.is_none(),
        };
        if is_known {
            return Ok(());
        }
        self.send_run(&shown).await?;
        let Some(bytes) = shown.frame() else { return Ok(()) };
        self.told.still.clone_from(&shown.scene.frame);
        if self.unacknowledged.is_empty() {
            self.heard = Instant::now();
        }
        self.unacknowledged.push_back(shown.sequence);
        self.send(Message::Binary(bytes)).await?;
        self.send_plan(&shown).await?;
        self.send_alerts(&shown).await?;
        self.send_commands(&shown).await
    }

    /// Sends the planned clearance, unless the page has it already: once a run, and a few times before it is complete.
    async fn send_plan(&mut self, shown: &Shown) -> Result<(), End> {
        let (Some(run), Some(plan)) = (&shown.scene.run, &shown.scene.plan) else { return Ok(()) };
        if self.told.plan.as_ref().is_some_and(|told| Arc::ptr_eq(told, plan)) {
            return Ok(());
        }
        self.told.plan = Some(Arc::clone(plan));
        self.send_json(&PlanMessage::of(run.run_id, plan)).await
    }

    /// Sends how it goes, and the alerts that are new.
    async fn send_status(&mut self) -> Result<(), End> {
        if !self.unacknowledged.is_empty() && self.heard.elapsed() > PATIENCE {
            return Err(End::Closed(close_code::POLICY, "no frame has been acknowledged for 30 s"));
        }
        let shown = Arc::clone(&self.scenes.borrow());
        self.send_run(&shown).await?;
        self.send_json(&StatusMessage::of(&shown.scene, self.told.chart_revision, monotonic_ns())).await?;
        self.told.chart_revision = shown.scene.chart.as_ref().map_or(0, |chart| chart.revisions());
        self.send_alerts(&shown).await
    }

    /// Sends the alerts that are new.
    async fn send_alerts(&mut self, shown: &Shown) -> Result<(), End> {
        for alert in shown.scene.alerts.since(self.told.next_alert) {
            self.send_json(&AlertMessage::from(alert)).await?;
        }
        self.told.next_alert = shown.scene.alerts.total();
        Ok(())
    }

    /// Sends the commands that are new.
    async fn send_commands(&mut self, shown: &Shown) -> Result<(), End> {
        for command in shown.scene.commands.since(self.told.next_command) {
            self.send_json(&CommandMessage::from(command)).await?;
        }
        self.told.next_command = shown.scene.commands.total();
        Ok(())
    }

    /// Sends the run, unless the page has it already.
    async fn send_run(&mut self, shown: &Shown) -> Result<(), End> {
        let Some(run) = &shown.scene.run else { return Ok(()) };
        if self.told.run.as_ref().is_some_and(|told| Arc::ptr_eq(told, run)) {
            return Ok(());
        }
        self.told.run = Some(Arc::clone(run));
        self.told.chart_revision = 0;
        self.told.plan = None;
        self.send_json(&RunMessage::from(&**run)).await
    }

    async fn send_json(&mut self, value: &impl Serialize) -> Result<(), End> {
        let text = serde_json::to_string(value).expect("what is told has no keys but strings");
        self.send(Message::Text(text.into())).await
    }

    async fn send(&mut self, message: Message) -> Result<(), End> {
        match timeout(PATIENCE, self.socket.send(message)).await {
            Ok(Ok(())) => Ok(()),
            Ok(Err(_)) | Err(_) => Err(End::Gone),
        }
    }
}
