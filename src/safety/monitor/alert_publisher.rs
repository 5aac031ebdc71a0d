//! Publishing alerts.

use bench_dragon_ipc::service::{self, Member, Role, Service};
use bench_dragon_ipc::{Alert, BusError, Domain, require_shared_memory};
use iceoryx2::port::notifier::{Notifier, NotifierCreateError};
use iceoryx2::port::publisher::{Publisher, PublisherCreateError};

/// Puts alerts on an instance's bus.
#[derive(Debug)]
pub struct AlertPublisher {
    // Dropped in this order: ports before the node that they belong to.
    publisher: Publisher<Service, Alert, ()>,
    notifier: Notifier<Service>,
    _member: Member,
}

impl AlertPublisher {
    /// Opens the alerts of a domain.
    ///
    /// # Errors
    /// [`BusError::SharedMemoryFull`], and as [`Member::alerts`]; more monitors than [`service::MAX_MONITORS`] are refused.
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
        Ok(Self { publisher, notifier, _member: member })
    }

    /// Publishes one alert and wakes its readers.
    ///
    /// # Errors
    /// [`BusError::Failed`] where iceoryx2 has no memory left, which the limits of the service rule out.
    pub fn publish(&self, alert: &Alert) -> Result<(), BusError> {
        self.publisher.send_copy(*alert).map_err(|error| BusError::failed(service::ALERTS, error))?;
        // A reader that is gone or whose wake-ups are full is its own affair.
        let _ = self.notifier.notify();
        Ok(())
    }
}
