//! A run of another host on the bus of this host.

use bench_dragon_ipc::{Alert, BusError, CommandReply, Domain, FrameHeader, HandleState, Refusal, SourceKind};

use super::known_runs::Description;
use super::remote_clock::RemoteClock;
use super::remote_run::RemoteRun;
use super::report::ReceiverSummary;
use super::tick_bound::TickBound;
use super::wire::{Described, Seen};
use crate::bridge::rate_limit::RateLimit;
use crate::safety::alerts::AlertPublisher;
use crate::source::SourcePorts;
use crate::source::replay::FASTEST_HZ;
use crate::system::clock::monotonic_ns;

/// Frames may arrive this many times faster than described, because frames that were delayed on the link arrive together.
const MAX_SPEEDUP: u64 = 2;
/// Smallest limit of frames that arrive at once, for slow sources.
const LEAST_BURST: u64 = 512;
/// Limit of alerts: per second, and burst.
const ALERT_RATE: (u64, u64) = (1_000, 1_000);

/// The run and its ports on the bus.
#[derive(Debug)]
pub(super) struct ReceivedRun {
    // Dropped before the ports: the publisher opens its service as a client, which requires a source.
    alerts: AlertPublisher,
    pub(super) ports: SourcePorts,
    pub(super) remote: RemoteRun,
    pub(super) handle_count: usize,
    toml: String,
    tick_bound: TickBound,
    clock: RemoteClock,
    last_arrived_ns: u64,
    frame_limit: RateLimit,
    alert_limit: RateLimit,
}

impl ReceivedRun {
    /// Creates the services of a run and publishes its description.
    ///
    /// # Errors
    /// As [`SourcePorts::open`] and [`AlertPublisher::open`].
    pub(super) fn begin(
        domain: &Domain,
        described: Described,
        toml: String,
        handle_count: usize,
    ) -> Result<Self, BusError> {
        let ports = SourcePorts::open(domain, SourceKind::Remote, &toml, handle_count, sent_hz(described))?;
        let tick_bound = TickBound::new(described.rate_hz);
        let most_hz = tick_bound.rate_hz * MAX_SPEEDUP;
        Ok(Self {
            alerts: AlertPublisher::open(domain)?,
            ports,
            remote: RemoteRun::new(described),
            handle_count,
            toml,
            tick_bound,
            clock: RemoteClock::default(),
            last_arrived_ns: 0,
            frame_limit: RateLimit::new(most_hz, most_hz.max(LEAST_BURST)),
            alert_limit: RateLimit::new(ALERT_RATE.0, ALERT_RATE.1),
        })
    }

    pub(super) fn run_id(&self) -> u64 {
        self.ports.run_id
    }

    pub(super) fn remote_run_id(&self) -> u64 {
        self.remote.described.run_id
    }

    /// Expected time between two frames, in nanoseconds.
    pub(super) fn period_ns(&self) -> u64 {
        self.remote.described.every.saturating_mul(1_000_000_000) / self.tick_bound.rate_hz
    }

    /// Returns the reply to a command that is refused here.
    pub(super) fn refused(&self, refusal: Refusal) -> CommandReply {
        CommandReply::refused(self.run_id(), self.remote.next_tick, refusal)
    }

    /// Returns the position that this host has seen of the run: the tick of the last frame, plus the ticks that have passed
    /// since then, but less than the tick of the next frame that is sent.
    pub(super) fn seen(&self, now_ns: u64) -> Seen {
        let since_ns = u128::from(now_ns.saturating_sub(self.last_arrived_ns));
        let ticks = since_ns * u128::from(self.tick_bound.rate_hz) / 1_000_000_000;
        let ticks = ticks.min(u128::from(self.remote.described.every - 1)) as u64;
        let last_tick = self.remote.last_tick().unwrap_or(0);
        Seen { run_id: self.remote_run_id(), tick: last_tick.saturating_add(ticks) }
    }

    pub(super) fn describe(&mut self, described: Described) {
        self.ports.report.report_rate(sent_hz(described));
        self.remote.described = described;
    }

    /// Publishes a frame of the run, for the instant at which it was due on this host's clock. Returns false if the
    /// frame is rejected; `summary` counts the reason.
    pub(super) fn take(
        &mut self,
        header: &FrameHeader,
        handles: &[HandleState],
        arrived_ns: u64,
        summary: &mut ReceiverSummary,
    ) -> Result<bool, BusError> {
        let begun_ns = monotonic_ns();
        if header.handle_count() != self.handle_count {
            summary.malformed += 1;
        } else if !self.frame_limit.allows(begun_ns) || !self.tick_bound.allows(header.tick, begun_ns) {
            summary.too_fast += 1;
        } else if let Some(tick) = self.remote.take(header.tick) {
            self.last_arrived_ns = arrived_ns;
            let due_ns = self.clock.due_here_ns(header.scheduled_ns, arrived_ns);
            self.ports.publish_copy(header, handles, tick, due_ns)?;
            self.ports.report.report_frame(&FrameHeader { tick, ..*header }, 0);
            self.ports.report.count(begun_ns - arrived_ns, monotonic_ns() - begun_ns);
            return Ok(true);
        } else {
            summary.not_new += 1;
        }
        Ok(false)
    }

    /// Publishes an alert of the run with the local run id and tick. Returns false if the rate limit rejects the alert.
    pub(super) fn take_alert(&mut self, alert: Alert) -> Result<bool, BusError> {
        if !self.alert_limit.allows(monotonic_ns()) {
            return Ok(false);
        }
        let (run_id, tick) = (self.run_id(), self.remote.tick_here(alert.tick));
        self.alerts.publish(&Alert { run_id, tick, ..alert })?;
        Ok(true)
    }

    /// Delivers the last alerts to readers that have joined since.
    pub(super) fn deliver_to_late_joiners(&self) {
        self.alerts.deliver_to_late_joiners();
    }

    /// Removes the services from the bus and adds the run's counts to `summary`. Returns the description of the run.
    pub(super) fn finish(self, summary: &mut ReceiverSummary) -> Description {
        let Self { alerts, ports, remote, toml, .. } = self;
        drop(alerts);
        ports.finish();
        summary.frames += remote.next_tick;
        summary.lost += remote.lost;
        (remote.described, toml)
    }
}

/// Returns the frames per second that the sender selects of a run, rounded up; 0 if the rate is unknown.
fn sent_hz(described: Described) -> u32 {
    described.rate_hz.div_ceil(described.every).try_into().unwrap_or(FASTEST_HZ)
}
