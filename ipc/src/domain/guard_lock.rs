//! Lock that admits one guard per instance.

use std::io;
use std::path::PathBuf;

use super::bus_error::BusError;
use super::lock_file::{self, HeldLock};
use super::place::Domain;

/// Lock of the only guard of an instance. The guard holds it while it runs.
#[derive(Debug)]
pub struct GuardLock {
    _held: HeldLock,
}

impl GuardLock {
    /// Takes the lock of a domain. Waits up to a second for a guard that is ending. The directory exists, because a guard is
    /// already a member of the domain.
    ///
    /// # Errors
    /// [`BusError::GuardRunning`] where another process holds the lock, [`BusError::Domain`] where the lock file cannot
    /// be used.
    pub fn take(domain: &Domain) -> Result<Self, BusError> {
        let taken = |pid| BusError::GuardRunning { instance: domain.instance().to_string(), pid };
        Ok(Self { _held: HeldLock::take_soon(lock_path(domain), taken)? })
    }

    /// Returns the process id of the guard that holds the lock of a domain; `None` if no guard runs.
    pub fn holder(domain: &Domain) -> Option<u32> {
        lock_file::holder(&lock_path(domain))
    }

    /// Removes the lock file of a killed guard.
    pub(crate) fn clear_abandoned(domain: &Domain) -> io::Result<()> {
        lock_file::clear_abandoned(&lock_path(domain))
    }
}

fn lock_path(domain: &Domain) -> PathBuf {
    domain.root().join("guard.lock")
}
