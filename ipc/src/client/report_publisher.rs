//! Keeps a reader's report up to date and sends it about once a second.

use iceoryx2::port::publisher::Publisher;
use iceoryx2::prelude::BackpressureStrategy;

use crate::service::{Member, Service};
use crate::wire::{FrameHeader, ReaderReport};

/// Period of the reports, in nanoseconds.
const PERIOD_NS: u64 = 1_000_000_000;

/// The report of a reader, which counts its frames.
#[derive(Clone, Debug)]
pub struct ReportCount {
    report: ReaderReport,
    /// Last report that was sent.
    sent: ReaderReport,
    /// Value of `ended` in the last report.
    ending: u32,
}

impl ReportCount {
    /// The report of the reader with this name, number and process, before its first frame.
    pub fn new(name: &str, reader: u128, pid: u32) -> Self {
        let mut report =
            ReaderReport { reader: [reader as u64, (reader >> 64) as u64], pid, ..ReaderReport::default() };
        report.set_name(name);
        Self { report, sent: report, ending: 1 }
    }

    /// Counts a frame, and stores the total number of lost frames.
    pub fn count(&mut self, header: &FrameHeader, lost: u64) {
        let ReaderReport { run_id, frames, sent_ns, .. } = &mut self.report;
        (*run_id, *sent_ns) = (header.run_id, header.published_ns);
        *frames += 1;
        self.report.lost = lost;
    }

    /// Makes the last report say that the reader ends because its disk is full.
    pub fn set_disk_full(&mut self) {
        (self.report.room_s, self.ending) = (0.0, ReaderReport::DISK_FULL);
    }

    /// Whether the last report is at least this many periods old. Time is read from the frames, so this also works across
    /// a restart of the source.
    pub fn is_due(&self, periods: u64) -> bool {
        self.report.sent_ns.abs_diff(self.sent.sent_ns) >= periods * PERIOD_NS
    }

    /// Takes the report to be sent; `None` if it has not changed.
    pub fn take(&mut self) -> Option<ReaderReport> {
        let is_new = self.report != self.sent;
        self.sent = self.report;
        is_new.then_some(self.report)
    }

    /// Takes the last report; `None` if the reader has read no frame.
    pub fn take_last(&mut self) -> Option<ReaderReport> {
        if self.report.frames == 0 {
            return None;
        }
        self.report.ended = self.ending;
        self.take()
    }
}

/// Counts the frames of a reader, and reports them.
///
/// Reports are optional. The service may be missing (as with a source of an earlier version), have its greatest number of
/// readers, or fail. Then the reader sends no reports and reads frames as usual.
#[derive(Debug)]
pub(crate) struct ReportPublisher {
    publisher: Option<Publisher<Service, ReaderReport, ()>>,
    count: ReportCount,
}

impl ReportPublisher {
    /// Opens the reports of the reader with this name and number.
    pub(crate) fn open(member: &Member, name: &str, reader: u128) -> Self {
        let publisher = member.readers().ok().and_then(|readers| {
            let builder = readers.publisher_builder().max_loaned_samples(1);
            builder.backpressure_strategy(BackpressureStrategy::DiscardData).create().ok()
        });
        Self { publisher, count: ReportCount::new(name, reader, std::process::id()) }
    }

    /// Counts a frame, and stores the total number of lost frames.
    pub(crate) fn count(&mut self, header: &FrameHeader, lost: u64) {
        self.count.count(header, lost);
    }

    /// Stores the total number of bytes written.
    pub(crate) fn set_bytes_written(&mut self, bytes: u64) {
        self.count.report.bytes_written = bytes;
    }

    /// Stores the wall time until the disk is full, in seconds.
    pub(crate) fn set_room(&mut self, room_s: f64) {
        self.count.report.room_s = room_s;
    }

    /// Makes the last report say that the reader ends because its disk is full.
    pub(crate) fn set_disk_full(&mut self) {
        self.count.set_disk_full();
    }

    /// Whether the last report is at least this many periods old. Time is read from the frames, so this also works across
    /// a restart of the source.
    pub(crate) fn is_due(&self, periods: u64) -> bool {
        self.count.is_due(periods)
    }

    /// Sends the report, if it has changed. Never waits.
    pub(crate) fn send(&mut self) {
        let report = self.count.take();
        self.publish(report);
    }

    fn publish(&self, report: Option<ReaderReport>) {
        if let (Some(publisher), Some(report)) = (&self.publisher, report) {
            // The next report contains the same counts, so a failed send is ignored.
            let _ = publisher.send_copy(report);
        }
    }
}

impl ReportPublisher {
    /// Sends the last report, if the reader has read a frame.
    fn end(&mut self) {
        let last = self.count.take_last();
        self.publish(last);
    }
}

impl Drop for ReportPublisher {
    fn drop(&mut self) {
        self.end();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report_publisher() -> ReportPublisher {
        let count = ReportCount { report: ReaderReport::default(), sent: ReaderReport::default(), ending: 1 };
        ReportPublisher { publisher: None, count }
    }

    fn frame(published_ns: u64) -> FrameHeader {
        FrameHeader { run_id: 7, published_ns, ..FrameHeader::default() }
    }

    #[test]
    fn a_report_is_due_at_the_first_frame_and_a_second_of_frames_later() {
        let mut reports = report_publisher();
        assert!(!reports.is_due(1), "nothing has been read");
        let due: Vec<u64> = (0..40)
            .map(|tick| 77 * PERIOD_NS + tick * PERIOD_NS / 10)
            .filter(|&published_ns| {
                reports.count(&frame(published_ns), 3);
                let is_due = reports.is_due(1);
                if is_due {
                    reports.send();
                }
                is_due
            })
            .collect();
        assert_eq!(due, [77, 78, 79, 80].map(|second| second * PERIOD_NS));
        assert_eq!((reports.count.sent.frames, reports.count.sent.lost, reports.count.sent.run_id), (31, 3, 7));
    }

    #[test]
    fn the_last_report_is_marked_as_last_and_is_not_sent_without_frames() {
        let mut silent = report_publisher();
        silent.end();
        assert_eq!(silent.count.sent, ReaderReport::default());
        let mut reports = report_publisher();
        reports.count(&frame(PERIOD_NS), 0);
        reports.send();
        assert_eq!((reports.count.sent.frames, reports.count.sent.ended), (1, 0));
        reports.end();
        assert_eq!((reports.count.sent.frames, reports.count.sent.ended), (1, 1));
    }

    #[test]
    fn the_last_report_of_a_reader_with_a_full_disk_says_so() {
        let mut reports = report_publisher();
        reports.count(&frame(PERIOD_NS), 0);
        reports.send();
        assert!(!reports.count.sent.has_full_disk());
        reports.set_disk_full();
        reports.end();
        assert_eq!((reports.count.sent.ended, reports.count.sent.has_full_disk()), (ReaderReport::DISK_FULL, true));
    }
}
