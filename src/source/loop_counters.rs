//! Counters that a source's loop writes and its reporter reads, without a lock.
//!
//! In each tick the loop queues the events, shows the tick, and counts its times, in this order. The reporter loads the tick first.
//! Then the queue has all events up to that tick, and the histograms have the times of every earlier tick.

use std::fmt::Debug;
use std::sync::atomic::{AtomicU64, Ordering};

use bench_dragon_ipc::TimeHistogram;

/// A number that one thread stores while others load it.
pub(super) trait SharedNumber: Debug + Default {
    fn load(&self, order: Ordering) -> u64;
    fn store(&self, value: u64, order: Ordering);
}

impl SharedNumber for AtomicU64 {
    fn load(&self, order: Ordering) -> u64 {
        self.load(order)
    }

    fn store(&self, value: u64, order: Ordering) {
        self.store(value, order);
    }
}

/// The last tick published.
#[derive(Debug, Default)]
pub(super) struct ShownTick<C = AtomicU64>(C);

impl<C: SharedNumber> ShownTick<C> {
    /// Shows a tick. All that the loop has stored before is visible to a reader that sees the tick.
    pub(super) fn show(&self, tick: u64) {
        self.0.store(tick, Ordering::Release);
    }

    pub(super) fn see(&self) -> u64 {
        self.0.load(Ordering::Acquire)
    }
}

/// A [`TimeHistogram`] that one thread updates while other threads read it.
#[derive(Debug)]
pub(super) struct TimeCounter<C = AtomicU64, const BUCKETS: usize = { TimeHistogram::BUCKETS }> {
    max_ns: C,
    counts: [C; BUCKETS],
}

impl<C: SharedNumber, const BUCKETS: usize> TimeCounter<C, BUCKETS> {
    /// The present distribution. A tick that the loop is counting may be missing. The greatest time is counted.
    pub(super) fn histogram(&self) -> TimeHistogram {
        let mut histogram = TimeHistogram { max_ns: self.max_ns.load(Ordering::Acquire), ..TimeHistogram::default() };
        for (count, counter) in histogram.counts.iter_mut().zip(&self.counts) {
            *count = counter.load(Ordering::Relaxed);
        }
        histogram
    }

    /// Counts a time. Only one thread counts, so the load and the store need not be one atomic operation.
    pub(super) fn record(&self, time_ns: u64) {
        let counter = &self.counts[TimeHistogram::bucket_of(time_ns)];
        counter.store(counter.load(Ordering::Relaxed) + 1, Ordering::Relaxed);
        if time_ns > self.max_ns.load(Ordering::Relaxed) {
            self.max_ns.store(time_ns, Ordering::Release);
        }
    }
}

impl<C: SharedNumber, const BUCKETS: usize> Default for TimeCounter<C, BUCKETS> {
    fn default() -> Self {
        Self { max_ns: C::default(), counts: std::array::from_fn(|_| C::default()) }
    }
}

#[cfg(test)]
mod tests {
    //! loom runs the loop and the reporter in every order that the memory model allows, with at most [`PREEMPTIONS`] forced changes
    //! of thread.

    use loom::sync::Arc;
    use loom::sync::atomic::AtomicU64 as ModelU64;
    use loom::thread;

    use super::*;

    /// Without a bound the orders take hours.
    const PREEMPTIONS: usize = 3;
    /// Times of the model's ticks, each with a bucket of its own.
    const TIMES_NS: [u64; 3] = [1, 0, 2];

    impl SharedNumber for ModelU64 {
        fn load(&self, order: Ordering) -> u64 {
            self.load(order)
        }

        fn store(&self, value: u64, order: Ordering) {
            self.store(value, order);
        }
    }

    /// What the loop and its reporter share.
    #[derive(Default)]
    struct Shared {
        /// Number of queued events. The order of the queue itself does not matter here.
        queued: ModelU64,
        tick: ShownTick<ModelU64>,
        times: TimeCounter<ModelU64, 3>,
    }

    fn in_every_order(events: impl Fn() + Send + Sync + 'static) {
        let mut model = loom::model::Builder::new();
        model.preemption_bound = Some(PREEMPTIONS);
        model.check(events);
    }

    /// Plays ticks from 1, each with one event.
    fn play(shared: &Shared) {
        for (tick, time_ns) in (1..).zip(TIMES_NS) {
            shared.queued.store(tick, Ordering::Relaxed);
            shared.tick.show(tick);
            shared.times.record(time_ns);
        }
    }

    #[test]
    fn a_report_has_the_events_up_to_its_tick_and_the_times_of_every_earlier_tick_in_any_order_of_events() {
        in_every_order(|| {
            let shared = Arc::new(Shared::default());
            let played = thread::spawn({
                let shared = Arc::clone(&shared);
                move || play(&shared)
            });
            let tick = shared.tick.see();
            let events = shared.queued.load(Ordering::Relaxed);
            let counted: u64 = shared.times.histogram().counts.iter().sum();
            assert!(events >= tick, "{events} events at tick {tick}");
            assert!(counted + 1 >= tick, "{counted} times at tick {tick}");
            played.join().expect("the loop ends");
            let all: u64 = shared.times.histogram().counts.iter().sum();
            assert_eq!((shared.tick.see(), all), (3, 3));
        });
    }

    #[test]
    fn the_greatest_time_of_a_histogram_is_counted_in_any_order_of_events() {
        in_every_order(|| {
            let shared = Arc::new(Shared::default());
            let played = thread::spawn({
                let shared = Arc::clone(&shared);
                move || play(&shared)
            });
            let TimeHistogram { max_ns, counts } = shared.times.histogram();
            assert!(max_ns == 0 || counts[max_ns as usize] == 1, "{max_ns} ns is not counted");
            played.join().expect("the loop ends");
        });
    }

    #[test]
    fn another_thread_reads_the_times_that_the_loop_counts() {
        let (counter, mut histogram) = (TimeCounter::<AtomicU64>::default(), TimeHistogram::default());
        for time_ns in [0, 5, 31_000, 31_001, 1 << 50] {
            counter.record(time_ns);
            histogram.record(time_ns);
        }
        assert_eq!(counter.histogram(), histogram);
    }
}
