//! What the monitors have seen.

use core::mem::MaybeUninit;
use std::time::Duration;

use bench_dragon_ipc::{Alert, AlertSubscriber};

use crate::dragon::bd_dragon_t;
use crate::layout::same_layout;
use crate::result::{Failure, answer, bd_result_t};

/// `bench_a` and `bench_b` of an alert that is about no pair.
pub const BD_NO_BENCH: u32 = 0xFFFF_FFFF;

/// One event. 72 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct bd_alert_t {
    /// Run in which it happened.
    pub run_id: u64,
    /// First tick at which it was so.
    pub tick: u64,
    /// Show time of the event in nanoseconds: exact for contact and parted, that of the frame for the others.
    pub sim_time_ns: i64,
    /// Show time of the forecast contact in nanoseconds; `INT64_MIN` where none lies ahead, or none is known yet.
    pub forecast_ns: i64,
    /// Clearance of the two benches in metres, negative where they overlap; 0 for an alert without benches.
    pub clearance_m: f64,
    /// Point midway between the nearest points of the two boards, in metres; 0 for an alert without benches.
    pub point_m: [f64; 2],
    /// A `bd_alert_kind_t`.
    pub kind: u32,
    /// The lower bench index, or `BD_NO_BENCH`.
    pub bench_a: u32,
    /// The higher bench index, or `BD_NO_BENCH`.
    pub bench_b: u32,
    /// Always 0.
    pub reserved: u32,
}

same_layout!(
    bd_alert_t,
    Alert { run_id, tick, sim_time_ns, forecast_ns, clearance_m, point_m, kind, bench_a, bench_b, reserved }
);

/// What happened.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum bd_alert_kind_t {
    /// Two benches came nearer than the configured `near_m`.
    BD_ALERT_NEAR = 0,
    /// Two benches touched.
    BD_ALERT_CONTACT = 1,
    /// Two benches that touched are apart again.
    BD_ALERT_PARTED = 2,
    /// The show is held.
    BD_ALERT_HELD = 3,
    /// The frames do not agree with the published description.
    BD_ALERT_FAULT = 4,
    /// The source of the frames was started again.
    BD_ALERT_RESTARTED = 5,
}

/// The oldest alert that has not been read yet, waiting for it at most `timeout_ns`; `BD_NOTHING` where none came. A signal
/// ends the wait early.
///
/// The first call begins to listen, so what was told before it does not arrive: call it once, with 0, when the dragon is open.
/// Alerts come from monitors; where none runs, there are none.
#[unsafe(no_mangle)]
pub extern "C" fn bd_dragon_alert(
    dragon: Option<&bd_dragon_t>,
    timeout_ns: u64,
    alert: Option<&mut MaybeUninit<bd_alert_t>>,
) -> bd_result_t {
    answer(|| {
        let alert = alert.ok_or_else(|| Failure::missing("alert"))?;
        let dragon = dragon.ok_or_else(|| Failure::missing("dragon"))?;
        let mut port = dragon.alerts.lock();
        let told = dragon.origin.open(&mut port, AlertSubscriber::open)?.wait(Duration::from_nanos(timeout_ns))?;
        Ok(told.map(|told| {
            alert.write((&told).into());
        }))
    })
}

impl From<&Alert> for bd_alert_t {
    fn from(alert: &Alert) -> Self {
        Self {
            run_id: alert.run_id,
            tick: alert.tick,
            sim_time_ns: alert.sim_time_ns,
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
