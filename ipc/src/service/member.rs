//! A process's membership in a domain, and the services that it opens there.

use core::fmt::Debug;
use core::time::Duration;
use std::sync::Arc;
use std::thread;

use iceoryx2::node::NodeCreationFailure;
use iceoryx2::port::client::Client;
use iceoryx2::port::subscriber::{Subscriber, SubscriberCreateError};
use iceoryx2::prelude::{IceoryxSend, Node, NodeBuilder, NodeName, ServiceName, SignalHandlingMode, ZeroCopySend};
use iceoryx2::service::builder::publish_subscribe::Builder;
use iceoryx2::service::port_factory::client::ClientCreateError;
use iceoryx2::service::port_factory::subscriber::PortFactorySubscriber;
use iceoryx2::service::port_factory::{PortFactory as _, publish_subscribe};

use super::joining::{Role, close_to_others, enter, require_memory};
use super::trouble::{Sorted, Trouble};
use crate::domain::{BusError, Domain, DomainError, Membership, SHARED_MEMORY, require_open_files, reserve_segments};
use crate::wake::WakePage;
use crate::wire::services::{
    ALERT_BUFFER, ALERTS, ALL_READERS, AlertService, COMMAND_EVENT_BUFFER, COMMAND_EVENTS, COMMANDS,
    CommandEventService, CommandService, DESCRIPTION, DescriptionService, EventService, FRAMES, FrameService,
    MAX_ACTIVE_REQUESTS, MAX_BORROWED_FRAMES, MAX_MONITORS, MAX_NODES, MAX_READERS, MAX_SOURCES, READERS, REPLAY,
    ReaderService, ReplayService, STATUS, Service, StatusService, frame_buffer,
};
use crate::wire::{Command, CommandReply, FrameHeader, HandleState};

/// Number of attempts for a service, and the time between two: one second in total. A source repeats them while another
/// process creates or removes the service. Source and client repeat them after a signal.
const MAX_TRIES: u32 = 100;
const TRY_PERIOD: Duration = Duration::from_millis(10);

/// A process's membership in a domain.
#[derive(Debug)]
pub struct Member {
    node: Node<Service>,
    instance: String,
    role: Role,
    // Dropped last, after the node.
    membership: Arc<Membership>,
}

impl Member {
    /// Joins a domain under a node name that `iox2 node list` shows. A source creates the domain's directory; for a
    /// client the directory must exist.
    ///
    /// # Errors
    /// [`BusError::NoServer`] for a client without a directory or services, [`BusError::Domain`] for a directory that is
    /// not usable. Also [`BusError::PermissionDenied`], [`BusError::TooFewFiles`], [`BusError::SharedMemoryFull`] and
    /// [`BusError::SharedMemoryUnusable`]. [`BusError::Failed`] for any other error, such as a name that iceoryx2 does
    /// not allow.
    pub fn join(domain: &Domain, name: &str, role: Role) -> Result<Self, BusError> {
        let instance = domain.instance().to_string();
        require_open_files(role.open_files())?;
        let membership = loop {
            match (enter(domain, role), role) {
                // The last member to leave has just removed the directory.
                (Err(DomainError::Missing { .. }), Role::Source { .. }) => {}
                (Err(DomainError::Missing { .. }), Role::Client) => return Err(BusError::NoServer { instance }),
                (entered, _) => break entered?,
            }
        };
        domain.renew_occupied_secret()?;
        domain
            .set_fallback_configuration()
            .map_err(|error| DomainError::Io { path: domain.iceoryx2_toml_path(), error })?;
        require_memory(domain, role.memory())?;
        let name = NodeName::new(name).map_err(|error| BusError::failed("the node's name", error))?;
        let node = NodeBuilder::new()
            .name(&name)
            .config(&domain.iceoryx2_config())
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<Service>()
            .map_err(|error| match error {
                NodeCreationFailure::InsufficientPermissions => BusError::PermissionDenied { service: "the domain" },
                error => BusError::failed("the domain", error),
            })?;
        close_to_others(domain).map_err(|error| DomainError::Io { path: SHARED_MEMORY.into(), error })?;
        Ok(Self { node, instance, role, membership: Arc::new(membership) })
    }

