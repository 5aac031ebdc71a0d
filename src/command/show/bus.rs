//! What a show reads of the bus.

use bench_dragon_ipc::{BusError, Domain, FrameSubscriber, ReaderReports, StatusReader};

/// The show's ports.
#[derive(Debug)]
pub(super) struct Bus {
    pub(super) frames: FrameSubscriber,
    pub(super) status: StatusReader,
    readers: ReaderReports,
}

impl Bus {
    /// Opens the ports. They outlive a server: what the next one publishes comes through them, too.
    ///
    /// # Errors
    /// As [`FrameSubscriber::open`], of which the server counts one as a reader.
    pub(super) fn open(domain: &Domain) -> Result<Self, BusError> {
        let status = StatusReader::open(domain, "show-status")?;
        let readers = ReaderReports::open(domain, "show-readers")?;
        // Last, so that everything else is there from the first frame on.
        Ok(Self { frames: FrameSubscriber::open(domain, "show")?, status, readers })
    }

    /// The process ids of the readers that have reported since the last call, and that have not ended.
    pub(super) fn living_readers(&self) -> Vec<u32> {
        // A report that cannot be read is that of a killed reader.
        let reports = std::iter::from_fn(|| self.readers.receive().ok().flatten());
        reports.filter(|report| report.ended == 0).map(|report| report.pid).collect()
    }
}
