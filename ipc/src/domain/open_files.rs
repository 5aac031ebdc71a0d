//! Check that this process may open enough files. Without it, iceoryx2 would fail while it opens a service.

use std::fs::File;

use super::bus_error::BusError;
use super::shortage::is_out_of_files;

/// Checks that `needed` more files can be open at a time, by opening that many for a moment.
///
/// # Errors
/// [`BusError::TooFewFiles`] where the limit is too low, [`BusError::Failed`] where `/dev/null` cannot be opened for
/// another reason.
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
