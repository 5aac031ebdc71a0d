//! Shared memory that a source keeps for operators' tools: with a full `/dev/shm` an operator can still hold the show.
//!
//! A source keeps a file of [`RESERVE_BYTES`] in `/dev/shm`. An operator's tool that finds no room for its own segments
//! removes the file, and takes its room. The source keeps a new one later, if there is room again.

use std::fs::{self, File};
use std::io;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::PathBuf;

use rustix::fs::{FallocateFlags, fallocate};

use super::lock_file::if_there;
use super::place::Domain;
use super::shortage::SHARED_MEMORY;

/// Size of the reserve: that of the segments of three operators' tools.
const RESERVE_BYTES: u64 = 1 << 20;

/// The reserve of a source. Dropping it removes the file.
#[derive(Debug)]
pub struct OperatorReserve {
    path: PathBuf,
}

impl OperatorReserve {
    /// Keeps the reserve of a domain, if there is room for it. The domain's name is random, so no other user occupies it.
    pub fn keep(domain: &Domain) -> Self {
        let reserve = Self { path: path(domain) };
        reserve.refill();
        reserve
    }

    /// Keeps a new reserve if a tool has taken the last one, and there is room again.
    pub fn refill(&self) {
        if self.path.exists() {
            return;
        }
        // Without room there is no reserve: the show itself does not need it.
        if self.create().is_err() {
            let _ = fs::remove_file(&self.path);
        }
    }

    fn create(&self) -> io::Result<()> {
        let file = File::options().write(true).create_new(true).mode(0o600).open(&self.path)?;
        Ok(fallocate(&file, FallocateFlags::empty(), 0, RESERVE_BYTES)?)
    }
}

impl Drop for OperatorReserve {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.path);
    }
}

/// Gives the room of a domain's reserve to the caller. Returns whether there was one.
pub(crate) fn release_operator_reserve(domain: &Domain) -> bool {
    if_there(fs::remove_file(path(domain))).is_ok_and(|removed| removed.is_some())
}

fn path(domain: &Domain) -> PathBuf {
    PathBuf::from(format!("{SHARED_MEMORY}/{}operators.space", domain.prefix()))
}
