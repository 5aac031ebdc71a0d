//! The periods of a server. On a busy machine it misses some, and its next tick advances by as many periods.

use bench_dragon_ipc::FrameHeader;
use serde_json::Value;

/// Returns the number of a frame's period, counted from that of another frame.
pub(crate) fn period(first: &FrameHeader, header: &FrameHeader, rate_hz: u64) -> u64 {
    let elapsed_ns = u128::from(header.scheduled_ns - first.scheduled_ns);
    ((elapsed_ns * u128::from(rate_hz) + 500_000_000) / 1_000_000_000) as u64
}

/// Returns the number of periods that a server missed between two successive frames.
pub(crate) fn missed(before: &FrameHeader, after: &FrameHeader, rate_hz: u64) -> u64 {
    period(before, after, rate_hz) - 1
}

/// Returns the periods by which a running show advances from one frame to the next: all missed ones too, or one if more were
/// missed than the default limit of a jump. The frame's time scale gives the length of each period.
pub(crate) fn periods(before: &FrameHeader, after: &FrameHeader, rate_hz: u64) -> u64 {
    match missed(before, after, rate_hz) {
        missed if 4 * missed > rate_hz => 1,
        missed => missed + 1,
    }
}

/// Fails unless a show of this many periods published a frame in each period that it did not miss.
pub(crate) fn assert_no_frame_missing(summary: &Value, periods: u64) {
    let [frames, overruns] = ["frames", "overruns"].map(|name| summary[name].as_u64().expect("a count"));
    assert!(frames <= periods && periods <= frames + overruns, "{periods} periods: {summary}");
}
