//! The allowed values of keys.

use std::ops::RangeInclusive;

use bench_dragon_geometry::number::Number;

use super::ConfigError;

/// Allowed rates of a server, in ticks a second.
pub const RATE_HZ: RangeInclusive<u32> = 1..=100_000;
/// Allowed time scales of a server, in show seconds per second of wall time.
pub const TIME_SCALE: RangeInclusive<f64> = 0.001..=1000.0;
/// Allowed processors of a server, as the kernel numbers them: the range of a CPU set.
pub const CPU: RangeInclusive<u32> = 0..=1023;
/// Allowed spin times of a server before each due instant, in microseconds.
pub const SPIN_US: RangeInclusive<u32> = 0..=1000;
/// Allowed values of the longest standstill after which a show jumps, in seconds of wall time.
pub const CATCH_UP_S: RangeInclusive<f64> = 0.0..=10.0;
/// Allowed planned speeds of the head, in metres per show second.
pub const HEAD_SPEED_MPS: RangeInclusive<f64> = 0.001..=10.0;
/// Speed in metres per show second from which on times of arrival are forecast. An ordered speed may be slower, down to 0: then the
/// head counts as one that stands.
pub const FORECAST_SPEED_MPS: f64 = 1e-6;
/// Allowed values of the head's greatest acceleration, in m/s².
pub const HEAD_ACCEL_MPS2: RangeInclusive<f64> = 0.001..=1000.0;
/// Allowed clearances of the monitor's warning, in metres.
pub const NEAR_M: RangeInclusive<f64> = 0.0..=10.0;
/// Allowed margins of the guard, in metres.
pub const MARGIN_M: RangeInclusive<f64> = 0.000_001..=10.0;

/// Diameter of the hinge holes without a configured one: the paper's.
pub const HOLE_DIAMETER_M: f64 = 0.055;

/// Greatest number of commands in `[[show.also]]`: the bus has capacity for these and as many other commands.
pub const MAX_ALSO: usize = 8;

/// Fails for a value out of range.
pub(super) fn require_whole(
    table: &'static str,
    key: &'static str,
    value: u32,
    allowed: &RangeInclusive<u32>,
) -> Result<(), ConfigError> {
    require(table, key, f64::from(value), &(f64::from(*allowed.start())..=f64::from(*allowed.end())))
}

/// The same for a number that is not whole.
pub(super) fn require(
    table: &'static str,
    key: &'static str,
    value: f64,
    allowed: &RangeInclusive<f64>,
) -> Result<(), ConfigError> {
    if allowed.contains(&value) {
        return Ok(());
    }
    let (value, lowest, highest) = (Number(value), allowed.start(), allowed.end());
    Err(ConfigError(format!("[{table}] {key} is {value}, must be from {lowest} to {highest}")))
}
