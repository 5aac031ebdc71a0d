//! A metric: one name, and a sample for each set of labels.

use prometheus::proto::{Counter, Gauge, Histogram, LabelPair, Metric, MetricFamily, MetricType};

/// Begins every name.
const PREFIX: &str = "bench_dragon_";

/// A name and its value.
pub(super) type Label<'a> = (&'static str, &'a str);

/// A sample that goes up and down, where it is known.
pub(super) fn gauge(name: &str, help: &str, value: impl Into<Option<f64>>) -> MetricFamily {
    gauges(name, help, value.into().map(|value| (vec![], value)))
}

/// Samples that go up and down, by their labels.
pub(super) fn gauges<'a>(
    name: &str,
    help: &str,
    samples: impl IntoIterator<Item = (Vec<Label<'a>>, f64)>,
) -> MetricFamily {
    let sample = |(labels, value)| {
        let mut gauge = Gauge::default();
        gauge.set_value(value);
        let mut metric = Metric::from_gauge(gauge);
        metric.set_label(pairs(labels));
        metric
    };
    family(name, help, MetricType::GAUGE, samples.into_iter().map(sample).collect())
}

/// A sample that only grows, where it is known.
pub(super) fn counter(name: &str, help: &str, value: impl Into<Option<u64>>) -> MetricFamily {
    counters(name, help, value.into().map(|value| (vec![], value)))
}

/// Samples that only grow, by their labels.
pub(super) fn counters<'a>(
    name: &str,
    help: &str,
    samples: impl IntoIterator<Item = (Vec<Label<'a>>, u64)>,
) -> MetricFamily {
    let sample = |(labels, value): (_, u64)| {
        let mut counter = Counter::default();
        counter.set_value(value as f64);
        let mut metric = Metric::default();
        metric.set_counter(counter);
        metric.set_label(pairs(labels));
        metric
    };
    family(name, help, MetricType::COUNTER, samples.into_iter().map(sample).collect())
}

/// A distribution, where it is known.
pub(super) fn histogram(name: &str, help: &str, distribution: Option<Histogram>) -> MetricFamily {
    let sample = |distribution| {
        let mut metric = Metric::default();
        metric.set_histogram(distribution);
        metric
    };
    family(name, help, MetricType::HISTOGRAM, distribution.into_iter().map(sample).collect())
}

fn family(name: &str, help: &str, kind: MetricType, samples: Vec<Metric>) -> MetricFamily {
    let mut family = MetricFamily::default();
    family.set_name(format!("{PREFIX}{name}"));
    family.set_help(help.to_owned());
    family.set_field_type(kind);
    family.set_metric(samples);
    family
}

fn pairs(labels: Vec<Label<'_>>) -> Vec<LabelPair> {
    let pair = |(name, value): Label<'_>| {
        let mut pair = LabelPair::default();
        pair.set_name(name.to_owned());
        pair.set_value(value.to_owned());
        pair
    };
    labels.into_iter().map(pair).collect()
}
