//! One source an instance, without a daemon.

use std::fs::{self, File};
use std::io;
use std::path::PathBuf;

use crate::domain::Domain;
use crate::domain_error::DomainError;
use crate::error::BusError;
use crate::lock_file::{self, Refused, hold_alone};

/// Held by the one source of an instance for as long as it runs.
#[derive(Debug)]
pub struct SourceLock {
    path: PathBuf,
    cleared: Vec<PathBuf>,
    // Closing the file drops the lock.
    _file: File,
}

impl SourceLock {
    /// Takes the lock of a domain, whose directory is made where it is missing.
    ///
    /// A source that was killed while it made a service leaves a file at which every later one would fail. Only sources
    /// make services and only the holder of this lock is one, so such a file is nobody's, and is removed.
    ///
    /// # Errors
    /// [`BusError::SourceRunning`] where another process holds it, [`BusError::Domain`].
    pub fn take(domain: &Domain) -> Result<Self, BusError> {
        let path = lock_path(domain);
        let locked = loop {
            domain.create_directory()?;
            match hold_alone(&path) {
                // The last one to leave has just removed the directory.
                Err(Refused::Io(error)) if error.kind() == io::ErrorKind::NotFound => {}
                locked => break locked,
            }
        };
        match locked {
            Ok(file) => {
                let cleared = clear_half_made(domain).map_err(|error| DomainError::Io { path: path.clone(), error })?;
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

/// Removes what iceoryx2 has begun to write and not finished: its finished service files are read-only.
fn clear_half_made(domain: &Domain) -> io::Result<Vec<PathBuf>> {
    let entries = match fs::read_dir(domain.root().join("services")) {
        Ok(entries) => entries,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(error),
    };
    let mut cleared = Vec::new();
    for entry in entries {
        let entry = entry?;
        if !entry.metadata()?.permissions().readonly() {
            fs::remove_file(entry.path())?;
            cleared.push(entry.path());
        }
    }
    Ok(cleared)
}
