//! Names, types and limits of the services. [`Member`](crate::service::Member) has one function per service, which the
//! source and every client call, so the two sides cannot disagree.
//!
//! Only a source (the server, a replay, a receiving bridge) creates services; a client opens existing ones. Each service
//! of a source allows two publishers, because iceoryx2 cannot tunnel a service with only one to another host.
//! [`SourceLock`](crate::source::SourceLock) ensures that there is only one source at a time. Alerts have as many publishers as
//! monitors are allowed, and the readers' reports as many as readers are allowed.

use iceoryx2::prelude::ipc;
use iceoryx2::service::port_factory::{event, publish_subscribe, request_response};

use super::alert::Alert;
use super::command::{Command, CommandReply};
use super::command_event::CommandEvent;
use super::frame::{FrameHeader, HandleState};
use super::reader_report::ReaderReport;
use super::replay_status::ReplayStatus;
use super::status::Status;

/// Name of the frames: a publish-subscribe service, and an event service of the same name for the wake-up.
pub const FRAMES: &str = "bench-dragon/frames";
/// Name of the description.
pub const DESCRIPTION: &str = "bench-dragon/description";
/// Name of the status.
pub const STATUS: &str = "bench-dragon/status";
/// Name of the alerts: a publish-subscribe service, and an event service of the same name for the wake-up.
pub const ALERTS: &str = "bench-dragon/alerts";
/// Name of the readers' reports.
pub const READERS: &str = "bench-dragon/readers";
/// Name of the commands.
pub const COMMANDS: &str = "bench-dragon/commands";
/// Name of the status of a replay.
pub const REPLAY: &str = "bench-dragon/replay";
/// Name of the events of commands.
pub const COMMAND_EVENTS: &str = "bench-dragon/command-events";

/// Greatest number of readers of one service, without the reserved places of [`OPERATOR_READERS`].
pub const MAX_READERS: usize = 24;
/// Number of further places for tools of the operator alone, such as `ctl`, `doctor`, `watch` and a view. Readers of
/// [`Domain::for_operators`](crate::Domain::for_operators) use them once all other places are taken.
pub const OPERATOR_READERS: usize = 4;
/// Greatest number of readers of one service, including operators' tools.
pub(crate) const ALL_READERS: usize = MAX_READERS + OPERATOR_READERS;
/// Greatest number of frames that a reader may hold at a time.
pub const MAX_BORROWED_FRAMES: usize = 4;
/// Greatest number of commands in flight from one client.
pub const MAX_ACTIVE_REQUESTS: usize = 4;
/// Greatest length of the description in bytes.
pub const MAX_DESCRIPTION_LEN: usize = 256 * 1024;

pub(crate) const MAX_SOURCES: usize = 2;
/// Greatest number of monitors that may send alerts at a time.
pub const MAX_MONITORS: usize = 8;
pub(crate) const MAX_NODES: usize = 128;
/// Number of unread frames that are kept for a reader, if shared memory allows.
const FRAME_BUFFER: usize = 256;
/// Least number of unread frames that are kept for a reader of a large dragon.
const LEAST_FRAME_BUFFER: usize = 4;
/// Shared memory that the frames of all readers may occupy, in bytes; for larger dragons the buffer shrinks. Together
/// with everything else it is less than the 64 MiB that containers have by default.
const FRAME_MEMORY: usize = 55 << 20;
/// Number of unread alerts that are kept for a reader, and of past ones that a late joiner may receive.
pub const ALERT_BUFFER: usize = 256;
/// Number of unread command events that are kept for a reader, and of past ones that a late joiner receives.
pub const COMMAND_EVENT_BUFFER: usize = 128;
/// Greatest shared memory of a source without its frames and its description, in bytes.
pub const SOURCE_MEMORY: u64 = 6 << 20;
/// Greatest shared memory of the alerts of all readers, in bytes.
pub const ALERT_MEMORY: u64 = 1 << 20;
/// Greatest shared memory of a client, in bytes. It is small, so that a safety stop works even if shared memory is almost
/// full.
pub(crate) const CLIENT_MEMORY: u64 = 256 << 10;
/// Greatest number of files that a source opens: forty of its own, and three per reader.
pub const SOURCE_FILES: usize = 128;
/// Greatest number of files that a client opens: twenty of its own, and one per reader of its reports.
pub(crate) const CLIENT_FILES: usize = 48;
/// Greatest number of files that a reader of reports opens: two more per reader that reports.
pub(crate) const REPORT_FILES: usize = CLIENT_FILES + 2 * ALL_READERS;

/// Size of iceoryx2's header of a sample, in bytes.
const ICEORYX2_HEADER: usize = 128;

/// The iceoryx2 service type of the bus: between processes, with each port used by one thread.
pub type Service = ipc::Service;
/// Creates publishers and subscribers of frames.
pub type FrameService = publish_subscribe::PortFactory<Service, [HandleState], FrameHeader>;
/// Creates publishers and subscribers of the description: TOML text with its `run_id` as user header.
pub type DescriptionService = publish_subscribe::PortFactory<Service, [u8], u64>;
/// Creates publishers and subscribers of the status.
pub type StatusService = publish_subscribe::PortFactory<Service, Status, ()>;
/// Creates publishers and subscribers of the status of a replay.
pub type ReplayService = publish_subscribe::PortFactory<Service, ReplayStatus, ()>;
/// Creates publishers and subscribers of alerts.
pub type AlertService = publish_subscribe::PortFactory<Service, Alert, ()>;
/// Creates publishers and subscribers of readers' reports.
pub type ReaderService = publish_subscribe::PortFactory<Service, ReaderReport, ()>;
/// Creates servers and clients of commands.
pub type CommandService = request_response::PortFactory<Service, Command, (), CommandReply, ()>;
/// Creates publishers and subscribers of the command events.
pub type CommandEventService = publish_subscribe::PortFactory<Service, CommandEvent, ()>;
/// Creates notifiers and listeners.
pub type EventService = event::PortFactory<Service>;

/// Returns the number of unread frames of this many handles that are kept for each reader.
pub fn frame_buffer(handle_count: usize) -> usize {
    let for_all_readers = ALL_READERS * frame_bytes(handle_count);
    (FRAME_MEMORY / for_all_readers).saturating_sub(MAX_BORROWED_FRAMES).clamp(LEAST_FRAME_BUFFER, FRAME_BUFFER)
}

/// Returns the greatest shared memory of frames of this many handles, in bytes.
pub fn frame_memory(handle_count: usize) -> u64 {
    let frames = ALL_READERS * (frame_buffer(handle_count) + MAX_BORROWED_FRAMES) + 2;
    (frames * frame_bytes(handle_count)) as u64
}

/// Returns the greatest shared memory of a description of this length, in bytes.
pub fn description_memory(len: usize) -> u64 {
    // One that each reader holds, one that waits for it, one for late joiners, and one that is being written.
    ((2 * ALL_READERS + 2) * (ICEORYX2_HEADER + len)) as u64
}

/// Returns the size of one frame in shared memory, in bytes: iceoryx2's header, the frame header and the handles.
fn frame_bytes(handle_count: usize) -> usize {
    ICEORYX2_HEADER + size_of::<FrameHeader>() + handle_count * size_of::<HandleState>()
}
