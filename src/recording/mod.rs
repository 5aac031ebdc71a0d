//! Recording: every frame, without loss, into MCAP files that any ROS 2 viewer or reader opens.
//!
//! **Contents.** `/dragon/frames` has every frame, bit for bit. `/dragon/poses` has one pose per bench at 30 Hz, and `/tf` the
//! same poses as frames of reference. `/dragon/boards` and `/dragon/markers` have the boards at 10 Hz. `/dragon/alerts`
//! has the alerts, and `/dragon/commands` the record of commands. A metadata record in each file has the configuration.
//! Messages are ROS 2 CDR; their definitions are in the file.
//!
//! **Times.** The log time of a frame, of its poses and of its transforms is the Unix time at which the frame was sent, and the
//! publish time the Unix time at which it was due. The sequence is the low 32 bits of the frame's tick. The log time of an alert
//! or a command event is its arrival. These times are monotonic stamps plus one offset, which is fixed at the start. The publish
//! time of an alert equals its log time; that of a command event is its own Unix time.
//!
//! **Copies.** The calling thread copies a frame once, from shared memory into a recycled buffer, and does nothing else. The
//! writing thread encodes, compresses and writes.
//!
//! **Waits.** Frames in flight to the file take at most [`BYTES_IN_FLIGHT`] of memory. Buffers are created when needed, and
//! recycled. When all buffers are in flight, [`Recorder::frame`] waits for the disk. During that wait the bus keeps the newest
//! frames, up to the buffer size of its reader. Frames that the bus drops show as a gap in the ticks. The recorder never delays
//! the server.
//!
//! **Crashes.** A chunk is closed and handed to the operating system when it is full (about a megabyte), and at the latest half
//! a second after its first message. A killed recorder loses at most the messages after the last closed chunk. The file then
//! lacks its index. [`repair()`] appends one in place, and reads at most the first and the last chunk. Once a second, a
//! separate thread syncs the file to disk; no frame waits for it. So a power cut loses the data after the last sync: a few
//! seconds if the disk keeps up. A finished file is on the disk.
//!
//! **Parts.** After the death of a recorder, and with rotation, a recording has several files. [`Parts`] finds them in a folder,
//! and [`PartsReader`] reads them as one recording and names its [`Gap`]s.
//!
//! **Full disks.** A forecast warns early ([`RecorderProgress`]). When the disk has no room for another chunk, the recorder
//! finishes the file within the room reserved for its summary. The next call returns [`RecordError::DiskFull`].

mod boards;
pub mod cdr;
pub mod export;

mod background_repair;
mod check;
mod definitions;
mod disk;
mod disk_sync;
mod error;
mod gaps;
mod growth;
mod interval;
mod mcap_file;
mod outline;
mod parts;
mod parts_reader;
mod progress;
mod reader;
mod record_heads;
mod recorder;
mod records;
mod repair;
mod rotation;
mod summary;
mod survey;
mod timeline;
mod topics;
mod writer;

/// The parts of the recorder and of the repair that have neither a thread nor a clock, with the interface of their disk.
pub mod on_disk {
    pub use super::{
        disk::{RecordingDisk, RecordingFile},
        disk_sync::{FileSync, FileSyncs},
        recorder::{FrameBuffer, WriterJob, frames_in_flight},
        repair::repair_on,
        writer::{RecordingWriter, WriterFault},
    };
}

pub(crate) use self::recorder::frames_in_flight;
pub use self::{
    background_repair::{BackgroundRepair, repair_folder},
    boards::{Boards, encode_markers, encode_scene},
    check::repair_checked,
    error::{Kept, RecordError},
    gaps::{Coverage, Gap},
    growth::walking_bytes_per_s,
    interval::{IntervalSearch, NothingFound, ShowInterval},
    parts::{PartOf, Parts, PartsError, recordings_in},
    parts_reader::{FlawedFile, PartsBookmark, PartsReader},
    progress::{DiskSpace, RecorderProgress, RecordingSummary, Size, SpaceWarning},
    reader::{Bookmark, Configuration, Flaws, FrameReader, ReadError},
    recorder::{BYTES_IN_FLIGHT, Recorder, RecorderSettings},
    repair::{Repair, RepairError, repair},
    timeline::{Timeline, TimelinePlace},
    topics::{Message, Recorded, RecordedAlert, RecordedFrame, Topic, channel_names},
};
