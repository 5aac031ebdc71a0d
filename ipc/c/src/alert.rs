//! Alerts of the monitors.

use core::mem::MaybeUninit;
use std::time::Duration;

use bench_dragon_ipc::Alert;

use crate::layout::same_layout;
use crate::result::{Failure, answer, bd_result_t};
use crate::show::{bd_show_t, opened};

/// Value of `bench_a` and `bench_b` in an alert without benches, and of `bench_b` in an alert about one bench.
pub const BD_NO_BENCH: u32 = 0xFFFF_FFFF;

const _: () = assert!(BD_NO_BENCH == Alert::NO_BENCH);

/// One alert: an event that a monitor detected. 72 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct bd_alert_t {
    /// Run in which it happened.
    pub run_id: u64,
    /// First tick at which the event held.
    pub tick: u64,
    /// Show time of the event in nanoseconds: exact for pairs that touch or part and boards at borders of the stage, if the head
    /// walked; the frame's show time for the other kinds.
    pub show_time_ns: i64,
    /// Show time of the forecast contact in nanoseconds; `INT64_MIN` where none lies ahead, or none is known yet.
    pub forecast_ns: i64,
    /// Clearance of the two benches in metres, negative where they overlap. For one bench: distance of its board from the border of the
    /// stage, 0 beyond it. 0 for an alert without benches.
    pub clearance_m: f64,
    /// Point midway between the nearest points of the two boards, in metres. For one bench: a point of its board beyond the border of the
    /// stage, or nearest to it, or of the border in the board. 0 for an alert without benches.
    pub point_m: [f64; 2],
    /// A `bd_alert_kind_t`.
    pub kind: u32,
    /// The lower bench index, the only one, or `BD_NO_BENCH`.
    pub bench_a: u32,
    /// The higher bench index, or `BD_NO_BENCH`.
    pub bench_b: u32,
    /// Always 0.
    pub reserved: u32,
}

same_layout!(
    bd_alert_t,
    Alert { run_id, tick, show_time_ns, forecast_ns, clearance_m, point_m, kind, bench_a, bench_b, reserved }
);

/// Returns the oldest unread alert in `alert`. Waits for one at most `timeout_ns` nanoseconds; 0 does not wait. A signal
/// ends the wait early.
///
/// Alerts are received from the first call on, so call it once with a timeout of 0 directly after `bd_show_open`.
/// Monitors send alerts; without a running monitor there are none.
///
/// `BD_NOTHING` if no alert arrived in time. `BD_NO_SERVER` if the first call found no server. On error `alert` is
/// unchanged.
#[unsafe(no_mangle)]
pub extern "C" fn bd_show_alert(
    show: *const bd_show_t,
    timeout_ns: u64,
    alert: Option<&mut MaybeUninit<bd_alert_t>>,
) -> bd_result_t {
    answer(|| {
        let alert = alert.ok_or_else(|| Failure::missing("alert"))?;
        let received = opened(show)?.alert(Duration::from_nanos(timeout_ns))?;
        Ok(received.map(|received| {
            alert.write((&received).into());
        }))
    })
}

impl From<&Alert> for bd_alert_t {
    fn from(alert: &Alert) -> Self {
        Self {
            run_id: alert.run_id,
            tick: alert.tick,
            show_time_ns: alert.show_time_ns,
            forecast_ns: alert.forecast_ns,
            clearance_m: alert.clearance_m,
            point_m: alert.point_m,
            kind: alert.kind,
            bench_a: alert.bench_a,
            bench_b: alert.bench_b,
            reserved: alert.reserved,
        }
    }
}
