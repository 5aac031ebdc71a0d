//! Reading what the readers of an instance report.

use iceoryx2::port::subscriber::Subscriber;

use crate::domain::Domain;
use crate::error::BusError;
use crate::open_files::require_open_files;
use crate::reader_report::ReaderReport;
use crate::service::{Member, READERS, REPORT_FILES, Role, Service};

/// Reads the reports of an instance's readers.
///
/// Of each reader only the newest report is kept. Whoever comes late or looks seldom misses nothing by it, since each report
/// counts from the reader's beginning; but not a reader's that ended before.
#[derive(Debug)]
pub struct ReaderReports {
    // Dropped before its node.
    subscriber: Subscriber<Service, ReaderReport, ()>,
    _member: Member,
}

impl ReaderReports {
    /// Opens the reports of a domain. The readers find that there is somebody with their next report.
    ///
    /// # Errors
    /// As [`Member::readers`]; [`BusError::NoServer`] also where the source is one of an earlier version, which makes no such
    /// service.
    pub fn open(domain: &Domain, name: &str) -> Result<Self, BusError> {
        require_open_files(REPORT_FILES)?;
        let member = Member::join(domain, name, Role::Client)?;
        let subscriber =
            member.readers()?.subscriber_builder().create().map_err(|error| BusError::failed(READERS, error))?;
        Ok(Self { subscriber, _member: member })
    }

    /// The next report that has not been read yet, of whichever reader. Never waits.
    ///
    /// # Errors
    /// [`BusError::Failed`] where a reader's memory cannot be mapped.
    pub fn receive(&self) -> Result<Option<ReaderReport>, BusError> {
        let sample = self.subscriber.receive().map_err(|error| BusError::failed(READERS, error))?;
        Ok(sample.map(|sample| *sample.payload()))
    }
}
