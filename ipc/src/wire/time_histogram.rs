//! A distribution of times: the number of times in each of a fixed row of buckets.
//!
//! The buckets are those of an HDR histogram with five bits. Below 64 ns each bucket is 1 ns wide. From there on, every
//! octave has 32 buckets of equal width, so a bucket's width is at most 1/32 of its least value. The last bucket also has
//! all times above [`TimeHistogram::LIMIT_NS`].

use iceoryx2::prelude::ZeroCopySend;
use zerocopy::{Immutable, IntoBytes, KnownLayout};

/// Number of bits of a bucket's index within its octave.
const SUB_BITS: u32 = 5;
/// Number of buckets per octave.
const SUB_BUCKETS: usize = 1 << SUB_BITS;
/// Number of bits of the longest time with a bucket of its own.
const LIMIT_BITS: u32 = 36;

/// Counts of times per bucket.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, ZeroCopySend, IntoBytes, Immutable, KnownLayout)]
#[type_name("bench_dragon.TimeHistogram.v1")]
pub struct TimeHistogram {
    /// The longest time, exact, in nanoseconds; 0 without any time.
    pub max_ns: u64,
    /// Number of times in each bucket. [`TimeHistogram::bounds_ns`] returns a bucket's bounds.
    pub counts: [u64; Self::BUCKETS],
}

const _: () = assert!(size_of::<TimeHistogram>() == 8200 && align_of::<TimeHistogram>() == 8);

impl TimeHistogram {
    /// Number of buckets.
    pub const BUCKETS: usize = SUB_BUCKETS * (LIMIT_BITS - SUB_BITS + 1) as usize;
    /// Limit of the buckets in nanoseconds, about 68.7 s. All longer times share the last bucket.
    pub const LIMIT_NS: u64 = 1 << LIMIT_BITS;

    /// Returns the bucket of a time.
    ///
    /// ```
    /// use bench_dragon_ipc::TimeHistogram;
    /// assert_eq!(TimeHistogram::bucket_of(63), 63);
    /// assert_eq!(TimeHistogram::bucket_of(64), TimeHistogram::bucket_of(65));
    /// assert_eq!(TimeHistogram::bucket_of(u64::MAX), TimeHistogram::BUCKETS - 1);
    /// ```
    pub const fn bucket_of(time_ns: u64) -> usize {
        if time_ns < SUB_BUCKETS as u64 {
            return time_ns as usize;
        }
        if time_ns >= Self::LIMIT_NS {
            return Self::BUCKETS - 1;
        }
        let shift = time_ns.ilog2() - SUB_BITS;
        (shift as usize) * SUB_BUCKETS + (time_ns >> shift) as usize
    }

    /// Returns the least and the greatest time of a bucket, in nanoseconds. The last bucket has no limit: its greatest
    /// time is [`u64::MAX`].
    ///
    /// ```
    /// use bench_dragon_ipc::TimeHistogram;
    /// let bucket = TimeHistogram::bucket_of(5000);
    /// assert_eq!(TimeHistogram::bounds_ns(bucket), (4992, 5119));
    /// ```
    ///
    /// # Panics
    /// If `bucket` is [`TimeHistogram::BUCKETS`] or more.
    pub const fn bounds_ns(bucket: usize) -> (u64, u64) {
        assert!(bucket < Self::BUCKETS, "the bucket must be under BUCKETS");
        let shift = (bucket / SUB_BUCKETS).saturating_sub(1);
        let least = ((bucket - shift * SUB_BUCKETS) as u64) << shift;
        let greatest = if bucket == Self::BUCKETS - 1 { u64::MAX } else { least + (1 << shift) - 1 };
        (least, greatest)
    }

    /// Counts one time.
    pub fn record(&mut self, time_ns: u64) {
        self.counts[Self::bucket_of(time_ns)] += 1;
        self.max_ns = self.max_ns.max(time_ns);
    }

    /// Adds all times of another histogram.
    pub fn add(&mut self, other: &Self) {
        for (count, more) in self.counts.iter_mut().zip(&other.counts) {
            *count += more;
        }
        self.max_ns = self.max_ns.max(other.max_ns);
    }

    /// Returns the number of counted times.
    pub fn count(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// Returns the time that the given share of all times, from 0 to 1, does not exceed, in nanoseconds; 0 without any
    /// time.
    ///
    /// The result is the greatest time of its bucket, or the longest time if that is less. So it is never too small, and
    /// at most 1/32 too large.
    pub fn quantile_ns(&self, share: f64) -> u64 {
        let rank = ((self.count() as f64 * share).ceil() as u64).max(1);
        let mut counted = 0;
        let bucket = self.counts.iter().position(|count| {
            counted += count;
            counted >= rank
        });
        bucket.map_or(0, |bucket| Self::bounds_ns(bucket).1.min(self.max_ns))
    }
}

impl Default for TimeHistogram {
    fn default() -> Self {
        Self { max_ns: 0, counts: [0; Self::BUCKETS] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_buckets_lie_side_by_side_from_0_on() {
        let mut next = 0;
        for bucket in 0..TimeHistogram::BUCKETS {
            let (least, greatest) = TimeHistogram::bounds_ns(bucket);
            assert_eq!(least, next);
            assert_eq!((TimeHistogram::bucket_of(least), TimeHistogram::bucket_of(greatest)), (bucket, bucket));
            next = greatest.wrapping_add(1);
        }
        assert_eq!(next, 0, "the last bucket has no limit");
    }

    #[test]
    fn a_bucket_is_at_most_a_thirty_second_of_its_least_time_wide() {
        for bucket in 0..TimeHistogram::BUCKETS - 1 {
            let (least, greatest) = TimeHistogram::bounds_ns(bucket);
            assert!((greatest - least) * 32 <= least, "from {least} to {greatest}");
        }
    }

    #[test]
    fn a_quantile_is_never_too_small_and_at_most_a_thirty_second_too_large() {
        let times: Vec<u64> = (1..=1000).map(|time| time * time * 7).collect();
        let mut histogram = TimeHistogram::default();
        for &time in &times {
            histogram.record(time);
        }
        for (share, exact) in [(0.001, times[0]), (0.5, times[499]), (0.99, times[989]), (0.999, times[998])] {
            let quantile = histogram.quantile_ns(share);
            assert!(exact <= quantile && quantile <= exact + exact / 32, "{share}: {quantile}, exact {exact}");
        }
        assert_eq!((histogram.quantile_ns(1.0), histogram.count()), (7_000_000, 1000));
    }

    #[test]
    fn quantiles_of_an_empty_histogram_are_zero() {
        let nothing = TimeHistogram::default();
        assert_eq!((nothing.count(), nothing.quantile_ns(0.5), nothing.max_ns), (0, 0, 0));
    }

    #[test]
    fn a_time_beyond_the_limit_keeps_its_length_as_the_longest() {
        let mut histogram = TimeHistogram::default();
        histogram.record(TimeHistogram::LIMIT_NS * 10);
        assert_eq!(histogram.quantile_ns(0.5), TimeHistogram::LIMIT_NS * 10);
    }

    #[test]
    fn added_histograms_count_as_if_their_times_were_recorded() {
        let mut together = TimeHistogram::default();
        let (mut sum, mut other) = (TimeHistogram::default(), TimeHistogram::default());
        for (one, another) in [(3, 70_000), (5, 1 << 40)] {
            sum.record(one);
            other.record(another);
            together.record(one);
            together.record(another);
        }
        sum.add(&other);
        assert_eq!(sum, together);
    }
}
