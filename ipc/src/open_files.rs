//! Whether this process may open as many files as it will need: iceoryx2 finds out in the middle of a service.

use std::fs::File;
use std::io;

use crate::error::BusError;

/// Checks that `needed` more files can be open at a time, by opening as many for a moment.
///
/// # Errors
/// [`BusError::TooFewFiles`], or [`BusError::Failed`] where not even `/dev/null` can be opened.
pub fn require_open_files(needed: usize) -> Result<(), BusError> {
    let mut files = Vec::with_capacity(needed);
    while files.len() < needed {
        match File::open("/dev/null") {
            Ok(file) => files.push(file),
            Err(error) if is_out_of_files(&error) => return Err(BusError::TooFewFiles { needed }),
            Err(error) => return Err(BusError::failed("/dev/null", error)),
        }
    }
    Ok(())
}

/// Whether an error means that this process, or the system, may open no more files.
pub(crate) fn is_out_of_files(error: &io::Error) -> bool {
    /// The kernel's numbers, `EMFILE` and `ENFILE`.
    const TOO_MANY: [Option<i32>; 2] = [Some(24), Some(23)];
    TOO_MANY.contains(&error.raw_os_error())
}
