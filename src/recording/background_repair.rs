//! Finishes the recordings of killed recorders in the background.

use std::{
    collections::HashSet,
    fs, io,
    path::{Path, PathBuf},
    thread,
    time::{Duration, Instant},
};

use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, bounded};
use rustix::process::setpriority_process;

use super::{
    check::{COPY_EXTENSION, DAMAGED_EXTENSION},
    disk::SystemDisk,
    repair::{Repair, RepairError, open_ours, repair},
};

/// Greatest number of files and folders in the queue.
const MOST_WAITING: usize = 64;
/// The lowest scheduling priority. The kernel derives the disk priority of the thread from it (`ioprio_set(2)`).
const NICE: i32 = 19;
/// Period of retries while another process has locked a file.
const RETRY_PERIOD: Duration = Duration::from_millis(100);
/// Greatest number of retries.
const MOST_RETRIES: u32 = 100;
/// Longest period at which the files of folders that other processes have open are tried again.
const LONGEST_PERIOD: Duration = Duration::from_secs(30);
/// Greatest number of these files.
const MOST_BUSY: usize = 1000;

/// A low-priority thread that repairs recordings one after the other.
///
/// A process may end at any instant of a repair; the next repair repeats it. So no process has to wait for a slow repair.
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
    /// Starts the thread. It calls `report` with the result of each requested file, and of each unfinished recording in a
    /// requested folder.
    ///
    /// # Errors
    /// The error of the system if it cannot start a thread.
    pub fn start(mut report: impl FnMut(Result<Repair, RepairError>) + Send + 'static) -> io::Result<Self> {
        let (waiting, requests) = bounded::<PathBuf>(MOST_WAITING);
        let (end, ended) = bounded(0);
        thread::Builder::new().name("record-repair".to_owned()).spawn(move || {
            // Dropped when the thread ends, even by a panic.
            let _end: Sender<()> = end;
            // If this fails, the thread works at the priority of the process.
            let _ = setpriority_process(None, NICE);
            let mut busy = Busy::default();
            loop {
                match busy.next_request(&requests) {
                    // A folder that cannot be listed counts as empty.
                    Ok(request) if request.is_dir() => {
                        let (repairs, open) = repair_free(candidates_in(&request).unwrap_or_default());
                        repairs.into_iter().for_each(&mut report);
                        busy.add(open);
                    }
                    Ok(request) => report(repair_when_free(&request)),
                    Err(RecvTimeoutError::Timeout) => busy.retry().into_iter().for_each(&mut report),
                    Err(RecvTimeoutError::Disconnected) => return,
                }
            }
        })?;
        Ok(Self { waiting, ended })
    }

    /// Queues the repair of a file, or of all unfinished recordings of a folder as by [`repair_folder`]. Recordings of a folder
    /// that another process has open are repaired after it has closed them. Never waits. Returns `false` if the queue is full.
    pub fn repair(&self, path: PathBuf) -> bool {
        self.waiting.try_send(path).is_ok()
    }

    /// Waits until all requested repairs are done, but no longer than `timeout`. Returns whether they are done. Otherwise the
    /// thread continues, at most until the process ends. Recordings of folders that another process has open are left as they
    /// are.
    pub fn finish(self, timeout: Duration) -> bool {
        drop(self.waiting);
        self.ended.recv_timeout(timeout) == Err(RecvTimeoutError::Disconnected)
    }
}

/// Repairs a file. Retries while another process has locked it.
fn repair_when_free(path: &Path) -> Result<Repair, RepairError> {
    for _ in 0..MOST_RETRIES {
        match repair(path) {
            Err(RepairError::InUse { .. }) => thread::sleep(RETRY_PERIOD),
            done => return done,
        }
    }
    repair(path)
}

/// Repairs all unfinished recordings of ours in a folder, in place, and returns the result of each. Skips finished recordings,
/// recordings that another process has open (for example to record or copy them), and all other files.
///
/// # Errors
/// [`RepairError::Read`] if the folder cannot be listed. A failed repair is an entry of the list; the other recordings are
/// still repaired.
pub fn repair_folder(folder: &Path) -> Result<Vec<Result<Repair, RepairError>>, RepairError> {
    Ok(repair_free(candidates_in(folder)?).0)
}

