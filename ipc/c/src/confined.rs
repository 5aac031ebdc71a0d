//! Ports of iceoryx2 behind a lock, so that any thread may use them.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// A port that never leaves its lock.
///
/// iceoryx2's `ipc::Service` shares a port's state with what the port gives out by an `Rc`, and that alone is why its ports
/// stay on one thread; the state itself is `Send`. So it may go from thread to thread as long as everything with a share in
/// it goes along: whoever locks may copy values out of what the port gives, but keeps what it gives in here.
#[derive(Debug)]
pub(crate) struct Confined<Port>(Mutex<Port>);

// SAFETY: everything that counts references to the port's state lies in `Port`, and only the lock's holder reaches it.
unsafe impl<Port> Send for Confined<Port> {}
// SAFETY: as above.
unsafe impl<Port> Sync for Confined<Port> {}

impl<Port> Confined<Port> {
    pub(crate) fn new(port: Port) -> Self {
        Self(Mutex::new(port))
    }

    /// Waits for whoever uses the port. What a panic has left half done is iceoryx2's to notice.
    pub(crate) fn lock(&self) -> MutexGuard<'_, Port> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
