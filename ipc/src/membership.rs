//! Who is in a domain: every process of it holds a shared lock on one file of the domain's directory. The kernel drops
//! the lock with the process, however that ends, so an exclusive lock proves that nobody else is there.
//!
//! Whoever is alone in a domain, the first to join and the last to leave, takes away what killed processes have left
//! there, and what iceoryx2 itself never removes. A client that holds no lock of ours, such as a stock iceoryx2 one, says by
//! its iceoryx2 node that it is there.

use std::fs::{self, File};
use std::io::{self, ErrorKind};
use std::path::PathBuf;

use iceoryx2::prelude::{CallbackProgression, Node, NodeState};

use crate::domain::Domain;
use crate::domain_error::DomainError;
use crate::guard_lock::GuardLock;
use crate::lock_file::{if_there, lock_at};
use crate::service::Service;
use crate::source_lock::SourceLock;

/// Where shared memory lives in the file system.
pub(crate) const SHARED_MEMORY: &str = "/dev/shm";
/// The directories that iceoryx2 makes in a domain's root path.
const DIRECTORIES: [&str; 2] = ["nodes", "services"];

/// One membership; given up when it is dropped.
#[derive(Debug)]
pub(crate) struct Membership {
    domain: Domain,
    file: File,
}

impl Membership {
    /// Joins a domain whose directory is there. Waits only while somebody else clears the domain up.
    pub(crate) fn join(domain: &Domain) -> Result<Self, DomainError> {
        // Before there is a file: what is missing there would not come by trying again.
        fs::metadata(SHARED_MEMORY).map_err(|error| DomainError::Io { path: SHARED_MEMORY.into(), error })?;
        let path = lock_path(domain);
        let join = |file: &mut File| {
            file.lock_shared()?;
            if is_alone(file, domain) {
                sweep(domain)?;
            }
            file.lock_shared()
        };
        let file = lock_at(&path, join).map_err(|error| match error.kind() {
            ErrorKind::NotFound => DomainError::Missing { path: domain.root().to_owned() },
            _ => DomainError::Io { path, error },
        })?;
        Ok(Self { domain: domain.clone(), file })
    }
}

impl Drop for Membership {
    fn drop(&mut self) {
        if is_alone(&self.file, &self.domain) {
            // Whatever stays is swept away by the next one to join.
            let _ = dissolve(&self.domain);
        }
    }
}

fn lock_path(domain: &Domain) -> PathBuf {
    domain.root().join("members.lock")
}

/// Whether nobody else is in the domain. Tries for the exclusive lock; where that fails, the shared one may be lost.
fn is_alone(file: &File, domain: &Domain) -> bool {
    file.try_lock().is_ok() && !has_live_node(domain)
}

fn has_live_node(domain: &Domain) -> bool {
    let mut found = false;
    let listed = Node::<Service>::list(&domain.iceoryx2_config(), |state| match state {
        NodeState::Alive(_) | NodeState::Inaccessible(_) => {
            found = true;
            CallbackProgression::Stop
        }
        NodeState::Dead(_) | NodeState::Undefined(_) => CallbackProgression::Continue,
    });
    found || listed.is_err()
}

/// Removes everything of iceoryx2's from a domain in which nobody is.
fn sweep(domain: &Domain) -> io::Result<()> {
    let prefix = domain.prefix();
    for folder in [SHARED_MEMORY.as_ref(), domain.root()] {
        for entry in fs::read_dir(folder)? {
            let entry = entry?;
            if entry.file_name().to_str().is_some_and(|name| name.starts_with(&prefix)) {
                if_there(fs::remove_file(entry.path()))?;
            }
        }
    }
    for directory in DIRECTORIES {
        if_there(fs::remove_dir_all(domain.root().join(directory)))?;
    }
    Ok(())
}

/// Removes the whole domain.
fn dissolve(domain: &Domain) -> io::Result<()> {
    sweep(domain)?;
    SourceLock::clear_abandoned(domain)?;
    GuardLock::clear_abandoned(domain)?;
    // One that fails before it has a node leaves before the file is written.
    if_there(fs::remove_file(domain.iceoryx2_toml_path()))?;
    fs::remove_file(lock_path(domain))?;
    fs::remove_dir(domain.root())
}