    /// Allocates all memory of the domain's segments, so that no write into them can fail later. Call it after the last port
    /// is created.
    ///
    /// # Errors
    /// [`BusError::SharedMemoryFull`] and [`BusError::SharedMemoryUnusable`].
    pub fn reserve_memory(&self) -> Result<(), BusError> {
        reserve_segments(self.membership.domain())
    }

    /// Returns a share of the membership, for objects that keep the node alive longer than this member.
    pub(crate) fn membership(&self) -> Arc<Membership> {
        Arc::clone(&self.membership)
    }

    /// Opens the frames: slices of [`HandleState`] with a [`FrameHeader`]. A slow reader loses its own oldest frames.
    ///
    /// # Errors
    /// As for every service: [`BusError::NoServer`], [`BusError::VersionMismatch`], [`BusError::PermissionDenied`],
    /// [`BusError::HalfMade`], [`BusError::TooManyClients`], [`BusError::Failed`]; for a source also
    /// [`BusError::Blocked`].
    pub fn frames(&self) -> Result<FrameService, BusError> {
        let builder = || {
            self.node
                .service_builder(&service_name(FRAMES))
                .publish_subscribe::<[HandleState]>()
                .user_header::<FrameHeader>()
                .enable_safe_overflow(true)
        };
        let create = |handle_count| limit(builder(), [frame_buffer(handle_count), MAX_BORROWED_FRAMES, 0]).create();
        if self.role != Role::Client {
            // Readers expect the page as soon as the frames exist.
            self.wake_page()?;
        }
        self.open_or_create(FRAMES, || builder().open(), create)
    }

    /// Opens the page with the wake word of the frames.
    ///
    /// # Errors
    /// [`BusError::VersionMismatch`] for a client of a source of an earlier version, which creates no page.
    /// [`BusError::SharedMemoryUnusable`] and [`BusError::Domain`] where the page cannot be created or mapped.
    pub fn wake_page(&self) -> Result<WakePage, BusError> {
        match self.role {
            Role::Source { .. } => WakePage::create(self.membership.domain()),
            Role::Client => WakePage::open(self.membership.domain()),
        }
    }

    /// Opens the event that follows each frame, for stock clients.
    ///
    /// # Errors
    /// As [`Member::frames`].
    pub fn frame_events(&self) -> Result<EventService, BusError> {
        self.events(FRAMES)
    }

    /// Opens the description: the configuration as TOML text. Late joiners receive the latest one.
    ///
    /// # Errors
    /// As [`Member::frames`].
    pub fn description(&self) -> Result<DescriptionService, BusError> {
        let builder = || {
            self.node
                .service_builder(&service_name(DESCRIPTION))
                .publish_subscribe::<[u8]>()
                .user_header::<u64>()
                .enable_safe_overflow(true)
        };
        let create = |_| limit(builder(), [1; 3]).create();
        self.open_or_create(DESCRIPTION, || builder().open(), create)
    }

    /// Opens the server's status. Late joiners receive the latest one.
    ///
    /// # Errors
    /// As [`Member::frames`].
    pub fn status(&self) -> Result<StatusService, BusError> {
        self.latest_value(STATUS)
    }

    /// Opens the status of a replay. Late joiners receive the latest one. Every source creates the service, but only a replay
    /// publishes.
    ///
    /// # Errors
    /// As [`Member::frames`].
    pub fn replay(&self) -> Result<ReplayService, BusError> {
        self.latest_value(REPLAY)
    }

    /// Opens the monitors' alerts. Late joiners may receive the last ones of each monitor.
    ///
    /// # Errors
    /// As [`Member::frames`].
    pub fn alerts(&self) -> Result<AlertService, BusError> {
        self.messages(ALERTS, [ALERT_BUFFER, MAX_BORROWED_FRAMES, ALERT_BUFFER], MAX_MONITORS)
    }

    /// Opens the wake-up event that follows each alert.
    ///
    /// # Errors
    /// As [`Member::frames`].
    pub fn alert_events(&self) -> Result<EventService, BusError> {
        self.events(ALERTS)
    }

