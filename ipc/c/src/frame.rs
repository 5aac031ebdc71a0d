//! A frame: the state of all dragons at one tick, in place in shared memory.

use core::mem::MaybeUninit;
use core::ptr::NonNull;

use bench_dragon_ipc::{BenchState, Continuity, DragonMotion, FrameHeader, HandleState, LentFrame, MAX_DRAGONS};

use crate::layout::same_layout;
use crate::result::release;

/// Greatest number of dragons of a show.
pub const BD_MAX_DRAGONS: usize = 32;

/// Values of a frame that concern the whole show, and one entry for each dragon. 1120 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct bd_frame_header_t {
    /// Random number of the run, under 2^53. It changes when the source is restarted.
    pub run_id: u64,
    /// Number of the frame in its run, from 0, without a gap. A jump means that this reader lost frames.
    pub tick: u64,
    /// Show time in nanoseconds.
    pub show_time_ns: i64,
    /// `CLOCK_MONOTONIC` instant at which the tick was due, in nanoseconds.
    pub scheduled_ns: u64,
    /// `CLOCK_MONOTONIC` instant at which the frame was sent, in nanoseconds.
    pub published_ns: u64,
    /// Signed arc length that the head of the leading dragon has walked since t = 0, in metres.
    pub head_travel_m: f64,
    /// Speed of that head in metres per show second; 0 while it stands.
    pub head_speed_mps: f64,
    /// Show seconds per wall-clock second.
    pub time_scale: f64,
    /// Number of benches of all dragons; the frame has one handle more for each dragon.
    pub bench_count: u32,
    /// A `bd_show_state_t`.
    pub state: u32,
    /// Place of the show on its course, in metres: the one number on which the poses of all dragons depend. Of several dragons it
    /// is plan time times the planned speed of the leading dragon. Of one dragon it is the travel of its head.
    pub course_m: f64,
    /// Speed along the course, in metres per show second; 0 while the show stands.
    pub course_mps: f64,
    /// Number of dragons.
    pub dragon_count: u32,
    /// 1 where the course is a plan, 0 where it is the travel of the only head.
    pub is_plan: u32,
    /// The dragons, the leading one first; entries beyond their number are 0.
    pub dragons: [bd_dragon_motion_t; BD_MAX_DRAGONS],
}

/// A dragon of a frame. 32 bytes. Its handles in the frame are `bench_count + 1` from `first_handle` on.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct bd_dragon_motion_t {
    /// Signed arc length that its head has walked since t = 0, in metres.
    pub travel_m: f64,
    /// Speed of its head in metres per show second; 0 while it stands.
    pub speed_mps: f64,
    /// Index of its first handle in the frame.
    pub first_handle: u32,
    /// Number of its benches; it has one handle more.
    pub bench_count: u32,
    /// A `bd_dragon_state_t`.
    pub state: u32,
    /// 0.
    pub reserved: u32,
}

same_layout!(bd_dragon_motion_t, DragonMotion { travel_m, speed_mps, first_handle, bench_count, state, reserved });

same_layout!(
    bd_frame_header_t,
    FrameHeader {
        run_id,
        tick,
        show_time_ns,
        scheduled_ns,
        published_ns,
        head_travel_m,
        head_speed_mps,
        time_scale,
        bench_count,
        state,
        course_m,
        course_mps,
        dragon_count,
        is_plan,
        dragons,
    }
);

const _: () = assert!(BD_MAX_DRAGONS == MAX_DRAGONS);

/// Position and velocity of one handle. 48 bytes. x right, y away, z up; z is 0 on a flat stage.
///
/// A dragon of N benches has N + 1 handles. Handle i is the front hinge of bench i, and handle N the rear hinge of the
/// last bench.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct bd_handle_state_t {
    /// Position x, y, z in metres.
    pub position_m: [f64; 3],
    /// Velocity in metres per show second; 0 while the head stands.
    pub velocity_mps: [f64; 3],
}

same_layout!(bd_handle_state_t, HandleState { position_m, velocity_mps });

/// A frame. Nothing is copied, and nothing in it changes while it is held. Any thread may read and release it.
#[derive(Debug)]
pub struct bd_frame_t {
    lent: LentFrame,
}

impl From<LentFrame> for bd_frame_t {
    fn from(lent: LentFrame) -> Self {
        Self { lent }
    }
}

impl bd_frame_t {
    fn header(&self) -> &bd_frame_header_t {
        // SAFETY: the two types have the same layout, and the frame lends its header for as long as itself.
        unsafe { NonNull::from(self.lent.header()).cast().as_ref() }
    }

    fn handles(&self) -> &[HandleState] {
        self.lent.handles()
    }

    pub(crate) fn bench_count(&self) -> usize {
        self.lent.header().bench_count as usize
    }

    /// A bench by its number, which must be under the number of benches.
    pub(crate) fn bench(&self, number: usize) -> BenchState {
        let (dragon, _) = self.lent.header().place(number);
        let front = number + dragon;
        BenchState::between(&self.handles()[front], &self.handles()[front + 1])
    }

    pub(crate) fn continuity(&self) -> Continuity {
        self.lent.continuity()
    }
}

/// Returns the header of a frame; NULL for NULL. Valid until the frame is released.
#[unsafe(no_mangle)]
pub extern "C" fn bd_frame_header(frame: Option<&bd_frame_t>) -> Option<&bd_frame_header_t> {
    frame.map(bd_frame_t::header)
}

/// Returns the array of a frame's handles, dragon after dragon and head first, and its length in `count`: the
/// number of benches plus that of dragons. `count` may be NULL. For NULL it returns NULL and a length of 0. Valid until
/// the frame is released.
#[unsafe(no_mangle)]
pub extern "C" fn bd_frame_handles(
    frame: Option<&bd_frame_t>,
    count: Option<&mut MaybeUninit<usize>>,
) -> *const bd_handle_state_t {
    let handles = frame.map_or(&[][..], bd_frame_t::handles);
    if let Some(count) = count {
        count.write(handles.len());
    }
    if handles.is_empty() { core::ptr::null() } else { handles.as_ptr().cast() }
}

/// Releases a frame. Its header and handles must not be read any more. NULL has no effect.
#[unsafe(no_mangle)]
pub extern "C" fn bd_frame_release(frame: Option<Box<bd_frame_t>>) {
    release(frame);
}
