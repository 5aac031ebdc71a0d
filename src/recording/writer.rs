//! The thread that encodes, compresses and writes the files of a recording.

use std::{
    fs,
    sync::Arc,
    time::{Duration, Instant},
};

use bench_dragon_ipc::{FrameHeader, dragon_names};
use crossbeam::channel::{Receiver, RecvTimeoutError, Sender};
use mcap::McapError;

use super::{
    cdr::{self, PoseRate},
    disk_sync::DiskSync,
    error::RecordError,
    growth::Growth,
    mcap_file::{McapFile, Stamp},
    progress::{RecordingSummary, SharedProgress, Totals},
    reader::Configuration,
    recorder::{FrameBuffer, RecorderSettings, SizeLimits, WriterJob},
    rotation::{FileNames, FinishedFiles},
    topics::{Message, Topic},
};

/// Longest time from a message to the close of its chunk: half of the second that a killed recorder may lose.
const FLUSH_AFTER: Duration = Duration::from_millis(500);

/// State of the writing thread.
pub(super) struct RecordingWriter {
    settings: RecorderSettings,
    limits: SizeLimits,
    names: FileNames,
    file: McapFile,
    /// Number in the name of the newest file, counted from 1.
    file_number: u64,
    disk: DiskSync,
    finished: FinishedFiles,
    before: Totals,
    configuration: Option<Configuration>,
    pose_rate: PoseRate,
    message: Vec<u8>,
    started: Instant,
    flush_at: Option<Instant>,
    growth: Growth,
    progress: Arc<SharedProgress>,
}

/// Reason why the thread must end. After `File`, the caller ends the file with [`McapFile::give_up`].
enum WriterFault {
    File(McapError),
    Other(RecordError),
}

impl<E: Into<McapError>> From<E> for WriterFault {
    fn from(error: E) -> Self {
        Self::File(error.into())
    }
}

impl RecordingWriter {
    pub(super) fn create(
        settings: RecorderSettings,
        names: FileNames,
        progress: Arc<SharedProgress>,
    ) -> Result<Self, RecordError> {
        let limits = settings.limits()?;
        let path = names.path(1);
        let file = McapFile::create(&path, settings.compression_level, limits.chunk)?;
        let disk = DiskSync::start().map_err(|source| RecordError::Create(path, source))?;
        let mut writer = Self {
            limits,
            names,
            file,
            file_number: 1,
            disk,
            finished: FinishedFiles::default(),
            before: Totals::default(),
            configuration: None,
            pose_rate: PoseRate::default(),
            message: Vec::new(),
            started: Instant::now(),
            flush_at: None,
            growth: Growth::default(),
            progress,
            settings,
        };
        writer.publish_progress();
        Ok(writer)
    }

    /// Records all jobs until the recorder drops the sender, then finishes the file.
    pub(super) fn run(
        mut self,
        jobs: &Receiver<WriterJob>,
        empty: &Sender<FrameBuffer>,
    ) -> Result<RecordingSummary, RecordError> {
        match self.record_all(jobs, empty).and_then(|()| self.finish_file()) {
            Ok(()) => {
                self.progress.totals.store(self.totals());
                self.into_summary()
            }
            Err(WriterFault::File(error)) => Err(self.file.give_up(error)),
            Err(WriterFault::Other(error)) => {
                // The caller needs the first error, not an error of this call.
                let _ = self.file.finish();
                Err(error)
            }
        }
    }

    fn record_all(&mut self, jobs: &Receiver<WriterJob>, empty: &Sender<FrameBuffer>) -> Result<(), WriterFault> {
        loop {
            let job = match self.flush_at {
                Some(due) => jobs.recv_deadline(due),
                None => jobs.recv().map_err(|_| RecvTimeoutError::Disconnected),
            };
            match job {
                Ok(WriterJob::Frame(buffer)) => {
                    self.record_frame(&buffer)?;
                    // Fails only after the recorder has dropped the receiver: it then needs no buffer.
                    let _ = empty.send(buffer);
                }
                Ok(WriterJob::Message { message, monotonic_ns }) => self.record_message(&message, monotonic_ns)?,
                Ok(WriterJob::Describe(configuration)) => self.describe(configuration)?,
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
            }
            if self.flush_at.is_some_and(|due| Instant::now() >= due) {
                self.close_chunk()?;
            }
        }
    }

    fn unix_ns(&self, monotonic_ns: u64) -> u64 {
        unix_ns(monotonic_ns, self.settings.unix_minus_monotonic_ns)
    }

    fn record_frame(&mut self, FrameBuffer { header, handles }: &FrameBuffer) -> Result<(), WriterFault> {
        let stamp = Stamp {
            sequence: header.tick as u32,
            log_time_ns: self.unix_ns(header.published_ns),
            publish_time_ns: self.unix_ns(header.scheduled_ns),
        };
        self.require_channels_of(header)?;
        cdr::encode_frame(&mut self.message, header, handles);
        self.write(Topic::Frames, 0, stamp)?;
        if self.pose_rate.is_due(header.scheduled_ns) && header.has_handles(handles.len()) {
            for (dragon, motion) in header.dragons().iter().enumerate() {
                cdr::encode_poses(&mut self.message, stamp.publish_time_ns, &handles[motion.handles()]);
                self.write(Topic::Poses, dragon, stamp)?;
            }
            let names = self.file.dragons();
            cdr::encode_transforms(&mut self.message, stamp.publish_time_ns, header, handles, names);
            self.write(Topic::Transforms, 0, stamp)?;
        }
        Ok(())
    }

