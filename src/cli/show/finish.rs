//! The end of a show: the order in which its children end, and the summary and the report, which it writes whatever the end.

use std::fs;
use std::path::PathBuf;
use std::time::Duration;

use super::Show;
use super::children::ChildRole;
use super::process::END_TIMEOUT;
use super::report::ReportSource;
use super::summary::ShowSummary;
use super::wall_time::{WallTime, log};
use crate::cli::doctor::CheckSheet;
use crate::output::set_live_line;
use crate::system::machine::Machine;

impl Show<'_> {
    /// Ends the children in order, and writes the summary and the report. `played` is the result of [`Show::play`]. Returns the
    /// summary, unless the show has not begun, and the first error of the show and of its end.
    pub(super) fn finish(&mut self, played: anyhow::Result<()>) -> (Option<ShowSummary>, anyhow::Result<()>) {
        let ended = self.end_all(&played);
        let result = played.and(ended);
        if result.is_err() && self.seen.header.is_none() {
            self.folder.remove_unused();
            return (None, result);
        }
        let course = self.reports.course.report(WallTime::now());
        let summary = ShowSummary { course, ..self.reports.totals.summary() };
        let written = self.folder.write_summary(&summary).and(self.write_report(&summary));
        (Some(summary), result.and(written))
    }

    /// Ends the children in order, all of them also after an error. Returns the first error.
    fn end_all(&mut self, played: &anyhow::Result<()>) -> anyhow::Result<()> {
        let over = self.over();
        let stopped = self.end_children(|role| role == ChildRole::Serve, END_TIMEOUT + self.braking);
        // The last frame and status may still be in the buffers.
        let looked = self.look_at_bus();
        self.bus = None;
        let read = self.end_children(|role| role != ChildRole::View, END_TIMEOUT);
        // A child that was killed during its end has printed no summary.
        self.reports.close_monitor();
        // A monitor that lags finds a contact after the server has ended.
        let outcome = self.outcome(played, over);
        self.send_outcome(&outcome);
        self.reports.totals.summary.outcome = Some(outcome);
        self.finish_recording();
        set_live_line(None);
        let closed = self.end_children(|_| true, END_TIMEOUT);
        self.repairs.finish().into_iter().for_each(|repaired| self.count_repaired(repaired));
        stopped.and(looked).and(read).and(closed)
    }

    fn write_report(&self, summary: &ShowSummary) -> anyhow::Result<()> {
        let size = |path: &PathBuf| fs::metadata(path).ok().map(|file| file.len());
        let recordings: Vec<_> = summary.recordings.iter().map(|path| (path.clone(), size(path))).collect();
        // An unreadable sheet costs the report its first page alone.
        let checks = CheckSheet::read(&self.folder.path).inspect_err(|error| log(&format!("{error:#}"))).ok().flatten();
        let source = ReportSource {
            summary,
            config: self.config,
            config_file: self.args.run.config.config.as_deref(),
            folder: &fs::canonicalize(&self.folder.path).unwrap_or_else(|_| self.folder.path.clone()),
            instance: &self.domain.instance().to_string(),
            machine: &Machine::read(),
            checks: checks.as_ref(),
            recordings: &recordings,
        };
        self.folder.write_report(&source.report().html())
    }

    fn end_children(&mut self, is_meant: impl Fn(ChildRole) -> bool, timeout: Duration) -> anyhow::Result<()> {
        let Self { children, reports, .. } = self;
        children.end(is_meant, timeout, |role, line| reports.take_line(role, line))
    }
}
