//! The thread that encodes, compresses and writes, one file after the other.

use std::{
    fs,
    sync::Arc,
    time::{Duration, Instant},
};

use bench_dragon_ipc::{Alert, CommandEvent, FrameHeader, HandleState};
use crossbeam::channel::{Receiver, RecvTimeoutError, Sender};
use mcap::{McapError, McapResult};

use super::{
    cdr,
    channels::Kind,
    disk_sync::DiskSync,
    error::RecordError,
    open_file::{Counts, Recording, Stamp},
    pose::PoseRate,
    progress::{SharedProgress, Summary},
    rotation::{FileNames, FinishedFiles},
    settings::{Limits, RecorderSettings},
    space::SpaceForecast,
    timeline::Timeline,
};

/// A message waits no longer than this for its chunk to be closed: half of the second that a killed recorder may lose.
const FLUSH_AFTER: Duration = Duration::from_millis(500);

/// A frame on its way to the writing thread, and back empty to be filled again.
#[derive(Debug, Default)]
pub(super) struct FrameBuffer {
    header: FrameHeader,
    handles: Vec<HandleState>,
}

impl FrameBuffer {
    /// Replaces the contents; allocates only until it has held the largest frame.
    pub(super) fn fill(&mut self, header: &FrameHeader, handles: &[HandleState]) {
        self.header = *header;
        self.handles.clear();
        self.handles.extend_from_slice(handles);
    }
}

/// What the writing thread is asked to record.
#[derive(Debug)]
pub(super) enum Job {
    Frame(FrameBuffer),
    Alert { alert: Alert, monotonic_ns: u64 },
    Command { event: CommandEvent, monotonic_ns: u64 },
    Describe(Description),
}

/// A configuration, and the run that it belongs to.
#[derive(Clone, Debug)]
pub(super) struct Description {
    pub(super) run_id: u64,
    pub(super) toml: String,
}

/// Everything that the writing thread owns.
pub(super) struct RecordingWriter {
    settings: RecorderSettings,
    limits: Limits,
    timeline: Timeline,
    names: FileNames,
    recording: Recording,
    disk: DiskSync,
    finished: FinishedFiles,
    before: Totals,
    description: Option<Description>,
    pose_rate: PoseRate,
    message: Vec<u8>,
    started: Instant,
    flush_at: Option<Instant>,
    forecast: SpaceForecast,
    progress: Arc<SharedProgress>,
}

/// What several files came to.
#[derive(Default)]
struct Totals {
    files: u64,
    bytes: u64,
    counts: Counts,
}

/// Why the thread must end; a file that cannot be written is still to be given up.
enum Fault {
    File(McapError),
    Other(RecordError),
}

impl<E: Into<McapError>> From<E> for Fault {
    fn from(error: E) -> Self {
        Self::File(error.into())
    }
}

impl RecordingWriter {
    /// Makes the first file.
    pub(super) fn create(
        settings: RecorderSettings,
        names: FileNames,
        progress: Arc<SharedProgress>,
    ) -> Result<Self, RecordError> {
        let limits = settings.limits()?;
        let path = names.path(1);
        let recording = Recording::create(&path, settings.compression_level, limits.chunk)?;
        let disk = DiskSync::start().map_err(|source| RecordError::Create { path, source })?;
        let mut writer = Self {
            timeline: Timeline::new(settings.unix_minus_monotonic_ns),
            limits,
            names,
            recording,
            disk,
            finished: FinishedFiles::default(),
            before: Totals::default(),
            description: None,
            pose_rate: PoseRate::default(),
            message: Vec::new(),
            started: Instant::now(),
            flush_at: None,
            forecast: SpaceForecast::default(),
            progress,
            settings,
        };
        writer.publish_totals();
        writer.publish_outlook();
        Ok(writer)
    }

    /// Records all jobs until their sender is gone, then finishes the file.
    pub(super) fn run(mut self, jobs: &Receiver<Job>, empty: &Sender<FrameBuffer>) -> Result<Summary, RecordError> {
        match self.record_all(jobs, empty).and_then(|()| self.finish_file()) {
            Ok(()) => {
                self.publish_totals();
                self.into_summary()
            }
            Err(Fault::File(error)) => Err(self.recording.give_up(error)),
            Err(Fault::Other(error)) => {
                // The first error is the one to tell.
                let _ = self.recording.finish();
                Err(error)
            }
        }
    }

    fn record_all(&mut self, jobs: &Receiver<Job>, empty: &Sender<FrameBuffer>) -> Result<(), Fault> {
        loop {
            let job = match self.flush_at {
                Some(due) => jobs.recv_deadline(due),
                None => jobs.recv().map_err(|_| RecvTimeoutError::Disconnected),
            };
            match job {
                Ok(Job::Frame(buffer)) => {
                    self.record_frame(&buffer)?;
                    // A recorder that has gone needs no buffer back.
                    let _ = empty.send(buffer);
                }
                Ok(Job::Alert { alert, monotonic_ns }) => self.record_alert(&alert, monotonic_ns)?,
                Ok(Job::Command { event, monotonic_ns }) => self.record_command(&event, monotonic_ns)?,
                Ok(Job::Describe(description)) => self.describe(description)?,
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
            }
            if self.flush_at.is_some_and(|due| Instant::now() >= due) {
                self.close_chunk()?;
            }
        }
    }

