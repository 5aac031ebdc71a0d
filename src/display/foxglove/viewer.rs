//! The stream to one viewer: what it subscribes to, as fast as it answers, and the replies to its requests.

use std::collections::{BTreeMap, VecDeque};
use std::convert::Infallible;
use std::net::IpAddr;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use axum::body::Bytes;
use axum::extract::ws::{Message, WebSocket, close_code};
use serde_json::{Value, json};
use tokio::sync::{mpsc, watch};
use tokio::time::{Instant, MissedTickBehavior, interval, timeout};

use super::channels::{Channel, KnownChannels};
use super::messages::{
    NoteLevel, call_failure, call_response, channel_message, json_message, note, parameter_values, server_info, time,
};
use super::parameters::{FollowedParameters, name_of};
use super::published::{Published, PublishedRun};
use super::requests::{ServiceCall, Subscription, ViewerRequest, read_call, read_request};
use super::services::{advertise_services, command_of, response_to};
use super::{Bridge, ViewerEvent};
use crate::config::Config;
use crate::display::view::Place;
use crate::display::web::{close, closed};
use crate::recording::{Message as RecordedMessage, cdr};

/// Greatest number of unanswered batches.
const MAX_UNANSWERED: usize = 2;
/// Number of waiting replies from which on no message is read.
const MAX_REPLIES: usize = 16;
/// Messages that the bridge cannot read, after which it closes the stream.
const MAX_UNREADABLE: u32 = 100;
/// Period of the status while no frames arrive, and of the look at a silent viewer.
const STATUS_PERIOD: Duration = Duration::from_secs(1);
/// Shortest time between two notes about dropped messages.
const NOTE_PERIOD: Duration = Duration::from_secs(5);
/// Timeout for an answer of the viewer, and for sending a message.
const VIEWER_TIMEOUT: Duration = Duration::from_secs(30);

/// Who a viewer is, and what it may do.
#[derive(Clone, Copy, Debug)]
pub(super) struct ViewerRights {
    pub(super) steers: bool,
    pub(super) from: IpAddr,
}

/// The stream to one viewer.
#[derive(Debug)]
pub(super) struct Viewer {
    socket: WebSocket,
    bridge: Arc<Bridge>,
    rights: ViewerRights,
    /// Counts this stream among the viewers.
    place: Place,
    newest: watch::Receiver<Arc<Published>>,
    closing: watch::Receiver<bool>,
    /// The run whose channels the viewer knows.
    run: Option<Arc<PublishedRun>>,
    channels: KnownChannels,
    /// Number of the channel of each subscription, by its own number.
    subscriptions: BTreeMap<u32, u32>,
    parameters: FollowedParameters,
    next_alert: u64,
    next_command: u64,
    /// Number of frames up to the last one that was sent.
    frames: u64,
    /// Numbers of the unanswered batches, oldest first.
    unanswered: VecDeque<u64>,
    batches: u64,
    /// Instant of the last answer, or of the first batch after all had been answered.
    heard: Instant,
    messages: u64,
    dropped: u64,
    /// Number of dropped messages in the last note about them, and its instant.
    noted: (u64, Instant),
    /// Number of frames at the last look.
    looked_at: u64,
    unreadable: u32,
    /// Replies to calls that wait to be sent: at most one for each command that the queue holds, and [`MAX_REPLIES`] more.
    replies: (mpsc::UnboundedSender<Message>, mpsc::UnboundedReceiver<Message>),
}

/// The reason for the end of a stream.
#[derive(Debug)]
enum StreamEnd {
    /// The viewer has disconnected, or is unreachable.
    Gone,
    /// The bridge closes the stream, with this code and reason.
    Closed(u16, &'static str),
}

impl Viewer {
    pub(super) fn new(socket: WebSocket, bridge: Arc<Bridge>, place: Place, rights: ViewerRights) -> Self {
        let mut newest = bridge.newest.subscribe();
        newest.mark_changed();
        let now = Instant::now();
        Self {
            socket,
            rights,
            place,
            newest,
            closing: bridge.closing.subscribe(),
            bridge,
            run: None,
            channels: KnownChannels::default(),
            subscriptions: BTreeMap::new(),
            parameters: FollowedParameters::default(),
            next_alert: 0,
            next_command: 0,
            frames: 0,
            unanswered: VecDeque::with_capacity(MAX_UNANSWERED),
            batches: 0,
            heard: now,
            messages: 0,
            dropped: 0,
            noted: (0, now),
            looked_at: 0,
            unreadable: 0,
            replies: mpsc::unbounded_channel(),
        }
    }

