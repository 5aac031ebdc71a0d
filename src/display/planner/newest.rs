//! A place for one value: the newest. A value that nobody has taken yet is replaced, never queued.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// The place. Clones are the same place.
#[derive(Debug)]
pub(super) struct Newest<T>(Arc<Shared<T>>);

#[derive(Debug)]
struct Shared<T> {
    state: Mutex<State<T>>,
    changed: Condvar,
}

#[derive(Debug)]
struct State<T> {
    value: Option<T>,
    is_closed: bool,
}

impl<T> Clone for Newest<T> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<T> Newest<T> {
    pub(super) fn new() -> Self {
        let state = State { value: None, is_closed: false };
        Self(Arc::new(Shared { state: Mutex::new(state), changed: Condvar::new() }))
    }

    /// Puts a value here. `join` gets the value that it replaces.
    pub(super) fn put(&self, value: T, join: impl FnOnce(T, T) -> T) {
        let mut state = self.state();
        state.value = Some(match state.value.take() {
            Some(older) => join(older, value),
            None => value,
        });
        self.0.changed.notify_one();
    }

    /// Waits for a value, and takes it; `None` once the place is closed.
    pub(super) fn take(&self) -> Option<T> {
        let waiting = |state: &mut State<T>| state.value.is_none() && !state.is_closed;
        let state = self.0.changed.wait_while(self.state(), waiting);
        let mut state = state.unwrap_or_else(PoisonError::into_inner);
        if state.is_closed { None } else { state.value.take() }
    }

    /// Whether work for an earlier value is of no more use.
    pub(super) fn is_outdated(&self) -> bool {
        let state = self.state();
        state.value.is_some() || state.is_closed
    }

    /// Waits whether a newer value comes within a time, or the place is closed.
    pub(super) fn is_outdated_within(&self, time: Duration) -> bool {
        let waiting = |state: &mut State<T>| state.value.is_none() && !state.is_closed;
        let waited = self.0.changed.wait_timeout_while(self.state(), time, waiting);
        let (state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        state.value.is_some() || state.is_closed
    }

    /// Closes the place: nothing is taken from it any more.
    pub(super) fn close(&self) {
        self.state().is_closed = true;
        self.0.changed.notify_all();
    }

    fn state(&self) -> MutexGuard<'_, State<T>> {
        // A value is replaced as a whole, so it is sound even after a panic.
        self.0.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_newest_value_is_taken_and_a_closed_place_has_none() {
        let place = Newest::new();
        (1..=3).for_each(|value| place.put(value, |_, newer| newer));
        assert!(place.is_outdated());
        assert_eq!(place.take(), Some(3));
        assert!(!place.is_outdated() && !place.is_outdated_within(Duration::ZERO));
        place.put(4, |_, newer| newer);
        assert!(place.is_outdated_within(Duration::MAX));
        place.close();
        assert_eq!(place.take(), None);
    }
}
