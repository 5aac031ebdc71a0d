//! Space in shared memory: checked before segments are created, and reserved once they exist.
//!
//! The kernel allocates a page of `/dev/shm` at the first write. Where none is left, it kills the writer by SIGBUS. So a
//! process that has joined the bus reserves all pages of its segments: later nobody else can take them away.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use rustix::fs::{FallocateFlags, fallocate};
use rustix::io::Errno;

use super::bus_error::BusError;
use super::lock_file::if_there;
use super::place::Domain;
use super::shortage::SHARED_MEMORY;
use super::sweep::named_as_ours;

/// Unit of the allocated size of a file, in bytes (`stat(2)`).
const BLOCK_BYTES: u64 = 512;

/// Checks that `/dev/shm` has `needed` bytes free, by writing as many into a file. The file has the domain's prefix and
/// is unlinked before the first byte. This also respects a quota or the limit of a control group.
///
/// # Errors
/// [`BusError::SharedMemoryFull`] where there is less space, [`BusError::SharedMemoryUnusable`] where `/dev/shm` cannot
/// be written.
pub fn require_shared_memory(domain: &Domain, needed: u64) -> Result<(), BusError> {
    static BLOCK: [u8; 64 * 1024] = [0; 64 * 1024];
    let failed = |error: io::Error| match error.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => BusError::SharedMemoryFull { needed },
        _ => BusError::SharedMemoryUnusable { error },
    };
    let mut file = unnamed_file(domain).map_err(failed)?;
    let mut left = needed;
    while left > 0 {
        let block = left.min(BLOCK.len() as u64) as usize;
        file.write_all(&BLOCK[..block]).map_err(failed)?;
        left -= block as u64;
    }
    Ok(())
}

/// Allocates all pages of a domain's segments. Pages that already exist keep their contents.
///
/// Segments of other processes are reserved too: a connection belongs to both of its ends. A segment that its creator has
/// not finished is left to its creator.
///
/// # Errors
/// [`BusError::SharedMemoryFull`] where a segment does not fit, [`BusError::SharedMemoryUnusable`] where `/dev/shm` cannot
/// be read or written.
pub(crate) fn reserve_segments(domain: &Domain) -> Result<(), BusError> {
    for entry in named_as_ours(Path::new(SHARED_MEMORY), domain)? {
        let Some(len) = unreserved_len(&entry, domain) else { continue };
        reserve(&entry.path(), len).map_err(|error| match error.kind() {
            ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::OutOfMemory => {
                BusError::SharedMemoryFull { needed: len }
            }
            _ => BusError::SharedMemoryUnusable { error },
        })?;
    }
    Ok(())
}

/// Returns the length of a segment of this user's that is not completely allocated. A segment that has just been removed
/// needs no memory.
fn unreserved_len(entry: &fs::DirEntry, domain: &Domain) -> Option<u64> {
    let metadata = entry.metadata().ok()?;
    let is_reserved = metadata.blocks() * BLOCK_BYTES >= metadata.len();
    (metadata.is_file() && metadata.uid() == domain.uid() && !is_reserved).then_some(metadata.len())
}

fn reserve(segment: &Path, len: u64) -> io::Result<()> {
    let file = match if_there(File::options().read(true).write(true).open(segment)) {
        Ok(Some(file)) => file,
        Ok(None) => return Ok(()),
        // iceoryx2 allows its user to read a segment only once the segment is finished.
        Err(error) if error.kind() == ErrorKind::PermissionDenied => return Ok(()),
        Err(error) => return Err(error),
    };
    loop {
        match fallocate(&file, FallocateFlags::empty(), 0, len) {
            Err(Errno::INTR) => {}
            // On a file system without this call, the check before the creation has to suffice.
            Ok(()) | Err(Errno::OPNOTSUPP) => return Ok(()),
            Err(error) => return Err(error.into()),
        }
    }
}

/// Creates a file in shared memory and unlinks it. A file of the same name, such as another user's, is not touched.
fn unnamed_file(domain: &Domain) -> io::Result<File> {
    /// Threads of one process may check at the same time.
    static NUMBER: AtomicU64 = AtomicU64::new(0);
    loop {
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let path = PathBuf::from(format!("{SHARED_MEMORY}/{}{}-{number}.space", domain.prefix(), std::process::id()));
        match File::create_new(&path) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error),
            Ok(file) => return fs::remove_file(&path).map(|()| file),
        }
    }
}
