//! The frames, alerts and commands of a recording that are exported, as they are read.

use bench_dragon_ipc::FrameHeader;

use super::error::ExportError;
use super::sampling::Sampling;
use super::{ExportCounts, ExportSettings, Subject};
use crate::recording::{Configuration, Flaws, FrameReader, IntervalSearch, Recorded};

/// Reads what is exported, one after the other; the file is never in memory as a whole.
#[derive(Debug)]
pub struct Selection {
    settings: ExportSettings,
    reader: FrameReader,
    sampling: Sampling,
    counts: ExportCounts,
    last_run_id: Option<u64>,
    search: IntervalSearch,
}

impl Selection {
    /// Opens the recording.
    ///
    /// # Errors
    /// [`ExportError::Open`].
    pub fn open(settings: ExportSettings) -> Result<Self, ExportError> {
        Ok(Self {
            reader: FrameReader::open(&settings.file).map_err(ExportError::Open)?,
            sampling: Sampling::new(settings.every_ns),
            search: IntervalSearch::new(settings.interval),
            settings,
            counts: ExportCounts::default(),
            last_run_id: None,
        })
    }

    /// The next frame, alert or event of a command that is to be written.
    ///
    /// # Errors
    /// [`ExportError::Read`]; and at the end, where frames were asked for and there was none,
    /// [`ExportError::Nothing`].
    pub fn next_recorded(&mut self) -> Result<Option<Recorded>, ExportError> {
        loop {
            let Some(recorded) = self.read()? else { return self.end().map(|()| None) };
            let ExportSettings { interval, subject, with_events, .. } = self.settings;
            let is_of = |events: Subject, time_ns| (with_events || subject == events) && interval.contains(time_ns);
            match &recorded {
                Recorded::Frame(frame) => self.count_frame(&frame.header),
                Recorded::Alert(alert) if is_of(Subject::Alerts, alert.sim_time_ns) => self.counts.alerts += 1,
                Recorded::Command(event) if is_of(Subject::Commands, event.sim_time_ns) => self.counts.commands += 1,
                Recorded::Alert(_) | Recorded::Command(_) => continue,
            }
            return Ok(Some(recorded));
        }
    }

    /// The configuration of the frame that was read last.
    pub fn configuration(&self) -> Option<&Configuration> {
        self.reader.configuration()
    }

    /// How far into the file the last frame is, in bytes.
    pub fn position(&self) -> u64 {
        self.reader.position()
    }

    /// What is exported.
    pub fn settings(&self) -> &ExportSettings {
        &self.settings
    }

    /// How much has been exported so far.
    pub fn counts(&self) -> ExportCounts {
        self.counts
    }

    /// Counts rows that were written.
    pub(super) fn count_rows(&mut self, rows: u64) {
        *self.counts.rows.get_or_insert(0) += rows;
    }

    /// What could not be read; known once all is read.
    pub fn flaws(&self) -> Flaws {
        self.reader.flaws()
    }

    fn read(&mut self) -> Result<Option<Recorded>, ExportError> {
        let Self { settings: ExportSettings { subject, .. }, reader, sampling, search, .. } = self;
        let is_wanted = |header: &FrameHeader| {
            let time_ns = header.sim_time_ns;
            let is_taken = search.comes_by(time_ns) && sampling.takes(header.run_id, time_ns);
            is_taken && subject.has_frames()
        };
        reader.next_wanted(is_wanted).map_err(ExportError::Read)
    }

    fn count_frame(&mut self, header: &FrameHeader) {
        self.counts.frames += 1;
        if self.last_run_id.replace(header.run_id) != Some(header.run_id) {
            self.counts.runs += 1;
        }
    }

    fn end(&self) -> Result<(), ExportError> {
        if self.counts.frames > 0 || !self.settings.subject.has_frames() {
            return Ok(());
        }
        Err(self.search.nothing_found(&self.settings.file, self.flaws()).into())
    }
}
