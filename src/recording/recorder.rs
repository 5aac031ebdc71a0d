//! The recorder: the interface of a recording program, and its settings.

use std::{
    ops::RangeInclusive,
    panic::resume_unwind,
    path::PathBuf,
    sync::Arc,
    thread::{self, JoinHandle},
};

use bench_dragon_ipc::{FrameHeader, HandleState};
use crossbeam::channel::{Receiver, Sender, TryRecvError, bounded};

use super::{
    disk::SystemDisk,
    disk_sync::SyncThread,
    error::RecordError,
    progress::{RecorderProgress, RecordingSummary, SharedProgress},
    reader::Configuration,
    rotation::FileNames,
    topics::Message,
    writer::RecordingWriter,
};

/// Greatest memory of the frames in flight, to the file or from it to a replay. It holds six seconds of the paper's dragon at 1
/// kHz. So a disk may stall for longer than the bus can keep frames. A few frames may be in flight at any frame size.
pub const BYTES_IN_FLIGHT: usize = 64 << 20;
/// Greatest number of small frames in flight.
const MOST_FRAMES_IN_FLIGHT: usize = 8192;
/// Number of large frames that may always be in flight.
const LEAST_FRAMES_IN_FLIGHT: usize = 4;

/// Least size at which files can rotate: dozens of frames.
const MIN_ROTATE_BYTES: u64 = 1_000_000;
/// Number of files of a bounded recording for which no file size is given.
const FILES_IN_TOTAL: u64 = 4;
/// Uncompressed size at which a chunk is closed. Small rotating files have smaller chunks.
const CHUNK_BYTES: u64 = 1 << 20;
/// Least number of chunks of a rotating file, so that it ends close to its size limit.
const CHUNKS_IN_FILE: u64 = 16;
const COMPRESSION_LEVELS: RangeInclusive<u64> = 1..=19;

/// A recording in progress.
///
/// Dropping a recorder also finishes the file, but reports no error.
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
    thread: Option<WriterThread>,
    progress: Arc<SharedProgress>,
}

#[derive(Debug)]
struct WriterThread {
    jobs: Sender<WriterJob>,
    empty: Receiver<FrameBuffer>,
    /// Number of buffers, empty or in flight.
    buffers: usize,
    handle: JoinHandle<Result<RecordingSummary, RecordError>>,
}

impl Recorder {
    /// Creates the file and starts the writing thread.
    ///
    /// # Errors
    /// [`RecordError::OutOfRange`] for a setting. [`RecordError::Exists`] if the file exists, or with rotation a later file of
    /// the recording. [`RecordError::Create`].
    pub fn start(settings: RecorderSettings) -> Result<Self, RecordError> {
        let names = FileNames::new(settings.file.clone());
        refuse_taken_names(&settings, &names)?;
        let progress = Arc::new(SharedProgress::new(names.clone()));
        let path = settings.file.clone();
        let syncs = SyncThread::start().map_err(|source| RecordError::Create(path.clone(), source))?;
        let shared = Arc::clone(&progress);
        let writer = RecordingWriter::create_with(settings, names, shared, Arc::new(SystemDisk), Box::new(syncs))?;
        let (jobs, jobs_received) = bounded(MOST_FRAMES_IN_FLIGHT);
        let (emptied, empty) = bounded(MOST_FRAMES_IN_FLIGHT);
        let handle = thread::Builder::new()
            .name("record-write".to_owned())
            .spawn(move || writer.run(&jobs_received, &emptied))
            .map_err(|source| RecordError::Create(path, source))?;
        Ok(Self { thread: Some(WriterThread { jobs, empty, buffers: 0, handle }), progress })
    }

    /// Records the configuration of a run. Each later file repeats the last configuration.
    ///
    /// # Errors
    /// The error that ended the writing thread.
    pub fn describe(&mut self, run_id: u64, toml: &str) -> Result<(), RecordError> {
        self.send(WriterJob::Describe(Configuration { run_id, toml: toml.to_owned() }))
    }

