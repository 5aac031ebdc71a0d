//! What an observer opens of the bus.

use bench_dragon_ipc::{AlertSubscriber, BusError, DescriptionReader, Domain, FrameSubscriber, StatusReader};

/// A reader of everything.
#[derive(Debug)]
pub(super) struct Ports {
    pub(super) frames: FrameSubscriber,
    pub(super) alerts: AlertSubscriber,
    pub(super) statuses: StatusReader,
    pub(super) descriptions: DescriptionReader,
}

impl Ports {
    /// Opens the frames last, so that from their first one on everything else is there.
    pub(super) fn open(domain: &Domain, name: &str) -> Result<Self, BusError> {
        let descriptions = DescriptionReader::open(domain, &format!("{name}-description"))?;
        let statuses = StatusReader::open(domain, &format!("{name}-status"))?;
        let alerts = AlertSubscriber::open(domain, &format!("{name}-alerts"))?;
        let frames = FrameSubscriber::open(domain, name)?;
        Ok(Self { frames, alerts, statuses, descriptions })
    }
}
