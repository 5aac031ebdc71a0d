//! The thread that encodes, compresses and writes the files of a recording.

use std::{
    fmt,
    sync::Arc,
    time::{Duration, Instant},
};

use bench_dragon_ipc::{FrameHeader, HandleState};
use crossbeam::channel::{Receiver, RecvTimeoutError, Sender};
use mcap::McapError;

use super::{
    boards::{Boards, encode_markers, encode_scene},
    cdr::{self, ViewedRate},
    disk::RecordingDisk,
    disk_sync::{DiskSync, FileSyncs},
    error::RecordError,
    growth::Growth,
    mcap_file::{McapFile, Stamp},
    progress::{RecorderProgress, RecordingSummary, SharedProgress, Totals},
    reader::Configuration,
    recorder::{FrameBuffer, RecorderSettings, SizeLimits, WriterJob},
    rotation::{FileNames, FinishedFiles},
    topics::{Message, Topic, channel_names},
};

/// Longest time from a message to the close of its chunk: half of the second that a killed recorder may lose.
const FLUSH_AFTER: Duration = Duration::from_millis(500);
/// Frames a second whose poses are recorded, and of these, whose boards are. Of wall time.
const POSES_HZ: u64 = 30;
const BOARDS_HZ: u64 = 10;

/// The writer of a recording: encodes, compresses and writes. It reads no clock: each `now` is the time since its start.
pub struct RecordingWriter {
    settings: RecorderSettings,
    limits: SizeLimits,
    names: FileNames,
    file: McapFile,
    /// Number in the name of the newest file, counted from 1.
    file_number: u64,
    disk: Arc<dyn RecordingDisk>,
    syncs: DiskSync,
    finished: FinishedFiles,
    before: Totals,
    configuration: Option<Configuration>,
    /// The boards of the configuration.
    boards: Option<Boards>,
    pose_rate: ViewedRate,
    board_rate: ViewedRate,
    message: Vec<u8>,
    flush_at: Option<Duration>,
    growth: Growth,
    progress: Arc<SharedProgress>,
}

impl fmt::Debug for RecordingWriter {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("RecordingWriter").field("file", &self.file.path).finish_non_exhaustive()
    }
}

/// Reason why a recording must end.
#[derive(Debug)]
pub enum WriterFault {
    /// The file cannot be written. The writer gives it up.
    File(McapError),
    /// Any other reason. The writer finishes its file.
    Other(RecordError),
}

impl<E: Into<McapError>> From<E> for WriterFault {
    fn from(error: E) -> Self {
        Self::File(error.into())
    }
}

impl RecordingWriter {
    /// Creates the file.
    ///
    /// # Errors
    /// As [`Recorder::start`](super::Recorder::start).
    pub fn create(
        settings: RecorderSettings,
        disk: Arc<dyn RecordingDisk>,
        syncs: Box<dyn FileSyncs>,
    ) -> Result<Self, RecordError> {
        let names = FileNames::new(settings.file.clone());
        let progress = Arc::new(SharedProgress::new(names.clone()));
        Self::create_with(settings, names, progress, disk, syncs)
    }

    pub(super) fn create_with(
        settings: RecorderSettings,
        names: FileNames,
        progress: Arc<SharedProgress>,
        disk: Arc<dyn RecordingDisk>,
        syncs: Box<dyn FileSyncs>,
    ) -> Result<Self, RecordError> {
        let limits = settings.limits()?;
        let file = McapFile::create(&*disk, &names.path(1), settings.compression_level, limits.chunk)?;
        let mut writer = Self {
            limits,
            names,
            file,
            file_number: 1,
            disk,
            syncs: DiskSync::new(syncs),
            finished: FinishedFiles::default(),
            before: Totals::default(),
            configuration: None,
            boards: None,
            pose_rate: ViewedRate::hz(POSES_HZ),
            board_rate: ViewedRate::hz(BOARDS_HZ),
            message: Vec::new(),
            flush_at: None,
            growth: Growth::default(),
            progress,
            settings,
        };
        writer.publish_progress(Duration::ZERO);
        Ok(writer)
    }

