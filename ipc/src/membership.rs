//! Who is in a domain: every process of it holds a shared lock on one file of the domain's directory. The kernel drops
//! the lock with the process, however that ends, so an exclusive lock proves that nobody else is there.
//!
//! The last one to leave takes away what iceoryx2 itself never removes: its counter of nodes in `/dev/shm` and the
//! empty directories.

use std::fs::{self, File};
use std::io::{self, ErrorKind};
use std::path::PathBuf;

use crate::domain::{Domain, DomainError};
use crate::lock_file::lock_at;

/// Where shared memory lives in the file system.
const SHARED_MEMORY: &str = "/dev/shm";

/// One membership; given up when it is dropped.
#[derive(Debug)]
pub(crate) struct Membership {
    domain: Domain,
    file: File,
}

impl Membership {
    /// Joins a domain whose directory is there. Waits only while somebody else clears the domain up.
    pub(crate) fn join(domain: &Domain) -> Result<Self, DomainError> {
        let path = lock_path(domain);
        let failed = |error: io::Error| match error.kind() {
            ErrorKind::NotFound => DomainError::Missing { path: domain.root().to_owned() },
            _ => DomainError::Io { path: path.clone(), error },
        };
        let file = lock_at(&path, |file| file.lock_shared()).map_err(failed)?;
        Ok(Self { domain: domain.clone(), file })
    }
}

impl Drop for Membership {
    fn drop(&mut self) {
        let is_last = self.file.try_lock().is_ok();
        if is_last && has_no_nodes(&self.domain) {
            // Whatever stays is found and used again by the next one to join.
            let _ = clear(&self.domain);
        }
    }
}

fn lock_path(domain: &Domain) -> PathBuf {
    domain.root().join("members.lock")
}

/// Whether iceoryx2 knows no node: a client in another language holds no lock of ours, but a node.
fn has_no_nodes(domain: &Domain) -> bool {
    match fs::read_dir(domain.root().join("nodes")) {
        Ok(mut nodes) => nodes.next().is_none(),
        Err(error) => error.kind() == ErrorKind::NotFound,
    }
}

fn clear(domain: &Domain) -> io::Result<()> {
    let prefix = domain.prefix();
    for entry in fs::read_dir(SHARED_MEMORY)? {
        let entry = entry?;
        if entry.file_name().to_str().is_some_and(|name| name.starts_with(&prefix)) {
            fs::remove_file(entry.path())?;
        }
    }
    for directory in ["nodes", "services"] {
        let _ = fs::remove_dir(domain.root().join(directory));
    }
    fs::remove_file(lock_path(domain))?;
    fs::remove_dir(domain.root())
}
