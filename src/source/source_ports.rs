//! What a source has on the bus: the server, a replay, and a bridge that receives.

use std::time::{Duration, Instant};

use bench_dragon_ipc::service::{
    self, AlertService, CommandService, EventService, FrameService, MAX_ACTIVE_REQUESTS, Member, ReaderService, Role,
    Service,
};
use bench_dragon_ipc::{
    BusError, Command, CommandEvent, CommandReply, Description, Domain, FrameHeader, HandleState, Refusal, Request,
    SourceKind, SourceLock, require_shared_memory,
};
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::server::Server;
use iceoryx2::prelude::{BackpressureStrategy, PortFactory as _};
use iceoryx2::sample_mut::SampleMut;

use super::command_log::Moment;
use super::reporter::node_name;
use super::source_report::{SourceReport, TimesOfAll};
use crate::system::clock::monotonic_ns;

/// How long a source waits for the readers that it was told to expect.
const READER_PATIENCE: Duration = Duration::from_secs(10);

/// What one run of a source has on the bus. The run has a number of its own, and its ticks are counted afresh.
///
/// The sample of the next frame is loaned right after the last one is sent, so that between a release and its frame
/// there is neither an allocation nor a search for free memory.
#[derive(Debug)]
pub(crate) struct SourcePorts {
    // Dropped in this order: the sample before its publisher, ports before their services, all of them before the node.
    next: Option<SampleMut<Service, [HandleState], FrameHeader>>,
    publisher: Publisher<Service, [HandleState], FrameHeader>,
    notifier: Notifier<Service>,
    frames: FrameService,
    _frame_events: EventService,
    handle_count: usize,
    commands: Server<Service, Command, (), CommandReply, ()>,
    _commands: CommandService,
    // Alerts are the monitor's and reports the readers', but only a source creates services, and they last while somebody
    // holds them.
    _alerts: (AlertService, EventService),
    _readers: ReaderService,
    /// Its slow side, which publishes the description and the status.
    pub(crate) report: SourceReport,
    _member: Member,
    pub(crate) run_id: u64,
}

impl SourcePorts {
    /// Makes the services of a run, or takes over those that clients of an earlier source keep open, and publishes its
    /// description.
    ///
    /// Its frames come so many times a second, which is not what the run is described with where it is played faster, or
    /// thinned out; 0 where that is not known.
    ///
    /// # Errors
    /// [`BusError::SharedMemoryFull`] where the frames of all possible readers would not fit, and as [`Member::join`].
    pub(crate) fn open(
        domain: &Domain,
        kind: SourceKind,
        toml: &str,
        bench_count: usize,
        rate_hz: u32,
    ) -> Result<Self, BusError> {
        let member = Member::join(domain, node_name(kind), Role::Source { bench_count })?;
        let run_id = random_run_id();
        let description = Description { run_id, toml: toml.to_owned() };
        let command_service = member.commands()?;
        let commands = command_service.server_builder().create();
        let commands = commands.map_err(|error| BusError::failed(service::COMMANDS, error))?;
        let alerts = (member.alerts()?, member.alert_events()?);
        let readers = member.readers()?;
        let report = SourceReport::start(kind, domain.clone(), description, bench_count, rate_hz)?;
        require_shared_memory(domain, service::frame_memory(bench_count))?;
        // The last services: clients take them for the sign that all are there.
        let (frames, frame_events) = (member.frames()?, member.frame_events()?);
        let handle_count = bench_count + 1;
        let publisher = frames
            .publisher_builder()
            .initial_max_slice_len(handle_count)
            .max_loaned_samples(1)
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(|error| BusError::failed(service::FRAMES, error))?;
        Ok(Self {
            next: Some(loan(&publisher, handle_count)?),
            publisher,
            notifier: frame_events
                .notifier_builder()
                .create()
                .map_err(|error| BusError::failed(service::FRAMES, error))?,
            frames,
            _frame_events: frame_events,
            handle_count,
            commands,
            _commands: command_service,
            _alerts: alerts,
            _readers: readers,
            report,
            _member: member,
            run_id,
        })
    }

