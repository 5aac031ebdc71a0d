//! Distributions of latency and lateness, and their reports: percentiles, bars for people, and the text format of
//! `HdrHistogram`'s tools.

use std::fmt;

use bench_dragon_ipc::TimeHistogram;
use hdrhistogram::Histogram;
use serde::{Deserialize, Serialize};

/// Greatest time in nanoseconds: an hour. Longer times count as an hour.
const MAX_NS: u64 = 3_600_000_000_000;

/// Beginnings of the intervals of bars, up to a power of ten. They are about a factor of 1.5 apart, and short to print.
const MANTISSAS: [u64; 6] = [10, 15, 20, 30, 50, 70];
/// Beginning of the first interval in nanoseconds. Smaller values count in this interval.
const LEAST_NS: u64 = 100;
const BAR_WIDTH: usize = 40;
/// Characters that are filled from the left by 1 to 8 eighths.
const EIGHTHS: [char; 8] =
    ['\u{258f}', '\u{258e}', '\u{258d}', '\u{258c}', '\u{258b}', '\u{258a}', '\u{2589}', '\u{2588}'];
/// Number of percentiles in each halving of the distance to 100 %, as in the plotter's examples.
const TICKS_PER_HALF_DISTANCE: u32 = 5;
const NS_PER_US: f64 = 1e3;

/// A distribution of times in nanoseconds, to three digits. It never grows: a value over an hour counts as an hour.
#[derive(Debug)]
pub struct LatencyHistogram(Histogram<u64>);

/// Reported percentiles, in microseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Percentiles {
    /// Median.
    pub p50: f64,
    /// 99th percentile.
    pub p99: f64,
    /// 99.9th percentile.
    pub p999: f64,
    /// Greatest value.
    pub max: f64,
}

impl From<&TimeHistogram> for Percentiles {
    fn from(histogram: &TimeHistogram) -> Self {
        Self::of(|quantile| histogram.quantile_ns(quantile), histogram.max_ns)
    }
}

impl Percentiles {
    /// Computes the percentiles of a distribution from its quantile function and its greatest value, both in nanoseconds.
    fn of(quantile_ns: impl Fn(f64) -> u64, max_ns: u64) -> Self {
        let [p50, p99, p999] = [0.5, 0.99, 0.999].map(|quantile| micros(quantile_ns(quantile)));
        Self { p50, p99, p999, max: micros(max_ns) }
    }
}

impl LatencyHistogram {
    /// Counts one value.
    pub fn record(&mut self, value_ns: u64) {
        self.0.saturating_record(value_ns);
    }

    /// Value that this share of all values does not exceed, in nanoseconds; 0 without values.
    pub fn quantile_ns(&self, quantile: f64) -> u64 {
        if self.0.is_empty() { 0 } else { self.0.value_at_quantile(quantile) }
    }

    /// Greatest value in nanoseconds; 0 without values.
    pub fn max_ns(&self) -> u64 {
        self.0.max()
    }

    /// Number of values.
    pub fn count(&self) -> u64 {
        self.0.len()
    }

    /// Returns the reported percentiles.
    pub fn percentiles(&self) -> Percentiles {
        Percentiles::of(|quantile| self.quantile_ns(quantile), self.max_ns())
    }
}

impl Default for LatencyHistogram {
    fn default() -> Self {
        Self(Histogram::new_with_bounds(1, MAX_NS, 3).expect("the bounds are in order"))
    }
}

/// Prints a distribution as lines with an interval in microseconds, a bar and a count, from the least value to the greatest. No
/// line is wider than 80 characters. An empty distribution prints nothing.
///
/// The limits of an interval have the precision of the histogram: three digits.
#[derive(Clone, Copy, Debug)]
pub struct Bars<'a>(pub &'a LatencyHistogram);

impl fmt::Display for Bars<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts = self.counts();
        let most = counts.iter().map(|&(_, count)| count).max().unwrap_or(0);
        for ((from_ns, count), to_ns) in counts.iter().zip(beginnings().skip_while(|&ns| ns <= counts[0].0)) {
            let (from, to) = (micros(*from_ns), micros(to_ns));
            let line = format!("{from:>7} \u{2013} {to:<7} {:<BAR_WIDTH$}  {count}", bar(*count, most));
            writeln!(formatter, "{}", line.trim_end())?;
        }
        Ok(())
    }
}

