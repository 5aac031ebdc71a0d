//! The lines of JSON that `monitor` prints, and `show` reads.

use bench_dragon_geometry::clearance::Standing;
use bench_dragon_geometry::number::Fixed;
use bench_dragon_ipc::{Alert, CommandEvent, Request, TimeHistogram};
use serde::{Deserialize, Serialize};

use crate::config::{Config, NamedBenches};
use crate::output::command_words::CommandLine;
use crate::output::histogram::Percentiles;

/// A line that `monitor` prints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub(crate) enum MonitorLine {
    Alert(AlertLine),
    /// A command to the source, or another event of the record of commands.
    Command(CommandLine),
    Progress(MonitorProgress),
    /// The guard holds the head permanently: no further travel can ever be granted.
    Guard(GuardReport),
    Summary(MonitorSummary),
}

/// An alert.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct AlertLine {
    /// Kind of the alert, in lower case.
    pub(crate) kind: String,
    pub(crate) time_s: f64,
    /// First tick at which the alert applies.
    pub(crate) tick: u64,
    pub(crate) run_id: u64,
    /// The two benches, or null if the alert is not about a pair.
    pub(crate) benches: Option<[u32; 2]>,
    /// The bench of an alert about one bench, or null.
    pub(crate) bench: Option<u32>,
    /// The dragons of these benches, if there are several.
    #[serde(flatten)]
    pub(crate) named: Option<NamedBenches>,
    /// Where the one bench is, of an alert about a border of the stage.
    #[serde(flatten)]
    pub(crate) at_border: Option<AtBorder>,
    pub(crate) clearance_m: Option<f64>,
    /// Point midway between the two boards, point of the one board, or null.
    pub(crate) point_m: Option<[f64; 2]>,
    /// Show time of the forecast contact, or null.
    pub(crate) forecast_s: Option<f64>,
}

/// A border of the stage and the distance of a board from it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct AtBorder {
    /// The border that is nearest to the board, as the configuration calls it.
    pub(crate) border: String,
    pub(crate) distance_m: f64,
}

impl AlertLine {
    /// The line of an alert of a run with this configuration, if it is known.
    pub(crate) fn of(alert: &Alert, config: Option<&Config>) -> Self {
        let (pair, bench) = (alert.pair(), alert.bench());
        Self {
            kind: alert.alert_kind().map_or_else(|| format!("kind {}", alert.kind), |kind| kind.to_string()),
            time_s: alert.show_time_ns as f64 * 1e-9,
            tick: alert.tick,
            run_id: alert.run_id,
            benches: pair,
            bench,
            named: config.and_then(|config| config.named_benches_of(alert)),
            at_border: bench.and_then(|_| {
                let border = config?.stage().nearest(alert.point_m.into())?;
                Some(AtBorder { border, distance_m: alert.clearance_m })
            }),
            clearance_m: pair.map(|_| alert.clearance_m),
            point_m: (pair.is_some() || bench.is_some()).then_some(alert.point_m),
            forecast_s: alert.forecast(),
        }
    }

    /// The benches of the alert in words; `None` if it is not about benches.
    pub(crate) fn who(&self) -> Option<String> {
        let pair = self.benches.map(|benches| NamedBenches::pair_words(self.named.as_ref(), benches));
        pair.or_else(|| self.bench.map(|bench| NamedBenches::bench_words(self.named.as_ref(), bench)))
    }

    /// The alert in words, for printing above the live line.
    pub(crate) fn words(&self) -> String {
        let who = self.who().map(|who| format!(", {who}")).unwrap_or_default();
        format!("{} s: {}{who}", Fixed::<6>(self.time_s), self.kind)
    }
}

/// Progress of a monitor.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct MonitorProgress {
    pub(crate) frames: u64,
    /// Frames lost between the first and the last frame that was read.
    pub(crate) lost: u64,
    /// Least clearance in the last frame, in metres; null before the first frame.
    pub(crate) clearance_m: Option<f64>,
    /// Least clearance of the frames since the progress before; null without a frame.
    #[serde(default)]
    pub(crate) least: Option<ClearanceReport>,
    /// Show time of the forecast contact, in seconds; null if none is known.
    pub(crate) forecast_s: Option<f64>,
    /// Show time of the earliest contact that the play of the hinges allows, in seconds; null without one.
    pub(crate) earliest_s: Option<f64>,
    /// Times from the instant at which a frame was due to the instant at which it was read.
    pub(crate) latency: TimesReport,
}

/// Totals of a monitor.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct MonitorSummary {
    pub(crate) frames: u64,
    /// Frames lost between the first and the last frame that was read.
    pub(crate) lost: u64,
    /// The first contact.
    pub(crate) contact: Option<ContactReport>,
    /// Show time of the earliest contact that the play of the hinges allows, as last forecast; null without one.
    pub(crate) earliest_s: Option<f64>,
    /// Least clearance of all frames; null without a frame.
    pub(crate) least_clearance: Option<ClearanceReport>,
    /// The permanent stop of the head by the guard; null if there was none.
    pub(crate) guard: Option<GuardReport>,
    /// Faults: a guard found that a frame disagreed with the published description.
    pub(crate) faults: u64,
    /// Alerts of pairs that were counted but not sent, because they were too many.
    pub(crate) suppressed_alerts: u64,
    /// Frames for which the travel since the frame before was not swept completely, because that took too much work.
    pub(crate) unswept_frames: u64,
    pub(crate) commands: CommandCounts,
    /// Percentiles of [`Self::latency`], in microseconds.
    pub(crate) latency_us: Percentiles,
    /// Times from the instant at which a frame was due to the instant at which it was read.
    pub(crate) latency: TimesReport,
}

