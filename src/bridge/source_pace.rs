//! The pace of a source, by its statuses and its frames, and the freshness of its newest frame.

use std::time::Duration;

use bench_dragon_ipc::FrameHeader;

use super::latest_frame::{Freshness, StaleAfter, freshness};

/// The rate and the last distance of the frames of a source, each with its run.
#[derive(Clone, Copy, Debug, Default)]
pub struct SourcePace {
    rate: Option<(u64, u32)>,
    spacing: Option<(u64, Duration)>,
}

impl SourcePace {
    /// Notes the rate in the status of a run.
    pub fn note_rate(&mut self, run_id: u64, rate_hz: u32) {
        self.rate = Some((run_id, rate_hz));
    }

    /// Notes the next frame that was read, after another one.
    pub fn note_frame(&mut self, last: &FrameHeader, next: &FrameHeader) {
        let apart_ns = next.scheduled_ns.saturating_sub(last.scheduled_ns);
        self.spacing = (last.run_id == next.run_id).then(|| (next.run_id, Duration::from_nanos(apart_ns)));
    }

    /// Period of the run of a frame, by its status.
    pub fn period_of(&self, header: &FrameHeader) -> Option<Duration> {
        let described = self.rate.filter(|(run_id, _)| *run_id == header.run_id);
        described.and_then(|(_, rate_hz)| Duration::from_secs(1).checked_div(rate_hz))
    }

    /// Returns whether a frame is fresh at `now_ns`.
    pub fn freshness(&self, header: &FrameHeader, now_ns: u64, stale_after: StaleAfter) -> Freshness {
        let period = self.period_of(header);
        // A status reaches a new reader a little later than the first frames.
        let spacing = self.spacing.filter(|(run_id, _)| *run_id == header.run_id).map(|(_, apart)| apart);
        freshness(header.published_ns, now_ns, stale_after.limit(period.or(spacing)))
    }
}
