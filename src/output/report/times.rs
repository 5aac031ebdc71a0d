//! A distribution of times as a line of JSON carries it.

use bench_dragon_ipc::TimeHistogram;
use serde::{Deserialize, Serialize};

/// A [`TimeHistogram`] without its empty buckets.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TimesReport {
    /// The longest time, exactly, in nanoseconds.
    pub max_ns: u64,
    /// Of each bucket that is not empty, its least time in nanoseconds, and how many times lie in it.
    pub counts: Vec<(u64, u64)>,
}

impl From<&TimeHistogram> for TimesReport {
    fn from(histogram: &TimeHistogram) -> Self {
        let counts = histogram.counts.iter().enumerate().filter(|(_, count)| **count > 0);
        Self {
            max_ns: histogram.max_ns,
            counts: counts.map(|(bucket, count)| (TimeHistogram::bounds_ns(bucket).0, *count)).collect(),
        }
    }
}

impl From<&TimesReport> for TimeHistogram {
    fn from(report: &TimesReport) -> Self {
        let mut histogram = Self { max_ns: report.max_ns, ..Self::default() };
        for (least_ns, count) in &report.counts {
            let bucket = &mut histogram.counts[Self::bucket_of(*least_ns)];
            *bucket = bucket.saturating_add(*count);
        }
        histogram
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_distribution_is_carried_whole() {
        let mut histogram = TimeHistogram::default();
        for time_ns in [0, 63, 64, 5000, 5001, 123_456_789, TimeHistogram::LIMIT_NS * 3] {
            histogram.record(time_ns);
        }
        let report = TimesReport::from(&histogram);
        assert_eq!(report.counts[3], (4992, 2));
        let line = serde_json::to_string(&report).expect("numbers");
        let read: TimesReport = serde_json::from_str(&line).expect("its own line");
        assert_eq!(TimeHistogram::from(&read), histogram);
    }
}
