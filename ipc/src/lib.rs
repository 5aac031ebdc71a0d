//! The bench dragon's bus: everything that a client needs, and nothing else.
//!
//! A server publishes the state of every bench at a fixed rate into iceoryx2 shared memory. Clients read it in place,
//! without a copy. The contract:
//!
//! | service | pattern | payload |
//! |---|---|---|
//! | `bench-dragon/frames` | publish-subscribe, event | `[`[`HandleState`]`]` under a [`FrameHeader`] |
//! | `bench-dragon/description` | latest value | TOML text under its `run_id` |
//! | `bench-dragon/status` | latest value | [`Status`] |
//! | `bench-dragon/alerts` | publish-subscribe, event | [`Alert`] |
//! | `bench-dragon/readers` | publish-subscribe | [`ReaderReport`] |
//! | `bench-dragon/commands` | request-response | [`Command`] → [`CommandReply`] |
//! | `bench-dragon/command-events` | publish-subscribe, last ones for late joiners | [`CommandEvent`] |
//! | `bench-dragon/replay` | latest value, of a replay alone | [`ReplayStatus`] |
//!
//! - *Creation:* only a source (a server, a replay or a receiving bridge) creates services. A client opens existing ones;
//!   without a source it receives [`BusError::NoServer`] and may try again.
//! - *Waiting:* no reader ever delays the server. A reader that falls behind by more than its buffer loses its own oldest
//!   frames and sees the loss in [`Frame::continuity`].
//! - *Changes by other processes:* a frame does not change while a reader holds it. Between two frames the server may be
//!   restarted ([`Continuity::Restarted`]).
//! - *Units:* metres, seconds, radians; x right, y away, z up. Times are integers in nanoseconds, clocks are
//!   `CLOCK_MONOTONIC`. Speeds are metres per show second.
//!
//! A complete client:
//!
//! ```no_run
//! use bench_dragon_ipc::{Domain, FrameSubscriber, Instance};
//! use std::{error::Error, time::Duration};
//!
//! fn main() -> Result<(), Box<dyn Error>> {
//!     let domain = Domain::new(Instance::default())?;
//!     let mut frames = FrameSubscriber::open(&domain, "head-printer")?;
//!     loop {
//!         if let Some(frame) = frames.wait(Duration::from_secs(1))? {
//!             let head = frame.benches().next().expect("a dragon has a head");
//!             let ([x, y, _], heading_deg) = (head.centre_m, head.heading_rad.to_degrees());
//!             println!("{:.3} s: head at {x:.3}, {y:.3}, {heading_deg:.1}°", frame.header().show_time_s());
//!         }
//!     }
//! }
//! ```

/// For the program's guard, and for programs that look whether one runs. Clients need none of it.
pub mod guard {
    pub use crate::domain::GuardLock;
}

/// For programs that publish frames, and for programs that look whether one runs. Clients need none of it.
pub mod source {
    pub use crate::domain::{OperatorReserve, ShowLock, SourceLock};
}

mod client;
mod domain;
pub mod service;
mod wake;
mod wire;

pub use client::{
    AlertSubscriber, CommandClient, CommandEventReader, Continuity, ContinuityTracker, Description, DescriptionReader,
    Frame, FrameSubscriber, LentFrame, ReaderReports, ReplayStatusReader, ReportCount, Show, SourceState, StatusReader,
};
pub use domain::{
    BusError, Census, Cleared, Domain, DomainError, ForeignFile, Instance, MAX_ROOT_PATH_LEN, NodeEntry, SegmentWatch,
    ServiceLayout, clear, require_open_files, require_shared_memory,
};
pub use wake::WakePage;
pub use wire::{
    Alert, AlertKind, BenchState, Command, CommandEvent, CommandReply, DragonMotion, DragonState, EventKind,
    FrameHeader, GuardState, HandleState, MAX_DRAGONS, ReaderReport, Refusal, ReplayStatus, Request, RunStart, Sender,
    Severity, ShowState, SourceKind, Status, Stop, Stops, TimeHistogram, TimecodeKind, TimecodeState, dragon_names,
    frame_bytes,
};
/// Traits that convert the bus's layouts to and from their bytes.
pub use zerocopy::{FromBytes, IntoBytes};

/// Version of iceoryx2 that the bus uses. Services of another version cannot be opened.
pub const ICEORYX2_VERSION: &str = "0.10";