/// Repairs the unfinished recordings of ours among these files. Returns the results, and the recordings that it skipped since
/// another process has them open.
fn repair_free(files: Vec<PathBuf>) -> (Vec<Result<Repair, RepairError>>, Vec<PathBuf>) {
    let open_files = open_files();
    let is_open = |path: &PathBuf| path.canonicalize().is_ok_and(|path| open_files.contains(&path));
    let (mut open, free): (Vec<_>, Vec<_>) = files.into_iter().partition(is_open);
    open.retain(|path| open_ours(&SystemDisk, path).is_ok());
    let mut repairs = Vec::new();
    for path in free {
        match repair(&path) {
            Err(RepairError::InUse { .. }) => open.push(path),
            repair => repairs.extend(is_of_unfinished(&repair).then_some(repair)),
        }
    }
    (repairs, open)
}

/// Files of a folder that may come from a killed recorder, sorted.
fn candidates_in(folder: &Path) -> Result<Vec<PathBuf>, RepairError> {
    let entries = fs::read_dir(folder).and_then(Iterator::collect::<io::Result<Vec<_>>>);
    let entries = entries.map_err(|source| RepairError::Read(folder.into(), source))?;
    let is_candidate = |path: &PathBuf| {
        path.is_file() && path.extension().is_none_or(|end| end != COPY_EXTENSION && end != DAMAGED_EXTENSION)
    };
    let mut candidates: Vec<PathBuf> = entries.into_iter().map(|entry| entry.path()).filter(is_candidate).collect();
    candidates.sort();
    Ok(candidates)
}

/// Recordings that other processes had open. They are tried again at periods that double up to [`LONGEST_PERIOD`], since another
/// process may be reading or copying them, or the kernel may still be ending their killed recorder.
#[derive(Debug, Default)]
struct Busy {
    files: Vec<PathBuf>,
    period: Duration,
    due: Option<Instant>,
}

impl Busy {
    /// Waits for the next request, or until the files are to be tried again.
    fn next_request(&self, requests: &Receiver<PathBuf>) -> Result<PathBuf, RecvTimeoutError> {
        match self.due {
            Some(due) => requests.recv_deadline(due),
            None => requests.recv().map_err(|_| RecvTimeoutError::Disconnected),
        }
    }

    fn add(&mut self, files: Vec<PathBuf>) {
        if !files.is_empty() {
            self.files.extend(files);
            self.files.truncate(MOST_BUSY);
            self.period = RETRY_PERIOD;
            self.due = Some(Instant::now() + self.period);
        }
    }

    fn retry(&mut self) -> Vec<Result<Repair, RepairError>> {
        let (repairs, files) = repair_free(std::mem::take(&mut self.files));
        self.files = files;
        self.period = (2 * self.period).min(LONGEST_PERIOD);
        self.due = (!self.files.is_empty()).then(|| Instant::now() + self.period);
        repairs
    }
}

/// Files that other processes have open, as far as this user may see them. For example, a file that another process is copying
/// into the folder looks unfinished, but must not be repaired.
fn open_files() -> HashSet<PathBuf> {
    let processes = fs::read_dir("/proc").into_iter().flatten().flatten();
    let others = processes.filter(|process| process.file_name() != *std::process::id().to_string());
    let files = others.flat_map(|process| fs::read_dir(process.path().join("fd")).into_iter().flatten().flatten());
    files.filter_map(|file| fs::read_link(file.path()).ok()).collect()
}

/// Whether a result concerns an unfinished recording of ours.
fn is_of_unfinished(repair: &Result<Repair, RepairError>) -> bool {
    match repair {
        Ok(repair) => repair.was_unfinished,
        // A folder may contain files that are not ours or not readable.
        Err(RepairError::Foreign { .. } | RepairError::InUse { .. } | RepairError::Read { .. }) => false,
        Err(RepairError::Damaged { .. } | RepairError::DiskFull { .. } | RepairError::Write { .. }) => true,
    }
}
