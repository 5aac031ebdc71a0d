//! Lock files: the kernel drops a lock with the process that holds it, however that ends.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use crate::lock_holders::Holders;

/// How long a lock file waits for a holder that is ending: far longer than that takes.
const PATIENCE: Duration = Duration::from_secs(10);
const TRY_PERIOD: Duration = Duration::from_millis(1);

/// Why an exclusive lock is not to be had.
pub(crate) enum Refused {
    /// Somebody else holds it; with the process id that is written in the file, empty in the instant before it is.
    Taken { pid: String },
    /// The file system's reason.
    Io(io::Error),
}

/// Takes the exclusive lock on the file at a path without waiting, and writes this process's id into it.
pub(crate) fn hold_alone(path: &Path) -> Result<File, Refused> {
    let mut file = lock_at(path, Refused::Io, lock_exclusively)?;
    write_pid(&mut file).map_err(Refused::Io)?;
    Ok(file)
}

fn write_pid(file: &mut File) -> io::Result<()> {
    file.set_len(0)?;
    file.seek(SeekFrom::Start(0))?;
    writeln!(file, "{}", std::process::id())
}

/// Removes a lock file that nobody holds. Waits for a holder that is ending, until the kernel has dropped its lock.
pub(crate) fn clear_abandoned(path: &Path) -> io::Result<()> {
    let Some(file) = if_there(File::open(path))? else { return Ok(()) };
    let begun = Instant::now();
    loop {
        if file.try_lock().is_ok() {
            // Its holder may have removed it just now.
            return if_there(fs::remove_file(path)).map(drop);
        }
        if Holders::of(&file) == Holders::Living || begun.elapsed() > PATIENCE {
            return Ok(());
        }
        thread::sleep(TRY_PERIOD);
    }
}

/// The process id of the holder of the lock file at a path, found out without touching the lock: a try would look like
/// another holder to one that starts at that moment.
pub(crate) fn holder(path: &Path) -> Option<u32> {
    let pid: u32 = fs::read_to_string(path).ok()?.trim().parse().ok()?;
    let open_files = fs::read_dir(format!("/proc/{pid}/fd")).ok()?;
    let holds = open_files.flatten().any(|file| fs::read_link(file.path()).is_ok_and(|target| target == path));
    holds.then_some(pid)
}

fn lock_exclusively(file: &mut File) -> Result<(), Refused> {
    match file.try_lock() {
        Ok(()) => Ok(()),
        Err(TryLockError::WouldBlock) => {
            let mut pid = String::new();
            file.read_to_string(&mut pid).map_err(Refused::Io)?;
            Err(Refused::Taken { pid: pid.trim().to_owned() })
        }
        Err(TryLockError::Error(error)) => Err(Refused::Io(error)),
    }
}

/// Opens the file at a path, making it where it is missing, and locks it with `lock`.
///
/// The holder of a lock may remove the file before it lets go, so after locking this makes sure that the file is still
/// the one at the path, and starts again where it is not.
pub(crate) fn lock_at<E>(
    path: &Path,
    failed: impl Fn(io::Error) -> E,
    lock: impl Fn(&mut File) -> Result<(), E>,
) -> Result<File, E> {
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(true).truncate(false).mode(0o600);
    loop {
        let mut file = options.open(path).map_err(&failed)?;
        lock(&mut file)?;
        if is_at(&file, path).map_err(&failed)? {
            return Ok(file);
        }
    }
}

/// Whether an open file is still the one at a path.
pub(crate) fn is_at(file: &File, path: &Path) -> io::Result<bool> {
    match if_there(fs::metadata(path))? {
        Some(at_path) => Ok(at_path.ino() == file.metadata()?.ino()),
        None => Ok(false),
    }
}

/// `None` where what was asked for is not there.
pub(crate) fn if_there<T>(outcome: io::Result<T>) -> io::Result<Option<T>> {
    match outcome {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        outcome => outcome.map(Some),
    }
}
