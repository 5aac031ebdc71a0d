//! The mapping from `CLOCK_MONOTONIC` to Unix time.
//!
//! On Linux the two clocks run at one rate, since `adjtimex` slews both alike. Their difference changes only where somebody sets
//! the wall clock. So one difference serves for as long as it agrees with later readings. A difference that was measured anew
//! for each use would jitter by the time that a busy machine takes between two readings.

use super::clock::offset_bounds;

/// Readings at the start. The shortest of them bounds the difference best.
const READINGS: usize = 16;
/// A kernel rounds the two clocks apart from each other, and to less than this.
const ROUNDING_NS: i64 = 1_000;

/// The interval that contains the difference of Unix time and `CLOCK_MONOTONIC`, in nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OffsetBounds {
    least_ns: i64,
    greatest_ns: i64,
}

impl OffsetBounds {
    /// Returns the bounds from a reading of the wall clock between two readings of `CLOCK_MONOTONIC`.
    pub fn new(before_ns: u64, unix_ns: i64, after_ns: u64) -> Self {
        Self { least_ns: unix_ns - after_ns as i64, greatest_ns: unix_ns - before_ns as i64 }
    }

    fn width_ns(self) -> i64 {
        self.greatest_ns - self.least_ns
    }

    fn contain(self, offset_ns: i64) -> bool {
        (self.least_ns - ROUNDING_NS..=self.greatest_ns + ROUNDING_NS).contains(&offset_ns)
    }

    fn middle_ns(self) -> i64 {
        self.least_ns + self.width_ns() / 2
    }
}

/// The difference of Unix time and `CLOCK_MONOTONIC`: constant until somebody sets the wall clock.
///
/// ```
/// use bench_dragon::system::unix_offset::{OffsetBounds, UnixOffset};
///
/// let mut offset = UnixOffset::new(OffsetBounds::new(1_000, 501_050, 1_100));
/// assert_eq!(offset.ns(), 500_000);
/// // A busy machine: a millisecond passed between the readings.
/// offset.correct(OffsetBounds::new(2_000_000, 2_500_900, 3_000_000));
/// assert_eq!(offset.ns(), 500_000);
/// // Somebody has set the wall clock a second forward.
/// offset.correct(OffsetBounds::new(4_000_000, 1_004_500_050, 4_000_100));
/// assert_eq!(offset.ns(), 1_000_500_000);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnixOffset {
    ns: i64,
}

impl UnixOffset {
    /// Returns the middle of the bounds.
    pub fn new(bounds: OffsetBounds) -> Self {
        Self { ns: bounds.middle_ns() }
    }

    /// Measures the present difference.
    pub fn measured() -> Self {
        let readings = std::iter::repeat_with(offset_bounds).take(READINGS);
        Self::new(readings.min_by_key(|bounds| bounds.width_ns()).expect("there are some readings"))
    }

    /// Keeps the difference if a new reading allows it, and takes the new one otherwise.
    pub fn correct(&mut self, bounds: OffsetBounds) {
        if !bounds.contain(self.ns) {
            *self = Self::new(bounds);
        }
    }

    /// The difference, in nanoseconds.
    pub fn ns(self) -> i64 {
        self.ns
    }
}
