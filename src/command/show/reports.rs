//! What the children report by the lines that they print.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Instant;

use anyhow::Context as _;
use bench_dragon_ipc::AlertKind;

use super::children::Role;
use super::live_line::{LiveLine, NearAlerts};
use super::summary::Totals;
use crate::cli::Format;
use crate::command::print::complain;
use crate::command::timecode::print_listening;
use crate::output::report::{ContactReport, MonitorLine, MonitorProgress, RecordLine, ServeLine, TimecodeEvent};

/// The reports of the children: added up, and what of them the show needs by itself.
pub(super) struct ChildReports {
    pub(super) totals: Totals,
    pub(super) line: LiveLine,
    /// What the running monitor has last said.
    pub(super) progress: MonitorProgress,
    /// Whether a child ended so often that the show went on without it.
    pub(super) has_given_up: bool,
    /// Whether the timecode stands, or none has come yet: then the show stands with it.
    pub(super) has_timecode_stood: bool,
    /// Where the server listens for timecode, once it does. The next server listens there too.
    pub(super) timecode_listen: Option<SocketAddr>,
    near: NearAlerts,
    format: Format,
    /// The recording whose recorder has not reported its end yet.
    pub(super) open_recording: Option<PathBuf>,
}

impl ChildReports {
    pub(super) fn new(start_s: f64, end_s: f64, format: Format) -> Self {
        Self {
            totals: Totals::default(),
            line: LiveLine::new(start_s, end_s),
            progress: MonitorProgress::default(),
            has_given_up: false,
            has_timecode_stood: true,
            timecode_listen: None,
            near: NearAlerts::default(),
            format,
            open_recording: None,
        }
    }

    /// Takes a line of a child.
    pub(super) fn take_line(&mut self, role: Role, line: &str) -> anyhow::Result<()> {
        let unreadable = || format!("a child printed {line:?}");
        match role {
            Role::Serve => self.take_serve_line(&serde_json::from_str(line).with_context(unreadable)?)?,
            Role::Monitor => self.take_monitor_line(serde_json::from_str(line).with_context(unreadable)?),
            Role::Record => self.take_record_line(&serde_json::from_str(line).with_context(unreadable)?),
            // Of a page only where it listens, which is where it did before. The others' lines are in their files.
            Role::View | Role::Also(_) => {}
        }
        Ok(())
    }

    /// Counts the frames of a monitor that has ended, by its last report; what it read after that counts as missed.
    pub(super) fn close_monitor(&mut self) {
        let MonitorProgress { frames, .. } = std::mem::take(&mut self.progress);
        self.totals.close_monitor(frames);
    }

    fn take_serve_line(&mut self, line: &ServeLine) -> anyhow::Result<()> {
        match line {
            ServeLine::Started { .. } | ServeLine::TimecodeSummary(_) => {}
            ServeLine::Listening { listen } => self.take_timecode_address(*listen)?,
            ServeLine::Timecode(timecode) => {
                match timecode.event {
                    TimecodeEvent::Follows => self.has_timecode_stood = false,
                    TimecodeEvent::Stands => self.has_timecode_stood = true,
                    // As before: one that stood goes on standing.
                    TimecodeEvent::Lost => {}
                }
                complain(&timecode.to_string());
            }
            ServeLine::Summary(summary) => self.totals.add_server(summary),
        }
        Ok(())
    }

    /// Reports where timecode has to be sent, once: the port may be one that the server chose.
    fn take_timecode_address(&mut self, listen: SocketAddr) -> anyhow::Result<()> {
        if self.timecode_listen.replace(listen) == Some(listen) {
            return Ok(());
        }
        print_listening(self.format, listen)
    }

    fn take_monitor_line(&mut self, line: MonitorLine) {
        match line {
            MonitorLine::Progress(progress) => {
                self.near.due(Instant::now()).iter().for_each(|line| complain(line));
                self.totals.see_latency(&progress.latency);
                self.progress = progress;
            }
            // The recording has them, and whoever sent one has had its answer.
            MonitorLine::Command(_) => {}
            MonitorLine::Guard(report) => {
                complain(&format!("{:.6} s: held by the guard for good", report.held_at_s));
                self.totals.guard = Some(report);
            }
            MonitorLine::Summary(summary) => {
                self.near.rest(Instant::now()).iter().for_each(|line| complain(line));
                self.totals.add_monitor(&summary);
                self.progress = MonitorProgress::default();
            }
            MonitorLine::Alert(alert) if alert.kind == AlertKind::Near.name() => {
                self.near.take(&alert, Instant::now()).iter().for_each(|line| complain(line));
            }
            MonitorLine::Alert(alert) => {
                self.near.rest(Instant::now()).iter().for_each(|line| complain(line));
                let benches = alert.benches.map_or(String::new(), |[a, b]| format!(", benches {a} and {b}"));
                complain(&format!("{:.6} s: {}{benches}", alert.time_s, alert.kind));
                if let (true, Some(benches)) = (alert.kind == AlertKind::Contact.name(), alert.benches) {
                    self.totals.contact.get_or_insert(ContactReport { time_s: alert.time_s, benches });
                }
            }
        }
    }

    fn take_record_line(&mut self, line: &RecordLine) {
        match line {
            RecordLine::Started { file } => {
                self.totals.recordings.push(file.clone());
                self.open_recording = Some(file.clone());
            }
            RecordLine::Warning { message } => complain(&format!("warning: {message}")),
            RecordLine::Summary(summary) => {
                self.open_recording = None;
                self.totals.recorded += summary.frames;
            }
        }
    }
}
