//! The summary of a show: the reports of the children, added up over their restarts.

use std::collections::BTreeMap;
use std::path::PathBuf;

use bench_dragon_ipc::{FrameHeader, Status, TimeHistogram};
use jiff::Timestamp;
use serde::Serialize;

use super::children::ChildRole;
use super::course::CourseReport;
use super::outcome::Outcome;
use crate::cli::monitor::lines::{ContactReport, GuardReport, MonitorSummary, TimesReport};
use crate::output::histogram::Percentiles;
use crate::source::server::ServerSummary;

/// The contents of `summary.json`.
#[derive(Clone, Debug, Default, Serialize)]
pub(super) struct ShowSummary {
    /// Run id of the last run.
    pub(super) run_id: u64,
    /// Why the show ended; null while it runs.
    pub(super) outcome: Option<Outcome>,
    /// Begin, end, least clearance, holds, alerts and commands.
    #[serde(flatten)]
    pub(super) course: CourseReport,
    /// Frames that were published, monitored, recorded and missed.
    pub(super) frames: ShowFrames,
    /// The first contact.
    pub(super) contact: Option<ContactReport>,
    /// The permanent stop of the head by the guard; null if there was none.
    pub(super) guard: Option<GuardReport>,
    /// Times from each due instant to the start of its tick, in microseconds, over all servers of the show.
    pub(super) lateness_us: Percentiles,
    /// Times from the instant at which a frame was due to the instant at which the monitor had read it, in microseconds, over
    /// all monitors of the show.
    pub(super) latency_us: Percentiles,
    /// Periods that the server missed.
    pub(super) overruns: u64,
    /// Lag of the show behind the clock at the end, in seconds of wall time.
    pub(super) behind_s: f64,
    /// Greatest lag of the show behind the clock, in seconds of wall time.
    pub(super) most_behind_s: f64,
    /// Number of restarts of each process.
    pub(super) restarts: Restarts,
    /// Each process that ended before the show did, oldest first.
    pub(super) restart_log: Vec<RestartReport>,
    /// The recording; if the recorder was restarted, the first recording.
    pub(super) recording: PathBuf,
    /// All recordings, oldest first.
    pub(super) recordings: Vec<PathBuf>,
}

/// Frames over the whole show.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(super) struct ShowFrames {
    pub(super) published: u64,
    pub(super) monitored: u64,
    pub(super) recorded: u64,
    pub(super) missed_by_monitor: u64,
    pub(super) missed_by_recorder: u64,
}

/// A process that ended before the show did.
#[derive(Clone, Debug, Serialize)]
pub(super) struct RestartReport {
    /// Name of the process in [`Restarts`].
    pub(super) role: String,
    /// Reason of the end: the exit status, the signal, or a missing sign of life.
    pub(super) reason: String,
    /// Show time of the last frame before the show noticed the end; null before the first frame.
    pub(super) show_time_s: Option<f64>,
    /// Wall time at which the show noticed the end, in UTC, RFC 3339.
    pub(super) at: String,
    /// Whether the process was restarted; false if it had ended too often.
    pub(super) restarted: bool,
}

/// Number of restarts of each process.
#[derive(Clone, Debug, Default, Serialize)]
pub(super) struct Restarts {
    pub(super) serve: u32,
    pub(super) monitor: u32,
    pub(super) record: u32,
    pub(super) view: u32,
    /// The commands of `[[show.also]]`, each under its name.
    #[serde(flatten)]
    pub(super) also: BTreeMap<String, u32>,
}

/// The totals of a show. They grow only with restarts, at most one per minute and child on average.
#[derive(Debug, Default)]
pub(super) struct ShowTotals {
    /// Frames published in each run, by the server's summary or by the newest frame that the show has read.
    published: BTreeMap<u64, u64>,
    overruns: BTreeMap<u64, u64>,
    lateness: MergedTimes,
    latency: MergedTimes,
    monitors: u64,
    /// The values that need no adding up.
    pub(super) summary: ShowSummary,
}

impl ShowTotals {
    /// Notes a frame that the show itself has read.
    pub(super) fn see_frame(&mut self, header: &FrameHeader) {
        self.summary.run_id = header.run_id;
        let published = self.published.entry(header.run_id).or_default();
        *published = (*published).max(header.tick + 1);
    }

    pub(super) fn see_status(&mut self, status: &Status) {
        self.overruns.insert(status.run_id, status.overruns);
        let seconds = |nanos: u64| nanos as f64 * 1e-9;
        self.see_behind(seconds(status.behind_ns), seconds(status.most_behind_ns));
        self.lateness.report(status.run_id, &status.lateness);
    }

    pub(super) fn add_server(&mut self, summary: &ServerSummary) {
        self.summary.run_id = summary.run_id;
        self.published.insert(summary.run_id, summary.frames);
        self.overruns.insert(summary.run_id, summary.overruns);
        self.see_behind(summary.behind_s, summary.most_behind_s);
    }

    /// Notes the latency that the present monitor has measured so far.
    pub(super) fn see_latency(&mut self, latency: &TimesReport) {
        self.latency.report(self.monitors, &latency.into());
    }

