//! Reader of frames, which keeps the lent ones.

use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::Arc;
use std::time::Duration;

use bench_dragon_ipc::service::MAX_BORROWED_FRAMES;
use bench_dragon_ipc::{BusError, Frame, FrameSubscriber};

use crate::confined::Confined;
use crate::dragon::bd_dragon_t;
use crate::frame::bd_frame_t;
use crate::result::{Failure, answer, bd_result_t};

/// A subscriber with the samples that it has lent. Every frame that C holds shares it, so it outlives a dragon that is
/// closed before its frames are released.
#[derive(Debug)]
pub struct FrameReader {
    /// Samples share the subscriber's state, so they are behind the same lock.
    port: Confined<Port>,
    /// Slots whose frame was released. The next read removes the sample.
    returned: [AtomicBool; MAX_BORROWED_FRAMES],
    lost: AtomicU64,
}

#[derive(Debug)]
struct Port {
    lent: [Option<Frame>; MAX_BORROWED_FRAMES],
    subscriber: FrameSubscriber,
}

impl FrameReader {
    pub(crate) fn new(subscriber: FrameSubscriber) -> Self {
        Self {
            port: Confined::new(Port { lent: Default::default(), subscriber }),
            returned: Default::default(),
            lost: AtomicU64::new(0),
        }
    }

    /// Marks a frame as released. Never waits, not even for a thread that waits for frames.
    pub(crate) fn take_back(&self, slot: usize) {
        self.returned[slot].store(true, Ordering::Release);
    }

    pub(crate) fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }

    /// Lends the frame that `read` finds. `needed` is the number of samples that `read` holds at a time.
    fn lend(
        self: &Arc<Self>,
        needed: usize,
        read: impl FnOnce(&mut FrameSubscriber) -> Result<Option<Frame>, BusError>,
    ) -> Result<Option<Box<bd_frame_t>>, Failure> {
        let mut port = self.port.lock();
        for (frame, returned) in port.lent.iter_mut().zip(&self.returned) {
            // Only the holder of a lent frame marks its slot, and only once. So a mark never belongs to an earlier frame
            // of the slot.
            if returned.swap(false, Ordering::Acquire) {
                *frame = None;
            }
        }
        let held = port.lent.iter().flatten().count();
        let free = port.lent.iter().position(Option::is_none);
        let Some(slot) = free.filter(|_| held + needed <= MAX_BORROWED_FRAMES) else {
            let limit = MAX_BORROWED_FRAMES + 1 - needed;
            let text = format!("{held} frames are held, must be under {limit} to read: release one");
            return Err(Failure::new(bd_result_t::BD_TOO_MANY_FRAMES, text));
        };
        let read = read(&mut port.subscriber);
        self.lost.store(port.subscriber.lost(), Ordering::Relaxed);
        let Some(frame) = read? else { return Ok(None) };
        let frame = port.lent[slot].insert(frame);
        Ok(Some(Box::new(bd_frame_t::lend(frame, slot, Arc::clone(self)))))
    }
}

/// Returns the oldest unread frame in `frame`. Never waits.
///
/// `BD_NOTHING` if all frames are read, `BD_TOO_MANY_FRAMES` if 4 frames are held. `frame` is NULL unless the result is
/// `BD_OK`.
#[unsafe(no_mangle)]
pub extern "C" fn bd_dragon_next(
    dragon: Option<&bd_dragon_t>,
    frame: Option<&mut MaybeUninit<*mut bd_frame_t>>,
) -> bd_result_t {
    read(dragon, frame, 1, FrameSubscriber::receive)
}

/// Returns the newest unread frame in `frame`. Older frames are dropped unread and do not count as lost. Never waits.
///
/// `BD_NOTHING` if all frames are read, `BD_TOO_MANY_FRAMES` if more than 2 frames are held: the search itself needs one.
/// `frame` is NULL unless the result is `BD_OK`.
#[unsafe(no_mangle)]
pub extern "C" fn bd_dragon_latest(
    dragon: Option<&bd_dragon_t>,
    frame: Option<&mut MaybeUninit<*mut bd_frame_t>>,
) -> bd_result_t {
    read(dragon, frame, 2, FrameSubscriber::latest)
}

/// Returns the oldest unread frame in `frame`. Waits for one at most `timeout_ns` nanoseconds.
///
/// The wait may end early with `BD_NOTHING`: by a signal, by the wake-up of a frame that is already read, and while no
/// server runs. Then do other work and call again. From the first call on, the server wakes this reader at each frame,
/// which costs the server one system call per frame. A reader that only polls costs the server nothing.
///
/// `BD_NOTHING` if no frame arrived, `BD_TOO_MANY_FRAMES` if 4 frames are held. `frame` is NULL unless the result is
/// `BD_OK`.
#[unsafe(no_mangle)]
pub extern "C" fn bd_dragon_wait(
    dragon: Option<&bd_dragon_t>,
    timeout_ns: u64,
    frame: Option<&mut MaybeUninit<*mut bd_frame_t>>,
) -> bd_result_t {
    read(dragon, frame, 1, |subscriber| subscriber.wait(Duration::from_nanos(timeout_ns)))
}

/// Returns the number of frames that this reader has lost, over all runs; 0 for NULL. Lost frames were published between
/// the first and the last frame that the reader has read, but it did not receive them.
#[unsafe(no_mangle)]
pub extern "C" fn bd_dragon_lost(dragon: Option<&bd_dragon_t>) -> u64 {
    dragon.map_or(0, |dragon| dragon.frames().lost())
}

/// Writes the found frame, or NULL.
fn read(
    dragon: Option<&bd_dragon_t>,
    frame: Option<&mut MaybeUninit<*mut bd_frame_t>>,
    needed: usize,
    read: impl FnOnce(&mut FrameSubscriber) -> Result<Option<Frame>, BusError>,
) -> bd_result_t {
    answer(|| {
        let frame = frame.ok_or_else(|| Failure::missing("frame"))?.write(core::ptr::null_mut());
        let dragon = dragon.ok_or_else(|| Failure::missing("dragon"))?;
        let lent = dragon.frames().lend(needed, read)?;
        Ok(lent.map(|lent| *frame = Box::into_raw(lent)))
    })
}
