//! Whether shared memory has room: iceoryx2 finds out by a SIGBUS at the first write.

use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::path::PathBuf;

use crate::domain::Domain;
use crate::error::BusError;

/// Checks that `/dev/shm` has `needed` bytes free, by writing as many into a file of the domain's prefix that is
/// unlinked before the first byte: what a quota or a control group allows counts too.
///
/// # Errors
/// [`BusError::SharedMemoryFull`], or [`BusError::SharedMemoryUnusable`] where `/dev/shm` cannot be written at all.
pub fn require_shared_memory(domain: &Domain, needed: u64) -> Result<(), BusError> {
    static BLOCK: [u8; 64 * 1024] = [0; 64 * 1024];
    let path = PathBuf::from(format!("/dev/shm/{}{}.space", domain.prefix(), std::process::id()));
    let failed = |error: std::io::Error| match error.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => BusError::SharedMemoryFull { needed },
        _ => BusError::SharedMemoryUnusable { error },
    };
    let mut file = File::create(&path).map_err(failed)?;
    fs::remove_file(&path).map_err(failed)?;
    let mut left = needed;
    while left > 0 {
        let block = left.min(BLOCK.len() as u64) as usize;
        file.write_all(&BLOCK[..block]).map_err(failed)?;
        left -= block as u64;
    }
    Ok(())
}
