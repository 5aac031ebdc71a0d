//! Syncing recorded data to disk, on a separate thread: a power cut loses little, and a slow disk delays no frame.
//!
//! The magic bytes that end a finished file are written here, after all its other bytes are on the disk. So a file that has them is
//! whole, whenever its recorder is killed and the power is lost.

use std::{
    fmt::Debug,
    io,
    sync::Arc,
    thread::{self, JoinHandle},
    time::Duration,
};

use crossbeam::channel::{Receiver, Sender, bounded};

use mcap::MAGIC;

use super::{disk::RecordingFile, repair::Locked};

/// Least time between two syncs of the open file.
const PERIOD: Duration = Duration::from_secs(1);
/// Greatest number of files in the queue for a sync. With rotation, several files may finish while the disk is slow.
const MOST_WAITING: usize = 4;

/// A sync of a file, and the end of a finished one.
#[derive(Debug)]
pub struct FileSync {
    file: Arc<dyn RecordingFile>,
    /// Of a finished file: where its last bytes begin, and its lock, since a repair would write them too.
    end: Option<(u64, Arc<Locked>)>,
}

impl FileSync {
    /// The sync of a file that is being written.
    pub(super) fn of_open(file: &Arc<dyn RecordingFile>) -> Self {
        Self { file: Arc::clone(file), end: None }
    }

    /// The sync of a file that has all bytes but the magic bytes at its end, for which it has reserved the room.
    pub(super) fn of_finished(file: &Arc<dyn RecordingFile>, length: u64, locked: &Arc<Locked>) -> Self {
        Self { file: Arc::clone(file), end: Some((length, Arc::clone(locked))) }
    }

    /// Waits until the file is on the disk. Then ends a finished file, releases the rest of its reserved room, and waits again.
    ///
    /// # Errors
    /// The error of the system. A file without its last bytes is unfinished, and a repair finishes it.
    pub fn run(self) -> io::Result<()> {
        self.file.sync()?;
        let Some((length, _locked)) = self.end else { return Ok(()) };
        self.file.write_all_at(MAGIC, length)?;
        self.file.set_length(length + MAGIC.len() as u64)?;
        self.file.sync()
    }
}

/// Syncs files to disk, one after the other, while the writer goes on.
pub trait FileSyncs: Debug + Send {
    /// Whether no file waits for its sync.
    fn is_idle(&self) -> bool;

    /// Requests a sync of a file. Waits only while the queue is full.
    fn request(&mut self, sync: FileSync);

    /// The first sync that failed, once.
    fn failure(&mut self) -> Option<io::Error>;

    /// Waits until all requested files are on the disk.
    fn finish(&mut self);
}

/// The thread that syncs files to disk.
#[derive(Debug)]
pub(super) struct SyncThread {
    files: Option<Sender<FileSync>>,
    failed: Receiver<io::Error>,
    thread: Option<JoinHandle<()>>,
}

impl SyncThread {
    pub(super) fn start() -> io::Result<Self> {
        let (files, asked) = bounded::<FileSync>(MOST_WAITING);
        let (failures, failed) = bounded(1);
        let thread = thread::Builder::new().name("record-sync".to_owned()).spawn(move || {
            for file in asked {
                if let Err(error) = file.run() {
                    // The channel holds one error: the first one ends the recording.
                    let _ = failures.try_send(error);
                }
            }
        })?;
        Ok(Self { files: Some(files), failed, thread: Some(thread) })
    }
}

impl FileSyncs for SyncThread {
    fn is_idle(&self) -> bool {
        self.files.as_ref().is_none_or(Sender::is_empty)
    }

    fn request(&mut self, sync: FileSync) {
        // The thread ends only after this sender is dropped, so the send succeeds.
        let _ = self.files.as_ref().map(|files| files.send(sync));
    }

    fn failure(&mut self) -> Option<io::Error> {
        self.failed.try_recv().ok()
    }

    fn finish(&mut self) {
        self.files = None;
        if let Some(thread) = self.thread.take() {
            thread.join().expect("the sync thread does not panic");
        }
    }
}

/// Decides when the files of a recording are synced.
#[derive(Debug)]
pub(super) struct DiskSync {
    syncs: Box<dyn FileSyncs>,
    /// Instant from which on the open file may be synced.
    from: Duration,
    /// Whether bytes were written since the last request.
    is_due: bool,
}

impl DiskSync {
    pub(super) fn new(syncs: Box<dyn FileSyncs>) -> Self {
        Self { syncs, from: PERIOD, is_due: false }
    }

    /// Notes that bytes were written.
    pub(super) fn note_write(&mut self) {
        self.is_due = true;
    }

    /// Instant of the next sync of the open file; `None` if all its bytes are synced, or wait for their sync.
    pub(super) fn due(&self) -> Option<Duration> {
        self.is_due.then_some(self.from)
    }

    /// Requests a sync of the open file if it is due, at most once a second and only if the queue is empty. Never waits. `now` is
    /// the time since the start of the recording.
    pub(super) fn look_after(&mut self, file: &Arc<dyn RecordingFile>, now: Duration) -> io::Result<()> {
        if self.due().is_some_and(|due| now >= due) {
            // With a slow disk, the file waits for another period.
            self.from = now + PERIOD;
            if self.syncs.is_idle() {
                self.is_due = false;
                self.syncs.request(FileSync::of_open(file));
            }
        }
        self.check()
    }

    /// Requests the sync and the end of a finished file. Waits only while the queue is full.
    pub(super) fn keep(&mut self, finished: FileSync) -> io::Result<()> {
        self.is_due = false;
        self.syncs.request(finished);
        self.check()
    }

    /// Waits until all requested files are on the disk.
    pub(super) fn finish(mut self) -> io::Result<()> {
        self.syncs.finish();
        self.check()
    }

    fn check(&mut self) -> io::Result<()> {
        self.syncs.failure().map_or(Ok(()), Err)
    }
}
