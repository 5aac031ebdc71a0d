//! A source's slow side: a thread that publishes the description and the status, so that the loop does not have to.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU32, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use bench_dragon_ipc::service::{self, COMMAND_EVENT_BUFFER, Member, Role};
use bench_dragon_ipc::{
    BusError, CommandEvent, Description, Domain, GuardLock, GuardState, SegmentWatch, ShowState, SourceKind, Status,
};
use crossbeam::channel::{self, Sender};
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::update_connections::UpdateConnections as _;
use rtrb::Consumer;

use super::service_manager::ServiceManager;
use super::source_report::TickTimes;
use crate::output::histogram::Percentiles;

/// How often the status is published and late joiners are given the description.
const REPORT_PERIOD: Duration = Duration::from_millis(100);

/// What the loop tells the reporter, a word at a time: each is the value of the last tick, not all of the same one.
#[derive(Debug)]
pub(super) struct LoopGauges {
    /// Last tick published.
    pub(super) tick: AtomicU64,
    /// Its show time in nanoseconds.
    pub(super) sim_time_ns: AtomicI64,
    /// Its state, as on the wire.
    pub(super) state: AtomicU32,
    /// Frames a second; 0 where that is not known.
    pub(super) rate_hz: AtomicU32,
    /// Releases skipped so far.
    pub(super) overruns: AtomicU64,
    /// How far the show is behind the clock, in nanoseconds.
    pub(super) behind_ns: AtomicU64,
    /// The furthest that it has been.
    pub(super) most_behind_ns: AtomicU64,
    /// Counted up by the loop with every turn, so that it is seen to live.
    pub(super) beats: AtomicU64,
    /// Travel that a guarded head may walk to, the bits of a double.
    pub(super) granted_to_m: AtomicU64,
    /// Travel that a refused seek of a guarded head asked for, the bits of a double.
    pub(super) asked_m: AtomicU64,
    /// Travel at which the proven travel ends for good, the bits of a double.
    pub(super) guard_end_m: AtomicU64,
    /// Whether the head waits for a guard's grants.
    pub(super) is_guarded: AtomicBool,
    /// What keeps the head from walking, as on the wire.
    pub(super) stops: AtomicU32,
    /// How the timecode is, as on the wire.
    pub(super) timecode: AtomicU32,
    /// The protocol of the timecode, as on the wire.
    pub(super) timecode_kind: AtomicU32,
    finished: AtomicBool,
}

impl LoopGauges {
    fn new(rate_hz: u32) -> Self {
        let none = || AtomicU64::new(Status::NONE.to_bits());
        Self {
            tick: AtomicU64::default(),
            sim_time_ns: AtomicI64::default(),
            state: AtomicU32::default(),
            rate_hz: rate_hz.into(),
            overruns: AtomicU64::default(),
            behind_ns: AtomicU64::default(),
            most_behind_ns: AtomicU64::default(),
            granted_to_m: none(),
            asked_m: none(),
            guard_end_m: none(),
            is_guarded: AtomicBool::default(),
            stops: AtomicU32::default(),
            timecode: AtomicU32::default(),
            timecode_kind: AtomicU32::default(),
            beats: AtomicU64::default(),
            finished: AtomicBool::default(),
        }
    }

    /// How the show stands, in one line.
    fn in_words(&self) -> String {
        let state = ShowState::from_wire(self.state.load(Ordering::Relaxed)).map_or("", ShowState::name);
        let sim_time_s = self.sim_time_ns.load(Ordering::Relaxed) as f64 * 1e-9;
        let [tick, overruns, behind_ns] =
            [&self.tick, &self.overruns, &self.behind_ns].map(|gauge| gauge.load(Ordering::Relaxed));
        let behind = if behind_ns > 0 { format!(", {:.1} s behind", behind_ns as f64 * 1e-9) } else { String::new() };
        format!("{state} at {sim_time_s:.1} s{behind}, tick {tick}, {overruns} overruns")
    }
}

/// The times of all ticks, in microseconds.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TimesOfAll {
    /// From the releases to the starts of their ticks.
    pub(crate) lateness_us: Percentiles,
    /// From the starts of the ticks to their ends.
    pub(crate) tick_us: Percentiles,
}

/// What there is to report on.
#[derive(Debug)]
pub(super) struct Account {
    pub(super) kind: SourceKind,
    pub(super) description: Description,
    pub(super) bench_count: usize,
    /// Frames a second; 0 where that is not known.
    pub(super) rate_hz: u32,
}

