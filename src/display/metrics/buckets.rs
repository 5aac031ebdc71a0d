//! A distribution as Prometheus has it: how many times are no longer than each of a few bounds.
//!
//! The bounds are a nanosecond under the powers of two from 2^10 to 2^30 ns, a microsecond to a second. Buckets of a
//! [`TimeHistogram`] end there, so that the counts are those of the times themselves. Their sum is not known; it is taken from the
//! middles of the buckets, each of which is off by 1/64 at most.

use bench_dragon_ipc::TimeHistogram;
use prometheus::proto::{Bucket, Histogram};

/// Exponents of the least and the greatest bound.
const EXPONENTS: std::ops::RangeInclusive<u32> = 10..=30;

/// A distribution of times, in seconds.
pub(super) fn distribution(times: &TimeHistogram) -> Histogram {
    let mut histogram = Histogram::default();
    histogram.set_sample_count(times.count());
    histogram.set_sample_sum(sum_s(times));
    histogram.set_bucket(EXPONENTS.map(|exponent| bucket(times, (1 << exponent) - 1)).collect());
    histogram
}

fn bucket(times: &TimeHistogram, bound_ns: u64) -> Bucket {
    let counted = &times.counts[..=TimeHistogram::bucket_of(bound_ns)];
    let mut bucket = Bucket::default();
    bucket.set_upper_bound(seconds(bound_ns));
    bucket.set_cumulative_count(counted.iter().sum());
    bucket
}

fn sum_s(times: &TimeHistogram) -> f64 {
    let middle_ns = |bucket| {
        let (least, greatest) = TimeHistogram::bounds_ns(bucket);
        // The last bucket has no end but that of the longest time.
        f64::midpoint(least as f64, greatest.min(times.max_ns).max(least) as f64)
    };
    let counts = times.counts.iter().enumerate().filter(|(_, count)| **count > 0);
    counts.map(|(bucket, count)| *count as f64 * middle_ns(bucket)).sum::<f64>() / 1e9
}

fn seconds(nanos: u64) -> f64 {
    nanos as f64 / 1e9
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bound_counts_exactly_the_times_that_are_no_longer() {
        let mut times = TimeHistogram::default();
        let recorded = [0, 1022, 1023, 1024, 1025, 2047, 2048, 70_000, (1 << 30) - 1, 1 << 30, 1 << 40];
        for time in recorded {
            times.record(time);
        }
        let histogram = distribution(&times);
        assert_eq!(histogram.get_sample_count(), recorded.len() as u64);
        for bucket in histogram.get_bucket() {
            let no_longer = recorded.iter().filter(|time| seconds(**time) <= bucket.upper_bound()).count();
            assert_eq!(bucket.cumulative_count(), no_longer as u64, "{}", bucket.upper_bound());
        }
        assert_eq!(histogram.get_bucket().first().map(Bucket::upper_bound), Some(0.000_001_023));
        assert_eq!(histogram.get_bucket().last().map(Bucket::upper_bound), Some(1.073_741_823));
    }

    #[test]
    fn the_sum_is_off_by_a_sixty_fourth_at_most() {
        let mut times = TimeHistogram::default();
        let recorded: Vec<u64> = (1..1000).map(|time| time * time * 100).collect();
        for &time in &recorded {
            times.record(time);
        }
        let exact = recorded.iter().map(|&time| seconds(time)).sum::<f64>();
        let sum = distribution(&times).get_sample_sum();
        assert!((sum - exact).abs() <= exact / 64.0, "{sum}, really {exact}");
        assert_eq!(distribution(&TimeHistogram::default()).get_sample_sum(), 0.0);
    }
}
