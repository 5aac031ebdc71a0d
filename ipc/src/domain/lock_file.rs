//! Lock files. The kernel drops a lock when its holder ends, also if the holder is killed.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Seek, SeekFrom, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use super::bus_error::BusError;
use super::domain_error::DomainError;
use super::lock_holders::{Holders, pids};

/// Timeout of waiting for a holder that is ending: much longer than a process takes to end.
const END_TIMEOUT: Duration = Duration::from_secs(10);
const TRY_PERIOD: Duration = Duration::from_millis(1);

/// Reason for which an exclusive lock is refused.
pub(crate) enum Refused {
    /// Another process holds the lock. Its id is `None` where this process cannot see it, as from another PID namespace.
    Taken { pid: Option<u32> },
    /// The file system reported an error.
    Io(io::Error),
}

/// Timeout of [`HeldLock::take_soon`].
const SOON: Duration = Duration::from_secs(1);

/// The exclusive lock on a file of a domain's directory, with this process's id in the file. Dropping it removes the file.
#[derive(Debug)]
pub(crate) struct HeldLock {
    path: PathBuf,
    // Closing the file drops the lock.
    _file: File,
}

impl HeldLock {
    /// Takes the lock. Waits up to a second for a holder that is ending, and for a process that only looks at the lock.
    pub(crate) fn take_soon(path: PathBuf, taken: impl FnOnce(Option<u32>) -> BusError) -> Result<Self, BusError> {
        let deadline = Instant::now() + SOON;
        loop {
            match hold_alone(&path) {
                Err(Refused::Taken { .. }) if Instant::now() < deadline => thread::sleep(TRY_PERIOD),
                locked => return Self::of(path, locked, taken),
            }
        }
    }

    /// The outcome of [`hold_alone`] for a path.
    pub(crate) fn of(
        path: PathBuf,
        locked: Result<File, Refused>,
        taken: impl FnOnce(Option<u32>) -> BusError,
    ) -> Result<Self, BusError> {
        match locked {
            Ok(file) => Ok(Self { path, _file: file }),
            Err(Refused::Taken { pid }) => Err(taken(pid)),
            Err(Refused::Io(error)) => Err(DomainError::Io { path, error }.into()),
        }
    }
}

impl Drop for HeldLock {
    fn drop(&mut self) {
        // Removed while the lock is held, so that the file cannot belong to another process. A file that cannot be
        // removed is reused.
        let _ = fs::remove_file(&self.path);
        // The last member to leave could not remove the directory while it contained this file.
        let _ = self.path.parent().map(fs::remove_dir);
    }
}

/// Takes the exclusive lock on the file at a path without waiting, and writes this process's id into the file.
pub(crate) fn hold_alone(path: &Path) -> Result<File, Refused> {
    let mut file = lock_at(path, Refused::Io, |file| lock_exclusively(file, path))?;
    write_pid(&mut file).map_err(Refused::Io)?;
    Ok(file)
}

fn write_pid(file: &mut File) -> io::Result<()> {
    file.set_len(0)?;
    file.seek(SeekFrom::Start(0))?;
    writeln!(file, "{}", std::process::id())
}

/// Removes a lock file without a holder. Waits for a holder that is ending until the kernel drops its lock.
pub(crate) fn clear_abandoned(path: &Path) -> io::Result<()> {
    let Some(file) = if_there(File::open(path))? else { return Ok(()) };
    let begun = Instant::now();
    loop {
        if file.try_lock().is_ok() {
            // The holder may have removed the file just now.
            return if_there(fs::remove_file(path)).map(drop);
        }
        if Holders::of(&file) == Holders::Living || begun.elapsed() > END_TIMEOUT {
            return Ok(());
        }
        thread::sleep(TRY_PERIOD);
    }
}

/// Returns the process id of the holder of the lock file at a path. It does not try the lock: to a process that starts at
/// that moment, the attempt would look like another holder.
pub(crate) fn holder(path: &Path) -> Option<u32> {
    let pid: u32 = fs::read_to_string(path).ok()?.trim().parse().ok()?;
    let open_files = fs::read_dir(format!("/proc/{pid}/fd")).ok()?;
    let holds = open_files.flatten().any(|file| fs::read_link(file.path()).is_ok_and(|target| target == path));
    holds.then_some(pid)
}

/// Whether a process holds the lock file at a path. Unlike [`holder`], it also detects a process of another container. It
/// takes a shared lock for a moment, so a process that takes the exclusive lock just then has to try again.
pub(crate) fn is_held(path: &Path) -> bool {
    File::open(path).is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)))
}

/// Takes the exclusive lock without waiting, or names its holder. The kernel's list of locks has the ids of this process's own
/// PID namespace. The id in the file is that of the holder's namespace, where this process may be another one.
fn lock_exclusively(file: &File, path: &Path) -> Result<(), Refused> {
    match file.try_lock() {
        Ok(()) => Ok(()),
        Err(TryLockError::WouldBlock) => {
            let listed = pids(file).unwrap_or_default().into_iter().find(|&pid| pid > 0);
            Err(Refused::Taken { pid: listed.or_else(|| holder(path)) })
        }
        Err(TryLockError::Error(error)) => Err(Refused::Io(error)),
    }
}

/// Opens the file at a path, creating it if it is missing, and locks it with `lock`.
///
/// The holder of a lock may remove the file before it drops the lock. So after locking, this function checks that the
/// file is still the one at the path, and starts again if it is not.
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

/// Whether an open file is still the file at a path.
pub(crate) fn is_at(file: &File, path: &Path) -> io::Result<bool> {
    match if_there(fs::metadata(path))? {
        Some(at_path) => Ok(at_path.ino() == file.metadata()?.ino()),
        None => Ok(false),
    }
}

/// Converts the error `NotFound` to `None`.
pub(crate) fn if_there<T>(outcome: io::Result<T>) -> io::Result<Option<T>> {
    match outcome {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        outcome => outcome.map(Some),
    }
}