    /// Records a frame. Copies it, and waits only while all buffers are in flight.
    ///
    /// # Errors
    /// The error that ended the writing thread. This frame and the frames in flight are not in the file.
    pub fn frame(&mut self, header: &FrameHeader, handles: &[HandleState]) -> Result<(), RecordError> {
        let thread = self.thread.as_mut().ok_or(RecordError::Ended)?;
        let Some(mut buffer) = thread.buffer(size_of_val(handles)) else { return Err(self.ended()) };
        buffer.fill(header, handles);
        self.send(WriterJob::Frame(buffer))
    }

    /// Records an alert, an event of the record of commands, or another message. `monotonic_ns` is its arrival.
    ///
    /// # Errors
    /// The error that ended the writing thread.
    pub fn record(&mut self, message: impl Into<Message>, monotonic_ns: u64) -> Result<(), RecordError> {
        self.send(WriterJob::Message { message: message.into(), monotonic_ns })
    }

    /// Sets the growth of the recording while the dragon walks, in bytes per second, for the forecast of a full disk.
    pub fn expect_growth(&self, walking_bytes_per_s: f64) {
        self.progress.walking_bytes_per_s.store(walking_bytes_per_s);
    }

    /// Progress of the recording. Does not wait for the writing thread.
    pub fn progress(&self) -> RecorderProgress {
        self.progress.load()
    }

    /// Writes the frames and messages in flight, and finishes the file.
    ///
    /// # Errors
    /// The error that ended the writing thread.
    pub fn finish(mut self) -> Result<RecordingSummary, RecordError> {
        self.join()
    }

    fn send(&mut self, job: WriterJob) -> Result<(), RecordError> {
        let thread = self.thread.as_ref().ok_or(RecordError::Ended)?;
        thread.jobs.send(job).map_err(|_| self.ended())
    }

    /// The error of a writing thread that ended before the recorder.
    fn ended(&mut self) -> RecordError {
        self.join().expect_err("the writing thread ends before the recorder only with an error")
    }

    fn join(&mut self) -> Result<RecordingSummary, RecordError> {
        let WriterThread { jobs, empty, handle, .. } = self.thread.take().ok_or(RecordError::Ended)?;
        drop((jobs, empty));
        handle.join().unwrap_or_else(|panic| resume_unwind(panic))
    }
}

impl WriterThread {
    /// Returns an empty buffer, or a new one. At the limit for this frame size, waits for the next empty buffer. `None` if the
    /// writing thread has ended.
    fn buffer(&mut self, frame_bytes: usize) -> Option<FrameBuffer> {
        let allowed = frames_in_flight(frame_bytes);
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
            // Smaller frames allowed more buffers: drops the surplus.
            self.buffers -= 1;
        }
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        // `finish` returns the result.
        let _ = self.join();
    }
}

/// A frame in flight to the writing thread. The buffer then returns empty to the recorder.
#[derive(Debug, Default)]
pub struct FrameBuffer {
    pub(super) header: FrameHeader,
    pub(super) handles: Vec<HandleState>,
}

impl FrameBuffer {
    /// Replaces the contents. Allocates only if a frame is larger than all before it.
    pub fn fill(&mut self, header: &FrameHeader, handles: &[HandleState]) {
        self.header = *header;
        self.handles.clear();
        self.handles.extend_from_slice(handles);
    }
}

/// A job of the writing thread.
#[derive(Debug)]
pub enum WriterJob {
    /// A frame.
    Frame(FrameBuffer),
    /// An alert, an event of the record of commands, or another message.
    Message {
        /// The message.
        message: Message,
        /// Its arrival.
        monotonic_ns: u64,
    },
    /// The configuration of a run.
    Describe(Configuration),
}

/// Greatest number of frames of a size that may be in flight.
pub fn frames_in_flight(frame_bytes: usize) -> usize {
    (BYTES_IN_FLIGHT / frame_bytes.max(1)).clamp(LEAST_FRAMES_IN_FLIGHT, MOST_FRAMES_IN_FLIGHT)
}

fn refuse_taken_names(settings: &RecorderSettings, names: &FileNames) -> Result<(), RecordError> {
    if settings.rotate_bytes.or(settings.max_total_bytes).is_none() {
        return Ok(());
    }
    match names.taken() {
        Ok(None) => Ok(()),
        Ok(Some(path)) => Err(RecordError::Exists(path)),
        Err(source) => Err(RecordError::Create(settings.file.clone(), source)),
    }
}