    /// Sends messages until the viewer or the bridge ends.
    pub(super) async fn run(mut self) {
        let ViewerRights { from, steers } = self.rights;
        self.bridge.admitted.fetch_add(1, Ordering::Relaxed);
        (self.bridge.report)(ViewerEvent::Joined { from, steers, viewers: self.bridge.viewers.count() });
        let Err(end) = self.stream().await;
        if self.frames > 0 {
            let newest = self.newest.borrow().frames;
            self.drop_frames(newest - self.frames);
        }
        (self.bridge.report)(ViewerEvent::Left { from, messages: self.messages, dropped: self.dropped });
        if let StreamEnd::Closed(code, reason) = end {
            close(self.socket, code, reason).await;
        }
    }

    async fn stream(&mut self) -> Result<Infallible, StreamEnd> {
        const ENDED: StreamEnd = StreamEnd::Closed(close_code::AWAY, "the bridge has ended");
        const REPLACED: StreamEnd =
            StreamEnd::Closed(close_code::AGAIN, "a viewer with the token has taken this place");
        self.greet().await?;
        let mut status_due = interval(STATUS_PERIOD);
        status_due.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            let has_room = self.unanswered.len() < MAX_UNANSWERED;
            tokio::select! {
                message = self.socket.recv(), if self.replies.1.len() < MAX_REPLIES => self.take(message).await?,
                _ = status_due.tick() => self.look_after().await?,
                Ok(()) = self.newest.changed(), if has_room => self.send_newest().await?,
                Some(reply) = self.replies.1.recv() => self.send(reply).await?,
                () = self.place.lost() => return Err(REPLACED),
                () = closed(&mut self.closing) => return Err(ENDED),
            }
        }
    }

    /// Sends what the bridge offers.
    async fn greet(&mut self) -> Result<(), StreamEnd> {
        self.send(server_info(&self.bridge, self.rights.steers)).await?;
        let fixed = Channel::FIXED.iter().enumerate().map(|(id, channel)| channel.declare(id as u32, ""));
        self.advertise(fixed.collect()).await?;
        if self.rights.steers {
            self.send(advertise_services()).await?;
        }
        Ok(())
    }

    async fn advertise(&mut self, channels: Vec<Value>) -> Result<(), StreamEnd> {
        self.send(json_message(&json!({ "op": "advertise", "channels": channels }))).await
    }

    /// Handles a message of the viewer.
    async fn take(&mut self, message: Option<Result<Message, axum::Error>>) -> Result<(), StreamEnd> {
        const MALFORMED: StreamEnd = StreamEnd::Closed(
            close_code::POLICY,
            "a message must be as RFC 6455 has it, a text in UTF-8, and have at most 65536 bytes",
        );
        match message {
            None | Some(Ok(Message::Close(_))) => Err(StreamEnd::Gone),
            Some(Ok(Message::Ping(_))) => Ok(()),
            Some(Ok(Message::Pong(payload))) => {
                self.note_answer(&payload);
                Ok(())
            }
            Some(Ok(Message::Text(text))) => match read_request(&text) {
                Ok(request) => self.answer(request).await,
                Err(reason) => self.reject(&reason).await,
            },
            Some(Ok(Message::Binary(message))) => match read_call(&message) {
                Some(call) => self.call(&call).await,
                None => self.reject("this binary message is not supported: viewers can only call services").await,
            },
            // The message is malformed or too long, or the connection is broken. In the last case the close frame is lost.
            Some(Err(_)) => Err(MALFORMED),
        }
    }

    async fn answer(&mut self, request: ViewerRequest) -> Result<(), StreamEnd> {
        match request {
            ViewerRequest::Subscribe { subscriptions } => {
                for subscription in subscriptions {
                    self.subscribe(subscription).await?;
                }
                Ok(())
            }
            ViewerRequest::Unsubscribe { subscription_ids } => {
                self.subscriptions.retain(|id, _| !subscription_ids.contains(id));
                Ok(())
            }
            ViewerRequest::GetParameters { parameter_names, id } => {
                let is_wanted =
                    |name: &str| parameter_names.is_empty() || parameter_names.iter().any(|other| other == name);
                self.send_parameters(id.as_deref(), is_wanted).await
            }
            ViewerRequest::SetParameters { id } => {
                self.send(note(
                    NoteLevel::Warning,
                    "parameters",
                    "the parameters describe the run: they cannot be set",
                ))
                .await?;
                self.send_parameters(id.as_deref(), |_| true).await
            }
            ViewerRequest::SubscribeParameterUpdates { parameter_names } => {
                self.parameters.follow(parameter_names);
                Ok(())
            }
            ViewerRequest::UnsubscribeParameterUpdates { parameter_names } => {
                self.parameters.leave(&parameter_names);
                Ok(())
            }
        }
    }

