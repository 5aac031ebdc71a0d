//! The reports of the children, read from the lines that they print.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Instant;

use anyhow::Context as _;
use bench_dragon_geometry::number::Fixed;
use bench_dragon_ipc::AlertKind;

use super::children::ChildRole;
use super::course::Course;
use super::cue_log::CueLog;
use super::live_line::{LiveLine, NearAlerts, ShowEnd};
use super::summary::ShowTotals;
use super::wall_time::{WallTime, log};
use crate::cli::flags::Format;
use crate::cli::monitor::lines::{AlertLine, ContactReport, MonitorLine, MonitorProgress};
use crate::cli::record::RecordLine;
use crate::cli::serve::ServeLine;
use crate::cli::timecode::{news_text, print_listening};
use crate::config::Cue;
use crate::source::server::StoppedBy;
use crate::source::timecode::FollowerEvent;

/// The reports of the children: their totals, and the values that the show itself needs.
#[derive(Default)]
pub(super) struct ChildReports {
    pub(super) totals: ShowTotals,
    pub(super) course: Course,
    pub(super) line: LiveLine,
    /// The last progress of the running monitor.
    pub(super) progress: MonitorProgress,
    /// Whether a child ended so often that the show went on without it.
    pub(super) has_given_up: bool,
    /// Whether the timecode runs, or ran when it was lost. Otherwise the show stands still with it.
    pub(super) has_timecode_run: bool,
    /// The address at which the server listens for timecode, once it does. The next server listens there, too.
    pub(super) timecode_listen: Option<SocketAddr>,
    /// The sender of the stop that ended the last server.
    pub(super) stopped_by: Option<StoppedBy>,
    near: NearAlerts,
    format: Format,
    /// The recording whose recorder has not reported its end yet.
    pub(super) open_recording: Option<PathBuf>,
}

impl ChildReports {
    pub(super) fn new(cues: &[Cue], start_s: f64, end: ShowEnd, format: Format) -> Self {
        let course = Course::begin(WallTime::now(), CueLog::of(cues));
        Self { course, line: LiveLine::new(start_s, end), format, ..Self::default() }
    }

    /// Handles a line of a child.
    pub(super) fn take_line(&mut self, role: ChildRole, line: &str) -> anyhow::Result<()> {
        let unreadable = || format!("a child printed an unreadable line: {line:?}");
        match role {
            ChildRole::Serve => self.take_serve_line(&serde_json::from_str(line).with_context(unreadable)?)?,
            ChildRole::Monitor => self.take_monitor_line(serde_json::from_str(line).with_context(unreadable)?),
            ChildRole::Record => self.take_record_line(&serde_json::from_str(line).with_context(unreadable)?),
            // A restarted page has the same address. The output of configured commands is in files.
            ChildRole::View | ChildRole::Also(_) => {}
        }
        Ok(())
    }

    /// Counts the frames of a monitor that has ended, by its last report. Frames that it read later count as missed.
    pub(super) fn close_monitor(&mut self) {
        let MonitorProgress { frames, .. } = std::mem::take(&mut self.progress);
        self.totals.close_monitor(frames);
    }

    fn take_serve_line(&mut self, line: &ServeLine) -> anyhow::Result<()> {
        match line {
            ServeLine::Started { .. } | ServeLine::TimecodeSummary(_) => {}
            ServeLine::Listening { listen } => self.take_timecode_address(*listen)?,
            ServeLine::Timecode(news) => {
                match news.event {
                    FollowerEvent::Follows { .. } => self.has_timecode_run = true,
                    FollowerEvent::Stands { .. } => self.has_timecode_run = false,
                    // No change: a show that stood still stays so.
                    FollowerEvent::Lost { .. } => {}
                }
                log(&news_text(news));
            }
            ServeLine::Summary(summary) => {
                self.stopped_by.clone_from(&summary.stopped_by);
                self.totals.add_server(summary);
            }
        }
        Ok(())
    }

    /// Reports the address for timecode once, because the server may have chosen the port.
    fn take_timecode_address(&mut self, listen: SocketAddr) -> anyhow::Result<()> {
        if self.timecode_listen.replace(listen) == Some(listen) {
            return Ok(());
        }
        print_listening(self.format, listen)
    }

    fn take_monitor_line(&mut self, line: MonitorLine) {
        match line {
            MonitorLine::Progress(progress) => {
                self.near.due(Instant::now()).iter().for_each(|line| log(line));
                self.totals.see_latency(&progress.latency);
                self.course.see_progress(&progress, WallTime::now());
                self.progress = progress;
            }
            // The show reads the commands from the bus, so that it has them without a monitor.
            MonitorLine::Command(_) => {}
            MonitorLine::Guard(report) => {
                log(&format!("{} s: held by the guard permanently{}", Fixed::<6>(report.held_at_s), report.details()));
                self.totals.summary.guard = Some(report);
            }
            MonitorLine::Summary(summary) => {
                self.near.rest(Instant::now()).iter().for_each(|line| log(line));
                self.totals.add_monitor(&summary);
                self.progress = MonitorProgress::default();
            }
            MonitorLine::Alert(alert) => self.take_alert(&alert),
        }
    }

    fn take_alert(&mut self, alert: &AlertLine) {
        self.course.see_alert(alert, WallTime::now());
        if alert.kind == AlertKind::Near.name() {
            self.near.take(alert, Instant::now()).iter().for_each(|line| log(line));
        } else {
            self.near.rest(Instant::now()).iter().for_each(|line| log(line));
            log(&alert.words());
            if let (true, Some(benches)) = (alert.kind == AlertKind::Contact.name(), alert.benches) {
                let named = alert.named.clone();
                self.totals.summary.contact.get_or_insert(ContactReport { time_s: alert.time_s, benches, named });
            }
        }
    }

    fn take_record_line(&mut self, line: &RecordLine) {
        match line {
            RecordLine::Started { file } => {
                self.totals.summary.recordings.push(file.clone());
                self.open_recording = Some(file.clone());
            }
            RecordLine::Warning { message } => log(&format!("warning: {message}")),
            RecordLine::Summary(summary) => {
                self.open_recording = None;
                self.totals.summary.frames.recorded += summary.frames;
            }
        }
    }
}
