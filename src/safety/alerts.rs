//! Publishes alerts, and limits the rate of a monitor's pair alerts.

use std::cmp::Ordering;

use bench_dragon_ipc::service::{self, Member, Role, Service};
use bench_dragon_ipc::{Alert, AlertKind, BusError, Domain, require_shared_memory};
use iceoryx2::port::notifier::{Notifier, NotifierCreateError};
use iceoryx2::port::publisher::{Publisher, PublisherCreateError};
use iceoryx2::port::update_connections::UpdateConnections as _;

/// Publishes alerts on the bus of an instance.
#[derive(Debug)]
pub struct AlertPublisher {
    // Fields drop in this order: the ports before their node.
    publisher: Publisher<Service, Alert, ()>,
    notifier: Notifier<Service>,
    _member: Member,
}

impl AlertPublisher {
    /// Opens the alert service of a domain.
    ///
    /// # Errors
    /// [`BusError::SharedMemoryFull`], and the errors of [`Member::alerts`]. [`BusError::TooManyClients`] for more monitors
    /// than [`service::MAX_MONITORS`].
    pub fn open(domain: &Domain) -> Result<Self, BusError> {
        require_shared_memory(domain, service::ALERT_MEMORY)?;
        let member = Member::join(domain, "monitor-alerts", Role::Client)?;
        let (alerts, events) = (member.alerts()?, member.alert_events()?);
        let publisher = alerts.publisher_builder().create().map_err(|error| match error {
            PublisherCreateError::ExceedsMaxSupportedPublishers => {
                BusError::TooManyClients { service: service::ALERTS }
            }
            error => BusError::failed(service::ALERTS, error),
        })?;
        let notifier = events.notifier_builder().create().map_err(|error| match error {
            NotifierCreateError::ExceedsMaxSupportedNotifiers => BusError::TooManyClients { service: service::ALERTS },
            error => BusError::failed(service::ALERTS, error),
        })?;
        member.reserve_memory()?;
        Ok(Self { publisher, notifier, _member: member })
    }

    /// Delivers the last alerts to readers that have joined since. Call it about as often as frames arrive: without a new
    /// reader it costs nothing.
    pub fn deliver_to_late_joiners(&self) {
        if let Err(error) = self.publisher.update_connections() {
            tracing::warn!("cannot deliver alerts to a reader: {error:?}");
        }
    }

    /// Publishes one alert and wakes its readers.
    ///
    /// # Errors
    /// [`BusError::Failed`] if iceoryx2 has no memory left. The limits of the service exclude this.
    pub fn publish(&self, alert: &Alert) -> Result<(), BusError> {
        self.publisher.send_copy(*alert).map_err(|error| BusError::failed(service::ALERTS, error))?;
        // Ignores a failed wake-up: the reader has ended, or its wake-up queue is full.
        let _ = self.notifier.notify();
        Ok(())
    }
}

/// Greatest number of pair alerts at once: fewer than the buffer of a reader.
pub const ALERT_BURST: u32 = 200;
/// Greatest mean rate of pair alerts per second, by the clock of the frames.
pub const ALERTS_PER_S: u32 = 100;

/// Limit of the alerts per time: a token bucket.
#[derive(Debug)]
pub(super) struct AlertLimit {
    tokens: f64,
    last_ns: u64,
    had_contact: bool,
    /// Number of alerts left out.
    pub(super) suppressed: u64,
}

impl AlertLimit {
    pub(super) fn new() -> Self {
        Self { tokens: f64::from(ALERT_BURST), last_ns: 0, had_contact: false, suppressed: 0 }
    }

    /// Leaves out the alerts of a frame that exceed the limit. The other alerts keep their order.
    pub(super) fn apply(&mut self, now_ns: u64, alerts: &mut Vec<Alert>) {
        let passed_s = now_ns.saturating_sub(self.last_ns) as f64 * 1e-9;
        self.last_ns = now_ns;
        self.tokens = f64::from(ALERTS_PER_S).mul_add(passed_s, self.tokens).min(f64::from(ALERT_BURST));
        let is_contact = |alert: &&Alert| alert.alert_kind() == Some(AlertKind::Contact);
        let first = alerts.iter().find(is_contact).copied().filter(|_| !self.had_contact);
        self.had_contact |= first.is_some();
        let most = (self.tokens as usize).max(usize::from(first.is_some()));
        if alerts.len() > most {
            self.suppressed += (alerts.len() - most) as u64;
            let last = most.checked_sub(1).map(|last| *alerts.clone().select_nth_unstable_by(last, order).1);
            keep(alerts, most, last, first);
        }
        self.tokens = (self.tokens - alerts.len() as f64).max(0.0);
    }
}

