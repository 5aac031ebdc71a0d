//! How a process joins a domain: its role, and what it checks and removes there first.

use std::fs::{self, Permissions};
use std::io;
use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _};

use crate::domain::{
    BusError, Domain, DomainError, Membership, SHARED_MEMORY, if_there, release_operator_reserve, remove_dead_nodes,
    require_shared_memory,
};
use crate::wire::services::{CLIENT_FILES, CLIENT_MEMORY, SOURCE_FILES, SOURCE_MEMORY};

/// Side of the services on which a process is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Creates missing services. The number of handles determines how many frames are buffered.
    Source {
        /// Number of handle states of a frame.
        handle_count: usize,
    },
    /// Opens existing services only.
    Client,
}

impl Role {
    /// Greatest shared memory of its ports without the frames, in bytes.
    pub(super) fn memory(self) -> u64 {
        match self {
            Self::Source { .. } => SOURCE_MEMORY,
            Self::Client => CLIENT_MEMORY,
        }
    }

    /// Greatest number of files that it opens.
    pub(super) fn open_files(self) -> usize {
        match self {
            Self::Source { .. } => SOURCE_FILES,
            Self::Client => CLIENT_FILES,
        }
    }
}

/// Gives mode 0600 to the domain's files in shared memory. iceoryx2 creates one, the state of its unique numbers, that every
/// user may write.
pub(super) fn close_to_others(domain: &Domain) -> io::Result<()> {
    let prefix = domain.prefix();
    for entry in fs::read_dir(SHARED_MEMORY)?.flatten() {
        if entry.file_name().to_string_lossy().starts_with(&prefix) {
            let Some(metadata) = if_there(entry.metadata())? else { continue };
            if metadata.is_file() && metadata.uid() == domain.uid() && metadata.mode() & 0o077 != 0 {
                if_there(fs::set_permissions(entry.path(), Permissions::from_mode(0o600)))?;
            }
        }
    }
    Ok(())
}

/// Checks that there is memory for a member's segments. Removes what killed processes have left, since it may be that very memory.
///
/// An operator's tool leaves the remains of the show's processes, from which every other tool sees that they were killed. If
/// `/dev/shm` is full, it removes them too, and takes the memory that a source keeps for it.
pub(super) fn require_memory(domain: &Domain, needed: u64) -> Result<(), BusError> {
    if !domain.is_operators() {
        remove_dead_nodes(domain, |_| true)?;
        return require_shared_memory(domain, needed);
    }
    remove_dead_nodes(domain, |node| !node.is_part_of_show())?;
    match require_shared_memory(domain, needed) {
        Err(BusError::SharedMemoryFull { .. }) => {
            remove_dead_nodes(domain, |_| true)?;
            release_operator_reserve(domain);
            require_shared_memory(domain, needed)
        }
        outcome => outcome,
    }
}

pub(super) fn enter(domain: &Domain, role: Role) -> Result<Membership, DomainError> {
    match role {
        Role::Source { .. } => domain.create_directory()?,
        Role::Client => {
            domain.check_directory()?;
            require_services(domain)?;
        }
    }
    Membership::join(domain)
}

/// Checks that there are services to open. This is cheaper than joining, and a waiting client calls it often.
fn require_services(domain: &Domain) -> Result<(), DomainError> {
    let path = domain.root().join("services");
    match fs::read_dir(&path).map(|mut services| services.next().is_none()) {
        Ok(false) => Ok(()),
        Ok(true) => Err(DomainError::Missing { path }),
        Err(error) => Err(DomainError::of(path, error)),
    }
}