    /// Notes the lag of a server behind the clock, and its greatest lag so far, in seconds.
    fn see_behind(&mut self, behind_s: f64, most_behind_s: f64) {
        self.summary.behind_s = behind_s;
        self.summary.most_behind_s = self.summary.most_behind_s.max(most_behind_s);
    }

    pub(super) fn add_monitor(&mut self, summary: &MonitorSummary) {
        self.see_latency(&summary.latency);
        self.summary.frames.monitored += summary.frames;
    }

    /// Adds the frames of a monitor that has ended.
    pub(super) fn close_monitor(&mut self, frames: u64) {
        self.summary.frames.monitored += frames;
        self.monitors += 1;
    }

    /// Adds the end of a child that ended before the show.
    pub(super) fn add_end(
        &mut self,
        role: ChildRole,
        name: &str,
        reason: &str,
        show_time_s: Option<f64>,
        is_restarted: bool,
    ) {
        let Restarts { serve, monitor, record, view, also } = &mut self.summary.restarts;
        let count = match role {
            ChildRole::Serve => serve,
            ChildRole::Monitor => monitor,
            ChildRole::Record => record,
            ChildRole::View => view,
            ChildRole::Also(_) => also.entry(name.to_owned()).or_default(),
        };
        *count += u32::from(is_restarted);
        let (role, reason, at) = (name.to_owned(), reason.to_owned(), format!("{:.3}", Timestamp::now()));
        self.summary.restart_log.push(RestartReport { role, reason, show_time_s, at, restarted: is_restarted });
    }

    pub(super) fn summary(&self) -> ShowSummary {
        let ShowFrames { monitored, recorded, .. } = self.summary.frames;
        let published = self.published.values().sum::<u64>();
        ShowSummary {
            frames: ShowFrames {
                published,
                missed_by_monitor: published.saturating_sub(monitored),
                missed_by_recorder: published.saturating_sub(recorded),
                ..self.summary.frames
            },
            lateness_us: Percentiles::from(&self.lateness.all()),
            latency_us: Percentiles::from(&self.latency.all()),
            overruns: self.overruns.values().sum(),
            recording: self.summary.recordings.first().cloned().unwrap_or_default(),
            ..self.summary.clone()
        }
    }
}

/// Times of several sources that report one after the other. Each report has all times of its source so far.
#[derive(Debug, Default)]
pub(super) struct MergedTimes {
    ended: TimeHistogram,
    /// The present source and its last report.
    current: Option<(u64, TimeHistogram)>,
}

impl MergedTimes {
    /// Takes the newest report of a source, which replaces its earlier reports. A report of a new source ends the last source.
    pub(super) fn report(&mut self, source: u64, times: &TimeHistogram) {
        if let Some((_, last)) = self.current.take_if(|(current, _)| *current != source) {
            self.ended.add(&last);
        }
        self.current = Some((source, *times));
    }

    pub(super) fn all(&self) -> TimeHistogram {
        let mut all = self.ended;
        self.current.iter().for_each(|(_, times)| all.add(times));
        all
    }
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::TimeHistogram;

    use super::*;

    #[test]
    fn the_lateness_of_a_show_covers_all_its_servers() {
        let mut totals = ShowTotals::default();
        let mut status = Status { run_id: 1, overruns: 2, ..Status::default() };
        status.lateness.record(900_000_000);
        totals.see_status(&status);
        let mut next = Status { run_id: 2, ..Status::default() };
        (0..999).for_each(|_| next.lateness.record(5_000));
        totals.see_status(&next);
        let summary = totals.summary();
        assert_eq!((summary.lateness_us.max, summary.overruns), (900_000.0, 2));
        assert!(summary.lateness_us.p99 < 5.2, "{summary:?}");
    }

    #[test]
    fn the_latency_of_a_show_covers_all_its_monitors() {
        let mut totals = ShowTotals::default();
        let times = |time_ns: u64| TimesReport::from(&times(&[time_ns]));
        totals.see_latency(&times(70_000));
        totals.close_monitor(3);
        totals.add_monitor(&MonitorSummary { frames: 4, latency: times(10_000), ..MonitorSummary::default() });
        totals.close_monitor(0);
        let summary = totals.summary();
        assert_eq!((summary.latency_us.max, summary.frames.monitored), (70.0, 7));
        assert!(summary.latency_us.p50 < 10.4, "{summary:?}");
    }

    fn times(times_ns: &[u64]) -> TimeHistogram {
        let mut histogram = TimeHistogram::default();
        for time_ns in times_ns {
            histogram.record(*time_ns);
        }
        histogram
    }

    #[test]
    fn only_the_newest_report_of_each_source_counts() {
        let mut merged = MergedTimes::default();
        assert_eq!(merged.all(), TimeHistogram::default());
        merged.report(7, &times(&[1]));
        merged.report(7, &times(&[1, 90_000]));
        merged.report(3, &times(&[2]));
        merged.report(3, &times(&[2, 3]));
        assert_eq!(merged.all(), times(&[1, 90_000, 2, 3]));
    }
}
