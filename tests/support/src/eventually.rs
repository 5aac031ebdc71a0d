//! Waiting, with a deadline, for a state of the system that no event announces.

use std::thread;
use std::time::{Duration, Instant};

/// How long a test waits for anything. It is there for hangs: far longer than any wait takes on a busy machine.
pub const DEADLINE: Duration = Duration::from_mins(3);
const LOOK_PERIOD: Duration = Duration::from_millis(2);

/// Looks until there is something to return. Past the deadline it panics with `what`, which completes "waited until …".
#[track_caller]
pub fn eventually<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    before_deadline(|| look().ok_or(())).unwrap_or_else(|()| panic!("waited {DEADLINE:?} until {what}"))
}

/// The same; past the deadline it names also the state that it last saw, which `look` returns as its error.
#[track_caller]
pub fn eventually_from<T>(what: &str, look: impl FnMut() -> Result<T, String>) -> T {
    before_deadline(look).unwrap_or_else(|state| panic!("waited {DEADLINE:?} until {what}; last seen: {state}"))
}

/// Looks until there is something to return.
///
/// # Errors
/// The last one of `look`, past the deadline.
pub fn before_deadline<T, State>(look: impl FnMut() -> Result<T, State>) -> Result<T, State> {
    within(DEADLINE, look)
}

/// The same with a time of the caller's. It looks once at least.
///
/// # Errors
/// The last one of `look`, after that time.
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
