//! A process's membership in a domain, and the services that it opens there.

use core::fmt::Debug;
use core::time::Duration;
use std::fs::Permissions;
use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _};
use std::sync::Arc;
use std::{fs, io, thread};

use iceoryx2::node::NodeCreationFailure;
use iceoryx2::port::client::Client;
use iceoryx2::port::subscriber::{Subscriber, SubscriberCreateError};
use iceoryx2::prelude::{IceoryxSend, Node, NodeBuilder, NodeName, ServiceName, SignalHandlingMode, ZeroCopySend};
use iceoryx2::service::builder::publish_subscribe::Builder;
use iceoryx2::service::port_factory::client::ClientCreateError;
use iceoryx2::service::port_factory::subscriber::PortFactorySubscriber;
use iceoryx2::service::port_factory::{PortFactory as _, publish_subscribe};

use super::trouble::{Sorted, Trouble};
use crate::domain::{
    BusError, Domain, DomainError, Membership, SHARED_MEMORY, if_there, release_operator_reserve, remove_dead_nodes,
    require_open_files, require_shared_memory, reserve_segments,
};
use crate::wake::WakePage;
use crate::wire::services::{
    ALERT_BUFFER, ALERTS, ALL_READERS, AlertService, CLIENT_FILES, CLIENT_MEMORY, COMMAND_EVENT_BUFFER, COMMAND_EVENTS,
    COMMANDS, CommandEventService, CommandService, DESCRIPTION, DescriptionService, EventService, FRAMES, FrameService,
    MAX_ACTIVE_REQUESTS, MAX_BORROWED_FRAMES, MAX_MONITORS, MAX_NODES, MAX_READERS, MAX_SOURCES, READERS, REPLAY,
    ReaderService, ReplayService, SOURCE_FILES, SOURCE_MEMORY, STATUS, Service, StatusService, frame_buffer,
};
use crate::wire::{
    Alert, Command, CommandEvent, CommandReply, FrameHeader, HandleState, ReaderReport, ReplayStatus, Status,
};

/// Number of attempts for a service, and the time between two: one second in total. A source repeats them while another
/// process creates or removes the service. Source and client repeat them after a signal.
const MAX_TRIES: u32 = 100;
const TRY_PERIOD: Duration = Duration::from_millis(10);

/// Side of the services on which a process is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Creates missing services. The number of handles determines how many frames are buffered.
    Source {
        /// Number of handle states of a frame.
        handle_count: usize,
    },
    /// Opens existing services only.
    Client,
}

impl Role {
    /// Greatest shared memory of its ports without the frames, in bytes.
    fn memory(self) -> u64 {
        match self {
            Self::Source { .. } => SOURCE_MEMORY,
            Self::Client => CLIENT_MEMORY,
        }
    }