    /// Begins another file for frames whose dragons have no channels in this one. Dragons without a description have numbers as names.
    fn require_channels_of(&mut self, header: &FrameHeader) -> Result<(), WriterFault> {
        let count = if header.is_plan == 1 { header.dragons().len() } else { 0 };
        if self.file.dragons().len() == count {
            return Ok(());
        }
        if self.file.holds_messages() {
            self.close_chunk()?;
            self.begin_next_file()?;
        }
        if self.file.dragons().len() != count {
            self.file.set_dragons((1..=count).map(|number| number.to_string()).collect());
        }
        Ok(())
    }

    fn record_message(&mut self, message: &Message, monotonic_ns: u64) -> Result<(), WriterFault> {
        let log_time_ns = self.unix_ns(monotonic_ns);
        let publish_time_ns = message.sent_ns.map_or(log_time_ns, |sent_ns| u64::try_from(sent_ns).unwrap_or(0));
        cdr::encode(&mut self.message, &message.fields);
        self.write(message.topic, 0, Stamp { sequence: message.number as u32, log_time_ns, publish_time_ns })
    }

    fn write(&mut self, topic: Topic, dragon: usize, stamp: Stamp) -> Result<(), WriterFault> {
        if !self.file.fits(&self.message) {
            self.close_chunk()?;
        }
        if !self.file.has_unflushed() {
            self.make_room()?;
        }
        self.file.write(topic, dragon, stamp, &self.message)?;
        self.flush_at.get_or_insert_with(|| Instant::now() + FLUSH_AFTER);
        Ok(())
    }

    fn describe(&mut self, configuration: Configuration) -> Result<(), WriterFault> {
        self.close_chunk()?;
        let has_channels = !self.file.holds_messages() || dragon_names(&configuration.toml) == self.file.dragons();
        let configuration = self.configuration.insert(configuration);
        if has_channels { Ok(self.file.describe(configuration)?) } else { self.begin_next_file() }
    }

    /// Hands the chunk to the operating system and publishes the progress.
    fn close_chunk(&mut self) -> Result<(), WriterFault> {
        self.flush_at = None;
        if self.file.has_unflushed() {
            self.file.flush()?;
        }
        self.disk.look_after(&self.file.file)?;
        self.publish_progress();
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
        self.file.finish()?;
        Ok(self.disk.keep(self.file.file.try_clone()?)?)
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
            match McapFile::create(&path, self.settings.compression_level, self.limits.chunk) {
                Err(RecordError::Exists(_)) if self.settings.rotate_bytes.is_none() => {}
                created => return created,
            }
        }
    }

    fn remove_oldest(&mut self) -> Result<(), WriterFault> {
        let Some(limit_bytes) = self.limits.total else { return Ok(()) };
        let current_bytes = self.file.bytes_after_chunk_with(&self.message);
        while let Some(path) = self.finished.take_oldest_over(limit_bytes, current_bytes) {
            fs::remove_file(&path).map_err(|source| WriterFault::Other(RecordError::Remove(path, source)))?;
        }
        Ok(())
    }

    fn totals(&self) -> Totals {
        let mut counts = self.before.counts;
        counts.add(self.file.counts);
        Totals { files: self.before.files + 1, bytes: self.before.bytes + self.file.written_bytes, counts }
    }

    fn publish_progress(&mut self) {
        let totals = self.totals();
        self.progress.totals.store(totals);
        // Without the size of the disk there is no forecast.
        let Ok(space) = self.file.space() else { return };
        let kept_bytes = self.finished.bytes + self.file.written_bytes;
        let growth_left_bytes = self.limits.total.map(|total| total.saturating_sub(kept_bytes));
        let walking_bytes_per_s = self.progress.walking_bytes_per_s.load();
        let elapsed = self.started.elapsed();
        let forecast = self.growth.observe(elapsed, totals.bytes, space, growth_left_bytes, walking_bytes_per_s);
        self.progress.forecast.store(forecast);
    }

    fn into_summary(mut self) -> Result<RecordingSummary, RecordError> {
        let Totals { bytes, counts, .. } = self.totals();
        if let Err(error) = self.disk.finish() {
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
    use super::unix_ns;

    #[test]
    fn unix_times_keep_the_intervals_between_instants() {
        let offset_ns = 1_700_000_000_000_000_007;
        assert_eq!(unix_ns(5_000, offset_ns) - unix_ns(2_000, offset_ns), 3_000);
        assert_eq!(unix_ns(3, offset_ns), 1_700_000_000_000_000_010);
    }

    #[test]
    fn instants_before_1970_map_to_1970() {
        assert_eq!(unix_ns(3, -10), 0);
    }
}
