//! Reading of frames.

use core::mem::MaybeUninit;
use std::time::Duration;

use bench_dragon_ipc::{BusError, LentFrame, Show};

use crate::frame::bd_frame_t;
use crate::result::{Failure, answer, bd_result_t};
use crate::show::{bd_show_t, opened};

/// Returns the oldest unread frame in `frame`. Never waits.
///
/// `BD_NOTHING` if all frames are read, `BD_TOO_MANY_FRAMES` if 4 frames are held. `frame` is NULL unless the result is
/// `BD_OK`.
#[unsafe(no_mangle)]
pub extern "C" fn bd_show_next(
    show: *const bd_show_t,
    frame: Option<&mut MaybeUninit<*mut bd_frame_t>>,
) -> bd_result_t {
    read(show, frame, Show::receive)
}

/// Returns the newest unread frame in `frame`. Older frames are dropped unread and do not count as lost. Never waits.
///
/// `BD_NOTHING` if all frames are read, `BD_TOO_MANY_FRAMES` if 4 frames are held. `frame` is NULL unless the result is
/// `BD_OK`.
#[unsafe(no_mangle)]
pub extern "C" fn bd_show_latest(
    show: *const bd_show_t,
    frame: Option<&mut MaybeUninit<*mut bd_frame_t>>,
) -> bd_result_t {
    read(show, frame, Show::latest)
}

/// Returns the oldest unread frame in `frame`. Waits for one at most `timeout_ns` nanoseconds.
///
/// A signal ends the wait early with `BD_NOTHING`. The wait lasts through a restart of the server. One system call of the
/// server wakes all readers that wait; a reader that only polls costs the server nothing. After `BD_NOTHING`,
/// `bd_show_source` returns whether the server has ended, is lost, or hangs.
///
/// `BD_NOTHING` if no frame arrived, `BD_CLOSED` as soon as another thread closes the client, `BD_TOO_MANY_FRAMES` if 4
/// frames are held. `frame` is NULL unless the result is `BD_OK`.
#[unsafe(no_mangle)]
pub extern "C" fn bd_show_wait(
    show: *const bd_show_t,
    timeout_ns: u64,
    frame: Option<&mut MaybeUninit<*mut bd_frame_t>>,
) -> bd_result_t {
    read(show, frame, |show| show.wait(Duration::from_nanos(timeout_ns)))
}

/// Does the same as `bd_show_wait`, but sleeps by the clock until `spin_ns` nanoseconds before the next frame is due, then looks
/// for it in a busy loop, at most until `spin_ns` after that instant. So the frame is read without a wake-up of the kernel; it
/// takes up to twice `spin_ns` in each period of one processor. 100000 is right for most machines. A reader whose processor is too
/// busy is woken as by `bd_show_wait`.
#[unsafe(no_mangle)]
pub extern "C" fn bd_show_wait_until_due(
    show: *const bd_show_t,
    timeout_ns: u64,
    spin_ns: u64,
    frame: Option<&mut MaybeUninit<*mut bd_frame_t>>,
) -> bd_result_t {
    let [timeout, spin] = [timeout_ns, spin_ns].map(Duration::from_nanos);
    read(show, frame, |show| show.wait_until_due(timeout, spin))
}

/// Returns the number of frames that this reader has lost, over all runs; 0 for NULL and for a
/// closed client. Lost frames were published between
/// the first and the last frame that the reader has read, but it did not receive them.
#[unsafe(no_mangle)]
pub extern "C" fn bd_show_lost(show: *const bd_show_t) -> u64 {
    opened(show).map_or(0, |show| show.lost())
}

/// Writes the found frame, or NULL.
fn read(
    show: *const bd_show_t,
    frame: Option<&mut MaybeUninit<*mut bd_frame_t>>,
    read: impl FnOnce(&Show) -> Result<Option<LentFrame>, BusError>,
) -> bd_result_t {
    answer(|| {
        let frame = frame.ok_or_else(|| Failure::missing("frame"))?.write(core::ptr::null_mut());
        let lent = read(&*opened(show)?)?;
        Ok(lent.map(|lent| *frame = Box::into_raw(Box::new(bd_frame_t::from(lent)))))
    })
}
