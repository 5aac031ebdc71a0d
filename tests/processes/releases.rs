//! The releases of a server. A machine that is busy with other things makes it miss some: it then goes on by as many periods.

use bench_dragon_ipc::FrameHeader;
use serde_json::Value;

/// Number of the release at which a frame was due, counted from another frame's.
pub(crate) fn release(first: &FrameHeader, header: &FrameHeader, rate_hz: u64) -> u64 {
    let elapsed_ns = u128::from(header.scheduled_ns - first.scheduled_ns);
    ((elapsed_ns * u128::from(rate_hz) + 500_000_000) / 1_000_000_000) as u64
}

/// Releases that a server missed between two successive frames.
pub(crate) fn missed(before: &FrameHeader, after: &FrameHeader, rate_hz: u64) -> u64 {
    release(before, after, rate_hz) - 1
}

/// Periods by which a running show goes on from one frame to the next, by the rule for missed releases: all of them, or one
/// where more were missed than the default lets it jump. The frame's time scale says how long each is.
pub(crate) fn periods(before: &FrameHeader, after: &FrameHeader, rate_hz: u64) -> u64 {
    match missed(before, after, rate_hz) {
        missed if 4 * missed > rate_hz => 1,
        missed => missed + 1,
    }
}

/// Fails unless a show of so many releases published a frame at each of them, but for those that it missed.
pub(crate) fn assert_released(summary: &Value, releases: u64) {
    let [frames, overruns] = ["frames", "overruns"].map(|name| summary[name].as_u64().expect("a count"));
    assert!(frames <= releases && releases <= frames + overruns, "{releases} releases: {summary}");
}
