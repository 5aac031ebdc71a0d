//! What the children have reported, added up over their restarts.

use std::collections::BTreeMap;
use std::path::PathBuf;

use bench_dragon::histogram::Percentiles;
use bench_dragon::report::{ContactReport, FrameCounts, GuardReport, MonitorSummary, Restarts, ShowSummary};
use bench_dragon::server::ServerSummary;
use bench_dragon_ipc::{FrameHeader, Status};

use super::child::Role;

/// The show's books.
#[derive(Debug, Default)]
pub(super) struct Tally {
    /// Frames published in each run: by the server's own account, or as far as the show has seen them.
    published: BTreeMap<u64, u64>,
    monitored: u64,
    recorded: u64,
    overruns: BTreeMap<u64, u64>,
    lateness_us: Percentiles,
    latency_us: Percentiles,
    last_run_id: u64,
    pub(super) contact: Option<ContactReport>,
    pub(super) guard: Option<GuardReport>,
    restarts: Restarts,
}

impl Tally {
    /// Takes note of a frame that the show itself has seen.
    pub(super) fn see_frame(&mut self, header: &FrameHeader) {
        self.last_run_id = header.run_id;
        let published = self.published.entry(header.run_id).or_default();
        *published = (*published).max(header.tick + 1);
    }

    /// Takes note of a server's present account, for the case that it never gives its last one.
    pub(super) fn see_status(&mut self, status: &Status) {
        let micros = |nanos: u64| nanos as f64 * 1e-3;
        self.overruns.insert(status.run_id, status.overruns);
        self.lateness_us = Percentiles {
            p50: micros(status.lateness_p50_ns),
            p99: micros(status.lateness_p99_ns),
            p999: micros(status.lateness_p999_ns),
            max: micros(status.lateness_max_ns),
        };
    }

    /// Adds a server's last account.
    pub(super) fn add_server(&mut self, summary: &ServerSummary) {
        self.last_run_id = summary.run_id;
        self.published.insert(summary.run_id, summary.frames);
        self.overruns.insert(summary.run_id, summary.overruns);
        self.lateness_us = summary.lateness_us;
    }

    /// Adds a monitor's last account.
    pub(super) fn add_monitor(&mut self, summary: &MonitorSummary) {
        self.monitored += summary.frames;
        self.latency_us = summary.latency_us;
    }

    /// Adds frames that a monitor has read.
    pub(super) fn add_monitored(&mut self, frames: u64) {
        self.monitored += frames;
    }

    /// Adds frames that are in a recording.
    pub(super) fn add_recorded(&mut self, frames: u64) {
        self.recorded += frames;
    }

    /// How often each child of a role has been started again.
    pub(super) fn restarts(&mut self, role: Role) -> &mut u32 {
        match role {
            Role::Serve => &mut self.restarts.serve,
            Role::Monitor => &mut self.restarts.monitor,
            Role::Record => &mut self.restarts.record,
            Role::View => &mut self.restarts.view,
        }
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
            lateness_us: self.lateness_us,
            latency_us: self.latency_us,
            overruns: self.overruns.values().sum(),
            restarts: self.restarts,
            recording: recordings.first().cloned().unwrap_or_default(),
            recordings,
        }
    }
}
