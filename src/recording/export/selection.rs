//! Selects the frames, alerts and commands of a recording for the export.

use std::sync::Arc;

use bench_dragon_ipc::{CommandEvent, EventKind, FrameHeader};

use super::{ExportCounts, ExportError, ExportFindings, ExportSettings, ExportSubject};
use crate::recording::{IntervalSearch, PartsReader, Recorded};

/// Reads the selected frames and messages one after the other. The whole file is never in memory.
#[derive(Debug)]
pub(crate) struct Selection {
    pub(super) settings: ExportSettings,
    /// Counts of the export so far.
    pub(crate) counts: ExportCounts,
    /// Reader of the recording.
    pub(crate) reader: PartsReader,
    sampling: Sampling,
    last_run_id: Option<u64>,
    search: IntervalSearch,
}

impl Selection {
    pub(crate) fn open(settings: ExportSettings) -> Self {
        Self {
            reader: PartsReader::new(Arc::clone(&settings.parts)),
            sampling: Sampling::new(settings.every_ns),
            search: IntervalSearch::new(settings.interval),
            settings,
            counts: ExportCounts::default(),
            last_run_id: None,
        }
    }

    /// Ends the reading. Returns the parts that could not be read, and the gaps.
    pub(crate) fn into_findings(self) -> ExportFindings {
        ExportFindings { coverage: self.reader.coverage(), flawed: self.reader.into_flawed() }
    }

    /// Returns the next selected frame, alert or command event. At the end, fails if the subject needs frames and the selection
    /// had none.
    pub(crate) fn next_recorded(&mut self) -> Result<Option<Recorded>, ExportError> {
        loop {
            let Some(recorded) = self.read()? else {
                if self.counts.frames == 0 && self.settings.subject.has_frames() {
                    return Err(self.search.nothing_found(&self.settings.parts.named, self.reader.flaws()).into());
                }
                return Ok(None);
            };
            let ExportSettings { interval, subject, has_events, has_grants, .. } = self.settings;
            let is_of =
                |events: ExportSubject, time_ns| (has_events || subject == events) && interval.contains(time_ns);
            match &recorded {
                Recorded::Frame(frame) => self.count_frame(&frame.header),
                Recorded::Alert(alert) if is_of(ExportSubject::Alerts, alert.alert.show_time_ns) => {
                    self.counts.alerts += 1;
                }
                Recorded::Command(event) if is_plain_grant(event) && !has_grants => continue,
                Recorded::Command(event) if is_of(ExportSubject::Commands, event.show_time_ns) => {
                    self.counts.commands += 1;
                }
                _ => continue,
            }
            return Ok(Some(recorded));
        }
    }

    fn read(&mut self) -> Result<Option<Recorded>, ExportError> {
        let Self { settings: ExportSettings { subject, .. }, reader, sampling, search, .. } = self;
        let is_wanted = |header: &FrameHeader| {
            let time_ns = header.show_time_ns;
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
}

/// Whether an event is a grant of a guard that the server has accepted.
fn is_plain_grant(event: &CommandEvent) -> bool {
    event.event_kind() == Some(EventKind::Grant) && event.outcome().is_ok()
}

/// Chooses the first frame of each run, the first frame in each step of show time, and the first frame after show time goes
/// back. A step begins at each whole multiple of its length.
///
/// For example, a step of 1 s chooses the frames at 0, 1 and 2 s, if such frames exist. A pause adds no frame. After a seek
/// back, the frames are chosen again.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sampling {
    every_ns: i64,
    /// Run and show time of the previous frame.
    last: Option<(u64, i64)>,
}

impl Sampling {
    /// Takes a step in nanoseconds of show time, 0 or more; 0 chooses every frame.
    fn new(every_ns: i64) -> Self {
        assert!(every_ns >= 0, "the command line rejects a negative step");
        Self { every_ns, last: None }
    }

    /// Whether the frame of a run at a show time is chosen. Call it for frames in their order.
    fn takes(&mut self, run_id: u64, show_time_ns: i64) -> bool {
        if self.every_ns == 0 {
            return true;
        }
        let step = |time_ns: i64| time_ns.div_euclid(self.every_ns);
        let last = self.last.replace((run_id, show_time_ns));
        last.is_none_or(|(last_run_id, last_ns)| {
            last_run_id != run_id || step(last_ns) != step(show_time_ns) || show_time_ns < last_ns
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken(every_ns: i64, times_ns: &[i64]) -> Vec<i64> {
        let mut sampling = Sampling::new(every_ns);
        times_ns.iter().copied().filter(|&time_ns| sampling.takes(7, time_ns)).collect()
    }

    #[test]
    fn first_frame_of_each_step_is_chosen() {
        assert_eq!(taken(10, &(0..=30).collect::<Vec<_>>()), [0, 10, 20, 30]);
        assert_eq!(taken(10, &[3, 6, 9, 12, 15, 18, 21, 24]), [3, 12, 21]);
        assert_eq!(taken(10, &[-11, -10, -5, -1, 0, 5]), [-11, -10, 0], "show times may be negative");
    }

    #[test]
    fn pause_adds_no_frame_and_seek_back_chooses_frames_again() {
        assert_eq!(taken(10, &[8, 9, 10, 10, 10, 11]), [8, 10]);
        assert_eq!(taken(10, &[30, 31, 12, 13, 20]), [30, 12, 20]);
        assert_eq!(taken(10, &[30, 38, 34, 35, 40]), [30, 34, 40], "seek back within a step");
    }

    #[test]
    fn first_frame_of_each_run_is_chosen() {
        let mut sampling = Sampling::new(10);
        assert!(sampling.takes(7, 1) && !sampling.takes(7, 2) && sampling.takes(8, 2));
    }

    #[test]
    fn step_of_zero_chooses_every_frame() {
        assert_eq!(taken(0, &[5, 5, 6]), [5, 5, 6]);
    }
}
