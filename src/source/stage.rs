//! The place on the bus of a run whose frames come from elsewhere: a recording, or another host.

use bench_dragon_ipc::service::{AlertService, EventService, Member, ReaderService, Role};
use bench_dragon_ipc::{BusError, Description, Domain, FrameHeader, HandleState, Refusal, Request, SourceKind};

use super::command_log::Moment;
use super::command_server::CommandServer;
use super::frame_publisher::FramePublisher;
use super::random_run_id;
use super::reporter::{TimesOfAll, node_name};
use super::source_report::SourceReport;

/// What one run of a source has on the bus. The run has a number of its own, and its ticks are counted afresh.
#[derive(Debug)]
pub(crate) struct Stage {
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

impl Stage {
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

    /// What it tells of itself.
    pub(crate) fn report(&mut self) -> &mut SourceReport {
        &mut self.report
    }

    /// Readers connected at present.
    pub(crate) fn reader_count(&self) -> usize {
        self.frames.reader_count()
    }

    /// Publishes a frame from elsewhere as a tick of this run: with its number, and due and sent now.
    pub(crate) fn publish(
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
        self.frames.publish(fill, crate::system::clock::monotonic_ns)
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
