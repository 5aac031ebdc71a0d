//! Metrics in Prometheus' types: gauges, counters and distributions.

use bench_dragon_ipc::TimeHistogram;
use prometheus::proto::{Bucket, Counter, Gauge, Histogram, LabelPair, Metric, MetricFamily, MetricType};

/// Begins every name.
const PREFIX: &str = "bench_dragon_";

/// The name of a label and its value.
pub(super) type Label<'a> = (&'static str, &'a str);

/// Samples, each with its labels.
pub(super) trait Samples<'a, Value>: IntoIterator<Item = (Vec<Label<'a>>, Value)> {}
impl<'a, Value, All: IntoIterator<Item = (Vec<Label<'a>>, Value)>> Samples<'a, Value> for All {}

/// A sample that goes up and down, where it is known.
pub(super) fn gauge(name: &str, help: &str, value: impl Into<Option<f64>>) -> MetricFamily {
    gauges(name, help, value.into().map(|value| (vec![], value)))
}

/// Samples that go up and down, by their labels.
pub(super) fn gauges<'a>(name: &str, help: &str, samples: impl Samples<'a, f64>) -> MetricFamily {
    let metric = |value| {
        let mut gauge = Gauge::default();
        gauge.set_value(value);
        Metric::from_gauge(gauge)
    };
    family(name, help, MetricType::GAUGE, samples, metric)
}

/// A gauge for each of these names: 1 for the one that holds now, 0 for the others.
pub(super) fn one_of<'a>(
    name: &str,
    help: &str,
    label: &'static str,
    names: impl IntoIterator<Item = &'a str>,
    now: &str,
) -> MetricFamily {
    let sample = |name: &'a str| (vec![(label, name)], f64::from(u8::from(name == now)));
    gauges(name, help, names.into_iter().map(sample))
}

/// A sample that only grows, where it is known.
pub(super) fn counter(name: &str, help: &str, value: impl Into<Option<u64>>) -> MetricFamily {
    counters(name, help, value.into().map(|value| (vec![], value)))
}

/// Samples that only grow, by their labels.
pub(super) fn counters<'a>(name: &str, help: &str, samples: impl Samples<'a, u64>) -> MetricFamily {
    let metric = |value: u64| {
        let (mut counter, mut metric) = (Counter::default(), Metric::default());
        counter.set_value(value as f64);
        metric.set_counter(counter);
        metric
    };
    family(name, help, MetricType::COUNTER, samples, metric)
}

/// The distribution of times, in seconds, where it is known.
pub(super) fn histogram(name: &str, help: &str, times: Option<&TimeHistogram>) -> MetricFamily {
    let metric = |times| {
        let mut metric = Metric::default();
        metric.set_histogram(distribution(times));
        metric
    };
    family(name, help, MetricType::HISTOGRAM, times.map(|times| (vec![], times)), metric)
}

fn family<'a, Value>(
    name: &str,
    help: &str,
    kind: MetricType,
    samples: impl Samples<'a, Value>,
    metric: impl Fn(Value) -> Metric,
) -> MetricFamily {
    let sample = |(labels, value): (Vec<Label<'_>>, Value)| {
        let mut metric = metric(value);
        metric.set_label(labels.into_iter().map(label_pair).collect());
        metric
    };
    let mut family = MetricFamily::default();
    family.set_name(format!("{PREFIX}{name}"));
    family.set_help(help.to_owned());
    family.set_field_type(kind);
    family.set_metric(samples.into_iter().map(sample).collect());
    family
}

fn label_pair((name, value): Label<'_>) -> LabelPair {
    let mut pair = LabelPair::default();
    pair.set_name(name.to_owned());
    pair.set_value(value.to_owned());
    pair
}

/// Exponents of the least and the greatest bound: a microsecond to a second.
///
/// The bounds are a nanosecond under these powers of two. Buckets of a [`TimeHistogram`] end there, so that the counts are those of
/// the times themselves. Their sum is not known; it is taken from the middles of the buckets, each of which is off by 1/64 at most.
const EXPONENTS: std::ops::RangeInclusive<u32> = 10..=30;

fn distribution(times: &TimeHistogram) -> Histogram {
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