    /// Subscribes to a channel. The viewer gets its newest message at once, and of events all that are kept.
    async fn subscribe(&mut self, Subscription { id, channel_id }: Subscription) -> Result<(), StreamEnd> {
        let Some(channel) = self.channels.get(channel_id) else {
            return self.reject(&format!("there is no channel with the number {channel_id}")).await;
        };
        if self.subscriptions.contains_key(&id) || self.subscriptions.values().any(|known| *known == channel_id) {
            return self.reject("a subscription needs a number of its own, and a channel without one").await;
        }
        self.subscriptions.insert(id, channel_id);
        let newest = Arc::clone(&self.newest.borrow());
        match channel {
            Channel::Alerts => self.next_alert = 0,
            Channel::Commands => self.next_command = 0,
            _ => return self.send_frame(&newest, |subscribed| subscribed == id).await,
        }
        self.send_events(&newest).await
    }

    async fn call(&mut self, call: &ServiceCall<'_>) -> Result<(), StreamEnd> {
        let &ServiceCall { service, call: number, .. } = call;
        let newest = Arc::clone(&self.newest.borrow());
        let cues = newest.snapshot.config().map(Config::cues).unwrap_or_default();
        let command = match &self.bridge.commands {
            None => Err("commands need a bridge that was started with --steer".to_owned()),
            Some(_) if !self.rights.steers => Err("commands need the address with the token".to_owned()),
            Some(commands) => command_of(call, cues).map(|request| (commands, request)),
        };
        match command {
            Err(reason) => self.send(call_failure(service, number, &reason)).await,
            Ok((commands, request)) => {
                let replies = self.replies.0.clone();
                commands.submit(request, move |outcome| {
                    let reply = match response_to(request, outcome) {
                        Ok(response) => call_response(service, number, &response),
                        Err(reason) => call_failure(service, number, &reason),
                    };
                    // A viewer that has gone has no more use for a reply.
                    drop(replies.send(reply));
                });
                Ok(())
            }
        }
    }

    /// Answers a message that the bridge cannot read. After many of them it closes the stream.
    async fn reject(&mut self, reason: &str) -> Result<(), StreamEnd> {
        self.unreadable += 1;
        if self.unreadable > MAX_UNREADABLE {
            return Err(StreamEnd::Closed(close_code::POLICY, "too many messages are not supported"));
        }
        self.send(note(NoteLevel::Error, "request", reason)).await
    }

    async fn send_parameters(&mut self, id: Option<&str>, is_wanted: impl Fn(&str) -> bool) -> Result<(), StreamEnd> {
        let newest = Arc::clone(&self.newest.borrow());
        let all = newest.run.as_ref().map(|run| &run.parameters[..]).unwrap_or_default();
        let wanted: Vec<&Value> = all.iter().filter(|parameter| is_wanted(name_of(parameter))).collect();
        self.send(parameter_values(&wanted, id)).await
    }

    /// Counts a batch as answered, and all batches before it.
    fn note_answer(&mut self, payload: &[u8]) {
        let number = payload.try_into().ok().map(u64::from_be_bytes);
        if let Some(known) = self.unanswered.iter().position(|&sent| Some(sent) == number) {
            self.unanswered.drain(..=known);
            self.heard = Instant::now();
        }
    }

    /// Sends the newest frame and the new events, unless the viewer has them.
    async fn send_newest(&mut self) -> Result<(), StreamEnd> {
        let newest = Arc::clone(&self.newest.borrow_and_update());
        self.advertise_run(&newest).await?;
        let new = newest.frames - self.frames;
        if new > 0 {
            let is_first = std::mem::replace(&mut self.frames, newest.frames) == 0;
            if !is_first {
                self.drop_frames(new - 1);
            }
            self.send(time(newest.clock_ns())).await?;
            self.send_frame(&newest, |_| true).await?;
            self.ping().await?;
        }
        self.send_events(&newest).await
    }

    /// Counts the messages of frames that were not sent.
    fn drop_frames(&mut self, frames: u64) {
        let messages = frames * self.subscribed().filter(|(_, channel)| channel.is_of_frames()).count() as u64;
        self.dropped += messages;
        self.bridge.dropped.fetch_add(messages, Ordering::Relaxed);
    }

    /// The subscriptions with their channels.
    fn subscribed(&self) -> impl Iterator<Item = (u32, Channel)> {
        self.subscriptions.iter().filter_map(|(&id, &channel)| Some((id, self.channels.get(channel)?)))
    }

    /// The subscription to a channel.
    fn subscription_to(&self, wanted: Channel) -> Option<u32> {
        self.subscribed().find(|(_, channel)| *channel == wanted).map(|(id, _)| id)
    }

    /// Ends a batch.
    async fn ping(&mut self) -> Result<(), StreamEnd> {
        if self.unanswered.is_empty() {
            self.heard = Instant::now();
        }
        self.batches += 1;
        self.unanswered.push_back(self.batches);
        self.send(Message::Ping(Bytes::copy_from_slice(&self.batches.to_be_bytes()))).await
    }

