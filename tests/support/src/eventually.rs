//! Waits with a deadline for a state that no event announces.

use std::thread;
use std::time::{Duration, Instant};

/// Longest wait of a test. It ends a test that hangs: on a busy machine, each wait is much shorter.
pub const DEADLINE: Duration = Duration::from_mins(3);
const LOOK_PERIOD: Duration = Duration::from_millis(2);

/// Calls `look` until it returns a value. Panics after the deadline. `what` completes the message "waited … until".
#[track_caller]
pub fn eventually<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    before_deadline(|| look().ok_or(())).unwrap_or_else(|()| panic!("waited {DEADLINE:?} until {what}"))
}

/// Calls `look` until it returns a value. Panics after the deadline, with the last state, which `look` returns as its error.
#[track_caller]
pub fn eventually_from<T>(what: &str, look: impl FnMut() -> Result<T, String>) -> T {
    before_deadline(look).unwrap_or_else(|state| panic!("waited {DEADLINE:?} until {what}; last seen: {state}"))
}

/// Calls `look` until it returns a value, at most until the deadline.
///
/// # Errors
/// After the deadline, the last error of `look`.
pub fn before_deadline<T, State>(look: impl FnMut() -> Result<T, State>) -> Result<T, State> {
    within(DEADLINE, look)
}

/// Calls `look` until it returns a value, for at most the duration `longest`. It calls `look` at least once.
///
/// # Errors
/// After this duration, the last error of `look`.
pub fn within<T, State>(longest: Duration, mut look: impl FnMut() -> Result<T, State>) -> Result<T, State> {
    let begun = Instant::now();
    loop {
        match look() {
            Err(state) if begun.elapsed() >= longest => return Err(state),
            Err(_) => thread::sleep(LOOK_PERIOD),
            found => return found,
        }
    }
}
