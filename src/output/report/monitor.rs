//! The lines of `monitor`.

use bench_dragon_ipc::{Alert, CommandEvent, Request, TimeHistogram};
use serde::{Deserialize, Serialize};

use super::CommandLine;
use crate::output::histogram::Percentiles;

/// A line of `monitor`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum MonitorLine {
    /// Something happened.
    Alert(AlertLine),
    /// A command to the source, or another event of the record of commands.
    Command(CommandLine),
    /// How it stands.
    Progress(MonitorProgress),
    /// The guard holds the head where no further ground can ever be granted.
    Guard(GuardReport),
    /// The monitor has ended.
    Summary(MonitorSummary),
}

/// An alert.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AlertLine {
    /// What happened, in lower case.
    pub kind: String,
    /// Show time.
    pub time_s: f64,
    /// First tick at which it was so.
    pub tick: u64,
    /// The run's number.
    pub run_id: u64,
    /// The two benches, or null where it is about no pair.
    pub benches: Option<[u32; 2]>,
    /// Their clearance, or null.
    pub clearance_m: Option<f64>,
    /// Point midway between the two boards, or null.
    pub point_m: Option<[f64; 2]>,
    /// Show time of the forecast contact, or null.
    pub forecast_s: Option<f64>,
}

impl From<&Alert> for AlertLine {
    fn from(alert: &Alert) -> Self {
        let pair = alert.pair();
        Self {
            kind: alert.alert_kind().map_or_else(|| format!("kind {}", alert.kind), |kind| kind.to_string()),
            time_s: alert.sim_time_ns as f64 * 1e-9,
            tick: alert.tick,
            run_id: alert.run_id,
            benches: pair,
            clearance_m: pair.map(|_| alert.clearance_m),
            point_m: pair.map(|_| alert.point_m),
            forecast_s: alert.forecast(),
        }
    }
}

/// How a monitor stands.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MonitorProgress {
    /// Frames read.
    pub frames: u64,
    /// Frames lost between the first and the last one read.
    pub lost: u64,
    /// Least clearance in the last frame; null before the first one.
    pub clearance_m: Option<f64>,
    /// Show time of the forecast contact; null where none is known.
    pub forecast_s: Option<f64>,
    /// From the instant each frame was due to the instant it was read.
    pub latency: TimesReport,
}

/// What a monitor saw.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MonitorSummary {
    /// Frames read.
    pub frames: u64,
    /// Frames lost between the first and the last one read.
    pub lost: u64,
    /// First contact, or null.
    pub contact: Option<ContactReport>,
    /// Least clearance of all frames; null where there was no frame.
    pub least_clearance: Option<ClearanceReport>,
    /// Where its guard held the head for good; null where it did not.
    pub guard: Option<GuardReport>,
    /// Times at which a guard found that a frame did not agree with the published description.
    pub faults: u64,
    /// Alerts of pairs that were counted and not sent, for they were too many.
    #[serde(default)]
    pub suppressed_alerts: u64,
    /// Frames up to which the way was not swept whole, for that took too much work.
    #[serde(default)]
    pub unswept_frames: u64,
    /// The commands to the source that it heard of.
    #[serde(default)]
    pub commands: CommandCounts,
    /// From the instant a frame was due to the instant it was read, in microseconds.
    pub latency_us: Percentiles,
    /// The same, whole.
    pub latency: TimesReport,
}

/// Commands to a source, counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct CommandCounts {
    /// Accepted ones, grants excepted.
    pub accepted: u64,
    /// Refused ones, refused grants included.
    pub refused: u64,
    /// Accepted grants.
    pub grants: u64,
    /// Events of commands that were lost on the way.
    pub lost: u64,
}

impl CommandCounts {
    /// Counts an event.
    pub fn count(&mut self, event: &CommandEvent) {
        match (event.request(), event.outcome()) {
            (_, Err(_)) => self.refused += 1,
            (Some(Request::Grant { .. }), Ok(())) => self.grants += 1,
            (Some(_), Ok(())) => self.accepted += 1,
            (None, Ok(())) => {}
        }
    }
}

/// Where a guard held the head for good.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GuardReport {
    /// Show time.
    pub held_at_s: f64,
    /// Least clearance there; null with fewer than three benches.
    pub clearance_m: Option<f64>,
    /// Show time at which two benches would have touched at the planned speed; null where they would not.
    pub forecast_contact_s: Option<f64>,
}

/// A contact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContactReport {
    /// Show time.
    pub time_s: f64,
    /// The two benches.
    pub benches: [u32; 2],
}

/// A clearance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClearanceReport {
    /// Show time.
    pub time_s: f64,
    /// The two benches.
    pub benches: [u32; 2],
    /// The clearance.
    pub clearance_m: f64,
}

/// A [`TimeHistogram`] without its empty buckets.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TimesReport {
    /// The longest time, exactly, in nanoseconds.
    pub max_ns: u64,
    /// Of each bucket that is not empty, its least time in nanoseconds, and how many times lie in it.
    pub counts: Vec<(u64, u64)>,
}

impl From<&TimeHistogram> for TimesReport {
    fn from(histogram: &TimeHistogram) -> Self {
        let counts = histogram.counts.iter().enumerate().filter(|(_, count)| **count > 0);
        Self {
            max_ns: histogram.max_ns,
            counts: counts.map(|(bucket, count)| (TimeHistogram::bounds_ns(bucket).0, *count)).collect(),
        }
    }
}

impl From<&TimesReport> for TimeHistogram {
    fn from(report: &TimesReport) -> Self {
        let mut histogram = Self { max_ns: report.max_ns, ..Self::default() };
        for (least_ns, count) in &report.counts {
            let bucket = &mut histogram.counts[Self::bucket_of(*least_ns)];
            *bucket = bucket.saturating_add(*count);
        }
        histogram
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_distribution_is_carried_whole() {
        let mut histogram = TimeHistogram::default();
        for time_ns in [0, 63, 64, 5000, 5001, 123_456_789, TimeHistogram::LIMIT_NS * 3] {
            histogram.record(time_ns);
        }
        let report = TimesReport::from(&histogram);
        assert_eq!(report.counts[3], (4992, 2));
        let line = serde_json::to_string(&report).expect("numbers");
        let read: TimesReport = serde_json::from_str(&line).expect("its own line");
        assert_eq!(TimeHistogram::from(&read), histogram);
    }
}
