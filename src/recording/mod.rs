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
//! **What a full disk does.** The forecast warns early ([`Progress`]). When no room is left for another chunk, the file
//! is finished within the room that was reserved for its summary, and the next call returns [`RecordError::DiskFull`].

pub mod cdr;
mod channels;
mod check;
mod contents;
mod disk_sync;
mod error;
pub mod export;
mod heads;
mod interval;
mod interval_search;
mod leftovers;
mod open_file;
pub mod pose;
mod progress;
mod reading;
mod records;
mod repair;
pub mod rotation;
pub mod schema;
mod settings;
pub mod space;
mod summary;
mod survey;
pub mod timeline;
mod writer;

use std::{
    panic::resume_unwind,
    sync::Arc,
    thread::{self, JoinHandle},
};

use bench_dragon_ipc::{Alert, CommandEvent, FrameHeader, HandleState};
use crossbeam::channel::{Receiver, Sender, TryRecvError, bounded};

pub use self::{
    check::repair_checked,
    error::{Kept, RecordError},
    interval::ShowInterval,
    interval_search::{IntervalSearch, NothingFound},
    leftovers::{BackgroundRepair, repair_folder},
    progress::{Progress, Summary},
    reading::{Bookmark, Configuration, Flaws, FrameReader, ReadError, Recorded, RecordedFrame},
    repair::{Repair, RepairError, repair},
    settings::RecorderSettings,
    space::{DiskSpace, Size, SpaceWarning},
};
use self::{
    progress::SharedProgress,
    rotation::FileNames,
    writer::{Description, FrameBuffer, Job, RecordingWriter},
};

/// What frames on their way to the file take of memory at most: six seconds of the paper's dragon at 1 kHz, so that a disk
/// may stall for longer than a bus can keep frames. A few frames are on their way however large they are.
pub const BYTES_IN_FLIGHT: usize = 64 << 20;
/// As many of small frames at most.
const MOST_FRAMES_IN_FLIGHT: usize = 8192;
/// As many of large frames at least.
const LEAST_FRAMES_IN_FLIGHT: usize = 4;

/// A recording in progress.
///
/// Dropping it finishes the file as well, but tells nobody how that went.
///
/// ```
/// use bench_dragon::recording::{Recorder, RecorderSettings};
/// use bench_dragon_ipc::{FrameHeader, HandleState};
///
/// let folder = tempfile::tempdir()?;
/// let mut recorder = Recorder::start(RecorderSettings::new(folder.path().join("show.mcap"), 0))?;
/// recorder.describe(7, "[dragon]\nbenches = 1\n")?;
/// recorder.frame(&FrameHeader { run_id: 7, ..Default::default() }, &[HandleState::default(); 2])?;
/// assert_eq!(recorder.finish()?.frames, 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Recorder {
    link: Option<Link>,
    progress: Arc<SharedProgress>,
}

/// The way to the writing thread, there for as long as the thread is.
#[derive(Debug)]
struct Link {
    jobs: Sender<Job>,
    empty: Receiver<FrameBuffer>,
    /// Buffers that there are, empty or in flight.
    buffers: usize,
    thread: JoinHandle<Result<Summary, RecordError>>,
}

impl Recorder {
    /// Makes the file and starts the writing thread.
    ///
    /// # Errors
    /// [`RecordError::OutOfRange`] for a setting, [`RecordError::Exists`] where the file, or with rotation a later file
    /// of the same name, is there already, and [`RecordError::Create`].
    pub fn start(settings: RecorderSettings) -> Result<Self, RecordError> {
        let names = FileNames::new(settings.file.clone());
        refuse_taken_names(&settings, &names)?;
        let progress = Arc::new(SharedProgress::new(names.clone()));
        let path = settings.file.clone();
        let writer = RecordingWriter::create(settings, names, Arc::clone(&progress))?;
        let (jobs, jobs_received) = bounded(MOST_FRAMES_IN_FLIGHT);
        let (emptied, empty) = bounded(MOST_FRAMES_IN_FLIGHT);
        let thread = thread::Builder::new()
            .name("record-write".to_owned())
            .spawn(move || writer.run(&jobs_received, &emptied))
            .map_err(|source| RecordError::Create { path, source })?;
        Ok(Self { link: Some(Link { jobs, empty, buffers: 0, thread }), progress })
    }

