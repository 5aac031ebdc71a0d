//! The times of processes that followed one another, as those of one.

use bench_dragon_ipc::TimeHistogram;

/// Times that several sources have reported one after the other, each of them all of its own so far.
#[derive(Debug, Default)]
pub(super) struct MergedTimes {
    ended: TimeHistogram,
    /// The source that reports now, and what it has last reported.
    current: Option<(u64, TimeHistogram)>,
}

impl MergedTimes {
    /// Takes the newest report of a source, which replaces its earlier ones. Another source has ended.
    pub(super) fn report(&mut self, source: u64, times: &TimeHistogram) {
        if let Some((_, last)) = self.current.take_if(|(current, _)| *current != source) {
            self.ended.add(&last);
        }
        self.current = Some((source, *times));
    }

    /// The times of all sources.
    pub(super) fn all(&self) -> TimeHistogram {
        let mut all = self.ended;
        self.current.iter().for_each(|(_, times)| all.add(times));
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(times_ns: &[u64]) -> TimeHistogram {
        let mut histogram = TimeHistogram::default();
        for time_ns in times_ns {
            histogram.record(*time_ns);
        }
        histogram
    }

    #[test]
    fn the_newest_report_of_each_source_counts_and_no_other() {
        let mut merged = MergedTimes::default();
        assert_eq!(merged.all(), TimeHistogram::default());
        merged.report(7, &times(&[1]));
        merged.report(7, &times(&[1, 90_000]));
        merged.report(3, &times(&[2]));
        merged.report(3, &times(&[2, 3]));
        assert_eq!(merged.all(), times(&[1, 90_000, 2, 3]));
    }
}
