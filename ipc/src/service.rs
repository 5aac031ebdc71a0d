//! The services: their names, types and limits. [`Member`] has one function a service, which the source and every client
//! call, so that the two sides cannot disagree.
//!
//! Only a source (the server, a replay, a receiving bridge) creates services; a client opens what is there. Each
//! service of a source allows two publishers, because iceoryx2 cannot tunnel a service with one to another host; that
//! there is only one source at a time is what [`SourceLock`](crate::SourceLock) is for. Alerts have as many publishers as
//! there may be monitors, and the readers' reports as many as there may be readers.

use iceoryx2::prelude::ipc;
use iceoryx2::service::port_factory::{event, publish_subscribe, request_response};

use crate::alert::Alert;
use crate::command::{Command, CommandReply};
use crate::command_event::CommandEvent;
use crate::frame::{FrameHeader, HandleState};
pub use crate::member::{Member, Role};
use crate::reader_report::ReaderReport;
use crate::status::Status;

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
/// Name of the events of commands.
pub const COMMAND_EVENTS: &str = "bench-dragon/command-events";

/// Readers that one service serves at a time.
pub const MAX_READERS: usize = 24;
/// Frames that a reader may hold on to at a time.
pub const MAX_BORROWED_FRAMES: usize = 4;
/// Commands in flight from one client.
pub const MAX_ACTIVE_REQUESTS: usize = 4;
/// Longest description in bytes.
pub const MAX_DESCRIPTION_LEN: usize = 64 * 1024;

pub(crate) const MAX_SOURCES: usize = 2;
/// Monitors that may tell alerts at a time.
pub const MAX_MONITORS: usize = 8;
pub(crate) const MAX_NODES: usize = 128;
/// Unread frames that are kept for a reader, where shared memory allows.
const FRAME_BUFFER: usize = 256;
/// Fewest unread frames kept for a reader of a large dragon.
const LEAST_FRAME_BUFFER: usize = 4;
/// What the frames of all readers may take of shared memory, in bytes, before the buffer shrinks: with all else less than
/// the 64 MiB that containers have by default.
const FRAME_MEMORY: usize = 55 << 20;
pub(crate) const ALERT_BUFFER: usize = 256;
/// Unread events of commands that are kept for a reader, and the last ones that a late joiner is given.
pub const COMMAND_EVENT_BUFFER: usize = 128;
/// What all but the frames of a source takes of shared memory at most, in bytes.
pub const SOURCE_MEMORY: u64 = 6 << 20;
/// What the alerts of all readers take of shared memory at most, in bytes.
pub const ALERT_MEMORY: u64 = 1 << 20;
/// What a client takes of shared memory at most, in bytes. Little, so that a safety stop gets through where hardly
/// anything is left.
pub(crate) const CLIENT_MEMORY: u64 = 256 << 10;
/// Files that a source opens at most: its own forty, and three for each reader.
pub const SOURCE_FILES: usize = 128;
/// Files that a client opens at most: its own twenty, and one for each reader of its reports.
pub(crate) const CLIENT_FILES: usize = 48;
/// Files that a reader of reports opens at most: two more for each reader that reports.
pub(crate) const REPORT_FILES: usize = CLIENT_FILES + 2 * MAX_READERS;

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
/// Makes publishers and subscribers of readers' reports.
pub type ReaderService = publish_subscribe::PortFactory<Service, ReaderReport, ()>;
/// Makes servers and clients of commands.
pub type CommandService = request_response::PortFactory<Service, Command, (), CommandReply, ()>;
/// Makes publishers and subscribers of the events of commands.
pub type CommandEventService = publish_subscribe::PortFactory<Service, CommandEvent, ()>;
/// Makes notifiers and listeners.
pub type EventService = event::PortFactory<Service>;

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
