//! The server's account of itself: the latest value on the `bench-dragon/status` service.

use iceoryx2::prelude::ZeroCopySend;

use crate::frame::ShowState;

/// How the server keeps its schedule. Published ten times a second and once more at the end.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[type_name("bench_dragon.Status.v1")]
pub struct Status {
    /// Run that this is about.
    pub run_id: u64,
    /// Last tick published.
    pub tick: u64,
    /// Show time of that tick in nanoseconds.
    pub sim_time_ns: i64,
    /// Releases that were missed since the start of the run, each a whole period by which the show is late.
    pub overruns: u64,
    /// Lateness of the releases since the start of the run: median, in nanoseconds.
    pub lateness_p50_ns: u64,
    /// 99th percentile of the lateness, in nanoseconds.
    pub lateness_p99_ns: u64,
    /// 99.9th percentile of the lateness, in nanoseconds.
    pub lateness_p999_ns: u64,
    /// Greatest lateness, in nanoseconds.
    pub lateness_max_ns: u64,
    /// Ticks a second of wall time.
    pub rate_hz: u32,
    /// A [`ShowState`] as its number.
    pub state: u32,
    /// Process id of the server.
    pub pid: u32,
    /// Always 0.
    pub reserved: u32,
}

const _: () = assert!(size_of::<Status>() == 80 && align_of::<Status>() == 8);

impl Status {
    /// The state of the show, or `None` where a newer server sends a number that this version does not know.
    pub fn show_state(&self) -> Option<ShowState> {
        ShowState::from_wire(self.state)
    }
}
