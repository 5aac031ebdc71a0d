//! The observer: a loop that reads the bus and delivers snapshots.

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use bench_dragon_ipc::{
    AlertSubscriber, BusError, CommandEventReader, DescriptionReader, Domain, FrameSubscriber, ReaderReports,
    ReplayStatusReader, StatusReader,
};

use super::clearance_memory::ClearanceMemory;
use super::members::Members;
use super::observer_state::ObserverState;
use super::snapshot::Snapshot;
use crate::system::clock::monotonic_ns;

/// Period at which the observer tries to open a bus that does not exist.
const LOOK_PERIOD: Duration = Duration::from_millis(20);
/// Period at which the observer retries a bus that it cannot read.
const RETRY_PERIOD: Duration = Duration::from_millis(500);

/// Reads a bus, with or without a source.
#[derive(Debug)]
pub struct Observer {
    domain: Domain,
    name: &'static str,
    period_ns: u64,
    plans: bool,
    remembers: bool,
}

impl Observer {
    /// Returns an observer that joins the bus under this name and makes `snapshots_hz` snapshots per second.
    pub fn new(domain: Domain, name: &'static str, snapshots_hz: u32) -> Self {
        Self { domain, name, period_ns: 1_000_000_000 / u64::from(snapshots_hz.max(1)), plans: false, remembers: false }
    }

    /// Adds the planned clearance of each run. A separate thread computes it, in some seconds of one core.
    #[must_use]
    pub fn with_plan(self) -> Self {
        Self { plans: true, ..self }
    }

    /// Keeps the measured clearance in a file of the instance, so that a later observer of the same run has it too.
    #[must_use]
    pub fn with_memory(self) -> Self {
        Self { remembers: true, ..self }
    }

    /// Observes on the caller's thread until the flag is set. It passes each snapshot to `show`, also if no frames arrive.
    ///
    /// Errors of the bus do not end the loop. They are reported in a snapshot, and the bus is opened again.
    pub fn run(&self, stop: &AtomicBool, mut show: impl FnMut(Snapshot)) {
        let memory = self.remembers.then(|| ClearanceMemory::of(&self.domain));
        let mut state = ObserverState::new(self.domain.instance().as_str(), monotonic_ns(), self.plans, memory);
        let mut ports = None;
        let mut due_ns = 0_u64;
        while !stop.load(Ordering::Relaxed) {
            let wait = Duration::from_nanos(due_ns.saturating_sub(monotonic_ns()));
            if let Err(error) = self.look(&mut ports, &mut state, wait) {
                ports = None;
                state.fail(&error);
                show(state.snapshot(monotonic_ns()));
                thread::sleep(RETRY_PERIOD);
                continue;
            }
            let now_ns = monotonic_ns();
            if now_ns >= due_ns {
                due_ns = (due_ns + self.period_ns).max(now_ns);
                if let Err(error) = ports.as_mut().map_or(Ok(()), |ports| state.renew(ports)) {
                    ports = None;
                    state.fail(&error);
                }
                state.look_at_source(&self.domain, now_ns);
                show(state.snapshot(now_ns));
            }
        }
    }

    /// Reads frames for at most this time, or opens the bus if it exists.
    fn look(&self, ports: &mut Option<Ports>, state: &mut ObserverState, wait: Duration) -> Result<(), BusError> {
        if let Some(ports) = ports {
            return state.take_frames(&mut ports.frames, wait);
        }
        match Ports::open(&self.domain, self.name) {
            Ok(opened) => {
                state.can_read(Some(monotonic_ns()));
                // Operators' tools leave the remains of killed processes, so these are still there.
                state.meet(Members::of(&self.domain));
                *ports = Some(opened);
            }
            Err(error) if error.is_absent() => {
                state.can_read(None);
                thread::sleep(LOOK_PERIOD.min(wait));
            }
            Err(error) => return Err(error),
        }
        Ok(())
    }
}

/// The readers of all services.
#[derive(Debug)]
pub(super) struct Ports {
    pub(super) frames: FrameSubscriber,
    pub(super) alerts: AlertSubscriber,
    pub(super) statuses: StatusReader,
    pub(super) descriptions: DescriptionReader,
    /// `None` for a source of an earlier version, which lacks this service.
    pub(super) reports: Option<ReaderReports>,
    /// `None` for a source of an earlier version, which lacks this service.
    pub(super) commands: Option<CommandEventReader>,
    /// `None` for a source of an earlier version, which lacks this service.
    pub(super) replay: Option<ReplayStatusReader>,
}

impl Ports {
    /// Opens the frames after the other required services, so that these are open at the first frame. Then it opens the
    /// services that may be missing permanently: a source creates them before the frames.
    pub(super) fn open(domain: &Domain, name: &str) -> Result<Self, BusError> {
        let descriptions = DescriptionReader::open(domain, &format!("{name}-description"))?;
        let statuses = StatusReader::open(domain, &format!("{name}-status"))?;
        let alerts = AlertSubscriber::open_with_past(domain, &format!("{name}-alerts"))?;
        let frames = FrameSubscriber::open(domain, name)?;
        let reports = if_there(ReaderReports::open(domain, &format!("{name}-reports")))?;
        let commands = if_there(CommandEventReader::open(domain, &format!("{name}-events")))?;
        let replay = if_there(ReplayStatusReader::open(domain, &format!("{name}-replay")))?;
        Ok(Self { frames, alerts, statuses, descriptions, reports, commands, replay })
    }
}

fn if_there<Port>(opened: Result<Port, BusError>) -> Result<Option<Port>, BusError> {
    match opened {
        Ok(port) => Ok(Some(port)),
        Err(error) if error.is_absent() => Ok(None),
        Err(error) => Err(error),
    }
}
