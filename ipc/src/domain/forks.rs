//! Forked children of a client's process.
//!
//! Nodes, ports and samples are registered in shared memory under the process that made them. A child that dropped its
//! copies would remove those of its parent. So a child leaves all inherited objects alone: [`Process::is_this`] is `false`
//! there.
//!
//! A `flock` lock belongs to the open file, which parent and child share. So the child closes the inherited lock files right
//! after the fork. Otherwise a child that outlives its parent would keep the parent's membership.

#![allow(unsafe_code, reason = "registers a handler of forks, and closes files in it")]

use core::sync::atomic::AtomicI32;
use core::sync::atomic::AtomicU32;
use core::sync::atomic::Ordering::{AcqRel, Acquire, Relaxed, Release};
use std::fs::File;
use std::os::fd::{AsRawFd as _, RawFd};
use std::sync::Once;

/// Number of lock files that a child closes at most; further memberships of one process are not closed.
const SLOTS: usize = 256;
const FREE: RawFd = -1;

/// Number of forks between the first process of this program and this process.
static FORKS: AtomicU32 = AtomicU32::new(0);
static LOCK_FILES: [AtomicI32; SLOTS] = [const { AtomicI32::new(FREE) }; SLOTS];

/// The process that made an object.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Process {
    forks: u32,
}

impl Process {
    /// This process.
    pub(crate) fn this() -> Self {
        static HANDLER: Once = Once::new();
        HANDLER.call_once(|| {
            // SAFETY: the handler makes only calls that POSIX allows between fork and exec. A failure, for lack of memory,
            // leaves children undetected.
            unsafe { libc::pthread_atfork(None, None, Some(after_fork_in_child)) };
        });
        Self { forks: FORKS.load(Relaxed) }
    }

    /// Whether this process made the object, and not a parent of it.
    pub(crate) fn is_this(self) -> bool {
        self.forks == FORKS.load(Relaxed)
    }
}

extern "C" fn after_fork_in_child() {
    FORKS.fetch_add(1, Relaxed);
    for slot in &LOCK_FILES {
        let file = slot.swap(FREE, AcqRel);
        if file != FREE {
            // SAFETY: the file's owner is an inherited object, which the child never uses or drops.
            unsafe { libc::close(file) };
        }
    }
}

/// Entry of a lock file that a forked child closes.
#[derive(Debug)]
pub(crate) struct ClosedInChildren {
    slot: Option<&'static AtomicI32>,
}

impl ClosedInChildren {
    pub(crate) fn new(file: &File) -> Self {
        let file = file.as_raw_fd();
        let slot = LOCK_FILES.iter().find(|slot| slot.compare_exchange(FREE, file, AcqRel, Acquire).is_ok());
        Self { slot }
    }
}

impl Drop for ClosedInChildren {
    fn drop(&mut self) {
        if let Some(slot) = self.slot {
            slot.store(FREE, Release);
        }
    }
}