impl Bars<'_> {
    /// Beginning of each interval in nanoseconds, with its count. Empty for an empty distribution.
    fn counts(self) -> Vec<(u64, u64)> {
        let histogram = &self.0.0;
        if histogram.is_empty() {
            return Vec::new();
        }
        let mut counts: Vec<(u64, u64)> = Vec::new();
        let mut beginnings = beginnings().peekable();
        let mut interval_ns = LEAST_NS;
        for recorded in histogram.iter_recorded() {
            let value_ns = histogram.median_equivalent(recorded.value_iterated_to());
            while let Some(next_ns) = beginnings.next_if(|&ns| ns <= value_ns) {
                interval_ns = next_ns;
                if !counts.is_empty() {
                    counts.push((interval_ns, 0));
                }
            }
            if counts.is_empty() {
                counts.push((interval_ns, 0));
            }
            let last = counts.last_mut().expect("the lines above add an interval to an empty list");
            last.1 += recorded.count_at_value();
        }
        counts
    }
}

/// Beginnings of the intervals in nanoseconds, an endless sequence.
fn beginnings() -> impl Iterator<Item = u64> {
    let powers = std::iter::successors(Some(LEAST_NS / MANTISSAS[0]), |power| power.checked_mul(10));
    powers.flat_map(|power| MANTISSAS.map(|mantissa| power.saturating_mul(mantissa)))
}

fn micros(nanos: u64) -> f64 {
    nanos as f64 / NS_PER_US
}

/// A bar whose share of the greatest width is `count / most`. Any count over 0 is visible.
fn bar(count: u64, most: u64) -> String {
    if count == 0 {
        return String::new();
    }
    let eighths = (count as f64 / most as f64 * (8 * BAR_WIDTH) as f64).round().max(1.0) as usize;
    let whole = EIGHTHS[7].to_string().repeat(eighths / 8);
    match eighths % 8 {
        0 => whole,
        rest => format!("{whole}{}", EIGHTHS[rest - 1]),
    }
}

/// Prints a distribution as `.hgrm` text with values in microseconds. Its percentiles are closer together near 100 %.
///
/// Source of the columns and the footer: `outputPercentileDistribution` of the Java library's `AbstractHistogram`.
/// <https://hdrhistogram.github.io/HdrHistogram/plotFiles.html> plots such files.
///
/// ```
/// use bench_dragon::output::histogram::{LatencyHistogram, PercentileText};
///
/// let mut histogram = LatencyHistogram::default();
/// histogram.record(1_500);
/// let text = PercentileText(&histogram).to_string();
/// assert!(text.contains("       1.500 1.000000000000          1\n"));
/// assert!(text.contains("#[Max     =        1.500, Total count    =            1]\n"));
/// ```
#[derive(Clone, Copy, Debug)]
pub struct PercentileText<'a>(pub &'a LatencyHistogram);

impl fmt::Display for PercentileText<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let histogram = &self.0.0;
        let titles = ["Value", "Percentile", "TotalCount", "1/(1-Percentile)"];
        writeln!(formatter, "{:>12} {:>14} {:>10} {:>14}\n", titles[0], titles[1], titles[2], titles[3])?;
        let mut count = 0;
        for step in histogram.iter_quantiles(TICKS_PER_HALF_DISTANCE) {
            count += step.count_since_last_iteration();
            let (value_us, share) = (step.value_iterated_to() as f64 / NS_PER_US, step.quantile_iterated_to());
            write!(formatter, "{value_us:>12.3} {share:.12} {count:>10}")?;
            match 1.0 - share {
                0.0 => writeln!(formatter)?,
                rest => writeln!(formatter, " {:>14.2}", 1.0 / rest)?,
            }
        }
        let (mean_us, deviation_us) = (histogram.mean() / NS_PER_US, histogram.stdev() / NS_PER_US);
        let max_us = histogram.max() as f64 / NS_PER_US;
        writeln!(formatter, "#[Mean    = {mean_us:>12.3}, StdDeviation   = {deviation_us:>12.3}]")?;
        writeln!(formatter, "#[Max     = {max_us:>12.3}, Total count    = {:>12}]", histogram.len())?;
        // The first bucket has all of its sub-buckets. Each further bucket has only the upper half of them.
        let buckets = usize::from(histogram.buckets());
        let sub_buckets = 2 * histogram.distinct_values() / (buckets + 1);
        writeln!(formatter, "#[Buckets = {buckets:>12}, SubBuckets     = {sub_buckets:>12}]")
    }
}