/// The running thread.
#[derive(Debug)]
pub(super) struct Reporter {
    pub(super) gauges: Arc<LoopGauges>,
    wake: Sender<()>,
    thread: Option<JoinHandle<TimesOfAll>>,
}

impl Reporter {
    /// Starts the thread and returns once the description is on the bus, and a status, which tells the rate of what comes.
    ///
    /// # Errors
    /// As [`Member::join`] and [`Member::description`]; [`BusError::Failed`] where no thread can be started.
    pub(super) fn start(
        domain: Domain,
        account: Account,
        times: Arc<TickTimes>,
        commands: Consumer<CommandEvent>,
    ) -> Result<Self, BusError> {
        let gauges = Arc::new(LoopGauges::new(account.rate_hz));
        let shared = Arc::clone(&gauges);
        let (ready, opened) = channel::bounded(1);
        let (wake, woken) = channel::bounded::<()>(1);
        let work = move || {
            let mut report = match Report::open(domain.clone(), &account, times, commands) {
                Ok(report) => report,
                Err(error) => {
                    let _ = ready.send(Err(error));
                    return TimesOfAll::default();
                }
            };
            report.publish(&shared, 0);
            let _ = ready.send(Ok(()));
            let mut service_manager = ServiceManager::of_environment();
            let mut segments = SegmentWatch::new(&domain);
            while !shared.finished.load(Ordering::Acquire) {
                let _ = woken.recv_timeout(REPORT_PERIOD);
                report.publish(&shared, COMMAND_EVENT_BUFFER / 2);
                segments.look();
                service_manager.look(shared.beats.load(Ordering::Relaxed), || shared.in_words());
            }
            report.publish(&shared, usize::MAX);
            report.times_of_all()
        };
        let thread =
            thread::Builder::new().name("reporter".to_owned()).spawn(work).map_err(|error| BusError::Failed {
                service: service::STATUS,
                reason: format!("cannot start the thread that reports: {error}"),
            })?;
        opened.recv().expect("the thread answers before it does anything else")?;
        Ok(Self { gauges, wake, thread: Some(thread) })
    }

    /// Publishes the last status and ends the thread. Returns the times of all ticks.
    pub(super) fn finish(mut self) -> TimesOfAll {
        self.join()
    }

    fn join(&mut self) -> TimesOfAll {
        self.gauges.finished.store(true, Ordering::Release);
        let _ = self.wake.try_send(());
        let thread = self.thread.take().map(JoinHandle::join);
        thread.map_or_else(TimesOfAll::default, |ended| ended.expect("the reporter does not panic"))
    }
}

impl Drop for Reporter {
    fn drop(&mut self) {
        // Also where the server fails, so that the thread's ports are taken off the bus.
        self.join();
    }
}

/// What the thread works with.
struct Report {
    description: Publisher<service::Service, [u8], u64>,
    status: Publisher<service::Service, Status, ()>,
    events: Publisher<service::Service, CommandEvent, ()>,
    _member: Member,
    domain: Domain,
    kind: SourceKind,
    run_id: u64,
    times: Arc<TickTimes>,
    commands: Consumer<CommandEvent>,
}

impl Report {
    fn times_of_all(&self) -> TimesOfAll {
        let TickTimes { lateness, duration } = &*self.times;
        TimesOfAll { lateness_us: (&lateness.histogram()).into(), tick_us: (&duration.histogram()).into() }
    }

    fn open(
        domain: Domain,
        account: &Account,
        times: Arc<TickTimes>,
        commands: Consumer<CommandEvent>,
    ) -> Result<Self, BusError> {
        let Account { kind, description, bench_count, .. } = account;
        let (kind, bench_count) = (*kind, *bench_count);
        let member = Member::join(&domain, &format!("{}-report", node_name(kind)), Role::Source { bench_count })?;
        let events = member.command_events()?.publisher_builder().create();
        Ok(Self {
            events: events.map_err(|error| failed(service::COMMAND_EVENTS, &error))?,
            description: publish_description(&member, description)?,
            status: member.status()?.publisher_builder().create().map_err(|error| failed(service::STATUS, &error))?,
            _member: member,
            domain,
            kind,
            run_id: description.run_id,
            times,
            commands,
        })
    }

