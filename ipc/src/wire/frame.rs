//! A frame: the state of the dragon at one tick, in its shared-memory layout.
//!
//! A frame is a [`FrameHeader`] and one [`HandleState`] per handle. A dragon of N benches has N + 1 handles. Handle i is
//! the front hinge of bench i, and handle N the rear hinge of the last bench.

use iceoryx2::prelude::ZeroCopySend;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

use super::wire_enum::wire_enum;

/// Values of a frame that concern the whole dragon: the user header of the `bench-dragon/frames` service.
///
/// 72 bytes, little-endian, no padding. A changed layout has a new type name.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[type_name("bench_dragon.FrameHeader.v1")]
pub struct FrameHeader {
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
    /// Signed arc length that the head has walked since t = 0, in metres.
    pub head_travel_m: f64,
    /// Speed of the head in metres per show second; 0 while the head stands.
    pub head_speed_mps: f64,
    /// Show seconds per wall-clock second.
    pub time_scale: f64,
    /// Number of benches; the frame has one handle state more.
    pub bench_count: u32,
    /// A [`ShowState`] as its number. Read it with [`FrameHeader::show_state`].
    pub state: u32,
}

const _: () = assert!(size_of::<FrameHeader>() == 72 && align_of::<FrameHeader>() == 8);

impl FrameHeader {
    /// The state of the show, or `None` for a number that this version does not support.
    pub fn show_state(&self) -> Option<ShowState> {
        ShowState::from_wire(self.state)
    }

    /// Number of handle states of the frame: one more than benches.
    pub fn handle_count(&self) -> usize {
        self.bench_count as usize + 1
    }

    /// Show time in seconds.
    pub fn show_time_s(&self) -> f64 {
        self.show_time_ns as f64 / 1e9
    }

    /// Time between the due instant and the sending of the frame, in nanoseconds.
    pub fn lateness_ns(&self) -> u64 {
        self.published_ns.saturating_sub(self.scheduled_ns)
    }
}

/// Position and velocity of one handle.
///
/// 48 bytes. x right, y away, z up; z is 0 on a flat stage.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[type_name("bench_dragon.HandleState.v1")]
pub struct HandleState {
    /// Position in metres.
    pub position_m: [f64; 3],
    /// Velocity in metres per show second; 0 while the head stands.
    pub velocity_mps: [f64; 3],
}

const _: () = assert!(size_of::<HandleState>() == 48 && align_of::<HandleState>() == 8);

impl HandleState {
    /// Position seen from above, in metres.
    pub fn plan_view_m(&self) -> [f64; 2] {
        let [x, y, _] = self.position_m;
        [x, y]
    }

    /// Speed in metres per show second.
    pub fn speed_mps(&self) -> f64 {
        let [x, y, z] = self.velocity_mps;
        x.hypot(y).hypot(z)
    }
}

/// Returns the bytes of a frame as in shared memory: 72 of its header, then 48 for each handle.
pub fn frame_bytes(header: &FrameHeader, handles: &[HandleState]) -> Vec<u8> {
    [header.as_bytes(), handles.as_bytes()].concat()
}

wire_enum! {
    /// State of the show.
    #[derive(Eq, Hash)]
    ShowState {
        /// The head walks.
        Running = 0, "running";
        /// Paused by the operator, or by a timecode that stands. `resume` continues.
        Paused = 1, "paused";
        /// Stopped for safety. Only `release` lifts the hold.
        Held = 2, "held";
        /// The show has reached the end of the route, of the run or of the requested time.
        Finished = 3, "finished";
        /// The head still walks and brakes, because of a pause, a hold, a stop or the timecode.
        Stopping = 4, "stopping";
        /// The run has ended in order. This is its last frame.
        Ended = 5, "ended";
        /// The show waits at its start for its first `release`. It is calm: no safety stop.
        Ready = 6, "ready";
    }
}

impl ShowState {
    /// Whether the head may walk. Show time advances only in these states.
    pub fn walks(self) -> bool {
        matches!(self, Self::Running | Self::Stopping)
    }
}
