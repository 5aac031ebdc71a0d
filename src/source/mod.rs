//! Sources of frames: the server and the replay, and the parts that all sources share.
//!
//! A source holds the instance's [`SourceLock`](bench_dragon_ipc::source::SourceLock), creates the services, and gives each run
//! a new random number.

mod command_log;
mod loop_counters;
mod reporter;
mod source_ports;
mod source_report;

pub mod replay;
pub mod server;
pub mod timecode;

pub(crate) mod service_manager;

#[cfg(feature = "zenoh")]
pub(crate) use command_log::AskedCommand;
pub use command_log::{CommandLog, Moment, answer_command};
pub use source_ports::ExpectedReaders;
#[cfg(feature = "zenoh")]
pub(crate) use source_ports::described_bench_count;
pub(crate) use source_ports::{SourcePorts, described_rate_hz, take_instance};
pub(crate) use source_report::TimesOfAll;
