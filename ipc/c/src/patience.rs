//! Looking again and again for what no event announces.

use std::thread;
use std::time::{Duration, Instant};

use crate::result::Failure;

const LOOK_PERIOD: Duration = Duration::from_millis(10);

/// Looks until there is something, at least once, and for at most so long.
pub(crate) fn look<Found>(
    timeout_ns: u64,
    mut look: impl FnMut() -> Result<Option<Found>, Failure>,
) -> Result<Option<Found>, Failure> {
    let began = Instant::now();
    let timeout = Duration::from_nanos(timeout_ns);
    loop {
        let found = look()?;
        let left = timeout.saturating_sub(began.elapsed());
        if found.is_some() || left.is_zero() {
            return Ok(found);
        }
        thread::sleep(left.min(LOOK_PERIOD));
    }
}
