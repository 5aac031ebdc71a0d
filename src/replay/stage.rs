//! A pass's place on the bus: its services, its number and its description.

use bench_dragon_ipc::service::{AlertService, EventService, Member, Role};
use bench_dragon_ipc::{BusError, Description, Domain, FrameHeader, Refusal, Request};

use crate::record::RecordedFrame;
use crate::source::{CommandServer, FramePublisher, SourceReport, TimesOfAll, random_run_id};

use super::read_ahead::RecordedRun;

/// What one run of a source has on the bus.
#[derive(Debug)]
pub(super) struct Stage {
    // Dropped in this order: ports before the node.
    frames: FramePublisher,
    commands: CommandServer,
    // The alerts are the monitor's, but only a source creates services, and they last while somebody holds them.
    _alerts: (AlertService, EventService),
    report: SourceReport,
    _member: Member,
    run_id: u64,
}

impl Stage {
    /// Makes the services of a recorded run and publishes its description.
    ///
    /// # Errors
    /// As [`Member::join`] and [`Member::frames`].
    pub(super) fn open(domain: &Domain, run: &RecordedRun) -> Result<Self, BusError> {
        let bench_count = run.bench_count;
        let member = Member::join(domain, "replay", Role::Source { bench_count })?;
        let run_id = random_run_id();
        let toml = run.configuration.toml.clone();
        let rate_hz = recorded_rate_hz(&toml);
        Ok(Self {
            frames: FramePublisher::create(domain, &member, bench_count)?,
            commands: CommandServer::create(&member)?,
            _alerts: (member.alerts()?, member.alert_events()?),
            report: SourceReport::start(domain.clone(), Description { run_id, toml }, bench_count, rate_hz)?,
            _member: member,
            run_id,
        })
    }

    pub(super) fn run_id(&self) -> u64 {
        self.run_id
    }

    /// What it tells of itself.
    pub(super) fn report(&mut self) -> &mut SourceReport {
        &mut self.report
    }

    /// Readers connected at present.
    pub(super) fn reader_count(&self) -> usize {
        self.frames.reader_count()
    }

    /// Publishes a recorded frame as a tick of this run.
    pub(super) fn publish(&mut self, frame: &RecordedFrame, tick: u64, scheduled_ns: u64) -> Result<(), BusError> {
        let run_id = self.run_id;
        let fill = |handles: &mut [_]| {
            handles.copy_from_slice(&frame.handles);
            FrameHeader { run_id, tick, scheduled_ns, ..frame.header }
        };
        self.frames.publish(fill, crate::clock::monotonic_ns)
    }

    /// Answers the commands that have come. Returns whether a client asked for the end.
    pub(super) fn take_commands(&self, tick: u64) -> bool {
        let mut asked_to_stop = false;
        self.commands.drain(self.run_id, tick, |request| match request {
            Request::Stop => {
                asked_to_stop = true;
                Ok(())
            }
            _ => Err(Refusal::Replayed),
        });
        asked_to_stop
    }

    /// Leaves the bus. Returns the times of all ticks.
    pub(super) fn finish(self) -> TimesOfAll {
        self.report.finish()
    }
}

/// The rate that a run was recorded at; 0 where its configuration is one that this version does not know.
fn recorded_rate_hz(toml: &str) -> u32 {
    let rate_hz = toml.parse::<toml::Table>().ok().and_then(|table| table.get("serve")?.get("rate_hz")?.as_integer());
    rate_hz.and_then(|rate_hz| rate_hz.try_into().ok()).unwrap_or(0)
}
