//! What a source tells of its run: the description, the status, and a sign of life to the service manager.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use bench_dragon_ipc::{
    BusError, Description, Domain, FrameHeader, SourceKind, Status, Stops, TimeHistogram, TimecodeKind, TimecodeState,
};

use super::command_server::CommandLog;
use super::reporter::{Account, Reporter, TimesOfAll};
use super::server::motion::Limits;

/// The slow side of a run, on a thread of its own. What the loop tells it costs a few stores.
#[derive(Debug)]
pub(crate) struct SourceReport {
    reporter: Reporter,
    times: Arc<TickTimes>,
    commands: CommandLog,
}

impl SourceReport {
    /// Starts the thread of a source of this kind and returns once the description and a first status are on the bus.
    ///
    /// # Errors
    /// What kept them from the bus.
    pub(crate) fn start(
        kind: SourceKind,
        domain: Domain,
        description: Description,
        bench_count: usize,
        rate_hz: u32,
    ) -> Result<Self, BusError> {
        let times = Arc::new(TickTimes::default());
        let (commands, events) = CommandLog::new(description.run_id);
        let account = Account { kind, description, bench_count, rate_hz };
        let reporter = Reporter::start(domain, account, Arc::clone(&times), events)?;
        Ok(Self { reporter, times, commands })
    }

    /// The record of the run's commands.
    pub(crate) fn commands(&mut self) -> &mut CommandLog {
        &mut self.commands
    }

    /// Tells that the loop turns.
    pub(crate) fn beat(&self) {
        self.reporter.gauges.beats.fetch_add(1, Ordering::Relaxed);
    }

    /// Tells what the last frame says, and how many releases have been skipped so far.
    pub(crate) fn report_frame(&self, frame: &FrameHeader, overruns: u64) {
        self.beat();
        self.reporter.gauges.tick.store(frame.tick, Ordering::Release);
        self.reporter.gauges.sim_time_ns.store(frame.sim_time_ns, Ordering::Relaxed);
        self.reporter.gauges.state.store(frame.state, Ordering::Relaxed);
        self.reporter.gauges.overruns.store(overruns, Ordering::Relaxed);
    }

    /// Reports how far the show is behind the clock, in nanoseconds of wall time.
    pub(crate) fn report_behind(&self, behind_ns: u64) {
        self.reporter.gauges.behind_ns.store(behind_ns, Ordering::Relaxed);
        self.reporter.gauges.most_behind_ns.fetch_max(behind_ns, Ordering::Relaxed);
    }

    /// Tells how many frames a second come from now on; 0 where that is not known.
    #[cfg(feature = "zenoh")]
    pub(crate) fn report_rate(&self, rate_hz: u32) {
        self.reporter.gauges.rate_hz.store(rate_hz, Ordering::Relaxed);
    }

    /// Reports how far a guarded head may walk, and where a seek has asked for.
    pub(crate) fn report_limits(&self, limits: Limits) {
        let Limits { granted_to_m, asked_m, end_m } = limits;
        let gauges = &*self.reporter.gauges;
        gauges.is_guarded.store(granted_to_m.is_some(), Ordering::Relaxed);
        let travels = [(&gauges.granted_to_m, granted_to_m), (&gauges.asked_m, asked_m), (&gauges.guard_end_m, end_m)];
        for (gauge, travel_m) in travels {
            gauge.store(travel_m.unwrap_or(Status::NONE).to_bits(), Ordering::Relaxed);
        }
    }

    /// Reports what keeps the head from walking.
    pub(crate) fn report_stops(&self, stops: Stops) {
        self.reporter.gauges.stops.store(stops.to_wire(), Ordering::Relaxed);
    }

    /// Reports how the timecode is.
    pub(crate) fn report_timecode(&self, kind: TimecodeKind, state: TimecodeState) {
        self.reporter.gauges.timecode_kind.store(kind.to_wire(), Ordering::Relaxed);
        self.reporter.gauges.timecode.store(state.to_wire(), Ordering::Relaxed);
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

/// The times of all ticks.
#[derive(Debug, Default)]
pub(super) struct TickTimes {
    /// From each release to the start of its tick.
    pub(super) lateness: TimeCounter,
    /// From the start of each tick until the loop was ready for the next one.
    pub(super) duration: TimeCounter,
}

impl TickTimes {
    /// Counts one tick. Only one thread does so: the loop's.
    fn record(&self, lateness_ns: u64, duration_ns: u64) {
        self.lateness.record(lateness_ns);
        self.duration.record(duration_ns);
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
        let times = TickTimes::default();
        let (mut lateness, mut duration) = (TimeHistogram::default(), TimeHistogram::default());
        for time_ns in [0, 5, 31_000, 31_001, 1 << 50] {
            times.record(time_ns, time_ns / 3);
            lateness.record(time_ns);
            duration.record(time_ns / 3);
        }
        assert_eq!((times.lateness.histogram(), times.duration.histogram()), (lateness, duration));
    }
}
