//! Metrics in the text format of Prometheus: gauges, counters and distributions.
//!
//! Source: prometheus.io, exposition formats, the text-based format 0.0.4.

use std::fmt::Write as _;

use bench_dragon_ipc::TimeHistogram;

/// Media type of the text format.
pub(super) const TEXT_FORMAT: &str = "text/plain; version=0.0.4";
/// Prefix of every name.
const PREFIX: &str = "bench_dragon_";

/// The name of a label and its value.
pub(super) type Label<'a> = (&'static str, &'a str);

/// Samples, each with its labels.
pub(super) trait Samples<'a, Value>: IntoIterator<Item = (Vec<Label<'a>>, Value)> {}
impl<'a, Value, All: IntoIterator<Item = (Vec<Label<'a>>, Value)>> Samples<'a, Value> for All {}

/// A gauge with one sample; no text if the value is unknown.
pub(super) fn gauge(name: &str, help: &str, value: impl Into<Option<f64>>) -> String {
    gauges(name, help, value.into().map(|value| (vec![], value)))
}

/// A gauge with samples by their labels.
pub(super) fn gauges<'a>(name: &str, help: &str, samples: impl Samples<'a, f64>) -> String {
    metric(name, help, "gauge", samples.into_iter().map(|(labels, value)| ("", labels, value)))
}

/// Returns a sample for each name: 1 for the name that equals `now`, 0 for the others.
pub(super) fn one_of<'a>(
    label: &'static str,
    names: impl IntoIterator<Item = &'a str>,
    now: &str,
) -> impl Samples<'a, f64> {
    names.into_iter().map(move |name| (vec![(label, name)], f64::from(u8::from(name == now))))
}

/// A counter with one sample; no text if the value is unknown.
pub(super) fn counter(name: &str, help: &str, value: impl Into<Option<u64>>) -> String {
    counters(name, help, value.into().map(|value| (vec![], value)))
}

/// A counter with samples by their labels.
pub(super) fn counters<'a>(name: &str, help: &str, samples: impl Samples<'a, u64>) -> String {
    metric(name, help, "counter", samples.into_iter().map(|(labels, value)| ("", labels, value as f64)))
}

/// A histogram of times, in seconds; no text if `times` is unknown.
pub(super) fn histogram(name: &str, help: &str, times: Option<&TimeHistogram>) -> String {
    let Some(times) = times else { return String::new() };
    let bounds = buckets(times).map(|(bound_s, count)| (bound_s.to_string(), count));
    let bounds: Vec<(String, u64)> = bounds.chain([("+Inf".to_owned(), times.count())]).collect();
    let buckets = bounds.iter().map(|(bound, count)| ("_bucket", vec![("le", bound.as_str())], *count as f64));
    let totals = [("_sum", vec![], sum_s(times)), ("_count", vec![], times.count() as f64)];
    metric(name, help, "histogram", buckets.chain(totals))
}

/// Formats a metric. Each sample has a suffix of the name, labels and a value. Without samples, the text is empty.
fn metric<'a>(
    name: &str,
    help: &str,
    kind: &str,
    samples: impl Iterator<Item = (&'static str, Vec<Label<'a>>, f64)>,
) -> String {
    let mut text = String::new();
    for (suffix, labels, value) in samples {
        if text.is_empty() {
            text = format!("# HELP {PREFIX}{name} {help}\n# TYPE {PREFIX}{name} {kind}\n");
        }
        let labels: Vec<String> = labels.iter().map(|(name, value)| format!("{name}=\"{}\"", escaped(value))).collect();
        let labels = if labels.is_empty() { String::new() } else { format!("{{{}}}", labels.join(",")) };
        writeln!(text, "{PREFIX}{name}{suffix}{labels} {}", value + 0.0).expect("a string is always writable");
    }
    text
}

fn escaped(text: &str) -> String {
    text.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n")
}

/// Exponents of the least and the greatest bound: a microsecond to a second.
///
/// Each bound is one nanosecond below a power of two. Buckets of a [`TimeHistogram`] end at these bounds, so the counts are
/// exact. The exact sum of the times is unknown. It is computed from the middles of the buckets, each of which is off by at
/// most 1/64.
const EXPONENTS: std::ops::RangeInclusive<u32> = 10..=30;

/// Returns each bucket's bound in seconds, and the number of times up to this bound.
fn buckets(times: &TimeHistogram) -> impl Iterator<Item = (f64, u64)> {
    EXPONENTS.map(|exponent| {
        let bound_ns = (1 << exponent) - 1;
        (seconds(bound_ns), times.counts[..=TimeHistogram::bucket_of(bound_ns)].iter().sum())
    })
}

fn sum_s(times: &TimeHistogram) -> f64 {
    let middle_ns = |bucket| {
        let (least, greatest) = TimeHistogram::bounds_ns(bucket);
        // The last bucket has no upper bound, so it ends at the longest time.
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
        assert_eq!(times.count(), recorded.len() as u64);
        let buckets: Vec<(f64, u64)> = buckets(&times).collect();
        for (bound_s, count) in &buckets {
            let no_longer = recorded.iter().filter(|time| seconds(**time) <= *bound_s).count();
            assert_eq!(*count, no_longer as u64, "{bound_s}");
        }
        assert_eq!((buckets[0].0, buckets[buckets.len() - 1].0), (0.000_001_023, 1.073_741_823));
    }

    #[test]
    fn the_sum_is_off_by_a_sixty_fourth_at_most() {
        let mut times = TimeHistogram::default();
        let recorded: Vec<u64> = (1..1000).map(|time| time * time * 100).collect();
        for &time in &recorded {
            times.record(time);
        }
        let (sum, exact) = (sum_s(&times), recorded.iter().map(|&time| seconds(time)).sum::<f64>());
        assert!((sum - exact).abs() <= exact / 64.0, "{sum} instead of {exact}");
        assert_eq!(sum_s(&TimeHistogram::default()), 0.0);
    }
}
