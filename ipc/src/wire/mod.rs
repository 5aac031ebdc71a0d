//! Types that cross processes: their layouts in shared memory, the numbers of their enums, and the services that carry
//! them. Nothing here reads a file or a clock.

mod alert;
mod bench;
mod command;
mod command_event;
mod description;
mod frame;
mod reader_report;
mod replay_status;
pub(crate) mod services;
mod status;
mod time_histogram;
mod wire_enum;

pub use alert::{Alert, AlertKind, Severity};
pub use bench::BenchState;
pub use command::{Command, CommandReply, Refusal, Request, Sender};
pub use command_event::{CommandEvent, EventKind, RunStart};
pub use description::dragon_names;
pub use frame::{DragonMotion, DragonState, FrameHeader, HandleState, MAX_DRAGONS, ShowState, frame_bytes};
pub use reader_report::ReaderReport;
pub use replay_status::ReplayStatus;
pub use status::{GuardState, SourceKind, Status, Stop, Stops, TimecodeKind, TimecodeState};
pub use time_histogram::TimeHistogram;
