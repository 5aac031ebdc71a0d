//! A distribution of times as it is on the wire: how many lie in each of a fixed row of buckets.
//!
//! The buckets are those of an HDR histogram with five bits: below 64 ns each is one nanosecond wide, and from there on every
//! octave is cut into 32 of equal width, so that a bucket is at most 1/32 as wide as its least value. What takes longer than
//! [`TimeHistogram::LIMIT_NS`] is in the last one.

use iceoryx2::prelude::ZeroCopySend;

/// A bucket's index has so many bits below its octave.
const SUB_BITS: u32 = 5;
/// Buckets an octave.
const SUB_BUCKETS: usize = 1 << SUB_BITS;
/// Bits of the longest time that is told apart.
const LIMIT_BITS: u32 = 36;

/// Times, each counted in the bucket that it lies in.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, ZeroCopySend)]
#[type_name("bench_dragon.TimeHistogram.v1")]
pub struct TimeHistogram {
    /// The longest time, exactly, in nanoseconds; 0 where there is none.
    pub max_ns: u64,
    /// How many times lie in each bucket, of which [`TimeHistogram::bounds_ns`] tells the bounds.
    pub counts: [u64; Self::BUCKETS],
}

const _: () = assert!(size_of::<TimeHistogram>() == 8200 && align_of::<TimeHistogram>() == 8);

impl TimeHistogram {
    /// How many buckets there are.
    pub const BUCKETS: usize = SUB_BUCKETS * (LIMIT_BITS - SUB_BITS + 1) as usize;
    /// From here on times are not told apart: 68.7 s, in nanoseconds.
    pub const LIMIT_NS: u64 = 1 << LIMIT_BITS;

    /// The bucket that a time lies in.
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

    /// The least and the greatest time of a bucket, in nanoseconds. The last one has no greatest: [`u64::MAX`].
    ///
    /// ```
    /// use bench_dragon_ipc::TimeHistogram;
    /// let bucket = TimeHistogram::bucket_of(5000);
    /// assert_eq!(TimeHistogram::bounds_ns(bucket), (4992, 5119));
    /// ```
    ///
    /// # Panics
    /// Where there is no such bucket.
    pub const fn bounds_ns(bucket: usize) -> (u64, u64) {
        assert!(bucket < Self::BUCKETS, "no such bucket");
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

    /// Adds all times of another.
    pub fn add(&mut self, other: &Self) {
        for (count, more) in self.counts.iter_mut().zip(&other.counts) {
            *count += more;
        }
        self.max_ns = self.max_ns.max(other.max_ns);
    }

    /// How many times have been counted.
    pub fn count(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// The time that this share of all, from 0 to 1, does not exceed, in nanoseconds; 0 where there is none.
    ///
    /// It is the greatest of its bucket, or of all where that is less: never too little, and too much by 1/32 at most.
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
        assert_eq!(next, 0, "the last one has no end");
    }

    #[test]
    fn a_bucket_is_at_most_a_thirty_second_of_its_least_time_wide() {
        for bucket in 0..TimeHistogram::BUCKETS - 1 {
            let (least, greatest) = TimeHistogram::bounds_ns(bucket);
            assert!((greatest - least) * 32 <= least, "from {least} to {greatest}");
        }
    }

    #[test]
    fn a_quantile_is_never_too_little_and_too_much_by_a_thirty_second_at_most() {
        let times: Vec<u64> = (1..=1000).map(|time| time * time * 7).collect();
        let mut histogram = TimeHistogram::default();
        for &time in &times {
            histogram.record(time);
        }
        for (share, exact) in [(0.001, times[0]), (0.5, times[499]), (0.99, times[989]), (0.999, times[998])] {
            let quantile = histogram.quantile_ns(share);
            assert!(exact <= quantile && quantile <= exact + exact / 32, "{share}: {quantile}, really {exact}");
        }
        assert_eq!((histogram.quantile_ns(1.0), histogram.count()), (7_000_000, 1000));
    }

    #[test]
    fn nothing_counted_has_no_quantiles() {
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
    fn what_is_added_is_counted_as_if_recorded() {
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
