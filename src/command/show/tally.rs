//! What the children have reported, added up over their restarts.

use std::collections::BTreeMap;
use std::path::PathBuf;

use bench_dragon_ipc::{FrameHeader, Status};

use super::merged_times::MergedTimes;
use super::role::Role;
use crate::output::histogram::Percentiles;
use crate::output::report::{
    ContactReport, FrameCounts, GuardReport, MonitorSummary, RestartReport, Restarts, ShowSummary, TimesReport,
};
use crate::source::server::ServerSummary;

/// The show's books. What grows with it grows with its restarts alone, of which patience allows one a minute for each child.
#[derive(Debug, Default)]
pub(super) struct Tally {
    /// Frames published in each run: by the server's own account, or as far as the show has seen them.
    published: BTreeMap<u64, u64>,
    monitored: u64,
    recorded: u64,
    overruns: BTreeMap<u64, u64>,
    behind_s: f64,
    most_behind_s: f64,
    lateness: MergedTimes,
    latency: MergedTimes,
    /// Monitors that have ended.
    monitors: u64,
    last_run_id: u64,
    pub(super) contact: Option<ContactReport>,
    pub(super) guard: Option<GuardReport>,
    restarts: Restarts,
    restart_log: Vec<RestartReport>,
}

impl Tally {
    /// Takes note of a frame that the show itself has seen.
    pub(super) fn see_frame(&mut self, header: &FrameHeader) {
        self.last_run_id = header.run_id;
        let published = self.published.entry(header.run_id).or_default();
        *published = (*published).max(header.tick + 1);
    }

    /// Takes note of a server's present account.
    pub(super) fn see_status(&mut self, status: &Status) {
        self.overruns.insert(status.run_id, status.overruns);
        let seconds = |nanos: u64| nanos as f64 * 1e-9;
        self.see_behind(seconds(status.behind_ns), seconds(status.most_behind_ns));
        self.lateness.report(status.run_id, &status.lateness);
    }

    /// Adds a server's last account.
    pub(super) fn add_server(&mut self, summary: &ServerSummary) {
        self.last_run_id = summary.run_id;
        self.published.insert(summary.run_id, summary.frames);
        self.overruns.insert(summary.run_id, summary.overruns);
        self.see_behind(summary.behind_s, summary.most_behind_s);
    }

    /// Takes note of the latency that the present monitor has measured so far.
    pub(super) fn see_latency(&mut self, latency: &TimesReport) {
        self.latency.report(self.monitors, &latency.into());
    }

    /// Takes note of how far a server is behind the clock, and the furthest that it has been.
    fn see_behind(&mut self, behind_s: f64, most_behind_s: f64) {
        self.behind_s = behind_s;
        self.most_behind_s = self.most_behind_s.max(most_behind_s);
    }

    /// Adds a monitor's last account.
    pub(super) fn add_monitor(&mut self, summary: &MonitorSummary) {
        self.see_latency(&summary.latency);
        self.monitored += summary.frames;
    }

    /// Adds frames that a monitor has read which has ended.
    pub(super) fn close_monitor(&mut self, frames: u64) {
        self.monitored += frames;
        self.monitors += 1;
    }

    /// Adds frames that are in a recording.
    pub(super) fn add_recorded(&mut self, frames: u64) {
        self.recorded += frames;
    }

    /// Adds a child that ended before the show.
    pub(super) fn add_end(&mut self, role: Role, end: RestartReport) {
        let Restarts { serve, monitor, record, view, also } = &mut self.restarts;
        let count = match role {
            Role::Serve => serve,
            Role::Monitor => monitor,
            Role::Record => record,
            Role::View => view,
            Role::Also(_) => also.entry(end.role.clone()).or_default(),
        };
        *count += u32::from(end.restarted);
        self.restart_log.push(end);
    }

    /// The whole show.
    pub(super) fn summary(&self, recordings: Vec<PathBuf>) -> ShowSummary {
        let published = self.published.values().sum::<u64>();
        ShowSummary {
            run_id: self.last_run_id,
            frames: FrameCounts {
                published,
                monitored: self.monitored,
                recorded: self.recorded,
                missed_by_monitor: published.saturating_sub(self.monitored),
                missed_by_recorder: published.saturating_sub(self.recorded),
            },
            contact: self.contact,
            guard: self.guard,
            lateness_us: Percentiles::from(&self.lateness.all()),
            latency_us: Percentiles::from(&self.latency.all()),
            overruns: self.overruns.values().sum(),
            behind_s: self.behind_s,
            most_behind_s: self.most_behind_s,
            restarts: self.restarts.clone(),
            restart_log: self.restart_log.clone(),
            recording: recordings.first().cloned().unwrap_or_default(),
            recordings,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bench_dragon_ipc::TimeHistogram;

    #[test]
    fn the_lateness_of_a_show_is_that_of_all_its_servers() {
        let mut tally = Tally::default();
        let mut status = Status { run_id: 1, overruns: 2, ..Status::default() };
        status.lateness.record(900_000_000);
        tally.see_status(&status);
        let mut next = Status { run_id: 2, ..Status::default() };
        (0..999).for_each(|_| next.lateness.record(5_000));
        tally.see_status(&next);
        let summary = tally.summary(Vec::new());
        assert_eq!((summary.lateness_us.max, summary.overruns), (900_000.0, 2));
        assert!(summary.lateness_us.p99 < 5.2, "{summary:?}");
    }

    #[test]
    fn the_latency_of_a_show_is_that_of_all_its_monitors() {
        let mut tally = Tally::default();
        let times = |time_ns: u64| {
            let mut times = TimeHistogram::default();
            times.record(time_ns);
            TimesReport::from(&times)
        };
        tally.see_latency(&times(70_000));
        tally.close_monitor(3);
        tally.add_monitor(&MonitorSummary { frames: 4, latency: times(10_000), ..MonitorSummary::default() });
        tally.close_monitor(0);
        let summary = tally.summary(Vec::new());
        assert_eq!((summary.latency_us.max, summary.frames.monitored), (70.0, 7));
        assert!(summary.latency_us.p50 < 10.4, "{summary:?}");
    }
}
