//! Places for those who look.

use std::sync::Arc;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// Streams at a time.
pub const MAX_VIEWERS: usize = 32;

/// The places, some of them taken.
#[derive(Clone, Debug)]
pub(super) struct Seats(Arc<Semaphore>);

/// A place; free again when it is dropped.
#[derive(Debug)]
pub(super) struct Seat(#[expect(dead_code, reason = "held")] OwnedSemaphorePermit);

impl Seats {
    pub(super) fn new() -> Self {
        Self(Arc::new(Semaphore::new(MAX_VIEWERS)))
    }

    /// Takes a place, if one is free.
    pub(super) fn take(&self) -> Option<Seat> {
        Arc::clone(&self.0).try_acquire_owned().ok().map(Seat)
    }

    /// How many are taken.
    pub(super) fn taken(&self) -> usize {
        MAX_VIEWERS - self.0.available_permits()
    }
}
