//! One guard an instance.

use std::fs::{self, File};
use std::io;
use std::path::PathBuf;

use crate::domain::Domain;
use crate::domain_error::DomainError;
use crate::error::BusError;
use crate::lock_file::{self, Refused, hold_alone};

/// Held by the one guard of an instance for as long as it runs.
#[derive(Debug)]
pub struct GuardLock {
    path: PathBuf,
    // Closing the file drops the lock.
    _file: File,
}

impl GuardLock {
    /// Takes the lock of a domain, whose directory is there: a guard is a member of it already.
    ///
    /// # Errors
    /// [`BusError::GuardRunning`] where another process holds it, [`BusError::Domain`].
    pub fn take(domain: &Domain) -> Result<Self, BusError> {
        let path = lock_path(domain);
        match hold_alone(&path) {
            Ok(file) => Ok(Self { path, _file: file }),
            Err(Refused::Taken { pid }) => Err(BusError::GuardRunning { instance: domain.instance().to_string(), pid }),
            Err(Refused::Io(error)) => Err(DomainError::Io { path, error }.into()),
        }
    }

    /// The process id of the guard that holds the lock of a domain; `None` where no guard runs.
    pub fn holder(domain: &Domain) -> Option<u32> {
        lock_file::holder(&lock_path(domain))
    }

    /// Removes the file that a killed guard has left.
    pub(crate) fn clear_abandoned(domain: &Domain) -> io::Result<()> {
        lock_file::clear_abandoned(&lock_path(domain))
    }
}

impl Drop for GuardLock {
    fn drop(&mut self) {
        // While the lock is held, so that nobody else's file is removed. What cannot be removed is used again.
        let _ = fs::remove_file(&self.path);
        // The last one to leave the domain could not remove the directory while this file was in it.
        let _ = self.path.parent().map(fs::remove_dir);
    }
}

fn lock_path(domain: &Domain) -> PathBuf {
    domain.root().join("guard.lock")
}
