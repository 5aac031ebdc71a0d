//! Ports of a source on the bus: of the server, of a replay, and of a receiving bridge.

use std::time::{Duration, Instant};

use bench_dragon_ipc::service::{
    self, AlertService, CommandService, EventService, FrameService, MAX_ACTIVE_REQUESTS, Member, ReaderService,
    ReplayService, Role, Service,
};
use bench_dragon_ipc::source::SourceLock;
use bench_dragon_ipc::{
    BusError, Command, CommandEvent, CommandReply, Description, Domain, FrameHeader, HandleState, Refusal, Request,
    SourceKind, WakePage, require_shared_memory,
};
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::server::Server;
use iceoryx2::prelude::{BackpressureStrategy, PortFactory as _};
use iceoryx2::sample_mut::SampleMut;

use super::command_log::{CommandLog, Moment, answer_command};
use super::reporter::node_name;
use super::source_report::{SourceReport, TimesOfAll};
use crate::system::clock::monotonic_ns;

/// The readers for which a source waits before its first frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExpectedReaders {
    /// Their number.
    pub count: usize,
    /// Longest time to wait for them.
    pub wait: Duration,
}

impl ExpectedReaders {
    /// No readers.
    pub const NONE: Self = Self { count: 0, wait: Duration::ZERO };
}

/// The ports of one run of a source. Each run has its own number, and its ticks count from 0.
///
/// The sample of the next frame is loaned right after the last one is sent. So there is neither an allocation nor a
/// search for free memory between a due instant and its frame.
#[derive(Debug)]
pub(crate) struct SourcePorts {
    // Dropped in this order: the sample before its publisher, ports before their services, all of them before the node.
    next: Option<SampleMut<Service, [HandleState], FrameHeader>>,
    publisher: Publisher<Service, [HandleState], FrameHeader>,
    notifier: Notifier<Service>,
    frames: FrameService,
    frame_events: EventService,
    wake: WakePage,
    handle_count: usize,
    commands: Server<Service, Command, (), CommandReply, ()>,
    _commands: CommandService,
    // The monitor publishes alerts, the readers publish reports, and a replay its status. But only a source creates services, and a service
    // exists only while a node holds it.
    alerts: (AlertService, EventService),
    replay: ReplayService,
    _readers: ReaderService,
    /// The reports of the run: a thread publishes the description, the status and the command events.
    pub(crate) report: SourceReport,
    _member: Member,
    pub(crate) run_id: u64,
}

impl SourcePorts {
    /// Creates the services of a run, or takes over the services that clients of an earlier source hold open. Publishes
    /// the description.
    ///
    /// `rate_hz` is the number of frames a second that the source publishes; 0 where it is not known. For a replay it
    /// may differ from the rate in the description.
    ///
    /// # Errors
    /// [`BusError::SharedMemoryFull`] where the frames of all possible readers would not fit, and as [`Member::join`].
    pub(crate) fn open(
        domain: &Domain,
        kind: SourceKind,
        toml: &str,
        handle_count: usize,
        rate_hz: u32,
    ) -> Result<Self, BusError> {
        let member = Member::join(domain, node_name(kind), Role::Source { handle_count })?;
        let run_id = random_run_id();
        let description = Description { run_id, toml: toml.to_owned() };
        let command_service = member.commands()?;
        let commands = command_service.server_builder().create();
        let commands = commands.map_err(|error| BusError::failed(service::COMMANDS, error))?;
        let alerts = (member.alerts()?, member.alert_events()?);
        let (readers, replay) = (member.readers()?, member.replay()?);
        require_shared_memory(domain, service::description_memory(toml.len()))?;
        let report = SourceReport::start(kind, domain.clone(), description, handle_count, rate_hz)?;
        require_shared_memory(domain, service::frame_memory(handle_count))?;
        let wake = member.wake_page()?;
        // These services are created last: clients take their existence as the sign that all services exist.
        let (frames, frame_events) = (member.frames()?, member.frame_events()?);
        let publisher = frames
            .publisher_builder()
            .initial_max_slice_len(handle_count)
            .max_loaned_samples(1)
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(|error| BusError::failed(service::FRAMES, error))?;
        let notifier = frame_events.notifier_builder().create();
        let notifier = notifier.map_err(|error| BusError::failed(service::FRAMES, error))?;
        member.reserve_memory()?;
        Ok(Self {
            next: Some(loan(&publisher, handle_count)?),
            publisher,
            notifier,
            frames,
            frame_events,
            wake,
            handle_count,
            commands,
            _commands: command_service,
            alerts,
            replay,
            _readers: readers,
            report,
            _member: member,
            run_id,
        })
    }

    /// The services of the alerts and of a replay's status.
    pub(crate) fn replay_services(&self) -> (&AlertService, &EventService, &ReplayService) {
        (&self.alerts.0, &self.alerts.1, &self.replay)
    }

    /// Whether to wait longer: fewer readers are connected than expected, and less than the longest time has passed since
    /// `begun`.
    pub(crate) fn awaits_readers(&self, ExpectedReaders { count, wait }: ExpectedReaders, begun: Instant) -> bool {
        let seen = self.frames.dynamic_config().number_of_subscribers();
        let is_over = begun.elapsed() >= wait;
        if seen < count && is_over {
            tracing::warn!("starting with {seen} of {count} readers");
        }
        seen < count && !is_over
    }