    /// Opens the reports of the readers of frames. Only the newest report of each reader is kept.
    ///
    /// # Errors
    /// As [`Member::frames`].
    pub fn readers(&self) -> Result<ReaderService, BusError> {
        self.messages(READERS, [1, 1, 0], ALL_READERS)
    }

    /// Opens the commands to the server. The server replies to each once.
    ///
    /// # Errors
    /// As [`Member::frames`].
    pub fn commands(&self) -> Result<CommandService, BusError> {
        let builder = || self.node.service_builder(&service_name(COMMANDS)).request_response::<Command, CommandReply>();
        let create = |_| {
            builder()
                .max_servers(MAX_SOURCES)
                .max_clients(ALL_READERS)
                .max_nodes(MAX_NODES)
                .max_active_requests_per_client(MAX_ACTIVE_REQUESTS)
                .max_response_buffer_size(1)
                .create()
        };
        self.open_or_create(COMMANDS, || builder().open(), create)
    }

    /// Opens the command events: each command with its outcome. Late joiners receive the last ones.
    ///
    /// # Errors
    /// As [`Member::frames`].
    pub fn command_events(&self) -> Result<CommandEventService, BusError> {
        self.messages(COMMAND_EVENTS, [COMMAND_EVENT_BUFFER, 1, COMMAND_EVENT_BUFFER], MAX_SOURCES)
    }

    /// Creates a reader of a service that this member has opened. The reader begins with the past messages that the service
    /// keeps for late joiners.
    ///
    /// # Errors
    /// [`BusError::TooManyClients`] where all places are taken that this member may use, else [`BusError::Failed`].
    pub(crate) fn subscribe<Payload, Header>(
        &self,
        service: &'static str,
        opened: &publish_subscribe::PortFactory<Service, Payload, Header>,
    ) -> Result<Subscriber<Service, Payload, Header>, BusError>
    where
        Payload: Debug + IceoryxSend + ?Sized,
        Header: Debug + ZeroCopySend,
    {
        self.create_reader(service, opened, opened.subscriber_builder())
    }

    /// As [`Member::subscribe`], but the reader receives no past message.
    pub(crate) fn subscribe_from_now<Payload, Header>(
        &self,
        service: &'static str,
        opened: &publish_subscribe::PortFactory<Service, Payload, Header>,
    ) -> Result<Subscriber<Service, Payload, Header>, BusError>
    where
        Payload: Debug + IceoryxSend + ?Sized,
        Header: Debug + ZeroCopySend,
    {
        self.create_reader(service, opened, opened.subscriber_builder().history_request(0))
    }

    fn create_reader<Payload, Header>(
        &self,
        service: &'static str,
        opened: &publish_subscribe::PortFactory<Service, Payload, Header>,
        builder: PortFactorySubscriber<'_, Service, Payload, Header>,
    ) -> Result<Subscriber<Service, Payload, Header>, BusError>
    where
        Payload: Debug + IceoryxSend + ?Sized,
        Header: Debug + ZeroCopySend,
    {
        let subscriber = builder.create().map_err(|error| match error {
            SubscriberCreateError::ExceedsMaxSupportedSubscribers => BusError::TooManyClients { service },
            error => BusError::failed(service, error),
        })?;
        self.admit(service, opened.dynamic_config().number_of_subscribers())?;
        Ok(subscriber)
    }

    /// Creates a client of the commands.
    ///
    /// # Errors
    /// As [`Member::subscribe`].
    pub(crate) fn command_client(&self) -> Result<Client<Service, Command, (), CommandReply, ()>, BusError> {
        let opened = self.commands()?;
        let client = opened.client_builder().create().map_err(|error| match error {
            ClientCreateError::ExceedsMaxSupportedClients => BusError::TooManyClients { service: COMMANDS },
            error => BusError::failed(COMMANDS, error),
        })?;
        self.admit(COMMANDS, opened.dynamic_config().number_of_clients())?;
        Ok(client)
    }

    /// Refuses a reader that has taken a place which is reserved for operators' tools. It is counted after it was created,
    /// so that two readers at the same time cannot both take the last place.
    fn admit(&self, service: &'static str, readers: usize) -> Result<(), BusError> {
        let places = if self.membership.domain().is_operators() { ALL_READERS } else { MAX_READERS };
        if readers > places { Err(BusError::TooManyClients { service }) } else { Ok(()) }
    }

