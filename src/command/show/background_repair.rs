//! A thread that finishes one recording after the other.

use std::io;
use std::path::PathBuf;
use std::thread;
use std::time::Duration;

use bench_dragon::record::{Repair, RepairError, repair, repair_folder};
use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, bounded};

/// Files and folders that may wait.
const MOST_WAITING: usize = 64;
/// A file that another process is at work on is looked at again this often,
const LOOK_PERIOD: Duration = Duration::from_millis(100);
/// and this many times at most.
const MOST_LOOKS: u32 = 100;

/// The thread. It ends when it has done what it was asked for and this is dropped, or with the process: a repair that was
/// interrupted can be repeated.
#[derive(Debug)]
pub(super) struct BackgroundRepair {
    waiting: Sender<Request>,
    ended: Receiver<()>,
}

#[derive(Debug)]
enum Request {
    File(PathBuf),
    Folder(PathBuf),
}

impl BackgroundRepair {
    /// Starts the thread. It reports each file that was asked for by name, and each unfinished one of a folder.
    ///
    /// # Errors
    /// Where the system starts no thread.
    pub(super) fn start(mut report: impl FnMut(Result<Repair, RepairError>) + Send + 'static) -> io::Result<Self> {
        let (waiting, requests) = bounded::<Request>(MOST_WAITING);
        let (end, ended) = bounded(0);
        thread::Builder::new().name("repair".to_owned()).spawn(move || {
            // Dropped when the thread ends, in whatever way.
            let _end: Sender<()> = end;
            for request in requests {
                match request {
                    Request::File(path) => report(repair_when_free(&path)),
                    // A folder that cannot be listed holds nothing to finish.
                    Request::Folder(folder) => repair_folder(&folder).into_iter().flatten().for_each(&mut report),
                }
            }
        })?;
        Ok(Self { waiting, ended })
    }

    /// Has a file finished. Never waits; `false` where too many are waiting.
    pub(super) fn repair_file(&self, path: PathBuf) -> bool {
        self.waiting.try_send(Request::File(path)).is_ok()
    }

    /// Has all unfinished recordings of a folder finished. Never waits; `false` where too many are waiting.
    pub(super) fn repair_folder(&self, folder: PathBuf) -> bool {
        self.waiting.try_send(Request::Folder(folder)).is_ok()
    }

    /// Waits until all is done, but no longer than `patience`; whether it is.
    pub(super) fn finish(self, patience: Duration) -> bool {
        drop(self.waiting);
        self.ended.recv_timeout(patience) == Err(RecvTimeoutError::Disconnected)
    }
}

/// Finishes a file; where another process is at work on it, after that one.
fn repair_when_free(path: &std::path::Path) -> Result<Repair, RepairError> {
    for _ in 0..MOST_LOOKS {
        match repair(path) {
            Err(RepairError::InUse { .. }) => thread::sleep(LOOK_PERIOD),
            done => return done,
        }
    }
    repair(path)
}
