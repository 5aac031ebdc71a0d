//! What an observer opens of the bus.

use bench_dragon_ipc::{
    AlertSubscriber, BusError, CommandEventReader, DescriptionReader, Domain, FrameSubscriber, ReaderReports,
    StatusReader,
};

/// A reader of everything.
#[derive(Debug)]
pub(super) struct Ports {
    pub(super) frames: FrameSubscriber,
    pub(super) alerts: AlertSubscriber,
    pub(super) statuses: StatusReader,
    pub(super) descriptions: DescriptionReader,
    /// A source of an earlier version has none.
    pub(super) reports: Option<ReaderReports>,
    /// A source of an earlier version has none.
    pub(super) commands: Option<CommandEventReader>,
}

impl Ports {
    /// Opens the frames last, so that from their first one on everything else is there; and then what may be missing for good,
    /// since whoever makes frames has made it before.
    pub(super) fn open(domain: &Domain, name: &str) -> Result<Self, BusError> {
        let descriptions = DescriptionReader::open(domain, &format!("{name}-description"))?;
        let statuses = StatusReader::open(domain, &format!("{name}-status"))?;
        let alerts = AlertSubscriber::open(domain, &format!("{name}-alerts"))?;
        let frames = FrameSubscriber::open(domain, name)?;
        let reports = if_there(ReaderReports::open(domain, &format!("{name}-reports")))?;
        let commands = if_there(CommandEventReader::open(domain, &format!("{name}-events")))?;
        Ok(Self { frames, alerts, statuses, descriptions, reports, commands })
    }
}

fn if_there<Port>(opened: Result<Port, BusError>) -> Result<Option<Port>, BusError> {
    match opened {
        Ok(port) => Ok(Some(port)),
        Err(error) if error.is_absent() => Ok(None),
        Err(error) => Err(error),
    }
}
