//! Locks that admit one supervised show and one guard per instance, also while its server is restarted.

use std::fs::File;
use std::io;

use super::bus_error::BusError;
use super::lock_file::{self, HeldLock};
use super::place::Domain;

/// Lock of the only supervisor of an instance. The supervisor holds it from its start to its end.
#[derive(Debug)]
pub struct ShowLock {
    _held: HeldLock,
}

impl ShowLock {
    /// Takes the lock of a domain. Waits up to a second for a supervisor that is ending.
    ///
    /// # Errors
    /// [`BusError::ShowRunning`] where another process holds the lock, [`BusError::Domain`] where the directory or the lock
    /// file cannot be used.
    pub fn take(domain: &Domain) -> Result<Self, BusError> {
        domain.create_directory()?;
        let taken = |pid| BusError::ShowRunning { instance: domain.instance().to_string(), pid };
        Ok(Self { _held: HeldLock::take_soon(domain.lock_path("show"), taken)? })
    }

    /// Whether the supervisor of a domain was killed, and nothing has been started since. The file of its lock stays until the
    /// last member has left, or a source starts.
    pub fn is_abandoned(domain: &Domain) -> bool {
        File::open(domain.lock_path("show")).is_ok_and(|file| file.try_lock_shared().is_ok())
    }

    /// Removes the lock file of a killed supervisor.
    pub(crate) fn clear_abandoned(domain: &Domain) -> io::Result<()> {
        lock_file::clear_abandoned(&domain.lock_path("show"))
    }

    /// Returns the process id of the supervisor that holds the lock of a domain; `None` if no show runs.
    pub fn holder(domain: &Domain) -> Option<u32> {
        lock_file::holder(&domain.lock_path("show"))
    }
}

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
        Ok(Self { _held: HeldLock::take_soon(domain.lock_path("guard"), taken)? })
    }

    /// Returns the process id of the guard that holds the lock of a domain; `None` if no guard runs.
    pub fn holder(domain: &Domain) -> Option<u32> {
        lock_file::holder(&domain.lock_path("guard"))
    }

    /// Removes the lock file of a killed guard.
    pub(crate) fn clear_abandoned(domain: &Domain) -> io::Result<()> {
        lock_file::clear_abandoned(&domain.lock_path("guard"))
    }
}
