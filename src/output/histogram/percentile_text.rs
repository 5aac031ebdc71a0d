//! A distribution as the text that `HdrHistogram`'s tools exchange, `.hgrm`: percentiles that come the closer together the
//! nearer they are to 100 %.
//!
//! Source: `outputPercentileDistribution` of the Java library's `AbstractHistogram`, whose columns and footer these are.
//! <https://hdrhistogram.github.io/HdrHistogram/plotFiles.html> plots such files.

use std::fmt;

use super::LatencyHistogram;

/// Percentiles between any one and the point half way from it to 100 %: the number that the plotter's examples have.
const TICKS_PER_HALF_DISTANCE: u32 = 5;
const NS_PER_US: f64 = 1e3;

/// Shows a distribution as `.hgrm` text, its values in microseconds.
///
/// ```
/// use bench_dragon::output::histogram::{LatencyHistogram, PercentileText};
///
/// let mut histogram = LatencyHistogram::new();
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
        // The first bucket has all of its sub-buckets, each further one the upper half of them.
        let buckets = usize::from(histogram.buckets());
        let sub_buckets = 2 * histogram.distinct_values() / (buckets + 1);
        writeln!(formatter, "#[Buckets = {buckets:>12}, SubBuckets     = {sub_buckets:>12}]")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn histogram(values_ns: impl IntoIterator<Item = u64>) -> LatencyHistogram {
        let mut histogram = LatencyHistogram::new();
        values_ns.into_iter().for_each(|value_ns| histogram.record(value_ns));
        histogram
    }

    #[test]
    fn text_has_the_columns_and_the_footer_of_the_java_library() {
        let text = PercentileText(&histogram([1_000, 2_000, 3_000, 4_000])).to_string();
        let expected = "       Value     Percentile TotalCount 1/(1-Percentile)\n\n       \
            1.000 0.000000000000          1           1.00\n       \
            1.000 0.100000000000          1           1.11\n";
        assert!(text.starts_with(expected), "{text}");
        let footer = "       4.001 1.000000000000          4\n\
            #[Mean    =        2.501, StdDeviation   =        1.118]\n\
            #[Max     =        4.001, Total count    =            4]\n\
            #[Buckets =           32, SubBuckets     =         2048]\n";
        assert!(text.ends_with(footer), "{text}");
    }

    #[test]
    fn rows_rise_to_all_that_was_counted() {
        let text = PercentileText(&histogram((0..10_000).map(|i| 1_000 + i * i))).to_string();
        let rows: Vec<Vec<f64>> = text
            .lines()
            .skip(2)
            .take_while(|line| !line.starts_with('#'))
            .map(|line| line.split_whitespace().map(|cell| cell.parse().expect("a number")).collect())
            .collect();
        assert!(rows.len() > 50, "{text}");
        for column in 0..3 {
            assert!(rows.is_sorted_by(|before, after| before[column] <= after[column]), "column {column} of {text}");
        }
        assert_eq!(rows.last().map(|row| (row[1], row[2])), Some((1.0, 10_000.0)));
    }

    #[test]
    fn nothing_counted_is_a_table_without_rows() {
        let text = PercentileText(&LatencyHistogram::new()).to_string();
        assert_eq!(text.lines().count(), 5, "{text}");
        assert!(text.contains("Total count    =            0]"), "{text}");
    }
}
