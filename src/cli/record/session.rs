//! A running recorder: it passes all that arrives on the bus to the file, and reports its progress.

use std::thread;
use std::time::{Duration, Instant};

use bench_dragon_geometry::formation::Layout;
use bench_dragon_ipc::{AlertSubscriber, BusError, Domain, FrameHeader, FrameSubscriber, ReaderReport};

use super::{RecordLine, RecordSummary};
use crate::cli::bus_readers::{FrameReading, Next, RunPorts};
use crate::cli::flags::Format;
use crate::cli::print::print_notice;
use crate::recording::{Recorder, SpaceWarning, walking_bytes_per_s};
use crate::source::described_rate_hz;
use crate::system::clock::monotonic_ns;
use crate::system::stop::StopFlag;

/// Period at which the recorder checks the written bytes and the room on the disk.
const PROGRESS_PERIOD: Duration = Duration::from_secs(1);
/// Period at which the recorder repeats a warning whose cause persists.
const WARNING_PERIOD: Duration = Duration::from_mins(1);
/// Longest wait at the end of a recording for the command events of its last frames. A source sends events ten times a second.
const COMMAND_TIMEOUT: Duration = Duration::from_secs(2);
const LOOK_PERIOD: Duration = Duration::from_millis(1);

/// All that a recorder reads.
pub(super) struct RecordPorts {
    pub(super) run: RunPorts,
    alerts: AlertSubscriber,
}

impl RecordPorts {
    pub(super) fn open(domain: &Domain, stop: &StopFlag) -> Result<Self, BusError> {
        let (run, alerts) = RunPorts::open(domain, "record", stop, || AlertSubscriber::open(domain, "record-alerts"))?;
        Ok(Self { run, alerts })
    }
}

/// A running recorder, over any number of runs.
pub(super) struct RecordSession {
    format: Format,
    recorder: Recorder,
    /// Run id and tick of the newest frame.
    newest: Option<(u64, u64)>,
    /// The part of the summary that is known before the end.
    summary: RecordSummary,
    progress_due: Instant,
    warning_due: Instant,
}

impl RecordSession {
    pub(super) fn new(format: Format, recorder: Recorder) -> Self {
        let now = Instant::now();
        Self { format, recorder, newest: None, summary: RecordSummary::default(), progress_due: now, warning_due: now }
    }

    /// Records frame after frame; after a signal, only frames that were published before it.
    pub(super) fn read_frames(&mut self, ports: &mut RecordPorts, stop: &StopFlag) -> anyhow::Result<()> {
        let mut reading = FrameReading::until(stop);
        loop {
            let next = reading.poll(&mut ports.run.frames)?;
            if let Next::Frame(frame) = &next {
                self.describe(frame.header(), ports, stop)?;
            } else if self.newest.is_none() && matches!(next, Next::Nothing) {
                // The channels of a file depend on the description, which comes with the first frame.
                continue;
            }
            while let Some(alert) = ports.alerts.receive()? {
                self.recorder.record(&alert, monotonic_ns())?;
            }
            self.take_commands(ports)?;
            match next {
                Next::Frame(frame) => self.recorder.frame(frame.header(), frame.handles())?,
                Next::Nothing => {}
                Next::End => return Ok(()),
            }
            self.summary.lost = ports.run.frames.lost();
            self.look_at_progress(&mut ports.run.frames)?;
        }
    }

    /// Records the description of a frame's run before the first frame.
    fn describe(&mut self, header: &FrameHeader, ports: &mut RecordPorts, stop: &StopFlag) -> anyhow::Result<()> {
        let FrameHeader { run_id, tick, .. } = *header;
        if self.newest.is_none_or(|(known, _)| known != run_id)
            && let Some(description) = ports.run.descriptions.of(run_id, stop)?
        {
            self.recorder.describe(run_id, &description.toml)?;
            let layout = Layout::of(header.dragons().iter().map(|dragon| dragon.bench_count as usize));
            self.recorder.expect_growth(walking_bytes_per_s(&layout, described_rate_hz(&description.toml)));
        }
        self.newest = Some((run_id, tick));
        Ok(())
    }

    fn take_commands(&mut self, ports: &mut RecordPorts) -> anyhow::Result<()> {
        let Some(commands) = &mut ports.run.commands else { return Ok(()) };
        while let Some(event) = commands.receive()? {
            self.recorder.record(&event, monotonic_ns())?;
        }
        self.summary.commands_lost = commands.lost;
        Ok(())
    }

    /// Records the command events up to the last frame, which arrive after that frame. `replay --verify` needs them for the
    /// last frames.
    pub(super) fn take_last_commands(&mut self, ports: &mut RecordPorts) -> anyhow::Result<()> {
        let Some((run_id, tick)) = self.newest else { return Ok(()) };
        let deadline = Instant::now() + COMMAND_TIMEOUT;
        loop {
            // The check comes first: if it succeeds, all events are in the buffer, and `take_commands` receives them.
            let is_complete =
                ports.run.commands.as_mut().map_or(Ok(true), |commands| commands.is_complete(run_id, tick))?;
            self.take_commands(ports)?;
            if is_complete {
                return Ok(());
            }
            if Instant::now() >= deadline {
                tracing::warn!(
                    "commands of the last frames may be missing: the server has published no status up to tick {tick}"
                );
                return Ok(());
            }
            thread::sleep(LOOK_PERIOD);
        }
    }

    /// Reports the written bytes to the bus, and prints a warning if the disk is filling up.
    fn look_at_progress(&mut self, frames: &mut FrameSubscriber) -> anyhow::Result<()> {
        let now = Instant::now();
        if now < self.progress_due {
            return Ok(());
        }
        self.progress_due = now + PROGRESS_PERIOD;
        let progress = self.recorder.progress();
        frames.set_bytes_written(progress.bytes_written);
        frames.set_room(progress.seconds_until_full.unwrap_or(ReaderReport::NO_ROOM));
        match progress.warning {
            Some(warning) if now >= self.warning_due => {
                self.warning_due = now + WARNING_PERIOD;
                self.print_warning(&warning)
            }
            _ => Ok(()),
        }
    }

    fn print_warning(&self, warning: &SpaceWarning) -> anyhow::Result<()> {
        let text = format!("warning: {warning}");
        print_notice(self.format, &RecordLine::Warning { message: warning.to_string() }, &text)
    }

    pub(super) fn finish(self) -> anyhow::Result<RecordSummary> {
        let begun = self.recorder.progress().files;
        let summary = self.recorder.finish()?;
        Ok(RecordSummary {
            frames: summary.frames,
            alerts: summary.alerts,
            commands: summary.commands,
            bytes: summary.bytes,
            removed: begun.saturating_sub(summary.files.len() as u64),
            files: summary.files,
            ..self.summary
        })
    }
}
