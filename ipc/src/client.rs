//! Readers of the description, the status, the alerts and the command events, and the client that commands the server.

use core::time::Duration;
use std::rc::Rc;
use std::time::Instant;

use iceoryx2::pending_response::PendingResponse;
use iceoryx2::port::client::Client;
use iceoryx2::port::listener::{Listener, ListenerWaitError};
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::port::update_connections::UpdateConnections as _;

use crate::alert::Alert;
use crate::command::{Command, CommandReply, Request, Sender};
use crate::command_event::CommandEvent;
use crate::domain::Domain;
use crate::error::BusError;
use crate::replay_status::ReplayStatus;
use crate::service::{ALERTS, COMMAND_EVENTS, COMMANDS, DESCRIPTION, Member, REPLAY, Role, STATUS, Service};
use crate::source_lock::SourceLock;
use crate::status::Status;

/// Least timeout; shorter waits return at once. The socket behind a listener treats a timeout of 0 microseconds as no
/// timeout.
const LEAST_WAIT: Duration = Duration::from_micros(1);

/// The configuration of a run, as the server published it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Description {
    /// Run of the configuration.
    pub run_id: u64,
    /// The complete configuration as TOML.
    pub toml: String,
}

/// Reads the description of an instance.
#[derive(Debug)]
pub struct DescriptionReader {
    subscriber: Subscriber<Service, [u8], u64>,
    _member: Rc<Member>,
}

impl DescriptionReader {
    /// Opens the description of a domain.
    ///
    /// # Errors
    /// As [`Member::frames`].
    pub fn open(domain: &Domain, name: &str) -> Result<Self, BusError> {
        Self::of(&Rc::new(Member::join(domain, name, Role::Client)?))
    }

    /// Opens the description as one of several ports of a member.
    pub(crate) fn of(member: &Rc<Member>) -> Result<Self, BusError> {
        let subscriber = member.subscribe(DESCRIPTION, &member.description()?)?;
        member.reserve_memory()?;
        Ok(Self { subscriber, _member: Rc::clone(member) })
    }

    /// Connects to a source that has come up. From then on, what it has sent can be read also after its end.
    pub(crate) fn connect(&self) {
        // The next poll reports the error.
        let _ = self.subscriber.update_connections();
    }

    /// Returns the description if it is new since the last call. Never waits.
    ///
    /// # Errors
    /// [`BusError::VersionMismatch`] where the description is not UTF-8, [`BusError::Failed`] where its memory cannot be
    /// mapped.
    pub fn poll(&self) -> Result<Option<Description>, BusError> {
        let Some(sample) = self.subscriber.receive().map_err(|error| BusError::failed(DESCRIPTION, error))? else {
            return Ok(None);
        };
        let toml = core::str::from_utf8(sample.payload())
            .map_err(|_| BusError::VersionMismatch { service: DESCRIPTION })?
            .to_owned();
        Ok(Some(Description { run_id: *sample.user_header(), toml }))
    }
}

/// Reads the status of an instance.
#[derive(Debug)]
pub struct StatusReader {
    subscriber: Subscriber<Service, Status, ()>,
    _member: Rc<Member>,
}

impl StatusReader {
    /// Opens the status of a domain.
    ///
    /// # Errors
    /// As [`Member::frames`].
    pub fn open(domain: &Domain, name: &str) -> Result<Self, BusError> {
        Self::of(&Rc::new(Member::join(domain, name, Role::Client)?))
    }

    /// Opens the status as one of several ports of a member.
    pub(crate) fn of(member: &Rc<Member>) -> Result<Self, BusError> {
        let subscriber = member.subscribe(STATUS, &member.status()?)?;
        member.reserve_memory()?;
        Ok(Self { subscriber, _member: Rc::clone(member) })
    }

    /// As [`DescriptionReader::connect`].
    pub(crate) fn connect(&self) {
        let _ = self.subscriber.update_connections();
    }

    /// Returns the status if it is new since the last call. Never waits.
    ///
    /// # Errors
    /// [`BusError::Failed`] where the publisher's memory cannot be mapped.
    pub fn poll(&self) -> Result<Option<Status>, BusError> {
        let sample = self.subscriber.receive().map_err(|error| BusError::failed(STATUS, error))?;
        Ok(sample.map(|sample| *sample.payload()))
    }
}

/// Reads the latest status of a replay.
#[derive(Debug)]
pub struct ReplayStatusReader {
    subscriber: Subscriber<Service, ReplayStatus, ()>,
    _member: Member,
}

