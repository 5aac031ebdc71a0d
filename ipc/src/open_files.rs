//! Whether this process may open as many files as it will need: iceoryx2 finds out in the middle of a service.

use std::fs::File;

use crate::error::BusError;

/// Checks that `needed` more files can be open at a time, by opening as many for a moment.
///
/// # Errors
/// [`BusError::TooFewFiles`], or [`BusError::Failed`] where not even `/dev/null` can be opened.
pub fn require_open_files(needed: usize) -> Result<(), BusError> {
    /// The kernel's numbers for a process and a system that have no file left.
    const TOO_MANY: [Option<i32>; 2] = [Some(24), Some(23)];
    let mut files = Vec::with_capacity(needed);
    while files.len() < needed {
        match File::open("/dev/null") {
            Ok(file) => files.push(file),
            Err(error) if TOO_MANY.contains(&error.raw_os_error()) => return Err(BusError::TooFewFiles { needed }),
            Err(error) => return Err(BusError::failed("/dev/null", error)),
        }
    }
    Ok(())
}