    /// Announces the channels and the parameters of another run.
    async fn advertise_run(&mut self, newest: &Published) -> Result<(), StreamEnd> {
        let Some(run) = &newest.run else { return Ok(()) };
        if self.run.as_ref().is_some_and(|known| Arc::ptr_eq(known, run)) {
            return Ok(());
        }
        self.run = Some(Arc::clone(run));
        let (gone, declared) = self.channels.set_poses(&run.pose_topics);
        self.subscriptions.retain(|_, channel| !gone.contains(channel));
        if !gone.is_empty() {
            self.send(json_message(&json!({ "op": "unadvertise", "channelIds": gone }))).await?;
        }
        if !declared.is_empty() {
            self.advertise(declared).await?;
        }
        let followed = self.parameters.clone();
        if followed.is_empty() { Ok(()) } else { self.send_parameters(None, |name| followed.contains(name)).await }
    }

    /// Sends the frame's messages of the chosen subscriptions.
    async fn send_frame(&mut self, newest: &Published, is_chosen: impl Fn(u32) -> bool) -> Result<(), StreamEnd> {
        // The numbers of dragons are those of the run that the viewer knows. It is about to know the other one.
        if let (Some(known), Some(run)) = (&self.run, &newest.run)
            && !Arc::ptr_eq(known, run)
        {
            return Ok(());
        }
        let chosen: Vec<(u32, Channel)> = self.subscribed().filter(|(id, _)| is_chosen(*id)).collect();
        for (id, channel) in chosen {
            if let Some(payload) = newest.message(channel) {
                self.send_payload(id, newest, payload).await?;
            }
        }
        Ok(())
    }

    /// Sends the new alerts and commands.
    async fn send_events(&mut self, newest: &Published) -> Result<(), StreamEnd> {
        if let Some(id) = self.subscription_to(Channel::Alerts) {
            let log = &newest.snapshot.alerts.log;
            let since = std::mem::replace(&mut self.next_alert, log.total);
            let events: Vec<_> = log.since(since).map(|alert| RecordedMessage::from(&alert.event)).collect();
            self.send_recorded(id, newest, &events).await?;
        }
        if let Some(id) = self.subscription_to(Channel::Commands) {
            let log = &newest.snapshot.commands.log;
            let since = std::mem::replace(&mut self.next_command, log.total);
            let events: Vec<_> = log.since(since).map(|command| RecordedMessage::from(&command.event)).collect();
            self.send_recorded(id, newest, &events).await?;
        }
        Ok(())
    }

    async fn send_recorded(
        &mut self,
        id: u32,
        newest: &Published,
        events: &[RecordedMessage],
    ) -> Result<(), StreamEnd> {
        let mut payload = Vec::new();
        for event in events {
            cdr::encode(&mut payload, &event.fields);
            self.send_payload(id, newest, &payload).await?;
        }
        Ok(())
    }

    async fn send_payload(&mut self, id: u32, newest: &Published, payload: &[u8]) -> Result<(), StreamEnd> {
        self.send(channel_message(id, newest.clock_ns(), payload)).await?;
        self.messages += 1;
        self.bridge.messages.fetch_add(1, Ordering::Relaxed);
        Ok(())
    }

    /// Sends the status while no frames arrive, notes dropped messages, and ends the stream of a viewer that does not answer.
    async fn look_after(&mut self) -> Result<(), StreamEnd> {
        if !self.unanswered.is_empty() && self.heard.elapsed() > VIEWER_TIMEOUT {
            return Err(StreamEnd::Closed(close_code::POLICY, "the viewer has not answered for 30 s"));
        }
        let newest = Arc::clone(&self.newest.borrow());
        if std::mem::replace(&mut self.looked_at, newest.frames) == newest.frames && self.unanswered.is_empty() {
            let status = self.subscription_to(Channel::Status);
            self.send_frame(&newest, |id| Some(id) == status).await?;
        }
        let (noted, at) = self.noted;
        if self.dropped > noted && at.elapsed() >= NOTE_PERIOD {
            self.noted = (self.dropped, Instant::now());
            let text = format!("this viewer is slow: {} messages were replaced by newer ones", self.dropped);
            self.send(note(NoteLevel::Warning, "dropped", &text)).await?;
        }
        Ok(())
    }

    async fn send(&mut self, message: Message) -> Result<(), StreamEnd> {
        match timeout(VIEWER_TIMEOUT, self.socket.send(message)).await {
            Ok(Ok(())) => Ok(()),
            Ok(Err(_)) | Err(_) => Err(StreamEnd::Gone),
        }
    }
}
