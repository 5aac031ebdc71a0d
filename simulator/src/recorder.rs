//! The recorder's process: the production writer on the simulated disk, with its queue of jobs.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

use bench_dragon::recording::on_disk::{FrameBuffer, RecordingWriter, WriterFault, WriterJob, frames_in_flight};
use bench_dragon::recording::{Configuration, Kept, RecordError, RecorderSettings};
use bench_dragon_ipc::service::frame_buffer;
use bench_dragon_ipc::{Alert, CommandEvent, ContinuityTracker, HandleState, ReportCount};

use crate::disk::{ProcessLife, SimulatedDisk, WaitingSyncs};
use crate::frame::BusFrame;
use crate::promises::{RecordingBook, frame_hash};

/// A running recorder.
#[derive(Debug)]
pub(crate) struct RecorderProcess {
    /// Number of the process, which tells its events from those of an earlier one.
    pub(crate) life: u64,
    pub(crate) stopped_until_ns: u64,
    /// Whether it has joined the bus. Before, it gets no frames.
    pub(crate) has_joined: bool,
    /// Whether it has read a frame since the last look.
    pub(crate) is_heard: bool,
    pub(crate) process: Arc<ProcessLife>,
    pub(crate) syncs: WaitingSyncs,
    pub(crate) has_planned_sync: bool,
    /// Instant at which the writing thread wakes next.
    pub(crate) wakes_ns: Option<u64>,
    /// The newest file and the number of written frames at the request of each waiting sync, at the latest.
    requested: VecDeque<(PathBuf, u64)>,
    /// Unread frames, events and alerts on the bus.
    frames: VecDeque<Rc<BusFrame>>,
    pub(crate) events: VecDeque<CommandEvent>,
    pub(crate) alerts: VecDeque<Alert>,
    jobs: VecDeque<WriterJob>,
    frames_in_flight: usize,
    most_in_flight: usize,
    run_id: Option<u64>,
    /// Its report to those who watch the show.
    pub(crate) report: ReportCount,
    tracker: ContinuityTracker,
    writer: RecordingWriter,
    started_ns: u64,
    /// Instant at which the disk has taken the last write.
    pub(crate) busy_until_ns: u64,
    pub(crate) book: RecordingBook,
}

/// What is recorded of a show: settings that do not change.
#[derive(Debug)]
pub(crate) struct RecordedShow<'a> {
    pub(crate) toml: &'a str,
    pub(crate) handles: usize,
    pub(crate) rotate_bytes: Option<u64>,
}

impl RecorderProcess {
    pub(crate) fn start(
        life: u64,
        path: PathBuf,
        disk: &SimulatedDisk,
        show: &RecordedShow<'_>,
        now_ns: u64,
    ) -> Result<Self, RecordError> {
        let (process, syncs) = (ProcessLife::new(), WaitingSyncs::default());
        let settings = RecorderSettings { rotate_bytes: show.rotate_bytes, ..RecorderSettings::new(&path, 0) };
        let writer = RecordingWriter::create(settings, disk.of(&process), Box::new(syncs.clone()))?;
        Ok(Self {
            life,
            stopped_until_ns: 0,
            has_joined: false,
            is_heard: false,
            process,
            syncs,
            has_planned_sync: false,
            wakes_ns: None,
            requested: VecDeque::new(),
            frames: VecDeque::new(),
            events: VecDeque::new(),
            alerts: VecDeque::new(),
            jobs: VecDeque::new(),
            frames_in_flight: 0,
            most_in_flight: frames_in_flight(show.handles * size_of::<HandleState>()),
            run_id: None,
            report: ReportCount::new("record", life.into(), life as u32),
            tracker: ContinuityTracker::default(),
            writer,
            started_ns: now_ns,
            busy_until_ns: now_ns,
            book: RecordingBook::new(path, now_ns),
        })
    }

    /// Puts a frame into the buffer of the bus, which drops its oldest frame if it is full.
    pub(crate) fn deliver(&mut self, frame: &Rc<BusFrame>) {
        if self.frames.len() == frame_buffer(frame.handles.len()) {
            self.frames.pop_front();
        }
        self.frames.push_back(Rc::clone(frame));
    }

    /// Reads all frames for which there is a buffer, and the alerts and events before each. `now_ns` is the arrival.
    pub(crate) fn read(&mut self, show: &RecordedShow<'_>, now_ns: u64) {
        while self.has_buffer() {
            let frame = self.frames.pop_front();
            self.take_messages(now_ns);
            let Some(frame) = frame else { return };
            let BusFrame { header, handles, .. } = &*frame;
            self.is_heard = true;
            self.tracker.track(header);
            self.report.count(header, self.tracker.lost());
            if self.run_id.replace(header.run_id) != Some(header.run_id) {
                let configuration = Configuration { run_id: header.run_id, toml: show.toml.to_owned() };
                self.jobs.push_back(WriterJob::Describe(configuration));
            }
            let mut buffer = FrameBuffer::default();
            buffer.fill(header, handles);
            self.book.hand(frame_hash(header, handles), now_ns);
            self.jobs.push_back(WriterJob::Frame(buffer));
            self.frames_in_flight += 1;
        }
    }

