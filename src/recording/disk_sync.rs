//! Forcing what is recorded onto the disk, on a thread of its own: a power cut costs little, and a slow disk holds up no
//! frame.

use std::{
    fs::File,
    io,
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use crossbeam::channel::{Receiver, Sender, bounded};

/// How often a file that is being written is forced onto the disk, where the disk is that fast.
const PERIOD: Duration = Duration::from_secs(1);
/// Files that may wait for the disk; with rotation, several are finished while it is slow.
const MOST_WAITING: usize = 4;

/// The thread that waits for the disk.
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
                    // The first failure is enough to end the recording.
                    let _ = failures.try_send(error);
                }
            }
        })?;
        Ok(Self { files, failed, thread, due: Instant::now() + PERIOD })
    }

    /// Has a file that is being written forced onto the disk, once a second and not while others wait. Never waits itself.
    pub(super) fn look_after(&mut self, file: &File) -> io::Result<()> {
        let now = Instant::now();
        if now >= self.due && self.files.is_empty() {
            self.due = now + PERIOD;
            // Taken by nobody but this thread, so there is room.
            let _ = self.files.try_send(file.try_clone()?);
        }
        self.check()
    }

    /// Has a finished file forced onto the disk. Waits only where several wait already.
    pub(super) fn keep(&self, file: File) -> io::Result<()> {
        // The thread ends only when this end is dropped.
        let _ = self.files.send(file);
        self.check()
    }

    /// Waits until all is on the disk.
    pub(super) fn finish(self) -> io::Result<()> {
        drop(self.files);
        self.thread.join().expect("the thread that waits for the disk does not panic");
        self.failed.try_recv().map_or(Ok(()), Err)
    }

    fn check(&self) -> io::Result<()> {
        self.failed.try_recv().map_or(Ok(()), Err)
    }
}
