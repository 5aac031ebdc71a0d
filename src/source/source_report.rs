//! What a source tells of its run: the description, the status, and a sign of life to the service manager.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use bench_dragon_ipc::{BusError, Description, Domain, FrameHeader, Status};

use super::reporter::{Account, LoopGauges, Reporter, TimesOfAll};
use super::tick_times::{TickTimes, TickTimesRecorder};

/// The slow side of a run, on a thread of its own. What the loop tells it costs a few stores.
#[derive(Debug)]
pub(crate) struct SourceReport {
    reporter: Reporter,
    gauges: Arc<LoopGauges>,
    times: TickTimesRecorder,
}

impl SourceReport {
    /// Starts the thread of a source of this name and returns once the description and a first status are on the bus.
    ///
    /// # Errors
    /// What kept them from the bus.
    pub(crate) fn start(
        source: &'static str,
        domain: Domain,
        description: Description,
        bench_count: usize,
        rate_hz: u32,
    ) -> Result<Self, BusError> {
        let times = Arc::new(TickTimes::default());
        let account = Account { source, description, bench_count, rate_hz };
        let (reporter, gauges) = Reporter::start(domain, account, Arc::clone(&times))?;
        Ok(Self { reporter, gauges, times: TickTimesRecorder::new(times) })
    }

    /// Tells that the loop turns.
    pub(crate) fn beat(&self) {
        self.gauges.beats.fetch_add(1, Ordering::Relaxed);
    }

    /// Tells what the last frame says, and how many releases have been skipped so far.
    pub(crate) fn tell(&self, frame: &FrameHeader, overruns: u64) {
        self.beat();
        self.gauges.tick.store(frame.tick, Ordering::Release);
        self.gauges.sim_time_ns.store(frame.sim_time_ns, Ordering::Relaxed);
        self.gauges.state.store(frame.state, Ordering::Relaxed);
        self.gauges.overruns.store(overruns, Ordering::Relaxed);
    }

    /// Reports how far the show is behind the clock, in nanoseconds of wall time.
    pub(crate) fn tell_behind(&self, behind_ns: u64) {
        self.gauges.behind_ns.store(behind_ns, Ordering::Relaxed);
        self.gauges.most_behind_ns.fetch_max(behind_ns, Ordering::Relaxed);
    }

    /// Tells how many frames a second come from now on; 0 where that is not known.
    #[cfg(feature = "zenoh")]
    pub(crate) fn tell_rate(&self, rate_hz: u32) {
        self.gauges.rate_hz.store(rate_hz, Ordering::Relaxed);
    }

    /// Tells how far a guarded head may walk, and where it was asked to be put.
    pub(crate) fn tell_limits(&self, granted_to_m: Option<f64>, asked_m: Option<f64>) {
        self.gauges.granted_to_m.store(granted_to_m.unwrap_or(Status::NONE).to_bits(), Ordering::Relaxed);
        self.gauges.asked_m.store(asked_m.unwrap_or(Status::NONE).to_bits(), Ordering::Relaxed);
    }

    /// Counts how late a tick began and how long it took.
    pub(crate) fn count(&mut self, lateness_ns: u64, duration_ns: u64) {
        self.times.record(lateness_ns, duration_ns);
    }

    /// Publishes the last status and ends the thread. Returns the times of all ticks.
    pub(crate) fn finish(self) -> TimesOfAll {
        self.reporter.finish()
    }
}
