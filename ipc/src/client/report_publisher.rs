//! Keeps a reader's report up to date and sends it about once a second.

use iceoryx2::port::publisher::Publisher;
use iceoryx2::prelude::BackpressureStrategy;

use crate::service::{Member, Service};
use crate::wire::{FrameHeader, ReaderReport};

/// Period of the reports, in nanoseconds.
const PERIOD_NS: u64 = 1_000_000_000;

/// Counts the frames of a reader, and reports them.
///
/// Reports are optional. The service may be missing (as with a source of an earlier version), have its greatest number of
/// readers, or fail. Then the reader sends no reports and reads frames as usual.
#[derive(Debug)]
pub(crate) struct ReportPublisher {
    publisher: Option<Publisher<Service, ReaderReport, ()>>,
    report: ReaderReport,
    /// Last report that was sent.
    sent: ReaderReport,
    /// Value of `ended` in the last report.
    ending: u32,
}

impl ReportPublisher {
    /// Opens the reports of the reader with this name and number.
    pub(crate) fn open(member: &Member, name: &str, reader: u128) -> Self {
        let mut report = ReaderReport {
            reader: [reader as u64, (reader >> 64) as u64],
            pid: std::process::id(),
            ..ReaderReport::default()
        };
        report.set_name(name);
        let publisher = member.readers().ok().and_then(|readers| {
            let builder = readers.publisher_builder().max_loaned_samples(1);
            builder.backpressure_strategy(BackpressureStrategy::DiscardData).create().ok()
        });
        Self { publisher, sent: report, report, ending: 1 }
    }

    /// Counts a frame, and stores the total number of lost frames.
    pub(crate) fn count(&mut self, header: &FrameHeader, lost: u64) {
        let ReaderReport { run_id, frames, sent_ns, .. } = &mut self.report;
        (*run_id, *sent_ns) = (header.run_id, header.published_ns);
        *frames += 1;
        self.report.lost = lost;
    }

    /// Stores the total number of bytes written.
    pub(crate) fn set_bytes_written(&mut self, bytes: u64) {
        self.report.bytes_written = bytes;
    }

    /// Stores the wall time until the disk is full, in seconds.
    pub(crate) fn set_room(&mut self, room_s: f64) {
        self.report.room_s = room_s;
    }

    /// Makes the last report say that the reader ends because its disk is full.
    pub(crate) fn set_disk_full(&mut self) {
        (self.report.room_s, self.ending) = (0.0, ReaderReport::DISK_FULL);
    }

    /// Whether the last report is at least this many periods old. Time is read from the frames, so this also works across
    /// a restart of the source.
    pub(crate) fn is_due(&self, periods: u64) -> bool {
        self.report.sent_ns.abs_diff(self.sent.sent_ns) >= periods * PERIOD_NS
    }

    /// Sends the report, if it has changed. Never waits.
    pub(crate) fn send(&mut self) {
        if self.report == self.sent {
            return;
        }
        self.sent = self.report;
        if let Some(publisher) = &self.publisher {
            // The next report contains the same counts, so a failed send is ignored.
            let _ = publisher.send_copy(self.report);
        }
    }
}

impl ReportPublisher {
    /// Sends the last report, if the reader has read a frame.
    fn end(&mut self) {
        if self.report.frames > 0 {
            self.report.ended = self.ending;
            self.send();
        }
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
        ReportPublisher { publisher: None, report: ReaderReport::default(), sent: ReaderReport::default(), ending: 1 }
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
        assert_eq!((reports.sent.frames, reports.sent.lost, reports.sent.run_id), (31, 3, 7));
    }

    #[test]
    fn the_last_report_is_marked_as_last_and_is_not_sent_without_frames() {
        let mut silent = report_publisher();
        silent.end();
        assert_eq!(silent.sent, ReaderReport::default());
        let mut reports = report_publisher();
        reports.count(&frame(PERIOD_NS), 0);
        reports.send();
        assert_eq!((reports.sent.frames, reports.sent.ended), (1, 0));
        reports.end();
        assert_eq!((reports.sent.frames, reports.sent.ended), (1, 1));
    }

    #[test]
    fn the_last_report_of_a_reader_with_a_full_disk_says_so() {
        let mut reports = report_publisher();
        reports.count(&frame(PERIOD_NS), 0);
        reports.send();
        assert!(!reports.sent.has_full_disk());
        reports.set_disk_full();
        reports.end();
        assert_eq!((reports.sent.ended, reports.sent.has_full_disk()), (ReaderReport::DISK_FULL, true));
    }
}
