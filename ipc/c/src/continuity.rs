//! Relation of a frame to the previous one.

use core::mem::MaybeUninit;

use bench_dragon_ipc::Continuity;

use crate::frame::bd_frame_t;
use crate::result::{Failure, answer, bd_result_t};

/// Relation of a frame to the one that the same reader received before it.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum bd_continuity_t {
    /// The first frame that this reader has received.
    BD_FIRST = 0,
    /// The next tick of the same run.
    BD_NEXT = 1,
    /// The same run, but frames between the two did not reach the reader.
    BD_LOST = 2,
    /// Another run: the source was restarted. The number of frames lost from either run is unknown.
    BD_RESTARTED = 3,
}

/// Returns a frame's relation to the previously received one in `continuity`, and the number of frames lost between the
/// two in `lost`. `lost` may be NULL.
///
/// `BD_INVALID_ARGUMENT` if `frame` or `continuity` is NULL.
#[unsafe(no_mangle)]
pub extern "C" fn bd_frame_continuity(
    frame: Option<&bd_frame_t>,
    continuity: Option<&mut MaybeUninit<bd_continuity_t>>,
    lost: Option<&mut MaybeUninit<u64>>,
) -> bd_result_t {
    answer(|| {
        let frame = frame.ok_or_else(|| Failure::missing("frame"))?;
        let continuity = continuity.ok_or_else(|| Failure::missing("continuity"))?;
        let (kind, frames) = match frame.continuity() {
            Continuity::First => (bd_continuity_t::BD_FIRST, 0),
            Continuity::Next => (bd_continuity_t::BD_NEXT, 0),
            Continuity::Lost(frames) => (bd_continuity_t::BD_LOST, frames),
            Continuity::Restarted => (bd_continuity_t::BD_RESTARTED, 0),
        };
        continuity.write(kind);
        if let Some(lost) = lost {
            lost.write(frames);
        }
        Ok(Some(()))
    })
}
