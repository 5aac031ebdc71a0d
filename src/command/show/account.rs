//! What the children print, taken down: into the tally, and onto the live line.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Instant;

use anyhow::Context as _;
use bench_dragon_ipc::AlertKind;
use jiff::Timestamp;

use super::children::Role;
use super::live_line::{LiveLine, NearAlerts};
use super::summary::Tally;
use crate::cli::Format;
use crate::command::print::print_json;
use crate::output::report::{
    ContactReport, MonitorLine, MonitorProgress, RecordLine, RestartReport, ServeLine, ShowSummary, TimecodeEvent,
};

/// The show's account of itself.
#[derive(Debug)]
pub(super) struct Account {
    pub(super) tally: Tally,
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
    /// The recordings that were begun, oldest first.
    recordings: Vec<PathBuf>,
    /// The recording of which no account was given yet.
    open_recording: Option<PathBuf>,
}

impl Account {
    /// An empty account of a show between two show times.
    pub(super) fn new(start_s: f64, end_s: f64, format: Format) -> Self {
        Self {
            tally: Tally::default(),
            line: LiveLine::new(start_s, end_s),
            progress: MonitorProgress::default(),
            has_given_up: false,
            has_timecode_stood: true,
            timecode_listen: None,
            near: NearAlerts::default(),
            format,
            recordings: Vec::new(),
            open_recording: None,
        }
    }

    /// Takes down a line of a child.
    ///
    /// # Errors
    /// A line that is not one of the role's.
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

    /// Takes down the end of a child before that of the show.
    pub(super) fn take_end(
        &mut self,
        role: Role,
        name: &str,
        reason: String,
        show_time_s: Option<f64>,
        restarted: bool,
    ) {
        let at = format!("{:.3}", Timestamp::now());
        self.tally.add_end(role, RestartReport { role: name.to_owned(), reason, show_time_s, at, restarted });
    }

    /// Takes down what a monitor that has ended had last said; what it read after that counts as missed.
    pub(super) fn close_monitor(&mut self) {
        let MonitorProgress { frames, .. } = std::mem::take(&mut self.progress);
        self.tally.close_monitor(frames);
    }

    /// The file of a recorder that has ended without an account of it.
    pub(super) fn close_recorder(&mut self) -> Option<PathBuf> {
        self.open_recording.take()
    }

    /// The whole show.
    pub(super) fn summary(&self) -> ShowSummary {
        self.tally.summary(self.recordings.clone())
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
                self.line.say(&timecode.to_string());
            }
            ServeLine::Summary(summary) => self.tally.add_server(summary),
        }
        Ok(())
    }

    /// Reports where timecode has to be sent, once: the port may be one that the server chose.
    fn take_timecode_address(&mut self, listen: SocketAddr) -> anyhow::Result<()> {
        if self.timecode_listen.replace(listen) == Some(listen) {
            return Ok(());
        }
        match self.format {
            Format::Json => print_json(&ServeLine::Listening { listen }),
            Format::Text => {
                self.line.say(&format!("listening for timecode on {listen}; the show stands until the first one"));
                Ok(())
            }
        }
    }

    fn take_monitor_line(&mut self, line: MonitorLine) {
        match line {
            MonitorLine::Progress(progress) => {
                let near = self.near.due(Instant::now());
                self.say(near);
                self.tally.see_latency(&progress.latency);
                self.progress = progress;
            }
            // The recording has them, and whoever sent one has had its answer.
            MonitorLine::Command(_) => {}
            MonitorLine::Guard(report) => {
                self.line.say(&format!("{:.6} s: held by the guard for good", report.held_at_s));
                self.tally.guard = Some(report);
            }
            MonitorLine::Summary(summary) => {
                let near = self.near.rest(Instant::now());
                self.say(near);
                self.tally.add_monitor(&summary);
                self.progress = MonitorProgress::default();
            }
            MonitorLine::Alert(alert) if alert.kind == AlertKind::Near.name() => {
                let near = self.near.take(&alert, Instant::now());
                self.say(near);
            }
            MonitorLine::Alert(alert) => {
                let near = self.near.rest(Instant::now());
                self.say(near);
                let benches = alert.benches.map_or(String::new(), |[a, b]| format!(", benches {a} and {b}"));
                self.line.say(&format!("{:.6} s: {}{benches}", alert.time_s, alert.kind));
                if let (true, Some(benches)) = (alert.kind == AlertKind::Contact.name(), alert.benches) {
                    self.tally.contact.get_or_insert(ContactReport { time_s: alert.time_s, benches });
                }
            }
        }
    }

    fn say(&self, line: Option<String>) {
        if let Some(line) = line {
            self.line.say(&line);
        }
    }

    fn take_record_line(&mut self, line: &RecordLine) {
        match line {
            RecordLine::Started { file } => {
                self.recordings.push(file.clone());
                self.open_recording = Some(file.clone());
            }
            RecordLine::Warning { message } => self.line.say(&format!("warning: {message}")),
            RecordLine::Summary(summary) => {
                self.open_recording = None;
                self.tally.add_recorded(summary.frames);
            }
        }
    }
}