    /// Publishes a frame: `fill` writes its handles in place and returns its header.
    ///
    /// # Errors
    /// [`BusError::Failed`] where iceoryx2 has no memory left, which the limits of the service rule out.
    pub(crate) fn publish(&mut self, fill: impl FnOnce(&mut [HandleState]) -> FrameHeader) -> Result<(), BusError> {
        let mut sample = self.next.take().expect("each publish loans the next sample");
        let header = fill(sample.payload_mut());
        *sample.user_header_mut() = FrameHeader { published_ns: monotonic_ns(), ..header };
        sample.send().map_err(|error| BusError::failed(service::FRAMES, error))?;
        self.wake.raise();
        // Only stock iceoryx2 clients listen. One that is gone, or whose queue is full, is not an error of the source.
        if self.frame_events.dynamic_config().number_of_listeners() > 0 {
            let _ = self.notifier.notify();
        }
        self.next = Some(loan(&self.publisher, self.handle_count)?);
        Ok(())
    }

    /// Publishes a frame of another source as a tick of this run, with this run's number and the given tick and due
    /// time.
    pub(crate) fn publish_copy(
        &mut self,
        header: &FrameHeader,
        handles: &[HandleState],
        tick: u64,
        scheduled_ns: u64,
    ) -> Result<(), BusError> {
        let run_id = self.run_id;
        let fill = |place: &mut [HandleState]| {
            place.copy_from_slice(handles);
            FrameHeader { run_id, tick, scheduled_ns, ..*header }
        };
        self.publish(fill)
    }

    /// Takes up to [`MAX_ACTIVE_REQUESTS`] commands, replies to each with the result of `decide`, and records it with
    /// its reply. The other commands wait for the next tick.
    ///
    /// A client that disconnects before its reply, or a connection that fails, does not affect the other commands.
    pub(crate) fn take_commands(
        &mut self,
        tick: u64,
        moment: Moment,
        decide: impl FnMut(Request) -> Result<f64, Refusal>,
    ) {
        self.answer_commands(tick, decide, |log, event| log.record(event, moment));
    }

    /// As [`SourcePorts::take_commands`], but without a record.
    pub(crate) fn take_unrecorded_commands(
        &mut self,
        tick: u64,
        mut decide: impl FnMut(Request) -> Result<(), Refusal>,
    ) {
        // The ordered speed is for the record alone.
        self.answer_commands(tick, |request| decide(request).map(|()| 0.0), |_, _| ());
    }

    fn answer_commands(
        &mut self,
        tick: u64,
        mut decide: impl FnMut(Request) -> Result<f64, Refusal>,
        record: impl Fn(&mut CommandLog, CommandEvent),
    ) {
        for _ in 0..MAX_ACTIVE_REQUESTS {
            let Ok(Some(active)) = self.commands.receive() else { return };
            let (reply, event) = answer_command(active.payload(), self.run_id, tick, &mut decide);
            record(&mut self.report.commands, event);
            let _ = active.send_copy(reply);
        }
    }

    #[cfg(feature = "zenoh")]
    pub(crate) fn take_command(&self) -> Option<super::AskedCommand> {
        self.commands.receive().ok().flatten().map(super::AskedCommand)
    }

    /// Leaves the bus. Returns the times of all ticks.
    pub(crate) fn finish(self) -> TimesOfAll {
        self.report.finish()
    }
}

/// Takes the instance's source lock, and removes incomplete service files of a killed source.
///
/// # Errors
/// [`BusError::SourceRunning`] where another source runs on the instance.
pub(crate) fn take_instance(domain: &Domain) -> Result<SourceLock, BusError> {
    let lock = SourceLock::take(domain)?;
    for path in lock.cleared() {
        tracing::warn!("removed {}, an incomplete service file of a killed server", path.display());
    }
    Ok(lock)
}

/// The rate in the description of a run, in hertz; 0 where this version cannot read the description.
pub(crate) fn described_rate_hz(toml: &str) -> u32 {
    described(toml, "serve", "rate_hz").unwrap_or(0)
}

/// The number of benches in the description of a run; `None` where this version cannot read the description.
#[cfg(feature = "zenoh")]
pub(crate) fn described_bench_count(toml: &str) -> Option<u32> {
    let of_dragons = || {
        crate::config::NamedLayout::of_toml(toml).dragons().last().and_then(|(_, benches)| benches.end.try_into().ok())
    };
    described(toml, "dragon", "benches").or_else(of_dragons)
}

/// Reads a whole number of a description. The other keys are ignored, since a newer version may add some.
fn described(toml: &str, section: &str, key: &str) -> Option<u32> {
    let table = toml.parse::<toml::Table>().ok()?;
    table.get(section)?.get(key)?.as_integer()?.try_into().ok()
}

fn loan(
    publisher: &Publisher<Service, [HandleState], FrameHeader>,
    handle_count: usize,
) -> Result<SampleMut<Service, [HandleState], FrameHeader>, BusError> {
    publisher.loan_slice(handle_count).map_err(|error| BusError::failed(service::FRAMES, error))
}

/// A random number under 2^53, so that a double and a JavaScript number represent it exactly.
fn random_run_id() -> u64 {
    let mut bytes = [0; 8];
    rustix::rand::getrandom(&mut bytes, rustix::rand::GetRandomFlags::empty())
        .expect("the kernel's random numbers are ready before this program starts");
    u64::from_ne_bytes(bytes) >> 11
}