impl ReplayStatusReader {
    /// Opens the status of a domain's replay.
    ///
    /// # Errors
    /// As [`Member::frames`].
    pub fn open(domain: &Domain, name: &str) -> Result<Self, BusError> {
        let member = Member::join(domain, name, Role::Client)?;
        let subscriber =
            member.replay()?.subscriber_builder().create().map_err(|error| BusError::failed(REPLAY, error))?;
        Ok(Self { subscriber, _member: member })
    }

    /// Returns the status if it is new since the last call. Never waits.
    ///
    /// # Errors
    /// [`BusError::Failed`] where the publisher's memory cannot be mapped.
    pub fn poll(&self) -> Result<Option<ReplayStatus>, BusError> {
        let sample = self.subscriber.receive().map_err(|error| BusError::failed(REPLAY, error))?;
        Ok(sample.map(|sample| *sample.payload()))
    }
}

/// Reads the alerts of an instance, oldest first.
#[derive(Debug)]
pub struct AlertSubscriber {
    subscriber: Subscriber<Service, Alert, ()>,
    listener: Listener<Service>,
    _member: Member,
}

impl AlertSubscriber {
    /// Opens the alerts of a domain.
    ///
    /// # Errors
    /// As [`Member::frames`].
    pub fn open(domain: &Domain, name: &str) -> Result<Self, BusError> {
        let member = Member::join(domain, name, Role::Client)?;
        let listener =
            member.alert_events()?.listener_builder().create().map_err(|error| BusError::failed(ALERTS, error))?;
        let subscriber = member.subscribe(ALERTS, &member.alerts()?)?;
        member.reserve_memory()?;
        Ok(Self { subscriber, listener, _member: member })
    }

    /// Returns the oldest unread alert, or `None` if all are read. Never waits.
    ///
    /// # Errors
    /// [`BusError::Failed`] where the publisher's memory cannot be mapped.
    pub fn receive(&self) -> Result<Option<Alert>, BusError> {
        let sample = self.subscriber.receive().map_err(|error| BusError::failed(ALERTS, error))?;
        Ok(sample.map(|sample| *sample.payload()))
    }

    /// Returns the oldest unread alert. Waits for one at most `timeout` and then returns `None`. A signal ends the wait
    /// early.
    ///
    /// # Errors
    /// As [`AlertSubscriber::receive`].
    pub fn wait(&self, timeout: Duration) -> Result<Option<Alert>, BusError> {
        if let Some(alert) = self.receive()? {
            return Ok(Some(alert));
        }
        if timeout < LEAST_WAIT {
            return Ok(None);
        }
        match self.listener.timed_wait(|_| (), timeout) {
            Ok(_) | Err(ListenerWaitError::InterruptSignal) => self.receive(),
            Err(error) => Err(BusError::failed(ALERTS, error)),
        }
    }
}

/// Reads the events of the commands to an instance's source, oldest first. It starts with up to
/// [`COMMAND_EVENT_BUFFER`](crate::service::COMMAND_EVENT_BUFFER) events from before the reader was opened.
#[derive(Debug)]
pub struct CommandEventReader {
    subscriber: Subscriber<Service, CommandEvent, ()>,
    _member: Member,
}

impl CommandEventReader {
    /// Opens the events of a domain.
    ///
    /// # Errors
    /// As [`Member::frames`]; also [`BusError::NoServer`] where the source is of an earlier version, which does not
    /// create this service.
    pub fn open(domain: &Domain, name: &str) -> Result<Self, BusError> {
        let member = Member::join(domain, name, Role::Client)?;
        let subscriber = member.subscribe(COMMAND_EVENTS, &member.command_events()?)?;
        member.reserve_memory()?;
        Ok(Self { subscriber, _member: member })
    }

    /// Returns the oldest unread event, or `None` if all are read. Never waits. A gap in [`CommandEvent::number`] shows
    /// how many events were lost.
    ///
    /// # Errors
    /// [`BusError::Failed`] where the publisher's memory cannot be mapped.
    pub fn receive(&self) -> Result<Option<CommandEvent>, BusError> {
        let sample = self.subscriber.receive().map_err(|error| BusError::failed(COMMAND_EVENTS, error))?;
        Ok(sample.map(|sample| *sample.payload()))
    }
}

/// Sends commands to the server of an instance.
#[derive(Debug)]
pub struct CommandClient {
    client: Client<Service, Command, (), CommandReply, ()>,
    sender: Sender,
    domain: Domain,
    _member: Member,
}

impl CommandClient {
    /// Opens the commands of a domain.
    ///
    /// # Errors
    /// As [`Member::frames`].
    pub fn open(domain: &Domain, name: &str) -> Result<Self, BusError> {
        let member = Member::join(domain, name, Role::Client)?;
        let client = member.command_client()?;
        member.reserve_memory()?;
        Ok(Self { client, sender: Sender::Client, domain: domain.clone(), _member: member })
    }

