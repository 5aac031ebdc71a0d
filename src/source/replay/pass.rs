//! Pass: one replay of a recorded run.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use bench_dragon_ipc::{BusError, FrameHeader, Refusal, Request};
use crossbeam::channel::RecvTimeoutError;
use serde::{Deserialize, Serialize};

use super::read_ahead::{PlannedFrame, RecordedRun};
use super::{COMMAND_PERIOD, Replay};
use crate::output::histogram::Percentiles;
use crate::source::{Moment, SourcePorts, TimesOfAll};
use crate::system::clock::{monotonic_ns, sleep_precisely, sleep_until};

/// Results of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PassSummary {
    /// Number of the run on the bus.
    pub run_id: u64,
    /// Number of the recorded run.
    pub recorded_run_id: u64,
    /// Frames published.
    pub frames: u64,
    /// Frames between the first and the last one that the recorder lost.
    pub missing: u64,
    /// Show time of the last frame, in seconds.
    pub sim_time_s: f64,
    /// Number of frames that were late.
    pub overruns: u64,
    /// From each frame's due time to the start of its tick, in microseconds.
    pub lateness_us: Percentiles,
    /// From the start of each tick until the loop was ready for the next one, in microseconds.
    pub tick_us: Percentiles,
}

/// A recorded run with its services on the bus, before its first frame.
#[derive(Debug)]
pub(crate) struct Pass<'a> {
    replay: &'a mut Replay,
    run: RecordedRun,
    ports: SourcePorts,
    tick: u64,
    sim_time_s: f64,
    missing: u64,
    overruns_before: u64,
}

impl<'a> Pass<'a> {
    pub(super) fn new(replay: &'a mut Replay, run: RecordedRun, ports: SourcePorts) -> Self {
        let overruns_before = replay.clock.overruns();
        Self { replay, run, ports, tick: 0, sim_time_s: 0.0, missing: 0, overruns_before }
    }

    pub(crate) fn run_id(&self) -> u64 {
        self.ports.run_id
    }

    pub(crate) fn recorded_run_id(&self) -> u64 {
        self.run.configuration.run_id
    }

    /// Publishes frames until the recorded run ends, `stop` is set, or a client sends a stop.
    pub(crate) fn play(mut self, stop: &AtomicBool) -> Result<PassSummary, BusError> {
        sleep_precisely();
        self.wait_for_readers(stop);
        while let Some(frame) = self.next_frame(stop) {
            self.play_frame(frame, stop)?;
        }
        Ok(self.into_summary())
    }

    fn play_frame(
        &mut self,
        PlannedFrame { frame, due_ns, missing, .. }: PlannedFrame,
        stop: &AtomicBool,
    ) -> Result<(), BusError> {
        let due_ns = self.replay.clock.due_ns(due_ns, monotonic_ns());
        self.wait_until(due_ns, stop);
        if self.replay.is_stopped {
            return Ok(());
        }
        let begun_ns = monotonic_ns();
        let header = FrameHeader { time_scale: frame.header.time_scale * self.replay.clock.rate(), ..frame.header };
        let tick = self.tick;
        self.ports.publish_copy(&header, &frame.handles, tick, due_ns)?;
        self.missing = self.missing.saturating_add(missing);
        self.sim_time_s = header.sim_time_s();
        self.tick += 1;
        let overruns = self.overruns();
        self.ports.report.report_frame(&FrameHeader { tick, ..header }, overruns);
        self.ports.report.report_behind(self.replay.clock.behind_ns());
        // After the last frame the reading thread has ended. Then the frame is dropped here.
        let _ = self.run.played.send(frame);
        self.ports.report.count(begun_ns - due_ns, monotonic_ns() - begun_ns);
        Ok(())
    }

    /// Waits for the next frame; `None` at the end of the recorded run, or where the replay is stopped.
    fn next_frame(&mut self, stop: &AtomicBool) -> Option<PlannedFrame> {
        while !self.replay.is_stopped {
            match self.run.frames.recv_timeout(COMMAND_PERIOD) {
                Ok(frame) => return Some(frame),
                Err(RecvTimeoutError::Disconnected) => return None,
                Err(RecvTimeoutError::Timeout) => self.look_for_stop(stop),
            }
        }
        None
    }

    /// Waits for an instant, or until the replay is stopped.
    fn wait_until(&mut self, due_ns: u64, stop: &AtomicBool) {
        self.look_for_stop(stop);
        while !self.replay.is_stopped {
            let now_ns = monotonic_ns();
            if now_ns >= due_ns {
                return;
            }
            let is_far = due_ns - now_ns > COMMAND_PERIOD.as_nanos() as u64;
            sleep_until(if is_far { now_ns + COMMAND_PERIOD.as_nanos() as u64 } else { due_ns });
            if is_far || stop.load(Ordering::Relaxed) {
                self.look_for_stop(stop);
            }
        }
    }

    /// Replies to the waiting commands, and notes a stop by a client or a signal.
    fn look_for_stop(&mut self, stop: &AtomicBool) {
        let mut asked_to_stop = false;
        let sim_time_ns = (self.sim_time_s * 1e9).round() as i64;
        let moment = Moment { sim_time_ns, overruns: self.overruns() };
        self.ports.take_commands(self.tick, moment, |request| match request {
            Request::Stop => {
                asked_to_stop = true;
                Ok(())
            }
            _ => Err(Refusal::Replayed),
        });
        self.replay.is_stopped |= asked_to_stop || stop.load(Ordering::Relaxed);
    }

    fn wait_for_readers(&mut self, stop: &AtomicBool) {
        const LOOK_PERIOD: Duration = Duration::from_millis(1);
        let is_first = self.replay.summary.passes == 1;
        let expected = if is_first { self.replay.settings.readers } else { 0 };
        let begun = Instant::now();
        while !self.replay.is_stopped && self.ports.awaits_readers(expected, begun) {
            self.look_for_stop(stop);
            std::thread::sleep(LOOK_PERIOD);
        }
    }

    fn overruns(&self) -> u64 {
        self.replay.clock.overruns() - self.overruns_before
    }

    fn into_summary(self) -> PassSummary {
        let (run_id, recorded_run_id, overruns) = (self.run_id(), self.recorded_run_id(), self.overruns());
        let Self { tick: frames, sim_time_s, missing, .. } = self;
        self.replay.summary.frames += frames;
        let TimesOfAll { lateness_us, tick_us } = self.ports.finish();
        PassSummary { run_id, recorded_run_id, frames, missing, sim_time_s, overruns, lateness_us, tick_us }
    }
}
