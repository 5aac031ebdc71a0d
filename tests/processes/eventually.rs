//! Waiting for a state of the system that no event announces.

use std::thread;
use std::time::Duration;

const LOOK_PERIOD: Duration = Duration::from_millis(2);

/// Looks until there is something to return, however long that takes.
pub(crate) fn eventually<T>(mut look: impl FnMut() -> Option<T>) -> T {
    loop {
        if let Some(found) = look() {
            return found;
        }
        thread::sleep(LOOK_PERIOD);
    }
}
