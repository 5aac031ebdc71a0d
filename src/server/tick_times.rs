//! The times of every tick: measured by the loop, counted by a slower thread.
//!
//! The loop hands them over through a bounded lock-free queue and never waits: where the queue is full, what finds no
//! place is counted as dropped.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use crossbeam::queue::ArrayQueue;

use crate::histogram::LatencyHistogram;

/// Ticks that may wait to be counted: over half a second at the highest rate.
const QUEUE_LEN: usize = 1 << 16;

/// The times of one tick, in nanoseconds.
#[derive(Clone, Copy, Debug)]
pub(super) struct TickTimes {
    /// From the release to the start of the tick.
    pub(super) lateness_ns: u64,
    /// From the start of the tick until the loop is ready for the next one.
    pub(super) duration_ns: u64,
}

/// Both ends' share of the queue.
#[derive(Debug)]
struct Shared {
    queue: ArrayQueue<TickTimes>,
    dropped: AtomicU64,
}

/// The loop's end.
#[derive(Clone, Debug)]
pub(super) struct TickTimesSink(Arc<Shared>);

/// The counting thread's end.
#[derive(Debug)]
pub(super) struct TickTimesCounter {
    shared: Arc<Shared>,
    lateness: LatencyHistogram,
    duration: LatencyHistogram,
}

/// Makes both ends.
pub(super) fn tick_times_queue() -> (TickTimesSink, TickTimesCounter) {
    let shared = Arc::new(Shared { queue: ArrayQueue::new(QUEUE_LEN), dropped: AtomicU64::new(0) });
    let counter = TickTimesCounter {
        shared: Arc::clone(&shared),
        lateness: LatencyHistogram::new(),
        duration: LatencyHistogram::new(),
    };
    (TickTimesSink(shared), counter)
}

impl TickTimesSink {
    /// Hands the times of one tick over.
    pub(super) fn record(&self, times: TickTimes) {
        if self.0.queue.push(times).is_err() {
            self.0.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }
}

impl TickTimesCounter {
    /// Counts what has been handed over since the last call.
    pub(super) fn collect(&mut self) {
        while let Some(TickTimes { lateness_ns, duration_ns }) = self.shared.queue.pop() {
            self.lateness.record(lateness_ns);
            self.duration.record(duration_ns);
        }
    }

    /// From the releases to the starts of their ticks, as counted so far.
    pub(super) fn lateness(&self) -> &LatencyHistogram {
        &self.lateness
    }

    /// From the starts of the ticks to their ends, as counted so far.
    pub(super) fn duration(&self) -> &LatencyHistogram {
        &self.duration
    }

    /// Ticks that were not counted because this end was too slow.
    pub(super) fn dropped(&self) -> u64 {
        self.shared.dropped.load(Ordering::Relaxed)
    }
}