/// Keeps `most` alerts: the `first` contact, and the alerts up to `last` by priority.
fn keep(alerts: &mut Vec<Alert>, most: usize, last: Option<Alert>, first: Option<Alert>) {
    let mut left = most - usize::from(first.is_some());
    alerts.retain(|alert| {
        if Some(*alert) == first {
            return true;
        }
        let is_kept = left > 0 && last.is_some_and(|last| order(alert, &last).is_le());
        left -= usize::from(is_kept);
        is_kept
    });
}

/// Priority of alerts: contacts, then partings, then boards beyond or near borders of the stage, then the others; each
/// by clearance, then by benches.
fn order(one: &Alert, other: &Alert) -> Ordering {
    let rank = |alert: &Alert| match alert.alert_kind() {
        Some(AlertKind::Contact) => 0,
        Some(AlertKind::Parted) => 1,
        Some(kind) if kind.is_of_one_bench() => 2,
        _ => 3,
    };
    let benches = |alert: &Alert| [alert.bench_a, alert.bench_b];
    let by_clearance = || one.clearance_m.total_cmp(&other.clearance_m);
    rank(one).cmp(&rank(other)).then_with(by_clearance).then_with(|| benches(one).cmp(&benches(other)))
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::FrameHeader;

    use super::*;
    use crate::safety::monitor::run_alert;

    const SECOND_NS: u64 = 1_000_000_000;

    fn alert(kind: AlertKind, bench: u32) -> Alert {
        let clearance_m = f64::from(bench) * 1e-6;
        Alert { clearance_m, bench_a: bench, bench_b: bench + 2, ..run_alert(&FrameHeader::default(), kind) }
    }

    fn near(count: u32) -> Vec<Alert> {
        (0..count).rev().map(|bench| alert(AlertKind::Near, bench)).collect()
    }

    #[test]
    fn alerts_below_the_rate_limit_are_all_sent() {
        let mut limit = AlertLimit::new();
        for second in 1..100 {
            let mut alerts = near(ALERTS_PER_S);
            limit.apply(second * SECOND_NS, &mut alerts);
            assert_eq!(alerts, near(ALERTS_PER_S));
        }
        assert_eq!(limit.suppressed, 0);
    }

    #[test]
    fn flood_keeps_contacts_and_then_the_nearest_pairs_in_their_order() {
        let mut limit = AlertLimit::new();
        let mut alerts = [near(100_000), vec![alert(AlertKind::Contact, 7), alert(AlertKind::Parted, 9)]].concat();
        limit.apply(SECOND_NS, &mut alerts);
        assert_eq!(alerts.len(), ALERT_BURST as usize);
        assert_eq!(alerts[..198], near(198));
        assert_eq!(alerts[198..], [alert(AlertKind::Contact, 7), alert(AlertKind::Parted, 9)]);
        assert_eq!(limit.suppressed, 100_002 - 200);
        let mut at_once = near(5);
        limit.apply(SECOND_NS, &mut at_once);
        assert!(at_once.is_empty());
        let mut later = near(1_000);
        limit.apply(2 * SECOND_NS, &mut later);
        assert_eq!(later, near(100));
    }

    #[test]
    fn first_contact_of_a_run_is_always_sent() {
        let mut limit = AlertLimit::new();
        limit.apply(SECOND_NS, &mut near(100_000));
        let mut alerts = [near(10), vec![alert(AlertKind::Contact, 7), alert(AlertKind::Contact, 1)]].concat();
        limit.apply(SECOND_NS, &mut alerts);
        assert_eq!(alerts, [alert(AlertKind::Contact, 7)], "the first in time");
        let mut alerts = vec![alert(AlertKind::Contact, 3)];
        limit.apply(SECOND_NS, &mut alerts);
        assert!(alerts.is_empty());
        assert_eq!(limit.suppressed, 100_000 - 200 + 11 + 1);
    }
}
