//! Check that shared memory has enough space. Without it, iceoryx2 would be killed by SIGBUS at the first write.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::domain::Domain;
use crate::error::BusError;
use crate::sweep::SHARED_MEMORY;

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
