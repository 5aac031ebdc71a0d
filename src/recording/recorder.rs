//! The recorder: what a program calls to record, and its settings.

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
    error::RecordError,
    progress::{RecorderProgress, RecordingSummary, SharedProgress},
    reader::Configuration,
    rotation::FileNames,
    topics::Message,
    writer::RecordingWriter,
};

/// What frames on their way to the file, or from it to a replay, take of memory at most: six seconds of the paper's dragon at 1 kHz, so that a disk
/// may stall for longer than a bus can keep frames. A few frames are on their way however large they are.
pub const BYTES_IN_FLIGHT: usize = 64 << 20;
/// As many of small frames at most.
const MOST_FRAMES_IN_FLIGHT: usize = 8192;
/// As many of large frames at least.
const LEAST_FRAMES_IN_FLIGHT: usize = 4;

/// The smallest size at which files can be told to rotate: dozens of frames.
const MIN_ROTATE_BYTES: u64 = 1_000_000;
/// Parts into which a bounded recording is cut where no file size is given.
const FILES_IN_TOTAL: u64 = 4;
/// Uncompressed size at which a chunk is closed; a smaller file has smaller chunks.
const CHUNK_BYTES: u64 = 1 << 20;
/// A rotating file holds this many chunks at least, so it ends close to its limit.
const CHUNKS_IN_FILE: u64 = 16;
const COMPRESSION_LEVELS: RangeInclusive<u64> = 1..=19;

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
    thread: Option<WriterThread>,
    progress: Arc<SharedProgress>,
}

#[derive(Debug)]
struct WriterThread {
    jobs: Sender<WriterJob>,
    empty: Receiver<FrameBuffer>,
    /// Buffers that there are, empty or in flight.
    buffers: usize,
    handle: JoinHandle<Result<RecordingSummary, RecordError>>,
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
        let handle = thread::Builder::new()
            .name("record-write".to_owned())
            .spawn(move || writer.run(&jobs_received, &emptied))
            .map_err(|source| RecordError::Create(path, source))?;
        Ok(Self { thread: Some(WriterThread { jobs, empty, buffers: 0, handle }), progress })
    }

    /// Records the configuration of a run. Each later file repeats the last one.
    ///
    /// # Errors
    /// What ended the writing thread.
    pub fn describe(&mut self, run_id: u64, toml: &str) -> Result<(), RecordError> {
        self.send(WriterJob::Describe(Configuration { run_id, toml: toml.to_owned() }))
    }

    /// Records a frame: copies it, and waits only while all buffers are in flight.
    ///
    /// # Errors
    /// What ended the writing thread; the frame, and those that were in flight, are not in the file.
    pub fn frame(&mut self, header: &FrameHeader, handles: &[HandleState]) -> Result<(), RecordError> {
        let thread = self.thread.as_mut().ok_or(RecordError::Ended)?;
        let Some(mut buffer) = thread.buffer(size_of_val(handles)) else { return Err(self.ended()) };
        buffer.fill(header, handles);
        self.send(WriterJob::Frame(buffer))
    }

    /// Records an alert, an event of the record of commands, or another message that arrived at a monotonic instant.
    ///
    /// # Errors
    /// What ended the writing thread.
    pub fn record(&mut self, message: impl Into<Message>, monotonic_ns: u64) -> Result<(), RecordError> {
        self.send(WriterJob::Message { message: message.into(), monotonic_ns })
    }

    /// How far the recording is. Does not wait for the writing thread.
    pub fn progress(&self) -> RecorderProgress {
        self.progress.load()
    }

    /// Writes what is in flight and finishes the file.
    ///
    /// # Errors
    /// What ended the writing thread.
    pub fn finish(mut self) -> Result<RecordingSummary, RecordError> {
        self.join()
    }

    fn send(&mut self, job: WriterJob) -> Result<(), RecordError> {
        let thread = self.thread.as_ref().ok_or(RecordError::Ended)?;
        thread.jobs.send(job).map_err(|_| self.ended())
    }

    /// The error of a writing thread that is gone although the recorder is not.
    fn ended(&mut self) -> RecordError {
        self.join().expect_err("the writing thread ends by itself only with an error")
    }

    fn join(&mut self) -> Result<RecordingSummary, RecordError> {
        let WriterThread { jobs, empty, handle, .. } = self.thread.take().ok_or(RecordError::Ended)?;
        drop((jobs, empty));
        handle.join().unwrap_or_else(|panic| resume_unwind(panic))
    }
}

impl WriterThread {
    /// A buffer to be filled: an empty one, a new one, or where there may be no more of this size, the next that becomes
    /// empty. `None` where the writing thread has ended.
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

/// A frame on its way to the writing thread, and back empty to be filled again.
#[derive(Debug, Default)]
pub(super) struct FrameBuffer {
    pub(super) header: FrameHeader,
    pub(super) handles: Vec<HandleState>,
}

impl FrameBuffer {
    /// Replaces the contents; allocates only until it has held the largest frame.
    fn fill(&mut self, header: &FrameHeader, handles: &[HandleState]) {
        self.header = *header;
        self.handles.clear();
        self.handles.extend_from_slice(handles);
    }
}

#[derive(Debug)]
pub(super) enum WriterJob {
    Frame(FrameBuffer),
    Message { message: Message, monotonic_ns: u64 },
    Describe(Configuration),
}

/// Frames of a size that may be in flight.
pub(crate) fn frames_in_flight(frame_bytes: usize) -> usize {
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

/// Where and how to record.
#[derive(Clone, Debug)]
pub struct RecorderSettings {
    /// The file to make; with rotation the first of several. It must not exist.
    pub file: PathBuf,
    /// Size at which a file is finished and the next one begun, 1 MB or more; `None`: one file, or a quarter of
    /// `max_total_bytes`.
    pub rotate_bytes: Option<u64>,
    /// Size that all files together stay under, the oldest being removed; at least `rotate_bytes`. `None`: no bound.
    pub max_total_bytes: Option<u64>,
    /// Unix time minus `CLOCK_MONOTONIC`, in nanoseconds, taken once at the start.
    pub unix_minus_monotonic_ns: i64,
    /// Zstandard level, 1 to 19.
    pub compression_level: u32,
}

impl RecorderSettings {
    /// The level that keeps up with 10 kHz on one core; higher ones save little on poses.
    pub const DEFAULT_COMPRESSION_LEVEL: u32 = 1;

    /// Records into one file, however large it grows.
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

/// Sizes in bytes that agree with each other.
#[derive(Clone, Copy, Debug)]
pub(super) struct SizeLimits {
    /// Size that a file stays under.
    pub(super) file: Option<u64>,
    /// Size that all files together stay under.
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
