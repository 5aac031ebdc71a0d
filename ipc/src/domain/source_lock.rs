//! Lock that admits one source per instance, without a daemon.

use core::time::Duration;
use std::fs;
use std::io::{self, ErrorKind};
use std::path::PathBuf;
use std::thread;
use std::time::Instant;

use super::bus_error::BusError;
use super::domain_error::DomainError;
use super::lock_file::{self, HeldLock, Refused, hold_alone, if_there};
use super::open_files::require_open_files;
use super::place::Domain;
use super::show_lock::ShowLock;
use crate::wire::services::SOURCE_FILES;

/// Timeout of waiting for a source that is ending, for example after a crash of its parent, when both are restarted at
/// once.
const END_TIMEOUT: Duration = Duration::from_secs(1);
const TRY_PERIOD: Duration = Duration::from_millis(5);

/// Lock of the only source of an instance. The source holds it while it runs.
#[derive(Debug)]
pub struct SourceLock {
    _held: HeldLock,
    cleared: Vec<PathBuf>,
}

impl SourceLock {
    /// Takes the lock of a domain, and creates the directory if it is missing. Waits up to one second for a source that
    /// is ending.
    ///
    /// A source that was killed while it created a service leaves a file on which every later source would fail. Only the
    /// holder of this lock creates services, so such a file has no owner, and is removed.
    ///
    /// # Errors
    /// [`BusError::SourceRunning`] where another process holds the lock, [`BusError::TooFewFiles`] where the limit of
    /// open files is too low. [`BusError::Domain`] where the directory or a file in it is not usable.
    pub fn take(domain: &Domain) -> Result<Self, BusError> {
        require_open_files(SOURCE_FILES)?;
        let path = domain.lock_path("source");
        let deadline = Instant::now() + END_TIMEOUT;
        let locked = loop {
            domain.create_directory()?;
            match hold_alone(&path) {
                // The last member to leave has just removed the directory.
                Err(Refused::Io(error)) if error.kind() == ErrorKind::NotFound => {}
                Err(Refused::Taken { .. }) if Instant::now() < deadline => thread::sleep(TRY_PERIOD),
                locked => break locked,
            }
        };
        let taken = |pid| BusError::SourceRunning { instance: domain.instance().to_string(), pid };
        let held = HeldLock::of(path, locked, taken)?;
        if ShowLock::is_abandoned(domain) {
            // A source that is started without a `show` is not that of the killed one.
            ShowLock::clear_abandoned(domain)
                .map_err(|error| DomainError::Io { path: domain.root().to_owned(), error })?;
        }
        let cleared = clear_half_made(domain).map_err(|error| DomainError::Io { path: services(domain), error })?;
        Ok(Self { _held: held, cleared })
    }

    /// Returns the process id of the source that holds the lock of a domain; `None` if no source runs.
    pub fn holder(domain: &Domain) -> Option<u32> {
        lock_file::holder(&domain.lock_path("source"))
    }

    /// Whether a source runs in a domain. The lock of a killed source is free as soon as the kernel has ended the process.
    pub fn is_held(domain: &Domain) -> bool {
        lock_file::is_held(&domain.lock_path("source"))
    }

    /// Removes the lock file of a killed source.
    pub(crate) fn clear_abandoned(domain: &Domain) -> io::Result<()> {
        lock_file::clear_abandoned(&domain.lock_path("source"))
    }

    /// Files of half-made services that were removed when the lock was taken.
    pub fn cleared(&self) -> &[PathBuf] {
        &self.cleared
    }
}

/// Removes the half-made services of a killed source. A member that leaves at the same time may remove some of them
/// first.
fn clear_half_made(domain: &Domain) -> io::Result<Vec<PathBuf>> {
    let mut cleared = Vec::new();
    for path in half_made(domain)? {
        if if_there(fs::remove_file(&path))?.is_some() {
            cleared.push(path);
        }
    }
    Ok(cleared)
}

/// Returns the unfinished service files. iceoryx2 makes finished ones read-only.
pub(crate) fn half_made(domain: &Domain) -> io::Result<Vec<PathBuf>> {
    let Some(entries) = if_there(fs::read_dir(services(domain)))? else { return Ok(Vec::new()) };
    let mut half_made = Vec::new();
    for entry in entries {
        let path = entry?.path();
        // A client may have removed the file just now.
        if if_there(fs::metadata(&path))?.is_some_and(|metadata| !metadata.permissions().readonly()) {
            half_made.push(path);
        }
    }
    Ok(half_made)
}

fn services(domain: &Domain) -> PathBuf {
    domain.root().join("services")
}