    /// Whether a guard watches over the head.
    fn guard_state(&self, gauges: &LoopGauges) -> GuardState {
        match (gauges.is_guarded.load(Ordering::Relaxed), GuardLock::holder(&self.domain)) {
            (false, _) => GuardState::None,
            (true, None) => GuardState::Missing,
            (true, Some(_pid)) => GuardState::Running,
        }
    }

    /// Publishes the events that wait, so many at most, and gives late joiners the last ones.
    fn publish_commands(&mut self, most: usize) {
        for _ in 0..most {
            let Ok(event) = self.commands.pop() else { break };
            if let Err(error) = self.events.send_copy(event) {
                tracing::warn!("the event of a command is not published: {error}");
            }
        }
        if let Err(error) = self.events.update_connections() {
            tracing::warn!("a reader of the commands is not served: {error:?}");
        }
    }

    /// Publishes the status, and before it the events that wait, so many at most. Unless more wait, a reader of both that has
    /// a status has the events of all ticks up to the status's.
    fn publish(&mut self, gauges: &LoopGauges, most_commands: usize) {
        // The tick first, so that the histograms have counted every tick before it, and its events wait.
        let tick = gauges.tick.load(Ordering::Acquire);
        self.publish_commands(most_commands);
        let (lateness, tick_time) = (self.times.lateness.histogram(), self.times.duration.histogram());
        let status = Status {
            run_id: self.run_id,
            tick,
            sim_time_ns: gauges.sim_time_ns.load(Ordering::Relaxed),
            overruns: gauges.overruns.load(Ordering::Relaxed),
            behind_ns: gauges.behind_ns.load(Ordering::Relaxed),
            most_behind_ns: gauges.most_behind_ns.load(Ordering::Relaxed),
            lateness_p50_ns: lateness.quantile_ns(0.5),
            lateness_p99_ns: lateness.quantile_ns(0.99),
            lateness_p999_ns: lateness.quantile_ns(0.999),
            lateness_max_ns: lateness.max_ns,
            tick_p50_ns: tick_time.quantile_ns(0.5),
            tick_p99_ns: tick_time.quantile_ns(0.99),
            tick_p999_ns: tick_time.quantile_ns(0.999),
            tick_max_ns: tick_time.max_ns,
            granted_to_m: f64::from_bits(gauges.granted_to_m.load(Ordering::Relaxed)),
            asked_m: f64::from_bits(gauges.asked_m.load(Ordering::Relaxed)),
            guard_end_m: f64::from_bits(gauges.guard_end_m.load(Ordering::Relaxed)),
            rate_hz: gauges.rate_hz.load(Ordering::Relaxed),
            state: gauges.state.load(Ordering::Relaxed),
            pid: std::process::id(),
            source: self.kind.to_wire(),
            guard: self.guard_state(gauges).to_wire(),
            timecode: gauges.timecode.load(Ordering::Relaxed),
            timecode_kind: gauges.timecode_kind.load(Ordering::Relaxed),
            stops: gauges.stops.load(Ordering::Relaxed),
            lateness,
            tick_time,
        };
        if let Err(error) = self.status.send_copy(status) {
            tracing::warn!("the status is not published: {error}");
        }
        if let Err(error) = self.description.update_connections() {
            tracing::warn!("a reader of the description is not served: {error:?}");
        }
    }
}

/// The name of a source's nodes, as `iox2 node list` shows it.
pub(super) fn node_name(kind: SourceKind) -> &'static str {
    match kind {
        SourceKind::Server => "serve",
        SourceKind::Replay => "replay",
        SourceKind::Remote => "bridge-zenoh",
    }
}

fn publish_description(
    member: &Member,
    description: &Description,
) -> Result<Publisher<service::Service, [u8], u64>, BusError> {
    let publisher = member
        .description()?
        .publisher_builder()
        .initial_max_slice_len(service::MAX_DESCRIPTION_LEN)
        .create()
        .map_err(|error| failed(service::DESCRIPTION, &error))?;
    let text = description.toml.as_bytes();
    let mut sample = publisher.loan_slice(text.len()).map_err(|error| failed(service::DESCRIPTION, &error))?;
    sample.payload_mut().copy_from_slice(text);
    *sample.user_header_mut() = description.run_id;
    sample.send().map_err(|error| failed(service::DESCRIPTION, &error))?;
    Ok(publisher)
}

fn failed(service: &'static str, error: &dyn std::error::Error) -> BusError {
    BusError::failed(service, error)
}
