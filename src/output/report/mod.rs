//! What the processes say of themselves: the JSON lines that they print, and that `show` reads.
//!
//! Each line is one object whose `type` tells which. Times are seconds of show time, lengths metres.

mod bridge;
mod command;
mod command_line;
mod export;
mod latency;
mod monitor;
mod record;
mod replay;
mod scene;
mod serve;
mod show;
mod timecode;
mod times;

pub use bridge::{BridgeLine, BridgeSummary};
pub use command::{CommandWords, request_words};
pub use command_line::{CommandLine, local_time};
pub use export::ExportReport;
pub use latency::{LatencyReport, ReadMode};
pub use monitor::{
    AlertLine, ClearanceReport, CommandCounts, ContactReport, GuardReport, MonitorLine, MonitorProgress, MonitorSummary,
};
pub use record::{RecordLine, RecordSummary};
pub use replay::{ReplayLine, VerificationSummary};
pub use scene::{NearestReport, SceneReport};
pub use serve::ServeLine;
pub use show::{FrameCounts, RestartReport, Restarts, ShowSummary};
pub use timecode::{TimecodeEvent, TimecodeLine};
pub use times::TimesReport;
