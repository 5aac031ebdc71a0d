//! The services and their limits: one function a service, which the source and every client call, so that the two
//! sides cannot disagree.
//!
//! Only a source (the server, a replay, a receiving bridge) creates services; a client opens what is there. Each
//! service allows two publishers, because iceoryx2 cannot tunnel a service with one to another host; that there is
//! only one source at a time is seen to by the source itself.

use core::fmt;

use iceoryx2::node::NodeCreationFailure;
use iceoryx2::prelude::{Node, NodeBuilder, NodeName, ServiceName, SignalHandlingMode, ipc};
use iceoryx2::service::builder::event::{EventCreateError, EventOpenError};
use iceoryx2::service::builder::publish_subscribe::{PublishSubscribeCreateError, PublishSubscribeOpenError};
use iceoryx2::service::builder::request_response::{RequestResponseCreateError, RequestResponseOpenError};
use iceoryx2::service::port_factory::{event, publish_subscribe, request_response};

use crate::alert::Alert;
use crate::command::{Command, CommandReply};
use crate::domain::{Domain, DomainError};
use crate::error::BusError;
use crate::frame::{FrameHeader, HandleState};
use crate::membership::Membership;
use crate::space::require_shared_memory;
use crate::status::Status;

/// Name of the frames: a publish-subscribe service, and an event service of the same name for the wake-up.
pub const FRAMES: &str = "bench-dragon/frames";
/// Name of the description.
pub const DESCRIPTION: &str = "bench-dragon/description";
/// Name of the status.
pub const STATUS: &str = "bench-dragon/status";
/// Name of the alerts: a publish-subscribe service, and an event service of the same name for the wake-up.
pub const ALERTS: &str = "bench-dragon/alerts";
/// Name of the commands.
pub const COMMANDS: &str = "bench-dragon/commands";

/// Readers that one service serves at a time.
pub const MAX_READERS: usize = 32;
/// Frames that a reader may hold on to at a time.
pub const MAX_BORROWED_FRAMES: usize = 4;
/// Commands in flight from one client.
pub const MAX_ACTIVE_REQUESTS: usize = 4;
/// Longest description in bytes.
pub const MAX_DESCRIPTION_LEN: usize = 64 * 1024;

const MAX_SOURCES: usize = 2;
const MAX_NODES: usize = 128;
/// Unread frames that are kept for a reader, where shared memory allows.
const FRAME_BUFFER: usize = 256;
/// Fewest unread frames kept for a reader of a large dragon.
const LEAST_FRAME_BUFFER: usize = 4;
/// What the frames of all readers may take of shared memory, in bytes, before the buffer shrinks.
const FRAME_MEMORY: usize = 160 << 20;
const ALERT_BUFFER: usize = 256;
/// What the small ports of one process take of shared memory at most, in bytes.
const SMALL_PORTS: u64 = 2 << 20;

/// The iceoryx2 service type of the bus: one process, one thread a port.
pub type Service = ipc::Service;
/// Makes publishers and subscribers of frames.
pub type FrameService = publish_subscribe::PortFactory<Service, [HandleState], FrameHeader>;
/// Makes publishers and subscribers of the description: TOML text, with the `run_id` it belongs to as user header.
pub type DescriptionService = publish_subscribe::PortFactory<Service, [u8], u64>;
/// Makes publishers and subscribers of the status.
pub type StatusService = publish_subscribe::PortFactory<Service, Status, ()>;
/// Makes publishers and subscribers of alerts.
pub type AlertService = publish_subscribe::PortFactory<Service, Alert, ()>;
/// Makes servers and clients of commands.
pub type CommandService = request_response::PortFactory<Service, Command, (), CommandReply, ()>;
/// Makes notifiers and listeners.
pub type EventService = event::PortFactory<Service>;

/// On which side of a service a process stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Creates the service where it is missing. The benches decide how many frames are buffered.
    Source {
        /// Benches of the dragon.
        bench_count: usize,
    },
    /// Opens the service, which has to be there.
    Client,
}

/// A process's membership in a domain.
#[derive(Debug)]
pub struct Member {
    node: Node<Service>,
    instance: String,
    role: Role,
    // Given up last, after the node is gone.
    _membership: Membership,
}

impl Member {
    /// Joins a domain under a name that `iox2 node list` shows. A source makes the domain's directory; for a client
    /// it has to be there.
    ///
    /// # Errors
    /// [`BusError::NoServer`] for a client where the directory is missing, [`BusError::Domain`],
    /// [`BusError::PermissionDenied`] and [`BusError::SharedMemoryFull`].
    pub fn join(domain: &Domain, name: &str, role: Role) -> Result<Self, BusError> {
        let instance = domain.instance().to_string();
        let membership = loop {
            match (enter(domain, role), role) {
                // The last one to leave has just removed the directory.
                (Err(DomainError::Missing { .. }), Role::Source { .. }) => {}
                (Err(DomainError::Missing { .. }), Role::Client) => return Err(BusError::NoServer { instance }),
                (entered, _) => break entered?,
            }
        };
        require_shared_memory(domain, SMALL_PORTS)?;
        let name = NodeName::new(name).map_err(|error| BusError::failed("node name", error))?;
        let node = NodeBuilder::new()
            .name(&name)
            .config(&domain.iceoryx2_config())
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<Service>()
            .map_err(|error| match error {
                NodeCreationFailure::InsufficientPermissions => BusError::PermissionDenied { service: "the domain" },
                error => BusError::failed("the domain", error),
            })?;
        Ok(Self { node, instance, role, _membership: membership })
    }

