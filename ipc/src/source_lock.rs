//! One source an instance, without a daemon.

use core::time::Duration;
use std::fs::{self, File};
use std::io::{self, ErrorKind};
use std::path::PathBuf;
use std::thread;
use std::time::Instant;

use crate::domain::Domain;
use crate::domain_error::DomainError;
use crate::error::BusError;
use crate::lock_file::{self, Refused, hold_alone, if_there};
use crate::open_files::require_open_files;
use crate::service::SOURCE_FILES;

/// How long a source waits for one that is ending: after a crash of its parent, say, when both are started again at once.
const PATIENCE: Duration = Duration::from_secs(1);
const TRY_PERIOD: Duration = Duration::from_millis(5);

/// Held by the one source of an instance for as long as it runs.
#[derive(Debug)]
pub struct SourceLock {
    path: PathBuf,
    cleared: Vec<PathBuf>,
    // Closing the file drops the lock.
    _file: File,
}

impl SourceLock {
    /// Takes the lock of a domain, whose directory is made where it is missing. Waits up to a second for a source that is
    /// just ending.
    ///
    /// A source that was killed while it made a service leaves a file at which every later one would fail. Only sources
    /// make services and only the holder of this lock is one, so such a file is nobody's, and is removed.
    ///
    /// # Errors
    /// [`BusError::SourceRunning`] where another process holds it, [`BusError::TooFewFiles`], [`BusError::Domain`].
    pub fn take(domain: &Domain) -> Result<Self, BusError> {
        require_open_files(SOURCE_FILES)?;
        let path = lock_path(domain);
        let deadline = Instant::now() + PATIENCE;
        let locked = loop {
            domain.create_directory()?;
            match hold_alone(&path) {
                // The last one to leave has just removed the directory.
                Err(Refused::Io(error)) if error.kind() == ErrorKind::NotFound => {}
                Err(Refused::Taken { .. }) if Instant::now() < deadline => thread::sleep(TRY_PERIOD),
                locked => break locked,
            }
        };
        match locked {
            Ok(file) => {
                let cleared =
                    clear_half_made(domain).map_err(|error| DomainError::Io { path: services(domain), error })?;
                Ok(Self { path, cleared, _file: file })
            }
            Err(Refused::Taken { pid }) => {
                Err(BusError::SourceRunning { instance: domain.instance().to_string(), pid })
            }
            Err(Refused::Io(error)) => Err(DomainError::Io { path, error }.into()),
        }
    }
}

impl SourceLock {
    /// The process id of the source that holds the lock of a domain; `None` where no source runs.
    pub fn holder(domain: &Domain) -> Option<u32> {
        lock_file::holder(&lock_path(domain))
    }

    /// Removes the file that a killed source has left.
    pub(crate) fn clear_abandoned(domain: &Domain) -> io::Result<()> {
        lock_file::clear_abandoned(&lock_path(domain))
    }

    /// The half-made services that were in the way and have been removed.
    pub fn cleared(&self) -> &[PathBuf] {
        &self.cleared
    }
}

impl Drop for SourceLock {
    fn drop(&mut self) {
        // While the lock is held, so that nobody else's file is removed. What cannot be removed is used again.
        let _ = fs::remove_file(&self.path);
        // The last one to leave the domain could not remove the directory while this file was in it.
        let _ = self.path.parent().map(fs::remove_dir);
    }
}

fn lock_path(domain: &Domain) -> PathBuf {
    domain.root().join("source.lock")
}

/// Removes what a killed source has left half made. Whoever leaves the domain meanwhile may remove any of it first.
fn clear_half_made(domain: &Domain) -> io::Result<Vec<PathBuf>> {
    let mut cleared = Vec::new();
    for path in half_made(domain)? {
        if if_there(fs::remove_file(&path))?.is_some() {
            cleared.push(path);
        }
    }
    Ok(cleared)
}

/// What iceoryx2 has begun to write and not finished: its finished service files are read-only.
pub(crate) fn half_made(domain: &Domain) -> io::Result<Vec<PathBuf>> {
    let Some(entries) = if_there(fs::read_dir(services(domain)))? else { return Ok(Vec::new()) };
    let mut half_made = Vec::new();
    for entry in entries {
        let path = entry?.path();
        // One that a client has just taken away is no trouble any more.
        if if_there(fs::metadata(&path))?.is_some_and(|metadata| !metadata.permissions().readonly()) {
            half_made.push(path);
        }
    }
    Ok(half_made)
}

fn services(domain: &Domain) -> PathBuf {
    domain.root().join("services")
}
