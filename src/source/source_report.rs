//! Report of a source's loop on its run: a few atomic stores a tick, which a separate thread publishes.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU32, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};

use bench_dragon_geometry::number::Fixed;
use bench_dragon_ipc::service;
use bench_dragon_ipc::{
    BusError, Description, Domain, FrameHeader, ShowState, SourceKind, Status, Stops, TimecodeKind, TimecodeState,
};
use crossbeam::channel::{self, Sender};

use super::command_log::CommandLog;
use super::loop_counters::{ShownTick, TimeCounter};
use super::reporter::Reporter;
use super::server::motion::Limits;
use crate::output::histogram::Percentiles;
use crate::system::clock::unix_ns;

/// The loop's access to the [`Reporter`], which runs on a separate thread. Each report costs a few stores.
#[derive(Debug)]
pub(crate) struct SourceReport {
    gauges: Arc<LoopGauges>,
    /// The record of the run's commands.
    pub(crate) commands: CommandLog,
    wake: Sender<()>,
    thread: Option<JoinHandle<()>>,
}

impl SourceReport {
    /// Starts the reporting thread of a source of this kind. Returns when the description and a first status are on the
    /// bus.
    ///
    /// `rate_hz` is the number of frames a second that the source publishes; 0 where it is not known.
    ///
    /// # Errors
    /// As [`Reporter::open`]; [`BusError::Failed`] where the thread cannot be started.
    pub(crate) fn start(
        kind: SourceKind,
        domain: Domain,
        description: Description,
        handle_count: usize,
        rate_hz: u32,
    ) -> Result<Self, BusError> {
        let gauges = Arc::new(LoopGauges::new(rate_hz));
        let (commands, events) = CommandLog::new(description.run_id, unix_ns);
        let shared = Arc::clone(&gauges);
        let (ready, opened) = channel::bounded(1);
        let (wake, woken) = channel::bounded::<()>(1);
        let work = move || match Reporter::open(domain, kind, &description, handle_count, shared, events) {
            Ok(mut reporter) => {
                reporter.publish(0);
                let _ = ready.send(Ok(()));
                reporter.run(&woken);
            }
            Err(error) => drop(ready.send(Err(error))),
        };
        let thread = thread::Builder::new().name("reporter".to_owned()).spawn(work).map_err(|error| {
            BusError::Failed { service: service::STATUS, reason: format!("cannot start the reporting thread: {error}") }
        })?;
        opened.recv().expect("the thread first sends the result of its start")?;
        Ok(Self { gauges, commands, wake, thread: Some(thread) })
    }

    pub(crate) fn beat(&self) {
        self.gauges.beats.fetch_add(1, Ordering::Relaxed);
    }

    /// Reports the values of the last frame, and how many periods have been missed so far.
    pub(crate) fn report_frame(&self, frame: &FrameHeader, overruns: u64) {
        self.beat();
        self.gauges.tick.show(frame.tick);
        self.gauges.show_time_ns.store(frame.show_time_ns, Ordering::Relaxed);
        self.gauges.state.store(frame.state, Ordering::Relaxed);
        self.gauges.overruns.store(overruns, Ordering::Relaxed);
    }

    /// Reports how far the show is behind the clock, in nanoseconds of wall time.
    pub(crate) fn report_behind(&self, behind_ns: u64) {
        self.gauges.behind_ns.store(behind_ns, Ordering::Relaxed);
        self.gauges.most_behind_ns.fetch_max(behind_ns, Ordering::Relaxed);
    }

    /// Reports the number of frames a second from now on; 0 where it is not known.
    pub(crate) fn report_rate(&self, rate_hz: u32) {
        self.gauges.rate_hz.store(rate_hz, Ordering::Relaxed);
    }

    /// Reports the travel up to which a guarded head may walk, the travel of a refused seek, and the end of the proven
    /// travel.
    pub(crate) fn report_limits(&self, limits: Limits) {
        let Limits { granted_to_m, asked_m, end_m } = limits;
        let gauges = &*self.gauges;
        gauges.is_guarded.store(granted_to_m.is_some(), Ordering::Relaxed);
        let travels = [(&gauges.granted_to_m, granted_to_m), (&gauges.asked_m, asked_m), (&gauges.guard_end_m, end_m)];
        for (gauge, travel_m) in travels {
            gauge.store(travel_m.unwrap_or(Status::NONE).to_bits(), Ordering::Relaxed);
        }
    }

    pub(crate) fn report_stops(&self, stops: Stops) {
        self.gauges.stops.store(stops.to_wire(), Ordering::Relaxed);
    }