    /// The frames: slices of [`HandleState`] under a [`FrameHeader`]. A slow reader loses its own oldest frames.
    ///
    /// # Errors
    /// As every service: [`BusError::NoServer`], [`BusError::VersionMismatch`], [`BusError::PermissionDenied`],
    /// [`BusError::HalfMade`], [`BusError::TooManyClients`], [`BusError::Failed`].
    pub fn frames(&self) -> Result<FrameService, BusError> {
        let builder = || {
            self.node
                .service_builder(&service_name(FRAMES))
                .publish_subscribe::<[HandleState]>()
                .user_header::<FrameHeader>()
                .enable_safe_overflow(true)
        };
        self.publish_subscribe(
            FRAMES,
            || builder().open(),
            |bench_count| {
                builder()
                    .max_publishers(MAX_SOURCES)
                    .max_subscribers(MAX_READERS)
                    .max_nodes(MAX_NODES)
                    .subscriber_max_buffer_size(frame_buffer(bench_count))
                    .subscriber_max_borrowed_samples(MAX_BORROWED_FRAMES)
                    .history_size(0)
                    .create()
            },
        )
    }

    /// The wake-up that follows each frame.
    ///
    /// # Errors
    /// As [`Member::frames`].
    pub fn frame_events(&self) -> Result<EventService, BusError> {
        self.event(FRAMES)
    }

