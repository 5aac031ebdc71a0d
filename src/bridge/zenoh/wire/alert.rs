//! Alerts of the monitors.

use bench_dragon_geometry::dragon::MAX_BENCHES;
use bench_dragon_ipc::{Alert, AlertKind};

use super::WireError;
use super::fields::{Fields, concatenated, finite, pair_of, run_id};

/// Encoding of alerts, see [`encode_alert`].
pub const ALERT_ENCODING: &str = "application/octet-stream;bench_dragon.Alert.v1";
/// Bytes of an alert.
pub const ALERT_BYTES: usize = size_of::<Alert>();

/// An alert as bytes, in the order of its fields.
pub fn encode_alert(alert: &Alert) -> [u8; ALERT_BYTES] {
    let [x, y] = alert.point_m;
    let words = [
        alert.run_id,
        alert.tick,
        alert.sim_time_ns as u64,
        alert.forecast_ns as u64,
        alert.clearance_m.to_bits(),
        x.to_bits(),
        y.to_bits(),
        pair_of(alert.kind, alert.bench_a),
        pair_of(alert.bench_b, alert.reserved),
    ];
    concatenated(words)
}

/// Reads an alert.
///
/// # Errors
/// Whatever is not as a monitor publishes it.
pub fn decode_alert(bytes: &[u8]) -> Result<Alert, WireError> {
    let mut fields = Fields::of(bytes, ALERT_BYTES)?;
    let alert = Alert {
        run_id: fields.word(),
        tick: fields.word(),
        sim_time_ns: fields.word() as i64,
        forecast_ns: fields.word() as i64,
        clearance_m: fields.double(),
        point_m: fields.doubles(),
        kind: fields.half(),
        bench_a: fields.half(),
        bench_b: fields.half(),
        reserved: fields.half(),
    };
    run_id(alert.run_id)?;
    finite(&[alert.clearance_m])?;
    finite(&alert.point_m)?;
    AlertKind::from_wire(alert.kind).ok_or(WireError::Unknown(alert.kind))?;
    let (a, b) = (alert.bench_a, alert.bench_b);
    let is_none = a == Alert::NO_BENCH && b == Alert::NO_BENCH;
    if is_none || (a < b && (b as usize) < MAX_BENCHES) { Ok(alert) } else { Err(WireError::Pair(a, b)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_alert_is_about_two_benches_or_none() {
        let alert = Alert {
            run_id: 7,
            tick: 1,
            sim_time_ns: 5,
            forecast_ns: Alert::NO_FORECAST,
            clearance_m: 0.0,
            point_m: [0.0; 2],
            kind: 1,
            bench_a: 0,
            bench_b: 8,
            reserved: 0,
        };
        let none = Alert { bench_a: Alert::NO_BENCH, bench_b: Alert::NO_BENCH, ..alert };
        for sound in [alert, none] {
            assert_eq!(decode_alert(&encode_alert(&sound)), Ok(sound));
        }
        for (bench_a, bench_b) in [(8, 0), (3, 3), (0, Alert::NO_BENCH)] {
            let odd = Alert { bench_a, bench_b, ..alert };
            assert_eq!(decode_alert(&encode_alert(&odd)), Err(WireError::Pair(bench_a, bench_b)));
        }
    }
}
