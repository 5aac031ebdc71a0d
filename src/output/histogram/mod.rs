//! Distributions of latency and lateness, and what is reported of them: percentiles, bars for people, the text that
//! `HdrHistogram`'s plotter reads.

mod bars;
mod percentile_text;

pub use bars::Bars;
pub use percentile_text::PercentileText;

use bench_dragon_ipc::TimeHistogram;
use hdrhistogram::Histogram;
use serde::{Deserialize, Serialize};

/// Longest time that is told apart, in nanoseconds: an hour.
const MAX_NS: u64 = 3_600_000_000_000;

/// A distribution of times in nanoseconds, to three digits.
#[derive(Debug)]
pub struct LatencyHistogram(Histogram<u64>);

/// The percentiles that are reported, in microseconds.
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
        let micros = |nanos: u64| nanos as f64 / 1e3;
        Self {
            p50: micros(histogram.quantile_ns(0.5)),
            p99: micros(histogram.quantile_ns(0.99)),
            p999: micros(histogram.quantile_ns(0.999)),
            max: micros(histogram.max_ns),
        }
    }
}

impl LatencyHistogram {
    /// An empty one. It never grows: a value over an hour counts as an hour.
    pub fn new() -> Self {
        Self(Histogram::new_with_bounds(1, MAX_NS, 3).expect("the bounds are in order"))
    }

    /// Counts one value.
    pub fn record(&mut self, value_ns: u64) {
        self.0.saturating_record(value_ns);
    }

    /// The value that this share of all values does not exceed, in nanoseconds; 0 where there is none.
    pub fn quantile_ns(&self, quantile: f64) -> u64 {
        if self.0.is_empty() { 0 } else { self.0.value_at_quantile(quantile) }
    }

    /// The greatest value in nanoseconds; 0 where there is none.
    pub fn max_ns(&self) -> u64 {
        self.0.max()
    }

    /// How many values have been counted.
    pub fn count(&self) -> u64 {
        self.0.len()
    }

    /// The percentiles that are reported.
    pub fn percentiles(&self) -> Percentiles {
        let micros = |nanos: u64| nanos as f64 / 1e3;
        Percentiles {
            p50: micros(self.quantile_ns(0.5)),
            p99: micros(self.quantile_ns(0.99)),
            p999: micros(self.quantile_ns(0.999)),
            max: micros(self.max_ns()),
        }
    }
}

impl Default for LatencyHistogram {
    fn default() -> Self {
        Self::new()
    }
}
