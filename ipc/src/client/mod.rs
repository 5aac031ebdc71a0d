//! What programs open: one reader or client for each service, and [`Show`], all of them for any number of threads.

mod command_client;
mod continuity;
mod frame_schedule;
mod readers;
mod report_publisher;
mod show;
mod source_state;
mod subscriber;

pub use command_client::CommandClient;
pub use continuity::{Continuity, ContinuityTracker};
pub use readers::{
    AlertSubscriber, CommandEventReader, Description, DescriptionReader, ReaderReports, ReplayStatusReader,
    StatusReader,
};
pub use report_publisher::ReportCount;
pub use show::{LentFrame, Show};
pub use source_state::SourceState;
pub use subscriber::{Frame, FrameSubscriber};
