//! What a source has on the bus: the server, a replay, and a bridge that receives.

use bench_dragon_ipc::service::{self, AlertService, EventService, FrameService, Member, ReaderService, Role, Service};
use bench_dragon_ipc::{
    BusError, Description, Domain, FrameHeader, HandleState, Refusal, Request, SourceKind, SourceLock,
    require_shared_memory,
};
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::prelude::{BackpressureStrategy, PortFactory as _};
use iceoryx2::sample_mut::SampleMut;

use super::command_server::{CommandServer, Moment};
use super::reporter::{TimesOfAll, node_name};
use super::source_report::SourceReport;
use crate::system::clock::monotonic_ns;

/// What one run of a source has on the bus. The run has a number of its own, and its ticks are counted afresh.
#[derive(Debug)]
pub(crate) struct SourcePorts {
    // Dropped in this order: ports before the node.
    frames: FramePublisher,
    commands: CommandServer,
    // Alerts are the monitor's and reports the readers', but only a source creates services, and they last while somebody
    // holds them.
    _alerts: (AlertService, EventService),
    _readers: ReaderService,
    report: SourceReport,
    _member: Member,
    run_id: u64,
}

impl SourcePorts {
    /// Makes the services of a run and publishes its description.
    ///
    /// Its frames come so many times a second, which is not what the run is described with where it is played faster, or
    /// thinned out; 0 where that is not known.
    ///
    /// # Errors
    /// As [`Member::join`] and [`Member::frames`].
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
        Ok(Self {
            commands: CommandServer::create(&member)?,
            _alerts: (member.alerts()?, member.alert_events()?),
            _readers: member.readers()?,
            report: SourceReport::start(kind, domain.clone(), description, bench_count, rate_hz)?,
            // The last service: clients take it for the sign that all are there.
            frames: FramePublisher::create(domain, &member, bench_count)?,
            _member: member,
            run_id,
        })
    }

    pub(crate) fn run_id(&self) -> u64 {
        self.run_id
    }

    /// Its slow side, which publishes the description and the status.
    pub(crate) fn report(&mut self) -> &mut SourceReport {
        &mut self.report
    }

    /// Readers connected at present.
    pub(crate) fn reader_count(&self) -> usize {
        self.frames.frames.dynamic_config().number_of_subscribers()
    }

    /// Publishes the frame whose handles `fill` writes in place, and whose header it returns.
    ///
    /// # Errors
    /// [`BusError::Failed`] where iceoryx2 has no memory left, which the limits of the service rule out.
    pub(crate) fn publish(&mut self, fill: impl FnOnce(&mut [HandleState]) -> FrameHeader) -> Result<(), BusError> {
        self.frames.publish(fill)
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

    /// Answers the commands that have come.
    pub(crate) fn take_commands(
        &mut self,
        tick: u64,
        moment: Moment,
        decide: impl FnMut(Request) -> Result<(), Refusal>,
    ) {
        let log = self.report.commands();
        self.commands.drain(self.run_id, tick, decide, |event| log.record(event, moment));
    }

    /// Takes the next command, to be answered later.
    #[cfg(feature = "zenoh")]
    pub(crate) fn take_command(&self) -> Option<super::AskedCommand> {
        self.commands.take()
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

/// The source of an instance's frames.
///
/// The sample of the next frame is loaned right after the last one is sent, so that between a release and its frame
/// there is neither an allocation nor a search for free memory.
#[derive(Debug)]
struct FramePublisher {
    // Dropped in this order: the sample before its publisher, ports before their services.
    next: Option<SampleMut<Service, [HandleState], FrameHeader>>,
    publisher: Publisher<Service, [HandleState], FrameHeader>,
    notifier: Notifier<Service>,
    frames: FrameService,
    _events: EventService,
    handle_count: usize,
}

impl FramePublisher {
    /// Creates the frames' services, or takes over those that clients of an earlier source keep open.
    ///
    /// # Errors
    /// [`BusError::SharedMemoryFull`] where the frames of all possible readers would not fit, and as
    /// [`Member::frames`].
    fn create(domain: &Domain, member: &Member, bench_count: usize) -> Result<Self, BusError> {
        require_shared_memory(domain, service::frame_memory(bench_count))?;
        let (frames, events) = (member.frames()?, member.frame_events()?);
        let handle_count = bench_count + 1;
        let publisher = frames
            .publisher_builder()
            .initial_max_slice_len(handle_count)
            .max_loaned_samples(1)
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(|error| BusError::failed(service::FRAMES, error))?;
        let notifier = events.notifier_builder().create().map_err(|error| BusError::failed(service::FRAMES, error))?;
        let next = publisher.loan_slice(handle_count).map_err(|error| BusError::failed(service::FRAMES, error))?;
        Ok(Self { next: Some(next), publisher, notifier, frames, _events: events, handle_count })
    }

    /// Publishes one frame: `fill` writes every handle in place, then the header is stamped and the frame sent.
    fn publish(&mut self, fill: impl FnOnce(&mut [HandleState]) -> FrameHeader) -> Result<(), BusError> {
        let mut sample = self.next.take().expect("a sample is loaned after each frame");
        let header = fill(sample.payload_mut());
        *sample.user_header_mut() = FrameHeader { published_ns: monotonic_ns(), ..header };
        sample.send().map_err(|error| BusError::failed(service::FRAMES, error))?;
        // A reader that is gone or whose wake-ups are full is its own affair.
        let _ = self.notifier.notify();
        self.next = Some(
            self.publisher.loan_slice(self.handle_count).map_err(|error| BusError::failed(service::FRAMES, error))?,
        );
        Ok(())
    }
}

/// A random number under 2^53, so that every double and every JavaScript number holds it.
fn random_run_id() -> u64 {
    let mut bytes = [0; 8];
    rustix::rand::getrandom(&mut bytes, rustix::rand::GetRandomFlags::empty())
        .expect("the kernel's random numbers are ready long before any program runs");
    u64::from_ne_bytes(bytes) >> 11
}
