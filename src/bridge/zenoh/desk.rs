//! What the clerk and those who ask have in common.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use super::wire::Described;

/// What is answered, and what has been.
#[derive(Debug, Default)]
pub(super) struct Desk {
    description: Mutex<Option<Arc<(Described, String)>>>,
    commands: AtomicU64,
    refused: AtomicU64,
    is_closed: AtomicBool,
}

impl Desk {
    /// What is answered from now on.
    pub(super) fn describe(&self, described: Described, toml: &str) {
        // Held for as long as it takes to store a pointer.
        let mut description = self.description.lock().unwrap_or_else(PoisonError::into_inner);
        *description = Some(Arc::new((described, toml.to_owned())));
    }

    pub(super) fn description(&self) -> Option<Arc<(Described, String)>> {
        self.description.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Commands passed on to the server.
    pub(super) fn commands(&self) -> u64 {
        self.commands.load(Ordering::Relaxed)
    }

    pub(super) fn count_command(&self) {
        self.commands.fetch_add(1, Ordering::Relaxed);
    }

    /// Questions that were not taken.
    pub(super) fn refused(&self) -> u64 {
        self.refused.load(Ordering::Relaxed)
    }

    pub(super) fn count_refused(&self) {
        self.refused.fetch_add(1, Ordering::Relaxed);
    }

    /// Has nothing more passed on.
    pub(super) fn close(&self) {
        self.is_closed.store(true, Ordering::Relaxed);
    }

    /// Whether the bridge is ending.
    pub(super) fn is_closed(&self) -> bool {
        self.is_closed.load(Ordering::Relaxed)
    }
}