    /// Whether to wait for readers: there are fewer than expected, and it has been less than ten seconds since `begun`.
    pub(crate) fn awaits_readers(&self, expected: usize, begun: Instant) -> bool {
        let seen = self.frames.dynamic_config().number_of_subscribers();
        let is_over = begun.elapsed() >= READER_PATIENCE;
        if seen < expected && is_over {
            tracing::warn!("starting with {seen} of {expected} readers");
        }
        seen < expected && !is_over
    }

    /// Publishes the frame whose handles `fill` writes in place, and whose header it returns.
    ///
    /// # Errors
    /// [`BusError::Failed`] where iceoryx2 has no memory left, which the limits of the service rule out.
    pub(crate) fn publish(&mut self, fill: impl FnOnce(&mut [HandleState]) -> FrameHeader) -> Result<(), BusError> {
        let mut sample = self.next.take().expect("a sample is loaned after each frame");
        let header = fill(sample.payload_mut());
        *sample.user_header_mut() = FrameHeader { published_ns: monotonic_ns(), ..header };
        sample.send().map_err(|error| BusError::failed(service::FRAMES, error))?;
        // A reader that is gone or whose wake-ups are full is its own affair.
        let _ = self.notifier.notify();
        self.next = Some(loan(&self.publisher, self.handle_count)?);
        Ok(())
    }

    /// Publishes a frame from elsewhere as a tick of this run: with its number, and due and sent now.
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

    /// Takes up to [`MAX_ACTIVE_REQUESTS`] commands, answers each with what `decide` says of it, and records it with its
    /// answer. The others wait for the next tick.
    ///
    /// A client that is gone before its answer, or a connection that fails, changes nothing for the others.
    pub(crate) fn take_commands(
        &mut self,
        tick: u64,
        moment: Moment,
        mut decide: impl FnMut(Request) -> Result<(), Refusal>,
    ) {
        for _ in 0..MAX_ACTIVE_REQUESTS {
            let Ok(Some(active)) = self.commands.receive() else { return };
            let outcome = Request::from_wire(active.payload()).ok_or(Refusal::Unknown).and_then(&mut decide);
            let reply = match outcome {
                Ok(()) => CommandReply::accepted(self.run_id, tick),
                Err(refusal) => CommandReply::refused(self.run_id, tick, refusal),
            };
            self.report.commands.record(CommandEvent::answered(active.payload(), &reply), moment);
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

/// Takes an instance for a source.
///
/// # Errors
/// [`BusError::SourceRunning`] where a source runs on it.
pub(crate) fn take_instance(domain: &Domain) -> Result<SourceLock, BusError> {
    let lock = SourceLock::take(domain)?;
    for path in lock.cleared() {
        tracing::warn!("removed {}, which a killed server had left half made", path.display());
    }
    Ok(lock)
}

/// The rate that a run is described with; 0 where its description is one that this version does not know.
pub(crate) fn described_rate_hz(toml: &str) -> u32 {
    described(toml, "serve", "rate_hz").unwrap_or(0)
}

/// The benches that a run is described with, unless its description is one that this version does not know.
#[cfg(feature = "zenoh")]
pub(crate) fn described_bench_count(toml: &str) -> Option<u32> {
    described(toml, "dragon", "benches")
}

/// A whole number of a description. All else of it is passed over, since a newer version may say more.
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

/// A random number under 2^53, so that every double and every JavaScript number holds it.
fn random_run_id() -> u64 {
    let mut bytes = [0; 8];
    rustix::rand::getrandom(&mut bytes, rustix::rand::GetRandomFlags::empty())
        .expect("the kernel's random numbers are ready long before any program runs");
    u64::from_ne_bytes(bytes) >> 11
}