    /// The configuration as TOML text, kept for late joiners.
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
        self.publish_subscribe(
            DESCRIPTION,
            || builder().open(),
            |_| {
                builder()
                    .max_publishers(MAX_SOURCES)
                    .max_subscribers(MAX_READERS)
                    .max_nodes(MAX_NODES)
                    .subscriber_max_buffer_size(1)
                    .subscriber_max_borrowed_samples(1)
                    .history_size(1)
                    .create()
            },
        )
    }

    /// The server's account of itself, kept for late joiners.
    ///
    /// # Errors
    /// As [`Member::frames`].
    pub fn status(&self) -> Result<StatusService, BusError> {
        let builder = || {
            self.node.service_builder(&service_name(STATUS)).publish_subscribe::<Status>().enable_safe_overflow(true)
        };
        self.publish_subscribe(
            STATUS,
            || builder().open(),
            |_| {
                builder()
                    .max_publishers(MAX_SOURCES)
                    .max_subscribers(MAX_READERS)
                    .max_nodes(MAX_NODES)
                    .subscriber_max_buffer_size(1)
                    .subscriber_max_borrowed_samples(1)
                    .history_size(1)
                    .create()
            },
        )
    }

    /// The monitor's alerts.
    ///
    /// # Errors
    /// As [`Member::frames`].
    pub fn alerts(&self) -> Result<AlertService, BusError> {
        let builder =
            || self.node.service_builder(&service_name(ALERTS)).publish_subscribe::<Alert>().enable_safe_overflow(true);
        self.publish_subscribe(
            ALERTS,
            || builder().open(),
            |_| {
                builder()
                    .max_publishers(MAX_SOURCES)
                    .max_subscribers(MAX_READERS)
                    .max_nodes(MAX_NODES)
                    .subscriber_max_buffer_size(ALERT_BUFFER)
                    .subscriber_max_borrowed_samples(MAX_BORROWED_FRAMES)
                    .history_size(0)
                    .create()
            },
        )
    }

    /// The wake-up that follows each alert.
    ///
    /// # Errors
    /// As [`Member::frames`].
    pub fn alert_events(&self) -> Result<EventService, BusError> {
        self.event(ALERTS)
    }

    /// Commands to the server, each answered once.
    ///
    /// # Errors
    /// As [`Member::frames`].
    pub fn commands(&self) -> Result<CommandService, BusError> {
        let builder = || self.node.service_builder(&service_name(COMMANDS)).request_response::<Command, CommandReply>();
        let created = match builder().open() {
            Err(RequestResponseOpenError::DoesNotExist) if self.role != Role::Client => builder()
                .max_servers(MAX_SOURCES)
                .max_clients(MAX_READERS)
                .max_nodes(MAX_NODES)
                .max_active_requests_per_client(MAX_ACTIVE_REQUESTS)
                .max_response_buffer_size(1)
                .create(),
            opened => return opened.map_err(|error| self.request_response_error(error)),
        };
        created.map_err(|error| match error {
            RequestResponseCreateError::InsufficientPermissions => BusError::PermissionDenied { service: COMMANDS },
            RequestResponseCreateError::HangsInCreation => BusError::HalfMade { service: COMMANDS },
            error => BusError::failed(COMMANDS, error),
        })
    }

    fn publish_subscribe<Factory>(
        &self,
        service: &'static str,
        open: impl FnOnce() -> Result<Factory, PublishSubscribeOpenError>,
        create: impl FnOnce(usize) -> Result<Factory, PublishSubscribeCreateError>,
    ) -> Result<Factory, BusError> {
        use PublishSubscribeOpenError as Open;
        let error = match (open(), self.role) {
            (Err(Open::DoesNotExist), Role::Source { bench_count }) => {
                return create(bench_count).map_err(|error| match error {
                    PublishSubscribeCreateError::InsufficientPermissions => BusError::PermissionDenied { service },
                    PublishSubscribeCreateError::HangsInCreation => BusError::HalfMade { service },
                    error => BusError::failed(service, error),
                });
            }
            (Ok(factory), _) => return Ok(factory),
            (Err(error), _) => error,
        };
        Err(match error {
            Open::DoesNotExist | Open::IsMarkedForDestruction => self.no_server(),
            Open::IncompatibleTypes | Open::IncompatibleMessagingPattern | Open::VersionMismatch => {
                BusError::VersionMismatch { service }
            }
            Open::InsufficientPermissions => BusError::PermissionDenied { service },
            Open::HangsInCreation => BusError::HalfMade { service },
            Open::ExceedsMaxNumberOfNodes => BusError::TooManyClients { service },
            error => BusError::failed(service, error),
        })
    }

    fn event(&self, service: &'static str) -> Result<EventService, BusError> {
        let builder = || self.node.service_builder(&service_name(service)).event();
        let error = match builder().open() {
            Err(EventOpenError::DoesNotExist) if self.role != Role::Client => {
                let created = builder()
                    .max_notifiers(MAX_SOURCES)
                    .max_listeners(MAX_READERS)
                    .max_nodes(MAX_NODES)
                    .event_id_max_value(1)
                    .create();
                return created.map_err(|error| match error {
                    EventCreateError::InsufficientPermissions => BusError::PermissionDenied { service },
                    error => BusError::failed(service, error),
                });
            }
            Ok(factory) => return Ok(factory),
            Err(error) => error,
        };
        Err(match error {
            EventOpenError::DoesNotExist | EventOpenError::IsMarkedForDestruction => self.no_server(),
            EventOpenError::IncompatibleMessagingPattern | EventOpenError::VersionMismatch => {
                BusError::VersionMismatch { service }
            }
            EventOpenError::InsufficientPermissions => BusError::PermissionDenied { service },
            EventOpenError::HangsInCreation => BusError::HalfMade { service },
            EventOpenError::ExceedsMaxNumberOfNodes => BusError::TooManyClients { service },
            error => BusError::failed(service, error),
        })
    }

    fn request_response_error(&self, error: RequestResponseOpenError) -> BusError {
        use RequestResponseOpenError as Open;
        let service = COMMANDS;
        match error {
            Open::DoesNotExist | Open::IsMarkedForDestruction => self.no_server(),
            Open::IncompatibleRequestOrResponseType | Open::IncompatibleMessagingPattern | Open::VersionMismatch => {
                BusError::VersionMismatch { service }
            }
            Open::InsufficientPermissions => BusError::PermissionDenied { service },
            Open::HangsInCreation => BusError::HalfMade { service },
            Open::ExceedsMaxNumberOfNodes => BusError::TooManyClients { service },
            error => BusError::failed(service, error),
        }
    }

    fn no_server(&self) -> BusError {
        BusError::NoServer { instance: self.instance.clone() }
    }
}

fn enter(domain: &Domain, role: Role) -> Result<Membership, DomainError> {
    match role {
        Role::Source { .. } => domain.create_directory()?,
        Role::Client => domain.check_directory()?,
    }
    Membership::join(domain)
}

/// Unread frames kept for each reader of a dragon of this many benches.
pub fn frame_buffer(bench_count: usize) -> usize {
    let for_all_readers = MAX_READERS * frame_bytes(bench_count);
    (FRAME_MEMORY / for_all_readers).saturating_sub(MAX_BORROWED_FRAMES).clamp(LEAST_FRAME_BUFFER, FRAME_BUFFER)
}

/// Shared memory that the frames of a dragon of this many benches take at most, in bytes.
pub fn frame_memory(bench_count: usize) -> u64 {
    let frames = MAX_READERS * (frame_buffer(bench_count) + MAX_BORROWED_FRAMES) + 2;
    (frames * frame_bytes(bench_count)) as u64
}

/// Size of one frame in shared memory, in bytes: iceoryx2's header, ours and the handles.
fn frame_bytes(bench_count: usize) -> usize {
    const ICEORYX2_HEADER: usize = 128;
    ICEORYX2_HEADER + size_of::<FrameHeader>() + (bench_count + 1) * size_of::<HandleState>()
}

fn service_name(name: &'static str) -> ServiceName {
    ServiceName::new(name).expect("the names above are valid service names")
}

impl fmt::Display for Role {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Source { .. } => "source",
            Self::Client => "client",
        })
    }
}