    /// Returns the same client. Its commands are recorded with this kind of sender.
    #[must_use]
    pub fn sending_as(self, sender: Sender) -> Self {
        Self { sender, ..self }
    }

    /// Sends one command and waits until the server has accepted it, at most `timeout`. Returns the server's reply.
    ///
    /// The server replies at the start of its next tick, so a reply takes about one period.
    ///
    /// # Errors
    /// [`BusError::Refused`] where the server refuses the command; else as [`CommandClient::ask`].
    pub fn call(&self, request: Request, timeout: Duration) -> Result<CommandReply, BusError> {
        self.ask(request, timeout)?.to(request)
    }

    /// Sends one command and returns its reply, also if the server has refused the command. Waits at most `timeout`.
    ///
    /// # Errors
    /// [`BusError::NoServer`] where no server runs, or where the server ended or was killed before it replied.
    /// [`BusError::NoAnswer`] where no reply arrived in time, else [`BusError::Failed`].
    pub fn ask(&self, request: Request, timeout: Duration) -> Result<CommandReply, BusError> {
        self.ask_unless(request, timeout, || false)
    }

    /// Does the same as [`CommandClient::ask`], but also stops waiting as soon as `is_given_up` returns `true`. The
    /// command may still be executed.
    ///
    /// # Errors
    /// As [`CommandClient::ask`].
    pub fn ask_unless(
        &self,
        request: Request,
        timeout: Duration,
        is_given_up: impl Fn() -> bool,
    ) -> Result<CommandReply, BusError> {
        let mut pending = self.send(request)?;
        let no_answer = || BusError::NoAnswer { instance: self.domain.instance().to_string(), waited: timeout };
        await_reply(timeout, is_given_up, || pending.poll())?.ok_or_else(no_answer)
    }

    /// Sends one command, without waiting for its reply.
    pub(crate) fn send(&self, request: Request) -> Result<PendingReply, BusError> {
        let command = Command { sender: self.sender.to_wire(), pid: std::process::id(), ..request.to_wire() };
        let pending = self.client.send_copy(command).map_err(|error| BusError::failed(COMMANDS, error))?;
        let pending = PendingReply { pending, domain: self.domain.clone(), polls: 0 };
        if pending.pending.number_of_server_connections() == 0 || !SourceLock::is_held(&self.domain) {
            return Err(pending.no_server());
        }
        Ok(pending)
    }
}

/// Polls for the reply to a command. `None` as soon as `timeout` has passed or `is_given_up` returns `true`.
pub(crate) fn await_reply(
    timeout: Duration,
    is_given_up: impl Fn() -> bool,
    mut poll: impl FnMut() -> Result<Option<CommandReply>, BusError>,
) -> Result<Option<CommandReply>, BusError> {
    let begun = Instant::now();
    loop {
        // Read before the reply is received.
        let is_late = begun.elapsed() >= timeout || is_given_up();
        let reply = poll()?;
        if reply.is_some() || is_late {
            return Ok(reply);
        }
        std::thread::sleep(POLL_PERIOD);
    }
}

/// The reply to a command, which has not arrived yet.
#[derive(Debug)]
pub(crate) struct PendingReply {
    pending: PendingResponse<Service, Command, (), CommandReply, ()>,
    domain: Domain,
    polls: u32,
}

impl PendingReply {
    /// Returns the reply, if it has arrived. Never waits. Call it every [`POLL_PERIOD`].
    pub(crate) fn poll(&mut self) -> Result<Option<CommandReply>, BusError> {
        self.polls = self.polls.wrapping_add(1);
        // Read before the reply is received: a server disconnects from a command as soon as it has replied. A killed
        // server stays connected, but no longer holds its lock.
        let is_dead = self.polls.is_multiple_of(POLLS_PER_LOOK) && !SourceLock::is_held(&self.domain);
        let is_gone = is_dead || !self.pending.is_connected();
        match self.pending.receive().map_err(|error| BusError::failed(COMMANDS, error))? {
            Some(reply) => Ok(Some(*reply.payload())),
            None if is_gone => Err(self.no_server()),
            None => Ok(None),
        }
    }

    fn no_server(&self) -> BusError {
        BusError::NoServer { instance: self.domain.instance().to_string() }
    }
}

/// Period in which a client looks for the reply to its command.
const POLL_PERIOD: Duration = Duration::from_micros(200);
/// Polls after which a client looks whether the server still lives: about 20 ms.
const POLLS_PER_LOOK: u32 = 100;
