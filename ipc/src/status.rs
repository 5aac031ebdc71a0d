//! The server's account of itself: the latest value on the `bench-dragon/status` service.

use iceoryx2::prelude::ZeroCopySend;

use crate::frame::ShowState;
use crate::time_histogram::TimeHistogram;

/// How the server keeps its schedule. Published ten times a second and once more at the end.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[type_name("bench_dragon.Status.v3")]
pub struct Status {
    /// Run that this is about.
    pub run_id: u64,
    /// Last tick published.
    pub tick: u64,
    /// Show time of that tick in nanoseconds.
    pub sim_time_ns: i64,
    /// Releases that were missed since the start of the run. The show jumps a few of them; it is behind by those of a longer
    /// standstill.
    pub overruns: u64,
    /// How far the show is behind the clock, in nanoseconds of wall time: what is left of standstills, which the show makes
    /// up for.
    pub behind_ns: u64,
    /// The furthest that the show has been behind since the start of the run, in nanoseconds of wall time.
    pub most_behind_ns: u64,
    /// Lateness of the releases since the start of the run, from when each was due to the start of its tick: median, in
    /// nanoseconds. Percentiles are those of the histogram, so at most 1/32 too much.
    pub lateness_p50_ns: u64,
    /// 99th percentile of the lateness, in nanoseconds.
    pub lateness_p99_ns: u64,
    /// 99.9th percentile of the lateness, in nanoseconds.
    pub lateness_p999_ns: u64,
    /// Greatest lateness, in nanoseconds.
    pub lateness_max_ns: u64,
    /// Duration of the ticks since the start of the run, each until the loop was ready for the next one: median, in
    /// nanoseconds.
    pub tick_p50_ns: u64,
    /// 99th percentile of the duration, in nanoseconds.
    pub tick_p99_ns: u64,
    /// 99.9th percentile of the duration, in nanoseconds.
    pub tick_p999_ns: u64,
    /// Greatest duration, in nanoseconds.
    pub tick_max_ns: u64,
    /// Travel up to which a guarded server may move the head, in metres; [`Status::NONE`] for one that is not guarded.
    pub granted_to_m: f64,
    /// Travel that a refused seek asked a guarded server for, in metres, or [`Status::NONE`]: its guard proves it.
    pub asked_m: f64,
    /// Ticks a second of wall time.
    pub rate_hz: u32,
    /// A [`ShowState`] as its number.
    pub state: u32,
    /// Process id of the server.
    pub pid: u32,
    /// Always 0.
    pub reserved: u32,
    /// Lateness of every release since the start of the run.
    pub lateness: TimeHistogram,
    /// Duration of every tick since the start of the run.
    pub tick_time: TimeHistogram,
}

const _: () = assert!(size_of::<Status>() == 144 + 2 * size_of::<TimeHistogram>() && align_of::<Status>() == 8);

impl Status {
    /// The value of a travel that there is none of: not a number.
    pub const NONE: f64 = f64::NAN;

    /// Travel that a refused seek asked for, where there is one.
    pub fn asked(&self) -> Option<f64> {
        (!self.asked_m.is_nan()).then_some(self.asked_m)
    }

    /// The state of the show, or `None` where a newer server sends a number that this version does not know.
    pub fn show_state(&self) -> Option<ShowState> {
        ShowState::from_wire(self.state)
    }
}
