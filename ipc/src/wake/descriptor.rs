//! File descriptor that becomes readable when frames arrive, for `poll`, `epoll` and event loops.

use core::sync::atomic::AtomicBool;
use core::sync::atomic::Ordering::Acquire;
use std::io;
use std::os::fd::{AsRawFd as _, OwnedFd, RawFd};
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use rustix::event::{EventfdFlags, eventfd};

use super::page::WakePage;
use super::word::{Word as _, sleep_from};

/// Longest sleep of the thread; it then looks again.
const LONGEST_SLEEP: Duration = Duration::from_mins(1);

/// The descriptor, and the thread that makes it readable at each raise of the wake word.
#[derive(Debug)]
pub(crate) struct WakeDescriptor {
    event: Arc<OwnedFd>,
    thread: Option<JoinHandle<()>>,
}

impl WakeDescriptor {
    /// Starts the thread. It ends at the first raise after `is_closed` was set.
    pub(crate) fn open(wake: &Arc<WakePage>, is_closed: &Arc<AtomicBool>) -> io::Result<Self> {
        let event = Arc::new(eventfd(0, EventfdFlags::CLOEXEC | EventfdFlags::NONBLOCK)?);
        let (wake, is_closed, raised) = (Arc::clone(wake), Arc::clone(is_closed), Arc::clone(&event));
        let thread = thread::Builder::new().name("bd-descriptor".to_owned()).spawn(move || {
            loop {
                let seen = wake.load();
                // A frame may have arrived before the word was loaded. A counter that is full stays readable.
                let _ = rustix::io::write(&*raised, &1_u64.to_ne_bytes());
                if is_closed.load(Acquire) {
                    return;
                }
                sleep_from(&*wake, seen, LONGEST_SLEEP);
            }
        })?;
        Ok(Self { event, thread: Some(thread) })
    }

    pub(crate) fn raw_fd(&self) -> RawFd {
        self.event.as_raw_fd()
    }

    /// A copy that stays open after this value is dropped.
    pub(crate) fn copy(&self) -> io::Result<OwnedFd> {
        self.event.try_clone()
    }

    /// Makes the descriptor unreadable until the next raise.
    pub(crate) fn empty(&self) {
        let _ = rustix::io::read(&*self.event, &mut [0_u8; 8]);
    }
}

impl Drop for WakeDescriptor {
    fn drop(&mut self) {
        if let Some(thread) = self.thread.take() {
            // It does not panic.
            let _ = thread.join();
        }
    }
}