    /// Records the configuration of a run. Each later file repeats the last one.
    ///
    /// # Errors
    /// What ended the writing thread.
    pub fn describe(&mut self, run_id: u64, toml: &str) -> Result<(), RecordError> {
        self.send(Job::Describe(Description { run_id, toml: toml.to_owned() }))
    }

    /// Records a frame: copies it, and waits only while all buffers are in flight.
    ///
    /// # Errors
    /// What ended the writing thread; the frame, and those that were in flight, are not in the file.
    pub fn frame(&mut self, header: &FrameHeader, handles: &[HandleState]) -> Result<(), RecordError> {
        let link = self.link.as_mut().ok_or(RecordError::Ended)?;
        let Some(mut buffer) = link.buffer(size_of_val(handles)) else { return Err(self.ended()) };
        buffer.fill(header, handles);
        self.send(Job::Frame(buffer))
    }

    /// Records an alert that arrived at a monotonic instant.
    ///
    /// # Errors
    /// What ended the writing thread.
    pub fn alert(&mut self, alert: &Alert, monotonic_ns: u64) -> Result<(), RecordError> {
        self.send(Job::Alert { alert: *alert, monotonic_ns })
    }

    /// Records an event of the record of commands that arrived at a monotonic instant.
    ///
    /// # Errors
    /// What ended the writing thread.
    pub fn command(&mut self, event: &CommandEvent, monotonic_ns: u64) -> Result<(), RecordError> {
        self.send(Job::Command { event: *event, monotonic_ns })
    }

    /// How far the recording is. Takes a few loads and no lock.
    pub fn progress(&self) -> Progress {
        self.progress.load()
    }

    /// Writes what is in flight and finishes the file.
    ///
    /// # Errors
    /// What ended the writing thread.
    pub fn finish(mut self) -> Result<Summary, RecordError> {
        self.join()
    }

    fn send(&mut self, job: Job) -> Result<(), RecordError> {
        let link = self.link.as_ref().ok_or(RecordError::Ended)?;
        link.jobs.send(job).map_err(|_| self.ended())
    }

    /// The error of a writing thread that is gone although the recorder is not.
    fn ended(&mut self) -> RecordError {
        self.join().expect_err("the writing thread ends by itself only with an error")
    }

    fn join(&mut self) -> Result<Summary, RecordError> {
        let Link { jobs, empty, thread, .. } = self.link.take().ok_or(RecordError::Ended)?;
        drop((jobs, empty));
        thread.join().unwrap_or_else(|panic| resume_unwind(panic))
    }
}

impl Link {
    /// A buffer to be filled: an empty one, a new one, or where there may be no more of this size, the next that becomes
    /// empty. `None` where the writing thread has ended.
    fn buffer(&mut self, frame_bytes: usize) -> Option<FrameBuffer> {
        let allowed = (BYTES_IN_FLIGHT / frame_bytes.max(1)).clamp(LEAST_FRAMES_IN_FLIGHT, MOST_FRAMES_IN_FLIGHT);
        loop {
            let buffer = match self.empty.try_recv() {
                Ok(buffer) => buffer,
                Err(TryRecvError::Disconnected) => return None,
                Err(TryRecvError::Empty) if self.buffers < allowed => {
                    self.buffers += 1;
                    FrameBuffer::default()
                }
                Err(TryRecvError::Empty) => self.empty.recv().ok()?,
            };
            if self.buffers <= allowed {
                return Some(buffer);
            }
            // There were more of smaller frames.
            self.buffers -= 1;
        }
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        // Whoever wants to know how it went calls `finish`.
        let _ = self.join();
    }
}

fn refuse_taken_names(settings: &RecorderSettings, names: &FileNames) -> Result<(), RecordError> {
    if settings.rotate_bytes.or(settings.max_total_bytes).is_none() {
        return Ok(());
    }
    match names.taken() {
        Ok(None) => Ok(()),
        Ok(Some(path)) => Err(RecordError::Exists { path }),
        Err(source) => Err(RecordError::Create { path: settings.file.clone(), source }),
    }
}