    fn record_frame(&mut self, FrameBuffer { header, handles }: &FrameBuffer) -> Result<(), Fault> {
        let stamp = Stamp {
            sequence: header.tick as u32,
            log_time_ns: self.timeline.unix_ns(header.published_ns),
            publish_time_ns: self.timeline.unix_ns(header.scheduled_ns),
        };
        cdr::encode_frame(&mut self.message, header, handles);
        self.write(Kind::Frame, stamp)?;
        if self.pose_rate.is_due(header.published_ns) {
            cdr::encode_poses(&mut self.message, stamp.log_time_ns, handles);
            self.write(Kind::Poses, stamp)?;
        }
        Ok(())
    }

    fn record_alert(&mut self, alert: &Alert, monotonic_ns: u64) -> Result<(), Fault> {
        let unix_ns = self.timeline.unix_ns(monotonic_ns);
        let stamp = Stamp { sequence: alert.tick as u32, log_time_ns: unix_ns, publish_time_ns: unix_ns };
        cdr::encode_alert(&mut self.message, alert);
        self.write(Kind::Alert, stamp)
    }

    fn record_command(&mut self, event: &CommandEvent, monotonic_ns: u64) -> Result<(), Fault> {
        let stamp = Stamp {
            sequence: event.number as u32,
            log_time_ns: self.timeline.unix_ns(monotonic_ns),
            publish_time_ns: u64::try_from(event.wall_ns).unwrap_or(0),
        };
        cdr::encode_command(&mut self.message, event);
        self.write(Kind::Command, stamp)
    }

    fn write(&mut self, kind: Kind, stamp: Stamp) -> Result<(), Fault> {
        if !self.recording.fits(&self.message) {
            self.close_chunk()?;
        }
        if !self.recording.has_unflushed() {
            self.make_room()?;
        }
        self.recording.write(kind, stamp, &self.message)?;
        self.flush_at.get_or_insert_with(|| Instant::now() + FLUSH_AFTER);
        Ok(())
    }

    fn describe(&mut self, description: Description) -> Result<(), Fault> {
        self.close_chunk()?;
        self.recording.describe(description.run_id, &description.toml)?;
        self.description = Some(description);
        Ok(())
    }

    /// Hands the chunk to the operating system and tells how far the recording is.
    fn close_chunk(&mut self) -> Result<(), Fault> {
        self.flush_at = None;
        if self.recording.has_unflushed() {
            self.recording.flush()?;
        }
        self.disk.look_after(self.recording.file())?;
        self.publish_totals();
        self.publish_outlook();
        Ok(())
    }

    /// Makes room for a chunk that begins with the message: in a file, and among the files.
    fn make_room(&mut self) -> Result<(), Fault> {
        let needed_bytes = self.recording.bytes_after_chunk_with(&self.message);
        if self.recording.holds_messages() && self.limits.file.is_some_and(|limit| needed_bytes > limit) {
            self.begin_next_file()?;
        }
        self.remove_oldest()
    }

    fn finish_file(&mut self) -> Result<(), Fault> {
        self.recording.finish()?;
        Ok(self.disk.keep(self.recording.file().try_clone()?)?)
    }

    fn begin_next_file(&mut self) -> Result<(), Fault> {
        self.finish_file()?;
        self.before = self.totals();
        self.finished.push(self.recording.path().into(), self.recording.written_bytes());
        let path = self.names.path(self.before.files + 1);
        self.recording =
            Recording::create(&path, self.settings.compression_level, self.limits.chunk).map_err(Fault::Other)?;
        self.repeat_description()?;
        self.publish_totals();
        Ok(())
    }

    fn repeat_description(&mut self) -> McapResult<()> {
        match &self.description {
            Some(Description { run_id, toml }) => self.recording.describe(*run_id, toml),
            None => Ok(()),
        }
    }

    fn remove_oldest(&mut self) -> Result<(), Fault> {
        let Some(limit_bytes) = self.limits.total else { return Ok(()) };
        let current_bytes = self.recording.bytes_after_chunk_with(&self.message);
        while let Some(path) = self.finished.take_oldest_over(limit_bytes, current_bytes) {
            fs::remove_file(&path).map_err(|source| Fault::Other(RecordError::Remove { path, source }))?;
        }
        Ok(())
    }

    fn totals(&self) -> Totals {
        let mut counts = self.before.counts;
        counts.add(self.recording.counts());
        Totals { files: self.before.files + 1, bytes: self.before.bytes + self.recording.written_bytes(), counts }
    }

    fn publish_totals(&self) {
        let Totals { files, bytes, counts } = self.totals();
        self.progress.store(counts, bytes, files);
    }

    fn publish_outlook(&mut self) {
        // A disk that does not tell its size is only not forecast.
        let Ok(space) = self.recording.space() else { return };
        let kept_bytes = self.finished.bytes() + self.recording.written_bytes();
        let growth_left_bytes = self.limits.total.map(|total| total.saturating_sub(kept_bytes));
        let written_bytes = self.totals().bytes;
        let outlook = self.forecast.observe(self.started.elapsed(), written_bytes, space, growth_left_bytes);
        self.progress.store_outlook(outlook);
    }

    fn into_summary(mut self) -> Result<Summary, RecordError> {
        let Totals { bytes, counts, .. } = self.totals();
        if let Err(error) = self.disk.finish() {
            return Err(self.recording.give_up(error.into()));
        }
        self.finished.push(self.recording.path().into(), self.recording.written_bytes());
        let Counts { frames, alerts, commands } = counts;
        Ok(Summary { frames, alerts, commands, bytes, files: self.finished.into_paths() })
    }
}