    /// Greatest number of files that it opens.
    fn open_files(self) -> usize {
        match self {
            Self::Source { .. } => SOURCE_FILES,
            Self::Client => CLIENT_FILES,
        }
    }
}

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
        let create = |handle_count| limit(builder(), frame_buffer(handle_count), MAX_BORROWED_FRAMES, 0).create();
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
        let create = |_| limit(builder(), 1, 1, 1).create();
        self.open_or_create(DESCRIPTION, || builder().open(), create)
    }

    /// Opens the server's status. Late joiners receive the latest one.
    ///
    /// # Errors
    /// As [`Member::frames`].
    pub fn status(&self) -> Result<StatusService, BusError> {
        let builder = || {
            self.node.service_builder(&service_name(STATUS)).publish_subscribe::<Status>().enable_safe_overflow(true)
        };
        let create = |_| limit(builder(), 1, 1, 1).create();
        self.open_or_create(STATUS, || builder().open(), create)
    }

    /// Opens the status of a replay. Late joiners receive the latest one. Every source creates the service, but only a replay
    /// publishes.
    ///
    /// # Errors
    /// As [`Member::frames`].
    pub fn replay(&self) -> Result<ReplayService, BusError> {
        let builder = || {
            self.node
                .service_builder(&service_name(REPLAY))
                .publish_subscribe::<ReplayStatus>()
                .enable_safe_overflow(true)
        };
        let create = |_| limit(builder(), 1, 1, 1).create();
        self.open_or_create(REPLAY, || builder().open(), create)
    }

    /// Opens the monitors' alerts. Late joiners may receive the last ones of each monitor.
    ///
    /// # Errors
    /// As [`Member::frames`].
    pub fn alerts(&self) -> Result<AlertService, BusError> {
        let builder =
            || self.node.service_builder(&service_name(ALERTS)).publish_subscribe::<Alert>().enable_safe_overflow(true);
        let create =
            |_| limit(builder(), ALERT_BUFFER, MAX_BORROWED_FRAMES, ALERT_BUFFER).max_publishers(MAX_MONITORS).create();
        self.open_or_create(ALERTS, || builder().open(), create)
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
        let builder = || {
            self.node
                .service_builder(&service_name(READERS))
                .publish_subscribe::<ReaderReport>()
                .enable_safe_overflow(true)
        };
        let create = |_| limit(builder(), 1, 1, 0).max_publishers(ALL_READERS).create();
        self.open_or_create(READERS, || builder().open(), create)
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
        let builder = || {
            self.node
                .service_builder(&service_name(COMMAND_EVENTS))
                .publish_subscribe::<CommandEvent>()
                .enable_safe_overflow(true)
        };
        let create = |_| limit(builder(), COMMAND_EVENT_BUFFER, 1, COMMAND_EVENT_BUFFER).create();
        self.open_or_create(COMMAND_EVENTS, || builder().open(), create)
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

/// Sets the limits of a service: publishers, readers and nodes. `buffer` and `borrowed` are the unread and held samples
/// per reader, `history` the last samples for late joiners.
fn limit<Payload, Header>(
    builder: Builder<Payload, Header, Service>,
    buffer: usize,
    borrowed: usize,
    history: usize,
) -> Builder<Payload, Header, Service>
where
    Payload: Debug + IceoryxSend + ?Sized,
    Header: Debug + ZeroCopySend,
{
    builder
        .max_publishers(MAX_SOURCES)
        .max_subscribers(ALL_READERS)
        .max_nodes(MAX_NODES)
        .subscriber_max_buffer_size(buffer)
        .subscriber_max_borrowed_samples(borrowed)
        .history_size(history)
}

/// Gives mode 0600 to the domain's files in shared memory. iceoryx2 creates one, the state of its unique numbers, that every
/// user may write.
fn close_to_others(domain: &Domain) -> io::Result<()> {
    let prefix = domain.prefix();
    for entry in fs::read_dir(SHARED_MEMORY)?.flatten() {
        if entry.file_name().to_string_lossy().starts_with(&prefix) {
            let Some(metadata) = if_there(entry.metadata())? else { continue };
            if metadata.is_file() && metadata.uid() == domain.uid() && metadata.mode() & 0o077 != 0 {
                if_there(fs::set_permissions(entry.path(), Permissions::from_mode(0o600)))?;
            }
        }
    }
    Ok(())
}

/// Checks that there is memory for a member's segments. Removes what killed processes have left, since it may be that very memory.
///
/// An operator's tool leaves the remains of the show's processes, from which every other tool sees that they were killed. If
/// `/dev/shm` is full, it removes them too, and takes the memory that a source keeps for it.
fn require_memory(domain: &Domain, needed: u64) -> Result<(), BusError> {
    if !domain.is_operators() {
        remove_dead_nodes(domain, |_| true)?;
        return require_shared_memory(domain, needed);
    }
    remove_dead_nodes(domain, |node| !node.is_part_of_show())?;
    match require_shared_memory(domain, needed) {
        Err(BusError::SharedMemoryFull { .. }) => {
            remove_dead_nodes(domain, |_| true)?;
            release_operator_reserve(domain);
            require_shared_memory(domain, needed)
        }
        outcome => outcome,
    }
}

fn enter(domain: &Domain, role: Role) -> Result<Membership, DomainError> {
    match role {
        Role::Source { .. } => domain.create_directory()?,
        Role::Client => {
            domain.check_directory()?;
            require_services(domain)?;
        }
    }
    Membership::join(domain)
}

/// Checks that there are services to open. This is cheaper than joining, and a waiting client calls it often.
fn require_services(domain: &Domain) -> Result<(), DomainError> {
    let path = domain.root().join("services");
    match fs::read_dir(&path).map(|mut services| services.next().is_none()) {
        Ok(false) => Ok(()),
        Ok(true) => Err(DomainError::Missing { path }),
        Err(error) => Err(DomainError::of(path, error)),
    }
}

fn service_name(name: &'static str) -> ServiceName {
    ServiceName::new(name).expect("the bus's names are valid service names")
}
