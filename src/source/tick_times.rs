//! The times of every tick: counted by the loop itself, read by a slower thread.
//!
//! Fixed rows of counters, so that counting neither allocates nor waits nor drops anything.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use bench_dragon_ipc::TimeHistogram;

/// The times of all ticks.
#[derive(Debug, Default)]
pub(super) struct TickTimes {
    /// From each release to the start of its tick.
    pub(super) lateness: TimeCounter,
    /// From the start of each tick until the loop was ready for the next one.
    pub(super) duration: TimeCounter,
}

/// The loop's end: the only one that counts.
#[derive(Debug)]
pub(super) struct TickTimesRecorder(Arc<TickTimes>);

impl TickTimesRecorder {
    /// The recorder of these times. There is one.
    pub(super) fn new(times: Arc<TickTimes>) -> Self {
        Self(times)
    }

    /// Counts one tick.
    pub(super) fn record(&mut self, lateness_ns: u64, duration_ns: u64) {
        self.0.lateness.record(lateness_ns);
        self.0.duration.record(duration_ns);
    }
}

/// A [`TimeHistogram`] that one thread counts into and others may look at meanwhile.
#[derive(Debug)]
pub(super) struct TimeCounter {
    max_ns: AtomicU64,
    counts: [AtomicU64; TimeHistogram::BUCKETS],
}

impl TimeCounter {
    /// The distribution at present. While the loop counts, a tick may be missing in it.
    pub(super) fn histogram(&self) -> TimeHistogram {
        let mut histogram = TimeHistogram { max_ns: self.max_ns.load(Ordering::Acquire), ..TimeHistogram::default() };
        for (count, counter) in histogram.counts.iter_mut().zip(&self.counts) {
            *count = counter.load(Ordering::Relaxed);
        }
        histogram
    }

    /// Only one thread counts, so loading and storing need not be one step.
    fn record(&self, time_ns: u64) {
        let counter = &self.counts[TimeHistogram::bucket_of(time_ns)];
        counter.store(counter.load(Ordering::Relaxed) + 1, Ordering::Relaxed);
        if time_ns > self.max_ns.load(Ordering::Relaxed) {
            self.max_ns.store(time_ns, Ordering::Release);
        }
    }
}

impl Default for TimeCounter {
    fn default() -> Self {
        Self { max_ns: AtomicU64::new(0), counts: [const { AtomicU64::new(0) }; TimeHistogram::BUCKETS] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_loop_counts_is_what_the_other_thread_sees() {
        let times = Arc::new(TickTimes::default());
        let mut recorder = TickTimesRecorder::new(Arc::clone(&times));
        let (mut lateness, mut duration) = (TimeHistogram::default(), TimeHistogram::default());
        for time_ns in [0, 5, 31_000, 31_001, 1 << 50] {
            recorder.record(time_ns, time_ns / 3);
            lateness.record(time_ns);
            duration.record(time_ns / 3);
        }
        assert_eq!((times.lateness.histogram(), times.duration.histogram()), (lateness, duration));
    }
}
