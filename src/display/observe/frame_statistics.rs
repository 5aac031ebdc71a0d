//! Statistics of the received frames: count, rate, latency.

use std::sync::Arc;

use bench_dragon_ipc::{Continuity, FrameHeader, ShowState, TimeHistogram};

/// Period over which the rate and the recent latency are measured, in nanoseconds.
const WINDOW_NS: u64 = 1_000_000_000;

/// Statistics of the received frames since the observer began.
#[derive(Clone, Debug, Default)]
pub struct FrameStatistics {
    /// Frames read.
    pub frames: u64,
    /// Frames that were published between the first and the last one read, but not received.
    pub lost: u64,
    /// Restarts of the source.
    pub restarts: u64,
    /// Restarts of the source after a run that had not ended in order.
    pub crashes: u64,
    /// Frames per second of wall time, over the last second.
    pub rate_hz: f64,
    /// Time from the instant at which a frame was due to the instant at which the observer read it, over the last second.
    pub recent_latency: Arc<TimeHistogram>,
    /// The same since the observer began.
    pub latency: Arc<TimeHistogram>,
}

#[derive(Debug, Default)]
pub(super) struct FrameCounter {
    statistics: FrameStatistics,
    /// Latencies of the second in progress.
    recent: TimeHistogram,
    recent_frames: u64,
    /// Whether the last frame ended its run.
    has_ended: bool,
    begun_ns: u64,
}

impl FrameCounter {
    pub(super) fn new(now_ns: u64) -> Self {
        Self { begun_ns: now_ns, ..Self::default() }
    }

    pub(super) fn count(&mut self, header: &FrameHeader, continuity: Continuity, now_ns: u64) {
        self.statistics.frames += 1;
        match continuity {
            Continuity::Lost(frames) => self.statistics.lost += frames,
            Continuity::Restarted => {
                self.statistics.restarts += 1;
                self.statistics.crashes += u64::from(!self.has_ended);
            }
            Continuity::First | Continuity::Next => {}
        }
        self.has_ended = header.show_state() == Some(ShowState::Ended);
        self.recent_frames += 1;
        self.recent.record(now_ns.saturating_sub(header.scheduled_ns));
    }

    /// Returns the statistics. Rate and recent latency are those of the last complete second.
    pub(super) fn statistics(&mut self, now_ns: u64) -> &FrameStatistics {
        let elapsed_ns = now_ns.saturating_sub(self.begun_ns);
        if elapsed_ns >= WINDOW_NS {
            self.statistics.rate_hz = self.recent_frames as f64 * 1e9 / elapsed_ns as f64;
            Arc::make_mut(&mut self.statistics.latency).add(&self.recent);
            self.statistics.recent_latency = Arc::new(std::mem::take(&mut self.recent));
            self.recent_frames = 0;
            self.begun_ns = now_ns;
        }
        &self.statistics
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rate_and_recent_latency_cover_the_last_complete_second() {
        let mut count = FrameCounter::new(0);
        let frame = |tick| FrameHeader { tick, scheduled_ns: tick * 10_000_000, ..FrameHeader::default() };
        for tick in 0..100 {
            count.count(
                &frame(tick),
                if tick == 50 { Continuity::Lost(3) } else { Continuity::Next },
                tick * 10_000_000 + 40,
            );
        }
        assert_eq!(count.statistics(999_999_999).rate_hz, 0.0);
        let statistics = count.statistics(1_000_000_000).clone();
        assert_eq!((statistics.frames, statistics.lost, statistics.rate_hz), (100, 3, 100.0));
        assert_eq!((statistics.latency.count(), statistics.recent_latency.quantile_ns(1.0)), (100, 40));
        let later = count.statistics(2_000_000_000);
        assert_eq!((later.rate_hz, later.recent_latency.count(), later.latency.count()), (0.0, 0, 100));
    }

    #[test]
    fn a_restart_after_a_run_that_ended_in_order_is_not_a_crash() {
        let mut count = FrameCounter::new(0);
        let frame = |state: ShowState| FrameHeader { state: state.to_wire(), ..FrameHeader::default() };
        count.count(&frame(ShowState::Running), Continuity::First, 0);
        count.count(&frame(ShowState::Ended), Continuity::Restarted, 0);
        count.count(&frame(ShowState::Running), Continuity::Restarted, 0);
        assert_eq!((count.statistics(0).restarts, count.statistics(0).crashes), (2, 1));
    }
}
