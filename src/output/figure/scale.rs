//! Scales: numbers to places along an axis, and the round numbers that are written there.

use std::ops::RangeInclusive;

/// A linear scale from a range of values onto a stretch of the page in millimetres. The range has an extent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    values: [f64; 2],
    page: [f64; 2],
}

/// A value that is written at an axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tick {
    pub(super) value: f64,
    pub(super) label: String,
}

impl Scale {
    /// The scale that puts the ends of `values` at the two places on the page. A range without an extent, or one that is
    /// turned round or not finite, is widened to one around it: a figure of a single point has axes too.
    pub(super) fn new(values: &RangeInclusive<f64>, page: [f64; 2]) -> Self {
        let [low, high] = [*values.start(), *values.end()];
        let widened = range_of([low, high].into_iter().filter(|value| value.is_finite()), 0.0);
        let has_extent = |range: &RangeInclusive<f64>| {
            let extent = range.end() - range.start();
            extent > 0.0 && extent.is_finite()
        };
        let range = [values.clone(), widened, 0.0..=1.0].into_iter().find(has_extent).expect("the last one has one");
        Self { values: [*range.start(), *range.end()], page }
    }

    pub(super) fn at(&self, value: f64) -> f64 {
        self.page[0] + (value - self.values[0]) * self.mm_per_unit()
    }

    /// Millimetres of page for each unit, negative where the values grow towards the page's top.
    pub(super) fn mm_per_unit(&self) -> f64 {
        (self.page[1] - self.page[0]) / (self.values[1] - self.values[0])
    }

    /// Multiples of 1, 2 or 5 times a power of ten, the nearest to each other that leave `gap` millimetres between two.
    pub(super) fn ticks(&self, gap: f64) -> Vec<Tick> {
        let least = gap / self.mm_per_unit().abs();
        let magnitude = least.log10().floor();
        let steps = [1.0, 2.0, 5.0, 10.0].map(|factor| factor * 10_f64.powf(magnitude));
        let step = steps.into_iter().find(|step| *step >= least).unwrap_or(steps[3]);
        let decimals = (-(step * 1.000_001).log10().floor()).max(0.0) as usize;
        // A tick that rounding puts a billionth of a step outside belongs to the axis.
        let [first, last] = [self.values[0] / step - 1e-9, self.values[1] / step + 1e-9];
        let indices = first.ceil() as i64..=last.floor() as i64;
        indices.map(|index| Tick::new(index as f64 * step, decimals)).collect()
    }
}

impl Tick {
    fn new(value: f64, decimals: usize) -> Self {
        Self { value, label: number(value, decimals) }
    }
}

/// A number as it is printed, with a minus sign as wide as the plus sign and none for a zero.
pub(super) fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.contains(|digit| ('1'..='9').contains(&digit)) => format!("−{digits}"),
        Some(digits) => digits.to_owned(),
        None => text,
    }
}

/// The least range that holds all values, with a share of its extent added at both ends; an extent of its own where all
/// values are the same.
pub(super) fn range_of(values: impl IntoIterator<Item = f64>, margin: f64) -> RangeInclusive<f64> {
    let (low, high) = values
        .into_iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if low > high {
        return 0.0..=1.0;
    }
    let extent = high - low;
    // An extent that rounding alone makes would show noise.
    let noise = 1e-9 * low.abs().max(high.abs());
    let spread = if extent > noise { margin * extent } else { (0.1 * low.abs()).max(0.1) };
    low - spread..=high + spread
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(values: RangeInclusive<f64>, gap: f64) -> Vec<String> {
        Scale::new(&values, [0.0, 100.0]).ticks(gap).into_iter().map(|tick| tick.label).collect()
    }

    #[test]
    fn ticks_are_round_numbers_that_do_not_crowd() {
        assert_eq!(labels(-12.3..=11.0, 15.0), ["−10", "−5", "0", "5", "10"]);
        assert_eq!(labels(0.0..=0.18, 20.0), ["0.00", "0.05", "0.10", "0.15"]);
        assert_eq!(labels(0.0..=412.5, 15.0), ["0", "100", "200", "300", "400"]);
        assert_eq!(labels(0.3..=0.6, 30.0), ["0.3", "0.4", "0.5", "0.6"]);
    }

    #[test]
    fn a_scale_may_run_towards_the_top_of_the_page() {
        let scale = Scale::new(&(0.0..=10.0), [90.0, 10.0]);
        assert_eq!((scale.at(0.0), scale.at(10.0), scale.at(2.5)), (90.0, 10.0, 70.0));
    }

    #[test]
    fn a_scale_of_a_single_value_or_none_has_an_extent_all_the_same() {
        for values in [0.0..=0.0, 3.0..=3.0, f64::NAN..=1.0, f64::INFINITY..=f64::NEG_INFINITY, -1e308..=1e308] {
            let scale = Scale::new(&values, [0.0, 100.0]);
            assert!(scale.mm_per_unit().is_finite() && scale.mm_per_unit() > 0.0, "{values:?}: {scale:?}");
            assert!((1..100).contains(&scale.ticks(15.0).len()), "{values:?}: {scale:?}");
        }
    }

    #[test]
    fn a_range_of_equal_values_has_an_extent() {
        assert_eq!(range_of([2.0, 2.0], 0.05), 1.8..=2.2);
        assert_eq!(range_of([0.0, 1.0], 0.05), -0.05..=1.05);
        assert_eq!(range_of([], 0.05), 0.0..=1.0);
    }
}
