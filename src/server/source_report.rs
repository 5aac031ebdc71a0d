//! What a source other than the server tells of itself: the description of its run, and its status.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use bench_dragon_ipc::{BusError, Description, Domain, FrameHeader};

use crate::histogram::Percentiles;
use crate::server::reporter::{LoopGauges, Reporter, TimesOfAll};
use crate::server::tick_times::{TickTimes, TickTimesRecorder};

/// The slow side of a run, on a thread of its own. What the loop tells it costs a few stores.
#[derive(Debug)]
pub(crate) struct SourceReport {
    reporter: Reporter,
    gauges: Arc<LoopGauges>,
    times: TickTimesRecorder,
}

impl SourceReport {
    /// Starts the thread and returns once the description is on the bus.
    ///
    /// # Errors
    /// What kept it from the bus.
    pub(crate) fn start(
        domain: Domain,
        description: Description,
        bench_count: usize,
        rate_hz: u32,
    ) -> Result<Self, BusError> {
        let times = Arc::new(TickTimes::default());
        let (reporter, gauges) = Reporter::start(domain, description, bench_count, rate_hz, Arc::clone(&times))?;
        Ok(Self { reporter, gauges, times: TickTimesRecorder::new(times) })
    }

    /// Takes what the last frame says, and how often one has been late so far.
    pub(crate) fn tell(&mut self, frame: &FrameHeader, overruns: u64) {
        self.gauges.beats.fetch_add(1, Ordering::Relaxed);
        self.gauges.tick.store(frame.tick, Ordering::Relaxed);
        self.gauges.sim_time_ns.store(frame.sim_time_ns, Ordering::Relaxed);
        self.gauges.state.store(frame.state, Ordering::Relaxed);
        self.gauges.overruns.store(overruns, Ordering::Relaxed);
    }

    /// Counts how late a tick began and how long it took.
    pub(crate) fn count(&mut self, lateness_ns: u64, duration_ns: u64) {
        self.times.record(lateness_ns, duration_ns);
    }

    /// Publishes the last status and ends the thread. Returns the lateness and the duration of all ticks, in microseconds.
    pub(crate) fn finish(self) -> (Percentiles, Percentiles) {
        let TimesOfAll { lateness_us, tick_us } = self.reporter.finish();
        (lateness_us, tick_us)
    }
}
