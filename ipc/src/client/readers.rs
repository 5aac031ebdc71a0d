//! Readers of the description, the status, the alerts, the command events, and the reports of readers.

use core::time::Duration;
use std::rc::Rc;

use iceoryx2::port::listener::{Listener, ListenerWaitError};
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::port::update_connections::UpdateConnections as _;
use iceoryx2::prelude::ZeroCopySend;

use crate::domain::{BusError, Domain, require_open_files};
use crate::service::{
    ALERTS, COMMAND_EVENTS, DESCRIPTION, Member, READERS, REPLAY, REPORT_FILES, Role, STATUS, Service,
};
use crate::wire::{Alert, CommandEvent, ReaderReport, ReplayStatus, Status, dragon_names};

/// Least timeout; shorter waits return at once. The socket behind a listener treats a timeout of 0 microseconds as no
/// timeout.
const LEAST_WAIT: Duration = Duration::from_micros(1);

/// The oldest unread message of a service, or `None` if all are read.
fn receive<Payload: Copy + core::fmt::Debug + ZeroCopySend>(
    service: &'static str,
    subscriber: &Subscriber<Service, Payload, ()>,
) -> Result<Option<Payload>, BusError> {
    let sample = subscriber.receive().map_err(|error| BusError::failed(service, error))?;
    Ok(sample.map(|sample| *sample.payload()))
}

/// The configuration of a run, as the server published it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Description {
    /// Run of the configuration.
    pub run_id: u64,
    /// The complete configuration as TOML.
    pub toml: String,
}

impl Description {
    /// The names of the dragons, as [`dragon_names`].
    pub fn dragon_names(&self) -> Vec<&str> {
        dragon_names(&self.toml)
    }
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
        receive(STATUS, &self.subscriber)
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
        receive(REPLAY, &self.subscriber)
    }
}

/// Reads the alerts of an instance, oldest first: those that are sent from its opening on, or also the last ones before it.
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
        Self::open_with(domain, name, |member| member.subscribe_from_now(ALERTS, &member.alerts()?))
    }

    /// Opens the alerts of a domain. The reader begins with up to [`ALERT_BUFFER`](crate::service::ALERT_BUFFER) past alerts
    /// of each running monitor.
    ///
    /// # Errors
    /// As [`Member::frames`].
    pub fn open_with_past(domain: &Domain, name: &str) -> Result<Self, BusError> {
        Self::open_with(domain, name, |member| member.subscribe(ALERTS, &member.alerts()?))
    }

    fn open_with(
        domain: &Domain,
        name: &str,
        subscribe: impl FnOnce(&Member) -> Result<Subscriber<Service, Alert, ()>, BusError>,
    ) -> Result<Self, BusError> {
        let member = Member::join(domain, name, Role::Client)?;
        let listener =
            member.alert_events()?.listener_builder().create().map_err(|error| BusError::failed(ALERTS, error))?;
        let subscriber = subscribe(&member)?;
        member.reserve_memory()?;
        Ok(Self { subscriber, listener, _member: member })
    }

    /// Returns the oldest unread alert, or `None` if all are read. Never waits.
    ///
    /// # Errors
    /// [`BusError::Failed`] where the publisher's memory cannot be mapped.
    pub fn receive(&self) -> Result<Option<Alert>, BusError> {
        receive(ALERTS, &self.subscriber)
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
        receive(COMMAND_EVENTS, &self.subscriber)
    }
}

/// Reads the reports of an instance's readers.
///
/// Only the newest report of each reader is kept. Reports count from the reader's beginning, so late or rare reading
/// loses no counts. Reports of readers that ended before this object was opened are not received.
#[derive(Debug)]
pub struct ReaderReports {
    // Dropped before its node.
    subscriber: Subscriber<Service, ReaderReport, ()>,
    _member: Member,
}

impl ReaderReports {
    /// Opens the reports of a domain. Each reader connects to it with its next report.
    ///
    /// # Errors
    /// As [`Member::readers`] and [`Member::join`]; also [`BusError::NoServer`] where the source is of an earlier
    /// version, which does not create this service.
    pub fn open(domain: &Domain, name: &str) -> Result<Self, BusError> {
        require_open_files(REPORT_FILES)?;
        let member = Member::join(domain, name, Role::Client)?;
        let subscriber = member.subscribe(READERS, &member.readers()?)?;
        member.reserve_memory()?;
        Ok(Self { subscriber, _member: member })
    }

    /// Returns the next unread report of any reader, or `None` if all are read. Never waits.
    ///
    /// # Errors
    /// [`BusError::Failed`] where a reader's memory cannot be mapped.
    pub fn receive(&self) -> Result<Option<ReaderReport>, BusError> {
        receive(READERS, &self.subscriber)
    }
}
