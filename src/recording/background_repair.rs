//! Finishing what killed recorders left, while something else goes on.

use std::{
    collections::HashSet,
    fs, io,
    path::{Path, PathBuf},
    thread,
    time::Duration,
};

use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, bounded};
use rustix::process::setpriority_process;

use super::{
    check::{COPY_EXTENSION, DAMAGED_EXTENSION},
    repair::{Repair, RepairError, repair},
};

/// Files and folders that may wait.
const MOST_WAITING: usize = 64;
/// The lowest urgency: by it the kernel also gives a thread its turn at the disk (`ioprio_set(2)`).
const NICE: i32 = 19;
/// A file that another repair is at work on is looked at again this often,
const LOOK_PERIOD: Duration = Duration::from_millis(100);
/// and this many times at most.
const MOST_LOOKS: u32 = 100;

/// A thread of low urgency that repairs one recording after the other.
///
/// A process may end at any instant of a repair: the next one repeats it. So a thread that takes long is not waited for.
///
/// ```
/// use std::{sync::mpsc, time::Duration};
/// use bench_dragon::recording::BackgroundRepair;
///
/// let (results, repaired) = mpsc::channel();
/// let repairs = BackgroundRepair::start(move |result| drop(results.send(result)))?;
/// assert!(repairs.repair("none.mcap".into()));
/// assert!(repairs.finish(Duration::from_secs(10)));
/// assert!(repaired.recv()?.is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct BackgroundRepair {
    waiting: Sender<PathBuf>,
    ended: Receiver<()>,
}

impl BackgroundRepair {
    /// Starts the thread. It calls `report` with the result of each file that was asked for by name, and for each in a folder
    /// that was unfinished.
    ///
    /// # Errors
    /// Where the system starts no thread.
    pub fn start(mut report: impl FnMut(Result<Repair, RepairError>) + Send + 'static) -> io::Result<Self> {
        let (waiting, requests) = bounded::<PathBuf>(MOST_WAITING);
        let (end, ended) = bounded(0);
        thread::Builder::new().name("record-repair".to_owned()).spawn(move || {
            // Dropped when the thread ends, in whatever way.
            let _end: Sender<()> = end;
            // With the process's own urgency it does the same work.
            let _ = setpriority_process(None, NICE);
            for request in requests {
                if request.is_dir() {
                    // A folder that cannot be listed shows nothing that could be finished.
                    repair_folder(&request).unwrap_or_default().into_iter().for_each(&mut report);
                } else {
                    report(repair_when_free(&request));
                }
            }
        })?;
        Ok(Self { waiting, ended })
    }

    /// Has a file repaired, or all unfinished recordings of a folder, as [`repair_folder`] does. Never waits; `false` where too
    /// many are waiting already.
    pub fn repair(&self, path: PathBuf) -> bool {
        self.waiting.try_send(path).is_ok()
    }

    /// Waits until everything that was asked for is done, but no longer than `patience`; whether it is. Otherwise the thread
    /// goes on by itself, at most until the process ends.
    pub fn finish(self, patience: Duration) -> bool {
        drop(self.waiting);
        self.ended.recv_timeout(patience) == Err(RecvTimeoutError::Disconnected)
    }
}

/// Repairs a file; where another repair is at work on it, after that one.
fn repair_when_free(path: &Path) -> Result<Repair, RepairError> {
    for _ in 0..MOST_LOOKS {
        match repair(path) {
            Err(RepairError::InUse { .. }) => thread::sleep(LOOK_PERIOD),
            done => return done,
        }
    }
    repair(path)
}

/// Repairs all unfinished recordings of ours in a folder, in place, and reports each; finished ones, those that another
/// process has open, being recorded or copied, and all other files are passed over.
///
/// # Errors
/// [`RepairError::Read`] where the folder cannot be listed. A recording that cannot be repaired is one entry of the list
/// and keeps none of the others from being repaired.
pub fn repair_folder(folder: &Path) -> Result<Vec<Result<Repair, RepairError>>, RepairError> {
    Ok(unfinished_in(folder)?.iter().map(|path| repair(path)).filter(is_news).collect())
}

/// The files of a folder that a killed recorder may have left.
fn unfinished_in(folder: &Path) -> Result<Vec<PathBuf>, RepairError> {
    let entries = fs::read_dir(folder).and_then(Iterator::collect::<io::Result<Vec<_>>>);
    let entries = entries.map_err(|source| RepairError::Read(folder.into(), source))?;
    let is_candidate = |path: &PathBuf| {
        path.is_file() && path.extension().is_none_or(|end| end != COPY_EXTENSION && end != DAMAGED_EXTENSION)
    };
    let mut candidates: Vec<PathBuf> = entries.into_iter().map(|entry| entry.path()).filter(is_candidate).collect();
    candidates.sort();
    let open_files = open_files();
    candidates.retain(|path| path.canonicalize().is_ok_and(|path| !open_files.contains(&path)));
    Ok(candidates)
}

/// The files that other processes have open, as far as this user may know: one that is being copied here is unfinished
/// too, and not for us to finish.
fn open_files() -> HashSet<PathBuf> {
    let processes = fs::read_dir("/proc").into_iter().flatten().flatten();
    let others = processes.filter(|process| process.file_name() != *std::process::id().to_string());
    let files = others.flat_map(|process| fs::read_dir(process.path().join("fd")).into_iter().flatten().flatten());
    files.filter_map(|file| fs::read_link(file.path()).ok()).collect()
}

fn is_news(repair: &Result<Repair, RepairError>) -> bool {
    match repair {
        Ok(repair) => repair.was_unfinished,
        // Most files in a folder are not for us to read.
        Err(RepairError::Foreign { .. } | RepairError::InUse { .. } | RepairError::Read { .. }) => false,
        Err(RepairError::Damaged { .. } | RepairError::DiskFull { .. } | RepairError::Write { .. }) => true,
    }
}
