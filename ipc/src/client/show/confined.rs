//! iceoryx2 ports behind a lock, so that any thread may use them.

#![allow(unsafe_code, reason = "ports move between threads")]

use std::sync::{Mutex, MutexGuard, PoisonError};

/// A port that never leaves its lock.
///
/// iceoryx2's `ipc::Service` shares a port's state with the objects that the port returns, by an `Rc`. Only this `Rc`
/// binds the port to one thread; the state itself is `Send`. So the state may move between threads if every object that
/// shares it moves along. The holder of the lock may copy values out of the returned objects, but keeps the objects in
/// here.
#[derive(Debug)]
pub(crate) struct Confined<Port>(Mutex<Port>);

// SAFETY: all objects that count references to the port's state are in `Port`, and only the lock's holder accesses it.
unsafe impl<Port> Send for Confined<Port> {}
// SAFETY: as above.
unsafe impl<Port> Sync for Confined<Port> {}

impl<Port> Confined<Port> {
    pub(crate) fn new(port: Port) -> Self {
        Self(Mutex::new(port))
    }

    /// Waits until no other thread uses the port. A poisoned lock is ignored: iceoryx2 itself detects an unfinished
    /// operation.
    pub(crate) fn lock(&self) -> MutexGuard<'_, Port> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
