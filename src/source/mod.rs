//! What every source of frames is made of: the server's simulation is one, a replay another.
//!
//! A source holds the instance's [`SourceLock`](bench_dragon_ipc::SourceLock), creates the services, and gives each run
//! a number of its own.

mod command_log;
mod command_server;
mod frame_publisher;
mod reporter;
mod run_id;
mod source_report;
mod stage;
mod tick_times;

pub mod replay;
pub mod server;
pub mod timecode;

pub(crate) mod service_manager;

pub(crate) use command_log::{CommandLog, Moment};
#[cfg(feature = "zenoh")]
pub(crate) use command_server::AskedCommand;
pub(crate) use command_server::CommandServer;
pub(crate) use frame_publisher::FramePublisher;
pub(crate) use reporter::TimesOfAll;
pub(crate) use run_id::random_run_id;
pub(crate) use source_report::SourceReport;
#[cfg(feature = "zenoh")]
pub(crate) use stage::described_bench_count;
pub(crate) use stage::{Stage, described_rate_hz};