    pub(crate) fn report_timecode(&self, kind: TimecodeKind, state: TimecodeState) {
        self.gauges.timecode_kind.store(kind.to_wire(), Ordering::Relaxed);
        self.gauges.timecode.store(state.to_wire(), Ordering::Relaxed);
    }

    pub(crate) fn count(&mut self, lateness_ns: u64, duration_ns: u64) {
        self.gauges.lateness.record(lateness_ns);
        self.gauges.duration.record(duration_ns);
    }

    /// Publishes the last status and ends the thread. Returns the times of all ticks.
    pub(crate) fn finish(mut self) -> TimesOfAll {
        self.end();
        let LoopGauges { lateness, duration, .. } = &*self.gauges;
        TimesOfAll { lateness_us: (&lateness.histogram()).into(), tick_us: (&duration.histogram()).into() }
    }

    fn end(&mut self) {
        self.gauges.is_finished.store(true, Ordering::Release);
        let _ = self.wake.try_send(());
        if let Some(thread) = self.thread.take() {
            thread.join().expect("the reporter does not panic");
        }
    }
}

impl Drop for SourceReport {
    fn drop(&mut self) {
        // This also runs where the server fails, so that the thread's ports leave the bus.
        self.end();
    }
}

/// Percentiles of the times of all ticks, in microseconds.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TimesOfAll {
    /// From each due instant to the start of its tick.
    pub(crate) lateness_us: Percentiles,
    /// From the start of each tick until the loop was ready for the next one.
    pub(crate) tick_us: Percentiles,
}

/// Values that the loop shares with the reporter. Each is stored on its own, so a reader may see values of different
/// ticks.
#[derive(Debug, Default)]
pub(super) struct LoopGauges {
    /// Last tick published.
    pub(super) tick: ShownTick,
    /// Show time of that tick in nanoseconds.
    pub(super) show_time_ns: AtomicI64,
    /// State of the show at that tick, as its wire number.
    pub(super) state: AtomicU32,
    /// Frames a second; 0 where it is not known.
    pub(super) rate_hz: AtomicU32,
    /// Periods missed so far.
    pub(super) overruns: AtomicU64,
    /// How far the show is behind the clock, in nanoseconds.
    pub(super) behind_ns: AtomicU64,
    /// Greatest `behind_ns` of the run.
    pub(super) most_behind_ns: AtomicU64,
    /// Number of turns of the loop. The service manager receives a sign of life only while it increases.
    pub(super) beats: AtomicU64,
    /// Travel up to which a guarded head may walk, in metres, as the bits of a double.
    pub(super) granted_to_m: AtomicU64,
    /// Travel that a refused seek of a guarded head requested, in metres, as the bits of a double.
    pub(super) asked_m: AtomicU64,
    /// Travel at which the proven travel ends permanently, in metres, as the bits of a double.
    pub(super) guard_end_m: AtomicU64,
    /// Whether the head walks only on travel that a guard has granted.
    pub(super) is_guarded: AtomicBool,
    /// The [`Stops`] that keep the head from walking, as wire bits.
    pub(super) stops: AtomicU32,
    pub(super) timecode: AtomicU32,
    pub(super) timecode_kind: AtomicU32,
    /// From each due instant to the start of its tick.
    pub(super) lateness: TimeCounter,
    /// From the start of each tick until the loop was ready for the next one.
    pub(super) duration: TimeCounter,
    pub(super) is_finished: AtomicBool,
}

impl LoopGauges {
    fn new(rate_hz: u32) -> Self {
        let none = || AtomicU64::new(Status::NONE.to_bits());
        Self { rate_hz: rate_hz.into(), granted_to_m: none(), asked_m: none(), guard_end_m: none(), ..Self::default() }
    }

    /// State, show time, lag and overruns of the show, in one line.
    pub(super) fn in_words(&self) -> String {
        let state = ShowState::from_wire(self.state.load(Ordering::Relaxed)).map_or("", ShowState::name);
        let show_time_s = self.show_time_ns.load(Ordering::Relaxed) as f64 / 1e9;
        let tick = self.tick.see();
        let [overruns, behind_ns] = [&self.overruns, &self.behind_ns].map(|gauge| gauge.load(Ordering::Relaxed));
        let behind = if behind_ns > 0 { format!(", {:.1} s behind", behind_ns as f64 * 1e-9) } else { String::new() };
        format!("{state} at {} s{behind}, tick {tick}, {overruns} overruns", Fixed::<1>(show_time_s))
    }
}
