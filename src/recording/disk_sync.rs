//! Syncing recorded data to disk, on a separate thread: a power cut loses little, and a slow disk delays no frame.

use std::{
    fs::File,
    io,
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use crossbeam::channel::{Receiver, Sender, bounded};

/// Least time between two syncs of the open file.
const PERIOD: Duration = Duration::from_secs(1);
/// Greatest number of files in the queue for a sync. With rotation, several files may finish while the disk is slow.
const MOST_WAITING: usize = 4;

/// The thread that syncs files to disk.
#[derive(Debug)]
pub(super) struct DiskSync {
    files: Sender<File>,
    failed: Receiver<io::Error>,
    thread: JoinHandle<()>,
    due: Instant,
}

impl DiskSync {
    pub(super) fn start() -> io::Result<Self> {
        let (files, asked) = bounded::<File>(MOST_WAITING);
        let (failures, failed) = bounded(1);
        let thread = thread::Builder::new().name("record-sync".to_owned()).spawn(move || {
            for file in asked {
                if let Err(error) = file.sync_data() {
                    // The channel holds one error: the first one ends the recording.
                    let _ = failures.try_send(error);
                }
            }
        })?;
        Ok(Self { files, failed, thread, due: Instant::now() + PERIOD })
    }

    /// Requests a sync of the open file, at most once a second and only if the queue is empty. Never waits.
    pub(super) fn look_after(&mut self, file: &File) -> io::Result<()> {
        let now = Instant::now();
        if now >= self.due && self.files.is_empty() {
            self.due = now + PERIOD;
            // Only this thread sends, so the empty queue has room.
            let _ = self.files.try_send(file.try_clone()?);
        }
        self.check()
    }

    /// Requests a sync of a finished file. Waits only while the queue is full.
    pub(super) fn keep(&self, file: File) -> io::Result<()> {
        // The thread ends only after this sender is dropped, so the send succeeds.
        let _ = self.files.send(file);
        self.check()
    }

    /// Waits until all requested files are on the disk.
    pub(super) fn finish(self) -> io::Result<()> {
        drop(self.files);
        self.thread.join().expect("the sync thread does not panic");
        self.failed.try_recv().map_or(Ok(()), Err)
    }

    fn check(&self) -> io::Result<()> {
        self.failed.try_recv().map_or(Ok(()), Err)
    }
}
