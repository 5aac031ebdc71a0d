//! Repeats an attempt for values that no event announces.

use std::thread;
use std::time::{Duration, Instant};

use crate::result::Failure;

const LOOK_PERIOD: Duration = Duration::from_millis(10);

/// Calls `look` until it returns a value, at least once, and for at most `timeout_ns` nanoseconds. The failure that no
/// server runs is retried too, and returned at the end.
pub(crate) fn look<Found>(
    timeout_ns: u64,
    mut look: impl FnMut() -> Result<Option<Found>, Failure>,
) -> Result<Option<Found>, Failure> {
    let began = Instant::now();
    let timeout = Duration::from_nanos(timeout_ns);
    loop {
        let outcome = look();
        let left = timeout.saturating_sub(began.elapsed());
        let is_nothing_yet = match &outcome {
            Ok(found) => found.is_none(),
            Err(failure) => failure.is_absence(),
        };
        if !is_nothing_yet || left.is_zero() {
            return outcome;
        }
        thread::sleep(left.min(LOOK_PERIOD));
    }
}
