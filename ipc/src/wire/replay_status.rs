//! Status of a replay: the latest value on the `bench-dragon/replay` service.

use iceoryx2::prelude::ZeroCopySend;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// Position and pace of a replay. A replay publishes it about ten times a second; no other source does.
///
/// A position is wall time since the first frame of the recording. So it is unique, although a show time may occur several times,
/// for example after a seek. [`Request::Seek`](crate::Request::Seek) takes a position.
///
/// 56 bytes, no padding.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[type_name("bench_dragon.Replay.v1")]
pub struct ReplayStatus {
    /// Run of the replay on the bus.
    pub run_id: u64,
    /// Run of the recording that is replayed.
    pub recorded_run_id: u64,
    /// Position of the last published frame in nanoseconds, 0 to `length_ns`.
    pub position_ns: u64,
    /// Wall time from the first frame to the end of the recording, in nanoseconds.
    pub length_ns: u64,
    /// Unix time at which the last published frame was recorded, in nanoseconds.
    pub wall_ns: i64,
    /// Recorded seconds per second.
    pub pace: f64,
    /// 1 while the replay is paused, else 0.
    pub paused: u32,
    /// 1 while the replay stands at the end of the recording, else 0.
    pub at_end: u32,
}

const _: () = assert!(size_of::<ReplayStatus>() == 56 && align_of::<ReplayStatus>() == 8);
