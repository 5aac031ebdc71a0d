//! Reports: the JSON lines that the processes print, and that `show` reads.
//!
//! Each line is one object whose `type` names its kind. Times are seconds of show time, lengths metres.
//!
//! | file | lines of |
//! |---|---|
//! | `source` | `serve`, `timecode`, `replay`, `verify` |
//! | `monitor` | `monitor` |
//! | `reader` | `record`, `export`, `bridge`, `latency` |
//! | `show` | `ctl status`, and `summary.json` of a show |
//! | `command` | commands and their outcome, in several of these |

mod command;
mod monitor;
mod reader;
mod show;
mod source;

pub use command::{CommandLine, CommandWords, local_time, request_words};
pub use monitor::{
    AlertLine, ClearanceReport, CommandCounts, ContactReport, GuardReport, MonitorLine, MonitorProgress,
    MonitorSummary, TimesReport,
};
pub use reader::{BridgeLine, BridgeSummary, ExportReport, LatencyReport, ReadMode, RecordLine, RecordSummary};
pub use show::{FrameCounts, NearestReport, RestartReport, Restarts, ShowSummary, StatusReport};
pub use source::{ReplayLine, ServeLine, TimecodeEvent, TimecodeLine, VerificationSummary};
