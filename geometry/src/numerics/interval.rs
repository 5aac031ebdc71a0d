//! Intervals of numbers, for bounds on expressions.

use std::ops::{Add, Mul, Sub};

/// The numbers from `low` to `high`. Results contain every value of the expression, up to rounding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Interval {
    pub(crate) low: f64,
    pub(crate) high: f64,
}

impl Interval {
    /// The least interval that contains both numbers.
    pub(crate) fn hull(one: f64, other: f64) -> Self {
        Self { low: one.min(other), high: one.max(other) }
    }

    pub(crate) fn around(centre: f64, radius: f64) -> Self {
        Self { low: centre - radius, high: centre + radius }
    }

    /// The least interval that contains this one and a number.
    pub(crate) fn with(self, value: f64) -> Self {
        Self { low: self.low.min(value), high: self.high.max(value) }
    }

    pub(crate) fn widened(self, by: f64) -> Self {
        Self { low: self.low - by, high: self.high + by }
    }

    pub(crate) fn scaled(self, factor: f64) -> Self {
        Self::hull(self.low * factor, self.high * factor)
    }

    /// The common numbers of two intervals that overlap.
    pub(crate) fn common(self, other: Self) -> Self {
        Self { low: self.low.max(other.low), high: self.high.min(other.high) }
    }

    pub(crate) fn contains(self, other: Self) -> bool {
        self.low <= other.low && other.high <= self.high
    }

    pub(crate) fn squared(self) -> Self {
        let [low, high] = [self.low * self.low, self.high * self.high];
        let least = if self.low <= 0.0 && self.high >= 0.0 { 0.0 } else { low.min(high) };
        Self { low: least, high: low.max(high) }
    }

    /// The greatest size of a number in the interval.
    pub(crate) fn size(self) -> f64 {
        self.low.abs().max(self.high.abs())
    }

    pub(crate) fn width(self) -> f64 {
        self.high - self.low
    }
}

impl Add for Interval {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { low: self.low + other.low, high: self.high + other.high }
    }
}

impl Sub for Interval {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self { low: self.low - other.high, high: self.high - other.low }
    }
}

impl Mul for Interval {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let [one, two] = [self.low * other.low, self.low * other.high];
        let [three, four] = [self.high * other.low, self.high * other.high];
        Self { low: one.min(two).min(three.min(four)), high: one.max(two).max(three.max(four)) }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use test_support::property::random_cases;

    use super::*;

    fn intervals() -> impl Strategy<Value = (Interval, f64)> {
        (-3.0..3.0_f64, 0.0..2.0_f64, 0.0..=1.0_f64)
            .prop_map(|(low, width, share)| (Interval { low, high: low + width }, low + share * width))
    }

    proptest! {
        #![proptest_config(random_cases(256))]

        #[test]
        fn results_contain_the_results_of_the_numbers((one, x) in intervals(), (other, y) in intervals(), factor in -2.0..2.0_f64) {
            let holds = |interval: Interval, value: f64| interval.widened(1e-12).contains(Interval::hull(value, value));
            prop_assert!(holds(one + other, x + y) && holds(one - other, x - y) && holds(one * other, x * y));
            prop_assert!(holds(one.squared(), x * x) && holds(one.scaled(factor), factor * x) && x.abs() <= one.size() + 1e-12);
        }
    }
}
