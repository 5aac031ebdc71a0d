//! Reader of the reports that an instance's readers send.

use iceoryx2::port::subscriber::Subscriber;

use crate::domain::{BusError, Domain, require_open_files};
use crate::service::{Member, READERS, REPORT_FILES, Role, Service};
use crate::wire::ReaderReport;

/// Reads the reports of an instance's readers.
///
/// Only the newest report of each reader is kept. Reports count from the reader's beginning, so late or rare reading
/// loses no counts. Reports of readers that ended before this object was opened are not received.
#[derive(Debug)]
pub struct ReaderReports {
    // Dropped before its node.
    subscriber: Subscriber<Service, ReaderReport, ()>,
    _member: Member,
}

impl ReaderReports {
    /// Opens the reports of a domain. Each reader connects to it with its next report.
    ///
    /// # Errors
    /// As [`Member::readers`] and [`Member::join`]; also [`BusError::NoServer`] where the source is of an earlier
    /// version, which does not create this service.
    pub fn open(domain: &Domain, name: &str) -> Result<Self, BusError> {
        require_open_files(REPORT_FILES)?;
        let member = Member::join(domain, name, Role::Client)?;
        let subscriber = member.subscribe(READERS, &member.readers()?)?;
        member.reserve_memory()?;
        Ok(Self { subscriber, _member: member })
    }

    /// Returns the next unread report of any reader, or `None` if all are read. Never waits.
    ///
    /// # Errors
    /// [`BusError::Failed`] where a reader's memory cannot be mapped.
    pub fn receive(&self) -> Result<Option<ReaderReport>, BusError> {
        let sample = self.subscriber.receive().map_err(|error| BusError::failed(READERS, error))?;
        Ok(sample.map(|sample| *sample.payload()))
    }
}
