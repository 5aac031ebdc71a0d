//! Thread of a source that publishes the description, the status and the command events, outside the loop.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use bench_dragon_ipc::guard::GuardLock;
use bench_dragon_ipc::service::{self, COMMAND_EVENT_BUFFER, Member, Role};
use bench_dragon_ipc::source::OperatorReserve;
use bench_dragon_ipc::{BusError, CommandEvent, Description, Domain, GuardState, SegmentWatch, SourceKind, Status};
use crossbeam::channel::Receiver;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::update_connections::UpdateConnections as _;
use rtrb::Consumer;

use super::service_manager::ServiceManager;
use super::source_report::LoopGauges;

/// Period of the status, and of the delivery of the description to late joiners.
const REPORT_PERIOD: Duration = Duration::from_millis(100);
/// Period at which the memory for operators is kept anew. Within it, a tool that has taken the memory creates its segments.
const RESERVE_PERIOD: Duration = Duration::from_secs(10);

pub(super) struct Reporter {
    description: Publisher<service::Service, [u8], u64>,
    status: Publisher<service::Service, Status, ()>,
    events: Publisher<service::Service, CommandEvent, ()>,
    _member: Member,
    domain: Domain,
    kind: SourceKind,
    run_id: u64,
    gauges: Arc<LoopGauges>,
    commands: Consumer<CommandEvent>,
}

impl Reporter {
    /// Joins the bus and publishes the description.
    ///
    /// # Errors
    /// As [`Member::join`] and [`Member::description`].
    pub(super) fn open(
        domain: Domain,
        kind: SourceKind,
        description: &Description,
        handle_count: usize,
        gauges: Arc<LoopGauges>,
        commands: Consumer<CommandEvent>,
    ) -> Result<Self, BusError> {
        let member = Member::join(&domain, &format!("{}-report", node_name(kind)), Role::Source { handle_count })?;
        let events = member.command_events()?.publisher_builder().create();
        Ok(Self {
            events: events.map_err(|error| failed(service::COMMAND_EVENTS, &error))?,
            description: publish_description(&member, description)?,
            status: member.status()?.publisher_builder().create().map_err(|error| failed(service::STATUS, &error))?,
            _member: member,
            domain,
            kind,
            run_id: description.run_id,
            gauges,
            commands,
        })
    }

    /// Publishes until the run has ended, then publishes the last status.
    pub(super) fn run(mut self, woken: &Receiver<()>) {
        let mut service_manager = ServiceManager::of_environment();
        let mut segments = SegmentWatch::new(&self.domain);
        let reserve = OperatorReserve::keep(&self.domain);
        let mut reserve_due = Instant::now() + RESERVE_PERIOD;
        while !self.gauges.is_finished.load(Ordering::Acquire) {
            let _ = woken.recv_timeout(REPORT_PERIOD);
            self.publish(COMMAND_EVENT_BUFFER / 2);
            segments.look();
            if Instant::now() >= reserve_due {
                reserve.refill();
                reserve_due = Instant::now() + RESERVE_PERIOD;
            }
            service_manager.look(self.gauges.beats.load(Ordering::Relaxed), || self.gauges.in_words());
        }
        self.publish(usize::MAX);
    }

    /// The state of the run's guard: not required, missing or running.
    fn guard_state(&self) -> GuardState {
        match (self.gauges.is_guarded.load(Ordering::Relaxed), GuardLock::holder(&self.domain)) {
            (false, _) => GuardState::None,
            (true, None) => GuardState::Missing,
            (true, Some(_pid)) => GuardState::Running,
        }
    }

    /// Publishes at most `most` waiting events, and delivers the last ones to late joiners.
    fn publish_commands(&mut self, most: usize) {
        for _ in 0..most {
            let Ok(event) = self.commands.pop() else { break };
            if let Err(error) = self.events.send_copy(event) {
                tracing::warn!("cannot publish the event of a command: {error}");
            }
        }
        if let Err(error) = self.events.update_connections() {
            tracing::warn!("cannot deliver command events to a reader: {error:?}");
        }
    }

    /// Publishes at most `most_commands` waiting events, then the status. If no more events wait, a reader that has
    /// this status can also read all events up to the status's tick.
    pub(super) fn publish(&mut self, most_commands: usize) {
        let gauges = Arc::clone(&self.gauges);
        // The tick is loaded first: then the histograms contain every earlier tick, and its events are in the queue.
        let tick = gauges.tick.see();
        self.publish_commands(most_commands);
        let (lateness, tick_time) = (gauges.lateness.histogram(), gauges.duration.histogram());
        let status = Status {
            run_id: self.run_id,
            tick,
            show_time_ns: gauges.show_time_ns.load(Ordering::Relaxed),
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
            guard: self.guard_state().to_wire(),
            timecode: gauges.timecode.load(Ordering::Relaxed),
            timecode_kind: gauges.timecode_kind.load(Ordering::Relaxed),
            stops: gauges.stops.load(Ordering::Relaxed),
            lateness,
            tick_time,
        };
        if let Err(error) = self.status.send_copy(status) {
            tracing::warn!("cannot publish the status: {error}");
        }
        if let Err(error) = self.description.update_connections() {
            tracing::warn!("cannot deliver the description to a reader: {error:?}");
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
    let text = description.toml.as_bytes();
    let publisher = member
        .description()?
        .publisher_builder()
        .initial_max_slice_len(text.len().max(1))
        .create()
        .map_err(|error| failed(service::DESCRIPTION, &error))?;
    let mut sample = publisher.loan_slice(text.len()).map_err(|error| failed(service::DESCRIPTION, &error))?;
    sample.payload_mut().copy_from_slice(text);
    *sample.user_header_mut() = description.run_id;
    sample.send().map_err(|error| failed(service::DESCRIPTION, &error))?;
    Ok(publisher)
}

fn failed(service: &'static str, error: &dyn std::error::Error) -> BusError {
    BusError::failed(service, error)
}
