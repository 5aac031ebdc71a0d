//! Recording: every frame, without loss, into MCAP files that any ROS 2 viewer or reader opens.
//!
//! **What is recorded.** `/dragon/frames`, every frame bit for bit; `/dragon/poses`, one pose a bench at 30 Hz;
//! `/dragon/alerts`; `/dragon/commands`, the record of commands; the configuration as a metadata record in each file. Messages are ROS 2 CDR, their definitions are
//! in the file. A message's log time is the Unix time at which its frame was sent, its publish time the one at which it
//! was due, its sequence the low 32 bits of the tick; both times come from the monotonic stamps by one offset that is
//! fixed at the start.
//!
//! **Who copies.** The calling thread copies a frame once, from shared memory into a recycled buffer, and does nothing
//! else. The writing thread encodes, compresses and writes.
//!
//! **Who waits.** Frames on their way to the file may take [`BYTES_IN_FLIGHT`] of memory; buffers are made as they are
//! needed and go round. When all of them wait to be written, [`Recorder::frame`] waits for the disk, and the bus keeps
//! the newest frames meanwhile, as many as its reader's buffer holds; what it drops shows as a gap in the ticks. Nothing
//! here can hold up the server.
//!
//! **What a crash costs.** A chunk is closed and handed to the operating system when it is full (about a megabyte) and
//! half a second after its first message at the latest. A killed recorder loses at most what came after; the file then
//! lacks its index, and [`repair()`] appends one, in place and without reading the chunks. Once a second the file is forced onto the disk, by a thread that nothing
//! waits for; so a power cut costs what came after the last time, a few seconds where the disk keeps up. A finished
//! file is on the disk.
//!
//! **What a full disk does.** The forecast warns early ([`RecorderProgress`]). When no room is left for another chunk, the file
//! is finished within the room that was reserved for its summary, and the next call returns [`RecordError::DiskFull`].

pub mod cdr;
pub mod export;

mod background_repair;
mod check;
mod disk_sync;
mod error;
mod heads;
mod interval;
mod mcap_file;
mod progress;
mod reader;
mod recorder;
mod records;
mod repair;
mod rotation;
mod summary;
mod survey;
mod topics;
mod writer;

pub(crate) use self::recorder::frames_in_flight;
pub use self::{
    background_repair::{BackgroundRepair, repair_folder},
    check::repair_checked,
    error::{Kept, RecordError},
    interval::{IntervalSearch, NothingFound, ShowInterval},
    progress::{DiskSpace, RecorderProgress, RecordingSummary, Size, SpaceWarning},
    reader::{Bookmark, Configuration, Flaws, FrameReader, ReadError},
    recorder::{BYTES_IN_FLIGHT, Recorder, RecorderSettings},
    repair::{Repair, RepairError, repair},
    topics::{Message, Recorded, RecordedFrame, Topic},
};