    fn latest_value<Payload: Debug + IceoryxSend>(
        &self,
        service: &'static str,
    ) -> Result<publish_subscribe::PortFactory<Service, Payload, ()>, BusError> {
        self.messages(service, [1; 3], MAX_SOURCES)
    }

    /// Opens a service of messages with these [`limit`]s.
    fn messages<Payload: Debug + IceoryxSend>(
        &self,
        service: &'static str,
        limits: [usize; 3],
        publishers: usize,
    ) -> Result<publish_subscribe::PortFactory<Service, Payload, ()>, BusError> {
        let builder = || {
            self.node.service_builder(&service_name(service)).publish_subscribe::<Payload>().enable_safe_overflow(true)
        };
        let create = |_| limit(builder(), limits).max_publishers(publishers).create();
        self.open_or_create(service, || builder().open(), create)
    }

    fn events(&self, service: &'static str) -> Result<EventService, BusError> {
        let builder = || self.node.service_builder(&service_name(service)).event();
        let create = |_| {
            builder()
                .max_notifiers(MAX_MONITORS)
                .max_listeners(ALL_READERS)
                .max_nodes(MAX_NODES)
                .event_id_max_value(1)
                .create()
        };
        self.open_or_create(service, || builder().open(), create)
    }

    /// Opens a service. A source creates it if it is missing. An existing service keeps its own limits.
    ///
    /// A source retries while the last client of an earlier source is leaving. Source and client retry after an
    /// interrupting signal.
    fn open_or_create<Factory, OpenError: Sorted, CreateError: Sorted>(
        &self,
        service: &'static str,
        open: impl Fn() -> Result<Factory, OpenError>,
        create: impl Fn(usize) -> Result<Factory, CreateError>,
    ) -> Result<Factory, BusError> {
        let once = || match (open(), self.role) {
            (Err(error), Role::Source { handle_count }) if error.trouble() == Trouble::Absent => {
                create(handle_count).map_err(|error| (error.trouble(), self.sort(service, &error)))
            }
            (opened, _) => opened.map_err(|error| (error.trouble(), self.sort(service, &error))),
        };
        let mut tries = 1;
        loop {
            match once() {
                Err((Trouble::InFlux, _)) if self.role != Role::Client && tries < MAX_TRIES => tries += 1,
                Err((Trouble::Interrupted, _)) if tries < MAX_TRIES => tries += 1,
                outcome => return outcome.map_err(|(_, error)| error),
            }
            thread::sleep(TRY_PERIOD);
        }
    }

    fn sort(&self, service: &'static str, error: &impl Sorted) -> BusError {
        match error.trouble() {
            // A source has created an absent service, and has retried one in flux.
            Trouble::Absent | Trouble::InFlux | Trouble::HalfMade if self.role != Role::Client => {
                BusError::Blocked { service }
            }
            Trouble::Absent | Trouble::InFlux => BusError::NoServer { instance: self.instance.clone() },
            Trouble::Mismatch => BusError::VersionMismatch { service },
            Trouble::Denied => BusError::PermissionDenied { service },
            Trouble::HalfMade => BusError::HalfMade { service },
            Trouble::Full => BusError::TooManyClients { service },
            Trouble::Interrupted | Trouble::Other => BusError::failed(service, error),
        }
    }
}

/// Sets the limits of a service: publishers, readers and nodes, the unread and held samples per reader, and the last samples for
/// late joiners.
fn limit<Payload, Header>(
    builder: Builder<Payload, Header, Service>,
    [unread, held, history]: [usize; 3],
) -> Builder<Payload, Header, Service>
where
    Payload: Debug + IceoryxSend + ?Sized,
    Header: Debug + ZeroCopySend,
{
    builder
        .max_publishers(MAX_SOURCES)
        .max_subscribers(ALL_READERS)
        .max_nodes(MAX_NODES)
        .subscriber_max_buffer_size(unread)
        .subscriber_max_borrowed_samples(held)
        .history_size(history)
}

fn service_name(name: &'static str) -> ServiceName {
    ServiceName::new(name).expect("the bus's names are valid service names")
}