    /// Records all jobs until the recorder drops the sender, then finishes the file.
    pub(super) fn run(
        mut self,
        jobs: &Receiver<WriterJob>,
        empty: &Sender<FrameBuffer>,
    ) -> Result<RecordingSummary, RecordError> {
        let recorded = self.record_all(jobs, empty);
        self.end(recorded)
    }

    /// Finishes the file, unless an error has ended the recording.
    ///
    /// # Errors
    /// The error that has ended the recording, or that of the file's end.
    pub fn end(mut self, recorded: Result<(), WriterFault>) -> Result<RecordingSummary, RecordError> {
        match recorded.and_then(|()| self.finish_file()) {
            Ok(()) => {
                self.progress.totals.store(self.totals());
                self.into_summary()
            }
            Err(fault) => {
                // The caller needs the first error, not an error of these calls. Earlier files wait for their last bytes.
                let error = match fault {
                    WriterFault::File(error) => self.file.give_up(error),
                    WriterFault::Other(error) => {
                        let _ = self.finish_file();
                        error
                    }
                };
                let _ = self.syncs.finish();
                Err(error)
            }
        }
    }

    fn record_all(&mut self, jobs: &Receiver<WriterJob>, empty: &Sender<FrameBuffer>) -> Result<(), WriterFault> {
        let started = Instant::now();
        loop {
            let job = match self.due() {
                Some(due) => jobs.recv_deadline(started + due),
                None => jobs.recv().map_err(|_| RecvTimeoutError::Disconnected),
            };
            match job {
                Ok(job) => {
                    if let Some(buffer) = self.take(job, started.elapsed())? {
                        // Fails only after the recorder has dropped the receiver: it then needs no buffer.
                        let _ = empty.send(buffer);
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
            }
            self.act_if_due(started.elapsed())?;
        }
    }

    /// Records a job. Returns the buffer of a frame.
    ///
    /// # Errors
    /// [`WriterFault`]; the caller then calls [`RecordingWriter::end`] with it.
    pub fn take(&mut self, job: WriterJob, now: Duration) -> Result<Option<FrameBuffer>, WriterFault> {
        match job {
            WriterJob::Frame(buffer) => {
                self.record_frame(&buffer, now)?;
                return Ok(Some(buffer));
            }
            WriterJob::Message { message, monotonic_ns } => self.record_message(&message, monotonic_ns, now)?,
            WriterJob::Describe(configuration) => self.describe(configuration, now)?,
        }
        Ok(None)
    }

    /// Instant at which the open chunk is due to be closed, or closed chunks to be synced; `None` without either.
    pub fn due(&self) -> Option<Duration> {
        self.flush_at.into_iter().chain(self.syncs.due()).min()
    }

    /// Closes the open chunk and requests a sync, if that is due.
    ///
    /// # Errors
    /// As [`RecordingWriter::take`].
    pub fn act_if_due(&mut self, now: Duration) -> Result<(), WriterFault> {
        if self.flush_at.is_some_and(|due| now >= due) {
            return self.close_chunk(now);
        }
        Ok(self.syncs.look_after(&self.file.file, now)?)
    }

    fn unix_ns(&self, monotonic_ns: u64) -> u64 {
        unix_ns(monotonic_ns, self.settings.unix_minus_monotonic_ns)
    }

    fn record_frame(
        &mut self,
        FrameBuffer { header, handles }: &FrameBuffer,
        now: Duration,
    ) -> Result<(), WriterFault> {
        let stamp = Stamp {
            sequence: header.tick as u32,
            log_time_ns: self.unix_ns(header.published_ns),
            publish_time_ns: self.unix_ns(header.scheduled_ns),
        };
        self.require_channels_of(header, now)?;
        cdr::encode_frame(&mut self.message, header, handles);
        self.write(Topic::Frames, 0, stamp, now)?;
        if self.pose_rate.is_due(header.scheduled_ns) && header.has_handles(handles.len()) {
            for (dragon, motion) in header.dragons().iter().enumerate() {
                cdr::encode_poses(&mut self.message, stamp.publish_time_ns, &handles[motion.handles()]);
                self.write(Topic::Poses, dragon, stamp, now)?;
            }
            let names = self.file.dragons();
            cdr::encode_transforms(&mut self.message, stamp.publish_time_ns, header, handles, names);
            self.write(Topic::Transforms, 0, stamp, now)?;
            // Boards whose poses are in the file already compress well.
            if self.board_rate.is_due(header.scheduled_ns) {
                self.record_boards(header, handles, stamp, now)?;
            }
        }
        Ok(())
    }

    /// Records the boards of a frame, if the configuration is known.
    fn record_boards(
        &mut self,
        header: &FrameHeader,
        handles: &[HandleState],
        stamp: Stamp,
        now: Duration,
    ) -> Result<(), WriterFault> {
        let Some(boards) = &self.boards else { return Ok(()) };
        encode_scene(&mut self.message, stamp.publish_time_ns, header, handles, boards);
        self.write(Topic::Boards, 0, stamp, now)?;
        let Some(boards) = &self.boards else { return Ok(()) };
        encode_markers(&mut self.message, stamp.publish_time_ns, header, handles, boards);
        self.write(Topic::Markers, 0, stamp, now)
    }

    /// Begins another file for frames whose dragons have no channels in this one. Dragons without a description have numbers as names.
    fn require_channels_of(&mut self, header: &FrameHeader, now: Duration) -> Result<(), WriterFault> {
        let count = if header.is_plan == 1 { header.dragons().len() } else { 0 };
        if self.file.dragons().len() == count {
            return Ok(());
        }
        if self.file.holds_messages() {
            self.close_chunk(now)?;
            self.begin_next_file()?;
        }
        if self.file.dragons().len() != count {
            self.file.set_dragons((1..=count).map(|number| number.to_string()).collect());
        }
        Ok(())
    }

    fn record_message(&mut self, message: &Message, monotonic_ns: u64, now: Duration) -> Result<(), WriterFault> {
        let log_time_ns = self.unix_ns(monotonic_ns);
        let publish_time_ns = message.sent_ns.map_or(log_time_ns, |sent_ns| u64::try_from(sent_ns).unwrap_or(0));
        cdr::encode(&mut self.message, &message.fields);
        self.write(message.topic, 0, Stamp { sequence: message.number as u32, log_time_ns, publish_time_ns }, now)
    }

    fn write(&mut self, topic: Topic, dragon: usize, stamp: Stamp, now: Duration) -> Result<(), WriterFault> {
        if !self.file.fits(&self.message) {
            self.close_chunk(now)?;
        }
        if !self.file.has_unflushed() {
            self.make_room()?;
        }
        self.file.write(topic, dragon, stamp, &self.message)?;
        self.flush_at.get_or_insert(now + FLUSH_AFTER);
        Ok(())
    }

    fn describe(&mut self, configuration: Configuration, now: Duration) -> Result<(), WriterFault> {
        self.close_chunk(now)?;
        let has_channels = !self.file.holds_messages() || channel_names(&configuration.toml) == self.file.dragons();
        self.boards = Boards::of_toml(&configuration.toml);
        let configuration = self.configuration.insert(configuration);
        if has_channels {
            self.file.describe(configuration)?;
            self.syncs.note_write();
            Ok(())
        } else {
            self.begin_next_file()
        }
    }

    /// Hands the chunk to the operating system and publishes the progress.
    fn close_chunk(&mut self, now: Duration) -> Result<(), WriterFault> {
        self.flush_at = None;
        if self.file.has_unflushed() {
            self.file.flush()?;
            self.syncs.note_write();
        }
        self.syncs.look_after(&self.file.file, now)?;
        self.publish_progress(now);
        Ok(())
    }

    /// Makes room for a chunk that begins with the message. Begins the next file if this one is full, and removes the oldest
    /// files.
    fn make_room(&mut self) -> Result<(), WriterFault> {
        let needed_bytes = self.file.bytes_after_chunk_with(&self.message);
        if self.file.holds_messages() && self.limits.file.is_some_and(|limit| needed_bytes > limit) {
            self.begin_next_file()?;
        }
        self.remove_oldest()
    }

    fn finish_file(&mut self) -> Result<(), WriterFault> {
        match self.file.finish()? {
            Some(finished) => Ok(self.syncs.keep(finished)?),
            None => Ok(()),
        }
    }

    fn begin_next_file(&mut self) -> Result<(), WriterFault> {
        self.finish_file()?;
        self.before = self.totals();
        self.finished.push(self.file.path.clone(), self.file.written_bytes);
        self.file = self.create_next().map_err(WriterFault::Other)?;
        if let Some(configuration) = &self.configuration {
            self.file.describe(configuration)?;
        }
        self.progress.totals.store(self.totals());
        Ok(())
    }

    /// Creates the next file. Without rotation, a later name may be that of another recording.
    fn create_next(&mut self) -> Result<McapFile, RecordError> {
        loop {
            self.file_number += 1;
            let path = self.names.path(self.file_number);
            match McapFile::create(&*self.disk, &path, self.settings.compression_level, self.limits.chunk) {
                Err(RecordError::Exists(_)) if self.settings.rotate_bytes.is_none() => {}
                created => return created,
            }
        }
    }

    fn remove_oldest(&mut self) -> Result<(), WriterFault> {
        let Some(limit_bytes) = self.limits.total else { return Ok(()) };
        let current_bytes = self.file.bytes_after_chunk_with(&self.message);
        while let Some(path) = self.finished.take_oldest_over(limit_bytes, current_bytes) {
            self.disk.remove(&path).map_err(|source| WriterFault::Other(RecordError::Remove(path, source)))?;
        }
        Ok(())
    }

    fn totals(&self) -> Totals {
        let mut counts = self.before.counts;
        counts.add(self.file.counts);
        Totals { files: self.before.files + 1, bytes: self.before.bytes + self.file.written_bytes, counts }
    }

    /// Progress of the recording.
    pub fn progress(&self) -> RecorderProgress {
        self.progress.load()
    }

    fn publish_progress(&mut self, now: Duration) {
        let totals = self.totals();
        self.progress.totals.store(totals);
        // Without the size of the disk there is no forecast.
        let Ok(space) = self.file.space() else { return };
        let kept_bytes = self.finished.bytes + self.file.written_bytes;
        let growth_left_bytes = self.limits.total.map(|total| total.saturating_sub(kept_bytes));
        let walking_bytes_per_s = self.progress.walking_bytes_per_s.load();
        let forecast = self.growth.observe(now, totals.bytes, space, growth_left_bytes, walking_bytes_per_s);
        self.progress.forecast.store(forecast);
    }

    fn into_summary(mut self) -> Result<RecordingSummary, RecordError> {
        let Totals { bytes, counts, .. } = self.totals();
        if let Err(error) = self.syncs.finish() {
            return Err(self.file.give_up(error.into()));
        }
        self.finished.push(self.file.path.clone(), self.file.written_bytes);
        let [frames, alerts, commands] = [Topic::Frames, Topic::Alerts, Topic::Commands].map(|topic| counts.of(topic));
        Ok(RecordingSummary { frames, alerts, commands, bytes, files: self.finished.into_paths() })
    }
}

/// Unix time of a monotonic instant, both in nanoseconds; 0 for an instant before 1970.
///
/// The offset is fixed when the recording starts. So a step of the system clock does not change the intervals between frames.
fn unix_ns(monotonic_ns: u64, unix_minus_monotonic_ns: i64) -> u64 {
    monotonic_ns.saturating_add_signed(unix_minus_monotonic_ns)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{
        fs, io,
        path::Path,
        sync::{
            Mutex,
            atomic::{AtomicUsize, Ordering},
        },
    };

    use bench_dragon_ipc::{FrameHeader, HandleState};
    use mcap::MAGIC;

    use super::super::{
        disk::SystemDisk,
        disk_sync::FileSync,
        error::Kept,
        repair::{RepairError, repair},
    };

    /// Counts the requested syncs.
    #[derive(Clone, Debug, Default)]
    struct CountedSyncs(Arc<AtomicUsize>);

    impl FileSyncs for CountedSyncs {
        fn is_idle(&self) -> bool {
            true
        }

        fn request(&mut self, _sync: FileSync) {
            self.0.fetch_add(1, Ordering::Relaxed);
        }

        fn failure(&mut self) -> Option<io::Error> {
            None
        }

        fn finish(&mut self) {}
    }

    #[test]
    fn unix_times_keep_the_intervals_between_instants() {
        let offset_ns = 1_700_000_000_000_000_007;
        assert_eq!(unix_ns(5_000, offset_ns) - unix_ns(2_000, offset_ns), 3_000);
        assert_eq!(unix_ns(3, offset_ns), 1_700_000_000_000_000_010);
    }

    #[test]
    fn a_chunk_that_is_closed_shortly_after_a_sync_is_synced_without_another_frame() {
        let folder = tempfile::tempdir().expect("a folder");
        let (settings, syncs) = (RecorderSettings::new(folder.path().join("show.mcap"), 0), CountedSyncs::default());
        let mut writer = RecordingWriter::create(settings, Arc::new(SystemDisk), Box::new(syncs.clone()))
            .expect("the folder is ours");
        let act = |writer: &mut RecordingWriter, ms: u64| {
            writer.act_if_due(Duration::from_millis(ms)).expect("the disk has room");
            (writer.due().map(|due| due.as_millis()), syncs.0.load(Ordering::Relaxed))
        };
        let mut buffer = FrameBuffer::default();
        buffer.fill(&FrameHeader::default(), &[HandleState::default(); 2]);
        writer.take(WriterJob::Frame(buffer), Duration::ZERO).expect("the disk has room");
        assert_eq!(act(&mut writer, 0), (Some(500), 0), "the chunk is open");
        assert_eq!(act(&mut writer, 500), (Some(1000), 0), "the chunk is closed, and waits for its sync");
        assert_eq!(act(&mut writer, 1000), (None, 1));
    }

    /// Keeps the requested syncs.
    #[derive(Clone, Debug, Default)]
    struct KeptSyncs(Arc<Mutex<Vec<FileSync>>>);

    impl FileSyncs for KeptSyncs {
        fn is_idle(&self) -> bool {
            true
        }

        fn request(&mut self, sync: FileSync) {
            self.0.lock().expect("no panic").push(sync);
        }

        fn failure(&mut self) -> Option<io::Error> {
            None
        }

        fn finish(&mut self) {}
    }

    #[test]
    fn a_finished_file_gets_its_last_bytes_after_all_others_are_on_the_disk() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("show.mcap");
        let (settings, syncs) = (RecorderSettings::new(&path, 0), KeptSyncs::default());
        let mut writer = RecordingWriter::create(settings, Arc::new(SystemDisk), Box::new(syncs.clone()))
            .expect("the folder is ours");
        let mut buffer = FrameBuffer::default();
        buffer.fill(&FrameHeader::default(), &[HandleState::default(); 2]);
        writer.take(WriterJob::Frame(buffer), Duration::ZERO).expect("the disk has room");
        let bytes = writer.end(Ok(())).expect("the disk has room").bytes;
        let before = fs::read(&path).expect("a file");
        assert!(!before.ends_with(MAGIC) && before.len() as u64 + MAGIC.len() as u64 == bytes, "{bytes}");
        assert!(matches!(repair(&path), Err(RepairError::InUse(_))), "its lock is kept for the last bytes");

        let waiting = std::mem::take(&mut *syncs.0.lock().expect("no panic"));
        assert_eq!(waiting.len(), 1);
        // As by a recorder that is killed before the sync.
        fs::write(folder.path().join("killed.mcap"), &before).expect("there is room for a copy");
        for sync in waiting {
            sync.run().expect("the disk has room");
        }
        assert_eq!(fs::read(&path).expect("a file"), [before.as_slice(), MAGIC].concat());
        let repaired = |path: &Path| repair(path).map(|repair| (repair.frames, repair.was_unfinished));
        assert_eq!(repaired(&path).expect("a finished file"), (1, false));
        assert_eq!(repaired(&folder.path().join("killed.mcap")).expect("a file of ours"), (1, true));
    }

    #[test]
    fn a_recording_that_ends_on_a_fault_has_its_last_bytes() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("show.mcap");
        let settings = RecorderSettings::new(&path, 0);
        let writer = RecordingWriter::create(settings, Arc::new(SystemDisk), Box::new(KeptSyncs::default()))
            .expect("the folder is ours");
        let full = WriterFault::from(io::Error::from(io::ErrorKind::StorageFull));
        let ended = writer.end(Err(full));
        assert!(matches!(ended, Err(RecordError::DiskFull { kept: Kept::Finished, .. })), "{ended:?}");
        assert!(!repair(&path).expect("a file of ours").was_unfinished);
    }

    #[test]
    fn instants_before_1970_map_to_1970() {
        assert_eq!(unix_ns(3, -10), 0);
    }
}
