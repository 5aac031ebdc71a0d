//! An interval of travel, divided into strides, and these into stretches for one core at a time.

use crate::clearance::ApproachSearch;
use crate::dragon::Dragon;

/// Number of strides that a core takes at a time.
const STRIDES_AT_A_TIME: usize = 16;

/// Least work of a stretch, in steps. So the limit of work bounds the number of stretches.
const STEPS_PER_STRETCH: u64 = 1_000;

/// An interval of travel that is evaluated stride by stride.
#[derive(Clone, Copy, Debug)]
pub(super) struct Strides {
    from_m: f64,
    to_m: f64,
    count: usize,
}

impl Strides {
    /// The head's interval between two travels, in strides of equal length.
    pub(super) fn of(dragon: &Dragon, from_m: f64, to_m: f64) -> Self {
        let count = ((to_m - from_m) / ApproachSearch::stride_m(dragon)).ceil().max(1.0) as usize;
        Self { from_m, to_m, count }
    }

    /// Number of strides.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// Travel at the end of the first `strides` strides; at most the interval's end.
    pub(super) fn end_m(&self, strides: usize) -> f64 {
        if strides >= self.count {
            return self.to_m;
        }
        self.from_m + (self.to_m - self.from_m) * (strides as f64 / self.count as f64)
    }

    /// Number of stretches.
    pub(super) fn stretches(&self) -> usize {
        self.count.div_ceil(STRIDES_AT_A_TIME)
    }

    /// The travels at the ends of a stretch's strides. Each stretch begins at the end of the one before. Counts a part of the
    /// work on the dragon's meter.
    pub(super) fn stretch(&self, stretch: usize, dragon: &Dragon) -> Vec<f64> {
        dragon.meter().add(STEPS_PER_STRETCH);
        let first = stretch * STRIDES_AT_A_TIME;
        (first..=(first + STRIDES_AT_A_TIME).min(self.count)).map(|stride| self.end_m(stride)).collect()
    }

    /// Travel at the end of the first `stretches` stretches.
    pub(super) fn reached_m(&self, stretches: usize) -> f64 {
        self.end_m(stretches.saturating_mul(STRIDES_AT_A_TIME))
    }

    /// The ends of the strides around a travel, from the end of the stride before to the end of the stride behind.
    pub(super) fn around(&self, travel_m: f64) -> [f64; 2] {
        let share = (travel_m - self.from_m) / (self.to_m - self.from_m);
        let mut behind = (share * self.count as f64) as usize;
        while behind < self.count && self.end_m(behind) < travel_m {
            behind += 1;
        }
        [self.end_m(behind.saturating_sub(1)), self.end_m(behind + 1)]
    }
}