/// Counts of the commands to a source.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct CommandCounts {
    /// Accepted commands, without grants.
    pub(crate) accepted: u64,
    /// Refused commands, including refused grants.
    pub(crate) refused: u64,
    /// Accepted grants.
    pub(crate) grants: u64,
    /// Events of commands that were lost on the bus.
    pub(crate) lost: u64,
}

impl CommandCounts {
    pub(crate) fn count(&mut self, event: &CommandEvent) {
        match (event.request(), event.outcome()) {
            (_, Err(_)) => self.refused += 1,
            (Some(Request::Grant { .. }), Ok(())) => self.grants += 1,
            (Some(_), Ok(())) => self.accepted += 1,
            (None, Ok(())) => {}
        }
    }
}

/// A permanent stop of the head by a guard.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct GuardReport {
    pub(crate) held_at_s: f64,
    /// Least clearance at this stop, in metres; null with fewer than three benches.
    pub(crate) clearance_m: Option<f64>,
    /// Show time at which two benches would have touched at the planned speed, in seconds; null if they would not, or if this
    /// took too much work to compute.
    pub(crate) forecast_contact_s: Option<f64>,
    /// Whether the margin is proved to be kept at this stop. It is not where a show starts within the margin.
    pub(crate) is_margin_kept: bool,
    /// The board that is as near to a border of the stage as the guard allows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) border: Option<BorderStop>,
}

/// A border of the stage before which the guard stops.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct BorderStop {
    /// The border, as the configuration calls it.
    pub(crate) border: String,
    pub(crate) bench: usize,
    /// The dragon of the bench, if there are several.
    #[serde(flatten)]
    pub(crate) named: Option<NamedBenches>,
    /// Distance of its board from the border, in metres.
    pub(crate) distance_m: f64,
}

impl BorderStop {
    pub(crate) fn of(standing: &Standing, config: &Config) -> Self {
        let &Standing { bench, border, distance_m } = standing;
        let border = config.stage().name(border);
        Self { border, bench, named: config.named_benches([bench]), distance_m }
    }

    /// The bench in words.
    pub(crate) fn who(&self) -> String {
        NamedBenches::bench_words(self.named.as_ref(), self.bench)
    }
}

impl GuardReport {
    /// The known ones of clearance and forecast, and a margin that is not kept, in words that follow other words about this stop.
    pub(crate) fn details(&self) -> String {
        let clearance = self.clearance_m.map(|clearance_m| format!(", clearance {} m", Fixed::<6>(clearance_m)));
        let forecast = self.forecast_contact_s.map(|time_s| format!(", contact forecast at {} s", Fixed::<6>(time_s)));
        let unproved = ": margin_m is not proved to be kept here, so start or seek elsewhere".to_owned();
        let border = self
            .border
            .as_ref()
            .map(|stop| format!(", {} {} m from {}", stop.who(), Fixed::<6>(stop.distance_m), stop.border));
        clearance.into_iter().chain(border).chain(forecast).chain((!self.is_margin_kept).then_some(unproved)).collect()
    }
}

/// A contact.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ContactReport {
    pub(crate) time_s: f64,
    pub(crate) benches: [u32; 2],
    /// The dragons of the benches, if there are several.
    #[serde(flatten)]
    pub(crate) named: Option<NamedBenches>,
}

impl ContactReport {
    /// The two benches in words.
    pub(crate) fn who(&self) -> String {
        NamedBenches::pair_words(self.named.as_ref(), self.benches)
    }
}

/// The clearance of a pair of benches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ClearanceReport {
    pub(crate) time_s: f64,
    pub(crate) benches: [u32; 2],
    /// The dragons of the benches, if there are several.
    #[serde(flatten)]
    pub(crate) named: Option<NamedBenches>,
    pub(crate) clearance_m: f64,
    /// Point midway between the two boards.
    pub(crate) point_m: [f64; 2],
    /// Place on the course, from which the pose of every bench follows: the travel of the only head.
    pub(crate) travel_m: f64,
}

impl ClearanceReport {
    /// The two benches in words.
    pub(crate) fn who(&self) -> String {
        NamedBenches::pair_words(self.named.as_ref(), self.benches)
    }
}

/// A [`TimeHistogram`] without its empty buckets.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct TimesReport {
    /// The longest time in nanoseconds, exactly.
    pub(crate) max_ns: u64,
    /// The least time of each non-empty bucket in nanoseconds, and the number of times in the bucket.
    pub(crate) counts: Vec<(u64, u64)>,
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
    fn a_distribution_survives_its_line_of_json() {
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
