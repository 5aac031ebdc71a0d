//! Status of the server.

use core::mem::MaybeUninit;
use std::time::Duration;

use bench_dragon_ipc::Status;

use crate::result::{Failure, answer, bd_result_t};
use crate::show::{bd_show_t, opened};

/// State and timing of the server. Published ten times a second and once more at the end.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct bd_status_t {
    /// Run of the server.
    pub run_id: u64,
    /// Last tick published.
    pub tick: u64,
    /// Show time of that tick in nanoseconds.
    pub show_time_ns: i64,
    /// Number of periods that were missed since the start of the run. After a few missed periods show time jumps
    /// forward. After a longer standstill the show is behind; see `behind_ns`.
    pub overruns: u64,
    /// Time by which the show is behind the clock, in nanoseconds of wall time: the rest of standstills, for which the
    /// show makes up.
    pub behind_ns: u64,
    /// Greatest value of `behind_ns` since the start of the run.
    pub most_behind_ns: u64,
    /// Median of the lateness of all ticks since the start of the run, in nanoseconds. Lateness is the time from the due
    /// instant to the start of the tick.
    pub lateness_p50_ns: u64,
    /// 99th percentile of the lateness, in nanoseconds.
    pub lateness_p99_ns: u64,
    /// 99.9th percentile of the lateness, in nanoseconds.
    pub lateness_p999_ns: u64,
    /// Greatest lateness, in nanoseconds.
    pub lateness_max_ns: u64,
    /// Travel up to which a guarded server may move the head, in metres; NaN for a server that is not guarded.
    pub granted_to_m: f64,
    /// Travel at which the proven travel ends permanently, in metres; NaN where the guard has not reached it.
    pub guard_end_m: f64,
    /// Ticks per second of wall time.
    pub rate_hz: u32,
    /// A `bd_show_state_t`.
    pub state: u32,
    /// Process id of the server.
    pub pid: u32,
    /// A `bd_source_kind_t`.
    pub source: u32,
    /// A `bd_guard_state_t`.
    pub guard: u32,
    /// A `bd_timecode_state_t`.
    pub timecode: u32,
    /// A `bd_timecode_kind_t`.
    pub timecode_kind: u32,
    /// Reasons for which the head stands or brakes, as bits: a sum of `bd_stop_t`.
    pub stops: u32,
}

impl From<&Status> for bd_status_t {
    fn from(status: &Status) -> Self {
        Self {
            run_id: status.run_id,
            tick: status.tick,
            show_time_ns: status.show_time_ns,
            overruns: status.overruns,
            behind_ns: status.behind_ns,
            most_behind_ns: status.most_behind_ns,
            lateness_p50_ns: status.lateness_p50_ns,
            lateness_p99_ns: status.lateness_p99_ns,
            lateness_p999_ns: status.lateness_p999_ns,
            lateness_max_ns: status.lateness_max_ns,
            granted_to_m: status.granted_to_m,
            guard_end_m: status.guard_end_m,
            rate_hz: status.rate_hz,
            state: status.state,
            pid: status.pid,
            source: status.source,
            guard: status.guard,
            timecode: status.timecode,
            timecode_kind: status.timecode_kind,
            stops: status.stops,
        }
    }
}

/// Returns the latest status in `status`. Waits for the first one at most `timeout_ns` nanoseconds. The last status of a
/// server that has ended or was killed is returned until another server publishes its own.
///
/// `BD_NOTHING` if none arrived in time, `BD_NO_SERVER` if there is no server. On error `status` is unchanged.
#[unsafe(no_mangle)]
pub extern "C" fn bd_show_status(
    show: *const bd_show_t,
    timeout_ns: u64,
    status: Option<&mut MaybeUninit<bd_status_t>>,
) -> bd_result_t {
    answer(|| {
        let status = status.ok_or_else(|| Failure::missing("status"))?;
        let latest = opened(show)?.status(Duration::from_nanos(timeout_ns))?;
        Ok(latest.map(|latest| {
            status.write((&latest).into());
        }))
    })
}
