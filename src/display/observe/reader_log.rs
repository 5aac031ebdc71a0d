//! The reports of the bus's readers, summed by name.

use std::collections::{BTreeMap, VecDeque};

use bench_dragon_ipc::ReaderReport;

/// Greatest number of readers whose last reports are kept: several times the bus's limit of readers.
const KEPT_READERS: usize = 128;
/// Greatest number of names that are kept.
const KEPT_NAMES: usize = 64;

/// The sums of the reports of all readers of one name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names of the fields describe them")]
pub struct ReaderCount {
    /// Number of readers, one after another or side by side.
    pub readers: u64,
    pub frames: u64,
    pub lost: u64,
    pub bytes_written: u64,
    /// Instant of the newest report of any of these readers, in nanoseconds of `CLOCK_MONOTONIC`.
    pub sent_ns: u64,
}

/// The counts of all readers that have reported, by name. They only grow. At 65 names, the log drops the name whose last
/// report is the oldest.
#[derive(Clone, Debug, Default)]
pub struct ReaderLog {
    counts: BTreeMap<String, ReaderCount>,
    /// The readers in the order of their last reports, the newest at the end.
    readers: VecDeque<Heard>,
}

/// A reader that has reported.
#[derive(Clone, Copy, Debug, Default)]
struct Heard {
    /// The reader's last report.
    report: ReaderReport,
    /// Instant of the reader's first received report, in nanoseconds of `CLOCK_MONOTONIC`.
    since_ns: u64,
}

impl ReaderLog {
    /// Records the next report.
    pub fn push(&mut self, report: ReaderReport) {
        let earlier = self.readers.iter().position(|known| known.report.reader == report.reader);
        let earlier = earlier.and_then(|index| self.readers.remove(index));
        if self.readers.len() == KEPT_READERS {
            self.readers.pop_front();
        }
        self.readers.push_back(Heard { report, since_ns: earlier.map_or(report.sent_ns, |known| known.since_ns) });
        let since = earlier.unwrap_or_default().report;
        let count = self.counts.entry(report.name().to_owned()).or_default();
        count.readers += u64::from(earlier.is_none());
        count.frames += report.frames.saturating_sub(since.frames);
        count.lost += report.lost.saturating_sub(since.lost);
        count.bytes_written += report.bytes_written.saturating_sub(since.bytes_written);
        count.sent_ns = report.sent_ns;
        if self.counts.len() > KEPT_NAMES {
            self.forget_one();
        }
    }

    /// The readers' names and their counts, in order of the names.
    pub fn counts(&self) -> impl Iterator<Item = (&str, &ReaderCount)> {
        self.counts.iter().map(|(name, count)| (name.as_str(), count))
    }

    /// The last reports of the readers that have not ended, in the order in which they arrived. A reader is left out as
    /// replaced if another reader of its name sent its first report after this reader's last one.
    pub fn awaited(&self) -> impl Iterator<Item = &ReaderReport> {
        let is_replaced = |silent: &Heard| {
            let mut of_name = self.readers.iter().filter(|heard| heard.report.name() == silent.report.name());
            of_name.any(|other| other.since_ns > silent.report.sent_ns)
        };
        let awaited = self.readers.iter().filter(move |heard| heard.report.ended == 0 && !is_replaced(heard));
        awaited.map(|heard| &heard.report)
    }

    /// The newest report of a reader of this name, also of one that has ended.
    pub fn newest(&self, name: &str) -> Option<&ReaderReport> {
        self.readers.iter().rev().map(|heard| &heard.report).find(|report| report.name() == name)
    }

    /// The names of readers that have not ended, in order. The instant is that of the oldest last report among the readers of a
    /// name, in nanoseconds of `CLOCK_MONOTONIC`: so a living reader does not hide a killed one of the same name.
    pub fn silent_since(&self) -> impl Iterator<Item = (&str, u64)> {
        self.counts.keys().filter_map(|name| {
            let of_name = self.awaited().filter(|report| report.name() == name);
            Some((name.as_str(), of_name.map(|report| report.sent_ns).min()?))
        })
    }

    fn forget_one(&mut self) {
        let oldest = self.counts.iter().min_by_key(|(_, count)| count.sent_ns).map(|(name, _)| name.clone());
        if let Some(name) = oldest {
            self.counts.remove(&name);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(name: &str, reader: u64, frames: u64, sent_ns: u64) -> ReaderReport {
        let mut report = ReaderReport { reader: [reader, 0], frames, lost: frames / 10, sent_ns, ..Default::default() };
        report.set_name(name);
        report
    }

    #[test]
    fn the_counts_of_a_name_are_sums_over_its_readers() {
        let mut log = ReaderLog::default();
        for (reader, frames) in [(1, 100), (2, 20), (1, 150), (2, 20), (3, 7)] {
            log.push(report("desk", reader, frames, frames));
        }
        log.push(ReaderReport { bytes_written: 5, ..report("record", 9, 1, 3) });
        let counts: Vec<(&str, ReaderCount)> = log.counts().map(|(name, count)| (name, *count)).collect();
        let desk = ReaderCount { readers: 3, frames: 177, lost: 17, bytes_written: 0, sent_ns: 7 };
        let record = ReaderCount { readers: 1, frames: 1, lost: 0, bytes_written: 5, sent_ns: 3 };
        assert_eq!(counts, [("desk", desk), ("record", record)]);
    }

    #[test]
    fn readers_that_ended_or_were_replaced_are_not_silent() {
        let silent = |reports: &[ReaderReport]| {
            let mut log = ReaderLog::default();
            for &report in reports {
                log.push(report);
            }
            log.silent_since().next().map(|(_, sent_ns)| sent_ns)
        };
        let [of_one, of_other] = [1, 2].map(|reader| move |sent_ns| report("record", reader, 1, sent_ns));
        let ended = |report| ReaderReport { ended: 1, ..report };
        assert_eq!(silent(&[of_one(1), of_one(5)]), Some(5));
        assert_eq!(silent(&[of_one(1), ended(of_one(5))]), None);
        assert_eq!(silent(&[of_one(1), of_other(2), of_one(3), of_other(9)]), Some(3), "killed beside a living reader");
        assert_eq!(silent(&[of_one(1), of_other(2), ended(of_one(3)), of_other(9)]), Some(9));
        assert_eq!(silent(&[of_one(1), of_other(2), of_other(9)]), Some(9), "killed, and started again");
        assert_eq!(
            silent(&[of_one(1), of_other(2), ended(of_other(9))]),
            None,
            "the reader that replaced it has ended"
        );
    }

    #[test]
    fn only_the_newest_names_and_readers_are_kept() {
        let mut log = ReaderLog::default();
        for reader in 0..1000 {
            log.push(report(&format!("reader-{reader:04}"), reader, 1, reader));
        }
        assert_eq!(log.counts().map(|(name, _)| name).next(), Some("reader-0936"));
        assert_eq!((log.counts().count(), log.readers.len()), (KEPT_NAMES, KEPT_READERS));
    }
}
