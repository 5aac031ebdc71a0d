//! The lateness of the releases: measured by the loop, counted by a slower thread.
//!
//! The loop hands each value over through a bounded lock-free queue and never waits: a value that finds the queue full
//! is counted as dropped.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use crossbeam::queue::ArrayQueue;

use crate::histogram::LatencyHistogram;

/// Values that may wait to be counted: over half a second at the highest rate.
const QUEUE_LEN: usize = 1 << 16;

/// Both ends' share of the queue.
#[derive(Debug)]
struct Shared {
    queue: ArrayQueue<u64>,
    dropped: AtomicU64,
}

/// The loop's end.
#[derive(Clone, Debug)]
pub(super) struct LatenessSink(Arc<Shared>);

/// The counting thread's end.
#[derive(Debug)]
pub(super) struct LatenessCounter {
    shared: Arc<Shared>,
    histogram: LatencyHistogram,
}

/// Makes both ends.
pub(super) fn lateness_queue() -> (LatenessSink, LatenessCounter) {
    let shared = Arc::new(Shared { queue: ArrayQueue::new(QUEUE_LEN), dropped: AtomicU64::new(0) });
    (LatenessSink(Arc::clone(&shared)), LatenessCounter { shared, histogram: LatencyHistogram::new() })
}

impl LatenessSink {
    /// Hands one value over, in nanoseconds.
    pub(super) fn record(&self, lateness_ns: u64) {
        if self.0.queue.push(lateness_ns).is_err() {
            self.0.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }
}

impl LatenessCounter {
    /// Counts what has been handed over since the last call.
    pub(super) fn collect(&mut self) -> &LatencyHistogram {
        while let Some(lateness_ns) = self.shared.queue.pop() {
            self.histogram.record(lateness_ns);
        }
        &self.histogram
    }

    /// Values that were not counted because this end was too slow.
    pub(super) fn dropped(&self) -> u64 {
        self.shared.dropped.load(Ordering::Relaxed)
    }
}
