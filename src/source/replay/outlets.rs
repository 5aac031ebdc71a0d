//! The outlets of a replay beside its frames: the recorded alerts, the recorded commands, and its own status.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use bench_dragon_ipc::service::{self, Service};
use bench_dragon_ipc::{Alert, BusError, CommandEvent, Domain, EventKind, ReplayStatus, require_shared_memory};
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::update_connections::UpdateConnections as _;

use crate::source::SourcePorts;

/// Period of the status.
const STATUS_PERIOD: Duration = Duration::from_millis(100);
/// Number of the last cuts after which the ticks of events are still exact.
const MOST_CUTS: usize = 1 << 10;

/// The outlets of one pass.
#[derive(Debug)]
pub(super) struct Outlets {
    alerts: Publisher<Service, Alert, ()>,
    wake: Notifier<Service>,
    status: Publisher<Service, ReplayStatus, ()>,
    due: Instant,
    ticks: TickMap,
}

impl Outlets {
    /// Opens the outlets on the ports of a pass.
    ///
    /// # Errors
    /// [`BusError::SharedMemoryFull`], [`BusError::Failed`].
    pub(super) fn open(domain: &Domain, ports: &SourcePorts) -> Result<Self, BusError> {
        require_shared_memory(domain, service::ALERT_MEMORY)?;
        let (alerts, events, replay) = ports.replay_services();
        let alerts = alerts.publisher_builder().create();
        let wake = events.notifier_builder().create();
        let status = replay.publisher_builder().create();
        Ok(Self {
            alerts: alerts.map_err(|error| BusError::failed(service::ALERTS, error))?,
            wake: wake.map_err(|error| BusError::failed(service::ALERTS, error))?,
            status: status.map_err(|error| BusError::failed(service::REPLAY, error))?,
            due: Instant::now(),
            ticks: TickMap::default(),
        })
    }

    /// Notes that a recorded tick is replayed as a tick of the pass.
    pub(super) fn note_tick(&mut self, recorded: u64, own: u64) {
        self.ticks.note(recorded, own);
    }

    /// Publishes a recorded alert as one of this pass.
    ///
    /// # Errors
    /// [`BusError::Failed`] where iceoryx2 has no memory left, which the limits of the service rule out.
    pub(super) fn publish_alert(&self, run_id: u64, alert: Alert) -> Result<(), BusError> {
        let alert = Alert { run_id, tick: self.ticks.own(alert.tick), ..alert };
        self.alerts.send_copy(alert).map_err(|error| BusError::failed(service::ALERTS, error))?;
        // Ignores a failed wake-up: the reader has ended, or its wake-up queue is full.
        let _ = self.wake.notify();
        Ok(())
    }

    /// A recorded command as an event of this pass. `None` for start and end of the recorded run: the record of a replay is no
    /// complete record of a run, and must not be taken for one.
    pub(super) fn event(&self, event: CommandEvent) -> Option<CommandEvent> {
        let is_frame_of_run = matches!(event.event_kind(), Some(EventKind::Start | EventKind::End));
        (!is_frame_of_run).then(|| CommandEvent { tick: self.ticks.own(event.tick), ..event })
    }

    /// Whether the next status is due.
    pub(super) fn is_status_due(&self) -> bool {
        Instant::now() >= self.due
    }

    /// Publishes a status now, and delivers the last alerts to readers that have joined since.
    pub(super) fn publish_status(&mut self, status: ReplayStatus) {
        self.due = Instant::now() + STATUS_PERIOD;
        if let Err(error) = self.status.send_copy(status) {
            tracing::warn!("cannot publish the status of the replay: {error}");
        }
        if let Err(error) = self.alerts.update_connections() {
            tracing::warn!("cannot deliver alerts to a reader: {error:?}");
        }
    }
}

/// Converts recorded ticks to ticks of a pass. Between two cuts, both count alike.
#[derive(Debug, Default)]
struct TickMap {
    /// Recorded tick and own tick after each cut, oldest first.
    cuts: VecDeque<(u64, u64)>,
    last: Option<(u64, u64)>,
}

impl TickMap {
    fn note(&mut self, recorded: u64, own: u64) {
        if self.last.is_none_or(|(last, last_own)| (recorded, own) != (last + 1, last_own + 1)) {
            if self.cuts.len() == MOST_CUTS {
                self.cuts.pop_front();
            }
            self.cuts.push_back((recorded, own));
        }
        self.last = Some((recorded, own));
    }

    /// The tick of the pass at which a recorded tick was replayed last. For a tick that was not replayed, the one before it.
    fn own(&self, recorded: u64) -> u64 {
        let mut end = self.last.map_or(0, |(_, own)| own);
        for &(begin, own) in self.cuts.iter().rev() {
            if begin <= recorded {
                return (own + (recorded - begin)).min(end);
            }
            end = own.saturating_sub(1);
        }
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recorded_ticks_become_ticks_of_the_pass_also_after_cuts_and_jumps_back() {
        let mut map = TickMap::default();
        assert_eq!(map.own(7), 0);
        for (recorded, own) in [(5, 0), (6, 1), (10, 2), (11, 3)] {
            map.note(recorded, own);
        }
        assert_eq!([3, 5, 6, 8, 10, 11, 99].map(|recorded| map.own(recorded)), [0, 0, 1, 1, 2, 3, 3]);
        map.note(6, 4);
        map.note(7, 5);
        assert_eq!([6, 7, 11].map(|recorded| map.own(recorded)), [4, 5, 5], "after a seek back");
    }
}