/// Settings of a recorder.
#[derive(Clone, Debug)]
pub struct RecorderSettings {
    /// File to create; with rotation, the first of several. It must not exist.
    pub file: PathBuf,
    /// Size in bytes at which the recorder finishes a file and begins the next one, 1 MB or more. `None`: a quarter of
    /// `max_total_bytes`, or one file if that is `None` too.
    pub rotate_bytes: Option<u64>,
    /// Bound on the size of all files together, in bytes; at least `rotate_bytes`. The recorder removes the oldest files.
    /// `None`: no bound.
    pub max_total_bytes: Option<u64>,
    /// Unix time minus `CLOCK_MONOTONIC`, in nanoseconds, measured once at the start.
    pub unix_minus_monotonic_ns: i64,
    /// Zstandard level, 1 to 19.
    pub compression_level: u32,
}

impl RecorderSettings {
    /// The level that keeps up with 10 kHz on one core. Higher levels save little on poses.
    pub const DEFAULT_COMPRESSION_LEVEL: u32 = 1;

    /// Settings for one file of unbounded size.
    pub fn new(file: impl Into<PathBuf>, unix_minus_monotonic_ns: i64) -> Self {
        Self {
            file: file.into(),
            rotate_bytes: None,
            max_total_bytes: None,
            unix_minus_monotonic_ns,
            compression_level: Self::DEFAULT_COMPRESSION_LEVEL,
        }
    }

    pub(super) fn limits(&self) -> Result<SizeLimits, RecordError> {
        let file = self.rotate_bytes.or(self.max_total_bytes.map(|total| total / FILES_IN_TOTAL));
        let smallest_total = self.rotate_bytes.unwrap_or(FILES_IN_TOTAL * MIN_ROTATE_BYTES);
        for (name, value, allowed) in [
            ("rotate_bytes", self.rotate_bytes, MIN_ROTATE_BYTES..=u64::MAX),
            ("max_total_bytes", self.max_total_bytes, smallest_total..=u64::MAX),
            ("compression_level", Some(self.compression_level.into()), COMPRESSION_LEVELS),
        ] {
            if let Some(value) = value.filter(|value| !allowed.contains(value)) {
                return Err(RecordError::OutOfRange { name, value, allowed });
            }
        }
        let chunk = file.map_or(CHUNK_BYTES, |bytes| CHUNK_BYTES.min(bytes / CHUNKS_IN_FILE));
        Ok(SizeLimits { file, total: self.max_total_bytes, chunk })
    }
}

/// Consistent size limits in bytes.
#[derive(Clone, Copy, Debug)]
pub(super) struct SizeLimits {
    /// Bound on the size of a file.
    pub(super) file: Option<u64>,
    /// Bound on the size of all files together.
    pub(super) total: Option<u64>,
    /// Uncompressed size at which a chunk is closed.
    pub(super) chunk: u64,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error_of(rotate_bytes: Option<u64>, max_total_bytes: Option<u64>) -> String {
        let settings = RecorderSettings { rotate_bytes, max_total_bytes, ..RecorderSettings::new("a.mcap", 0) };
        settings.limits().expect_err("settings out of range").to_string()
    }

    #[test]
    fn an_error_names_the_setting_its_value_and_what_is_allowed() {
        assert_eq!(error_of(Some(5), None), "rotate_bytes is 5, allowed is 1000000 or more");
        assert_eq!(
            error_of(Some(8_000_000), Some(7_000_000)),
            "max_total_bytes is 7000000, allowed is 8000000 or more"
        );
        assert_eq!(error_of(None, Some(3_999_999)), "max_total_bytes is 3999999, allowed is 4000000 or more");
        let settings = RecorderSettings { compression_level: 0, ..RecorderSettings::new("a.mcap", 0) };
        let error = settings.limits().expect_err("settings out of range").to_string();
        assert_eq!(error, "compression_level is 0, allowed is 1 to 19");
    }

    #[test]
    fn a_bounded_recording_rotates_by_itself() {
        let settings = RecorderSettings { max_total_bytes: Some(8_000_000), ..RecorderSettings::new("a.mcap", 0) };
        assert_eq!(settings.limits().expect("valid settings").file, Some(2_000_000));
    }
}
