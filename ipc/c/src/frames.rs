//! Reading frames, and keeping those that are lent.

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

/// A subscriber with the samples that it has lent. Each frame in C's hands has a share in it, so that it outlives a dragon that
/// is closed before its frames are released.
#[derive(Debug)]
pub struct FrameReader {
    /// Samples share the subscriber's state, so they stay beside it.
    port: Confined<Port>,
    /// Slots whose frame has been given back; the next read takes the sample out.
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

    /// Notes that a frame is not read any more. Waits for nobody, not even for a reader that waits.
    pub(crate) fn take_back(&self, slot: usize) {
        self.returned[slot].store(true, Ordering::Release);
    }

    pub(crate) fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }

    /// Lends what `read` finds. `needed` is how many samples it takes while it looks.
    fn lend(
        self: &Arc<Self>,
        needed: usize,
        read: impl FnOnce(&mut FrameSubscriber) -> Result<Option<Frame>, BusError>,
    ) -> Result<Option<Box<bd_frame_t>>, Failure> {
        let mut port = self.port.lock();
        for (frame, returned) in port.lent.iter_mut().zip(&self.returned) {
            // Only its holder marks a lent frame, and only once, so a mark is never one of an earlier frame of this slot.
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

/// The oldest frame that has not been read yet; `BD_NOTHING` where all are read. Never waits.
///
/// A reader may hold 4 frames at a time: `BD_TOO_MANY_FRAMES` where it does.
#[unsafe(no_mangle)]
pub extern "C" fn bd_dragon_next(
    dragon: Option<&bd_dragon_t>,
    frame: Option<&mut MaybeUninit<*mut bd_frame_t>>,
) -> bd_result_t {
    read(dragon, frame, 1, FrameSubscriber::receive)
}

/// The newest frame; those before it are dropped unread, and do not count as lost. `BD_NOTHING` where all are read. Never
/// waits.
///
/// While it looks it holds a frame itself: `BD_TOO_MANY_FRAMES` where more than 2 are held.
#[unsafe(no_mangle)]
pub extern "C" fn bd_dragon_latest(
    dragon: Option<&bd_dragon_t>,
    frame: Option<&mut MaybeUninit<*mut bd_frame_t>>,
) -> bd_result_t {
    read(dragon, frame, 2, FrameSubscriber::latest)
}

/// The oldest frame that has not been read yet, waiting for it at most `timeout_ns`; `BD_NOTHING` where none came.
///
/// The wait may end early: by a signal, by the wake-up of a frame that has been read already, and while no server runs. Where
/// nothing came, look at what else there is to do, and call again. The first call makes the server wake this reader at each
/// frame, which costs the server a system call; a reader that only polls costs it nothing.
#[unsafe(no_mangle)]
pub extern "C" fn bd_dragon_wait(
    dragon: Option<&bd_dragon_t>,
    timeout_ns: u64,
    frame: Option<&mut MaybeUninit<*mut bd_frame_t>>,
) -> bd_result_t {
    read(dragon, frame, 1, |subscriber| subscriber.wait(Duration::from_nanos(timeout_ns)))
}

/// Frames that were published between the first one read and the last, and that this reader never got; 0 for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn bd_dragon_lost(dragon: Option<&bd_dragon_t>) -> u64 {
    dragon.map_or(0, |dragon| dragon.frames().lost())
}

/// Writes the frame that is found, or NULL.
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
