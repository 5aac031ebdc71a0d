//! Reading the description, the status and the alerts, and commanding the server.

use core::time::Duration;
use std::time::Instant;

use iceoryx2::port::client::Client;
use iceoryx2::port::listener::{Listener, ListenerWaitError};
use iceoryx2::port::subscriber::Subscriber;

use crate::alert::Alert;
use crate::command::{Command, CommandReply, Request, Sender};
use crate::command_event::CommandEvent;
use crate::domain::Domain;
use crate::error::BusError;
use crate::service::{ALERTS, COMMAND_EVENTS, COMMANDS, DESCRIPTION, Member, Role, STATUS, Service};
use crate::status::Status;
use crate::subscriber::LEAST_WAIT;

/// The configuration of a run, as the server published it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Description {
    /// The run that it belongs to.
    pub run_id: u64,
    /// The whole configuration as TOML.
    pub toml: String,
}

/// Reads the description of an instance.
#[derive(Debug)]
pub struct DescriptionReader {
    subscriber: Subscriber<Service, [u8], u64>,
    _member: Member,
}

impl DescriptionReader {
    /// Opens the description of a domain.
    ///
    /// # Errors
    /// As [`Member::frames`].
    pub fn open(domain: &Domain, name: &str) -> Result<Self, BusError> {
        let member = Member::join(domain, name, Role::Client)?;
        let subscriber = member
            .description()?
            .subscriber_builder()
            .create()
            .map_err(|error| BusError::failed(DESCRIPTION, error))?;
        Ok(Self { subscriber, _member: member })
    }

    /// The description, where it is new since the last call.
    ///
    /// # Errors
    /// [`BusError::VersionMismatch`] where it is not UTF-8, [`BusError::Failed`] where it cannot be mapped.
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
    _member: Member,
}

impl StatusReader {
    /// Opens the status of a domain.
    ///
    /// # Errors
    /// As [`Member::frames`].
    pub fn open(domain: &Domain, name: &str) -> Result<Self, BusError> {
        let member = Member::join(domain, name, Role::Client)?;
        let subscriber =
            member.status()?.subscriber_builder().create().map_err(|error| BusError::failed(STATUS, error))?;
        Ok(Self { subscriber, _member: member })
    }

    /// The status, where it is new since the last call.
    ///
    /// # Errors
    /// [`BusError::Failed`] where it cannot be mapped.
    pub fn poll(&self) -> Result<Option<Status>, BusError> {
        let sample = self.subscriber.receive().map_err(|error| BusError::failed(STATUS, error))?;
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
        let subscriber =
            member.alerts()?.subscriber_builder().create().map_err(|error| BusError::failed(ALERTS, error))?;
        Ok(Self { subscriber, listener, _member: member })
    }

    /// The oldest alert that has not been read yet. Never waits.
    ///
    /// # Errors
    /// [`BusError::Failed`] where it cannot be mapped.
    pub fn receive(&self) -> Result<Option<Alert>, BusError> {
        let sample = self.subscriber.receive().map_err(|error| BusError::failed(ALERTS, error))?;
        Ok(sample.map(|sample| *sample.payload()))
    }

    /// The oldest alert that has not been read yet, waiting for it at most `timeout`. A signal ends the wait early.
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

/// Reads the events of the commands to an instance's source, oldest first. The first ones are up to
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
    /// As [`Member::frames`]; [`BusError::NoServer`] also where the source is one of an earlier version, which makes no such
    /// service.
    pub fn open(domain: &Domain, name: &str) -> Result<Self, BusError> {
        let member = Member::join(domain, name, Role::Client)?;
        let subscriber = member
            .command_events()?
            .subscriber_builder()
            .create()
            .map_err(|error| BusError::failed(COMMAND_EVENTS, error))?;
        Ok(Self { subscriber, _member: member })
    }

    /// The oldest event that has not been read yet. Never waits. A gap in [`CommandEvent::number`] shows how many were lost.
    ///
    /// # Errors
    /// [`BusError::Failed`] where it cannot be mapped.
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
    instance: String,
    _member: Member,
}

impl CommandClient {
    /// Opens the commands of a domain.
    ///
    /// # Errors
    /// As [`Member::frames`].
    pub fn open(domain: &Domain, name: &str) -> Result<Self, BusError> {
        let member = Member::join(domain, name, Role::Client)?;
        let client = member.commands()?.client_builder().create().map_err(|error| BusError::failed(COMMANDS, error))?;
        let instance = domain.instance().to_string();
        Ok(Self { client, sender: Sender::Client, instance, _member: member })
    }

    /// The same client, whose commands are recorded as this kind of sender's.
    #[must_use]
    pub fn sending_as(self, sender: Sender) -> Self {
        Self { sender, ..self }
    }

    /// Sends one command and waits for its reply, at most `timeout`.
    ///
    /// The server answers at the start of its next tick, so a reply takes about one period.
    ///
    /// # Errors
    /// [`BusError::NoServer`] where no server took the command or it ended before it answered, [`BusError::NoAnswer`] where it
    /// has not answered in time, else [`BusError::Failed`].
    pub fn call(&self, request: Request, timeout: Duration) -> Result<CommandReply, BusError> {
        self.call_unless(request, timeout, || false)
    }

    /// The same for a command that may be given up: then no more time is left for its reply.
    ///
    /// # Errors
    /// As [`CommandClient::call`].
    pub fn call_unless(
        &self,
        request: Request,
        timeout: Duration,
        is_given_up: impl Fn() -> bool,
    ) -> Result<CommandReply, BusError> {
        const POLL_PERIOD: Duration = Duration::from_micros(200);
        let command = Command { sender: self.sender.to_wire(), pid: std::process::id(), ..request.to_wire() };
        let pending = self.client.send_copy(command).map_err(|error| BusError::failed(COMMANDS, error))?;
        if pending.number_of_server_connections() == 0 {
            return Err(BusError::NoServer { instance: self.instance.clone() });
        }
        let began = Instant::now();
        loop {
            // Asked before the reply is looked for: a server lets go of a command as soon as it has answered.
            let (is_gone, is_late) = (!pending.is_connected(), began.elapsed() >= timeout || is_given_up());
            if let Some(reply) = pending.receive().map_err(|error| BusError::failed(COMMANDS, error))? {
                return Ok(*reply.payload());
            }
            if is_gone {
                return Err(BusError::NoServer { instance: self.instance.clone() });
            }
            if is_late {
                return Err(BusError::NoAnswer { instance: self.instance.clone(), waited: timeout });
            }
            std::thread::sleep(POLL_PERIOD);
        }
    }
}