    /// Whether it has a buffer for another frame.
    pub(crate) fn has_buffer(&self) -> bool {
        self.frames_in_flight < self.most_in_flight
    }

    fn take_messages(&mut self, now_ns: u64) {
        for alert in self.alerts.drain(..) {
            self.jobs.push_back(WriterJob::Message { message: (&alert).into(), monotonic_ns: now_ns });
        }
        for event in self.events.drain(..) {
            self.jobs.push_back(WriterJob::Message { message: (&event).into(), monotonic_ns: now_ns });
        }
    }

    fn now(&self, now_ns: u64) -> Duration {
        Duration::from_nanos(now_ns - self.started_ns)
    }

    /// Takes jobs up to the first one that the disk spends time on, and closes the open chunk if that is due. Returns the
    /// instant of the next step.
    pub(crate) fn write(&mut self, disk: &SimulatedDisk, slow: u64, now_ns: u64) -> Result<Option<u64>, WriterFault> {
        let now = self.now(now_ns);
        let before = self.writer.progress();
        let mut spent_ns = 0;
        while spent_ns == 0
            && let Some(job) = self.jobs.pop_front()
        {
            self.frames_in_flight -= usize::from(matches!(job, WriterJob::Frame(_)));
            self.writer.take(job, now)?;
            spent_ns = disk.spent_ns();
        }
        self.writer.act_if_due(now)?;
        spent_ns += disk.spent_ns();
        while self.requested.len() < self.syncs.len() {
            self.requested.push_back((before.file.clone(), before.frames));
        }
        self.book.note_written(self.writer.progress().frames);
        self.busy_until_ns = now_ns + spent_ns.saturating_mul(slow);
        let due_ns = self.writer.due().map(|due| self.started_ns + due.as_nanos() as u64);
        Ok(if self.jobs.is_empty() { due_ns } else { Some(now_ns) }.map(|at_ns| at_ns.max(self.busy_until_ns)))
    }

    /// Whether its only file has frames. Such a file has the room for its end.
    pub(crate) fn has_one_file(&self) -> bool {
        let progress = self.writer.progress();
        progress.files == 1 && progress.frames > 0
    }

    /// Ends the process. Returns the book of what it leaves.
    pub(crate) fn kill(self) -> RecordingBook {
        self.process.kill_after(0);
        let Self { writer, mut book, .. } = self;
        book.path = writer.progress().file;
        book
    }

    /// Syncs the first waiting file.
    pub(crate) fn sync_first(&mut self) {
        let newest = self.writer.progress();
        let requested = self.requested.pop_front();
        self.syncs.sync_first();
        if !self.process.is_over() {
            // The sync of a finished file says nothing of the frames in the next one.
            let is_finished = |(file, _): &(PathBuf, u64)| *file != newest.file;
            self.book.note_synced(requested.filter(is_finished).map_or(newest.frames, |(_, frames)| frames));
        }
    }

    /// Ends in order: records all that it has read, and finishes its file.
    pub(crate) fn end(mut self, show: &RecordedShow<'_>, now_ns: u64) -> (RecordingBook, Result<u64, RecordError>) {
        let mut recorded = Ok(());
        while recorded.is_ok() && (!self.frames.is_empty() || !self.events.is_empty() || !self.jobs.is_empty()) {
            self.read(show, now_ns);
            let now = self.now(now_ns);
            for job in std::mem::take(&mut self.jobs) {
                self.frames_in_flight -= usize::from(matches!(job, WriterJob::Frame(_)));
                if recorded.is_ok() {
                    recorded = self.writer.take(job, now).map(|_| ());
                }
            }
        }
        self.fail_or_end(recorded)
    }

    /// Ends after an error, or in order.
    pub(crate) fn fail_or_end(self, recorded: Result<(), WriterFault>) -> (RecordingBook, Result<u64, RecordError>) {
        let Self { writer, mut book, process, .. } = self;
        let written = writer.progress().frames;
        book.note_written(written);
        book.path = writer.progress().file;
        let ended = writer.end(recorded).map(|summary| summary.frames);
        book.is_finished = ended.is_ok() && !process.is_over();
        match &ended {
            _ if process.is_over() => {}
            Ok(frames) => book.note_synced(*frames),
            Err(RecordError::DiskFull { kept: Kept::Unfinished, .. } | RecordError::Write { .. }) => {}
            // A recorder that ends on a full disk finishes its files on the disk too.
            Err(_) => book.note_synced(written),
        }
        (book, ended)
    }
}
