//! Values of the command line: read, and refused with what is allowed.

use std::fmt::Display;
use std::net::SocketAddr;
use std::ops::RangeInclusive;
use std::str::FromStr;

use bench_dragon_ipc::service::MAX_READERS;
use bench_dragon_ipc::{Instance, Request};

use crate::config::{CATCH_UP_S, CPU, Priority, PriorityError, RATE_HZ, SPIN_US, TIME_SCALE};
use crate::source::replay::RATE;

/// Greatest time that can be stepped to, in seconds: its nanoseconds, and some more, are whole numbers of an `f64`.
pub(super) const MAX_STEPPED_S: f64 = 1_000_000.0;

pub(super) fn instance(name: &str) -> Result<Instance, String> {
    Instance::new(name).map_err(|_| format!("must be 1 to {} of a-z, 0-9 and -", Instance::MAX_LEN))
}

pub(super) fn listen_address(text: &str) -> Result<SocketAddr, String> {
    text.parse().map_err(|_| "must be an address and a port, as in 127.0.0.1:8223 or [::]:8223".to_owned())
}

pub(super) fn site(name: &str) -> Result<String, String> {
    let is_name = !name.is_empty() && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"-._".contains(&byte));
    if is_name { Ok(name.to_owned()) } else { Err("must be a host's name, without a port".to_owned()) }
}

pub(super) fn finite(text: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|value: &f64| value.is_finite());
    value.ok_or_else(|| "must be a finite number".to_owned())
}

/// Seconds that are a whole number of nanoseconds, as that.
pub(super) fn nanoseconds(text: &str) -> Result<i64, String> {
    let told = || format!("must be from -{MAX_STEPPED_S} to {MAX_STEPPED_S}, with at most nine decimals");
    let value: f64 = text.parse().map_err(|_| told())?;
    let whole_ns = (value * 1e9).round();
    // Whole numbers this small have quotients that are rounded as decimals are when they are read.
    let is_whole = value.abs() <= MAX_STEPPED_S && whole_ns / 1e9 == value;
    if is_whole { Ok(whole_ns as i64) } else { Err(told()) }
}

pub(super) fn rate(text: &str) -> Result<u32, String> {
    within(text, &RATE_HZ)
}

pub(super) fn cpu(text: &str) -> Result<u32, String> {
    within(text, &CPU)
}

pub(super) fn priority(text: &str) -> Result<Priority, PriorityError> {
    text.parse()
}

pub(super) fn spin(text: &str) -> Result<u32, String> {
    within(text, &SPIN_US)
}

pub(super) fn time_scale(text: &str) -> Result<f64, String> {
    within(text, &TIME_SCALE)
}

pub(super) fn catch_up(text: &str) -> Result<f64, String> {
    within(text, &CATCH_UP_S)
}

pub(super) fn play_rate(text: &str) -> Result<f64, String> {
    within(text, &RATE)
}

pub(super) fn period(text: &str) -> Result<f64, String> {
    within(text, &(0.01..=3600.0))
}

pub(super) fn duration(text: &str) -> Result<f64, String> {
    within(text, &(0.01..=1_000_000.0))
}

pub(super) fn file_megabytes(text: &str) -> Result<u64, String> {
    within(text, &(1..=1_000_000))
}

pub(super) fn total_megabytes(text: &str) -> Result<u64, String> {
    within(text, &(4..=1_000_000_000))
}

pub(super) fn readers(text: &str) -> Result<usize, String> {
    within(text, &(0..=MAX_READERS))
}

pub(super) fn count(text: &str) -> Result<u64, String> {
    within(text, &(1..=u64::MAX))
}

pub(super) fn speed(text: &str) -> Result<f64, String> {
    within(text, &(0.0..=Request::MAX_SPEED_MPS))
}

pub(super) fn within<Value: FromStr + PartialOrd + Display>(
    text: &str,
    allowed: &RangeInclusive<Value>,
) -> Result<Value, String> {
    let value = text.parse().ok().filter(|value| allowed.contains(value));
    value.ok_or_else(|| format!("must be from {} to {}", allowed.start(), allowed.end()))
}
