//! Pass: one replay of a recorded run.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use bench_dragon_ipc::{BusError, FrameHeader, HandleState, ReplayStatus, ShowState, Stop, Stops};
use crossbeam::channel::RecvTimeoutError;
use serde::{Deserialize, Serialize};

use super::excerpt::{Planned, PlannedFrame, RecordedRun};
use super::outlets::Outlets;
use super::{COMMAND_PERIOD, ExpectedReaders, Replay, ReplayError, published_rate_hz};
use crate::output::histogram::Percentiles;
use crate::recording::RecordedFrame;
use crate::source::{SourcePorts, TimesOfAll, described_rate_hz};
use crate::system::clock::{monotonic_ns, sleep_precisely, sleep_until};

/// Rate at which a replay that stands repeats its frame, if the rate of the recording is not known.
const STANDING_HZ: u32 = 10;
/// Greatest rate at which it does so.
const MOST_STANDING_HZ: u32 = 100;

/// Results of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PassSummary {
    /// Number of the run on the bus.
    pub run_id: u64,
    /// Number of the recorded run.
    pub recorded_run_id: u64,
    /// Frames published, with those that a standing replay repeated.
    pub frames: u64,
    /// Frames between the first and the last one that the recorder lost.
    pub missing: u64,
    /// Show time of the last frame, in seconds.
    #[serde(rename = "sim_time_s")]
    pub show_time_s: f64,
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
    // Dropped before the ports that hold its services.
    outlets: Outlets,
    ports: SourcePorts,
    tick: u64,
    /// The last frame from the recording, which a standing replay repeats.
    shown: Option<RecordedFrame>,
    /// The frame to play next, after it was read.
    next: Option<PlannedFrame>,
    /// Events that were recorded before the frame of their tick, until that frame is shown.
    early: Vec<Planned>,
    /// Due time of the next standing frame, while the replay stands.
    standing_due_ns: Option<u64>,
    rate_hz: u32,
    missing: u64,
    overruns_before: u64,
}

/// The next step of a pass.
enum Step {
    Play,
    /// The replay stands: paused, or at the end of the recording.
    Stand,
    End,
}

impl<'a> Pass<'a> {
    pub(super) fn new(
        replay: &'a mut Replay,
        run: RecordedRun,
        ports: SourcePorts,
        rate_hz: u32,
    ) -> Result<Self, BusError> {
        let overruns_before = replay.clock.overruns();
        let outlets = Outlets::open(&replay.domain, &ports)?;
        let pass = Self {
            replay,
            run,
            outlets,
            ports,
            tick: 0,
            shown: None,
            next: None,
            early: Vec::new(),
            standing_due_ns: None,
            rate_hz,
            missing: 0,
            overruns_before,
        };
        Ok(pass)
    }

    pub(crate) fn run_id(&self) -> u64 {
        self.ports.run_id
    }

    pub(crate) fn recorded_run_id(&self) -> u64 {
        self.run.configuration.run_id
    }

    /// Publishes frames and events until the recorded run ends, `stop` is set, a client sends a stop, or a client seeks another
    /// run.
    pub(crate) fn play(mut self, stop: &AtomicBool) -> Result<PassSummary, ReplayError> {
        sleep_precisely();
        self.wait_for_readers(stop);
        loop {
            match self.next_step(stop)? {
                Step::Play => self.play_next(stop)?,
                Step::Stand => self.stand(stop)?,
                Step::End => return Ok(self.into_summary()),
            }
        }
    }

    /// Takes commands, carries out a seek, and reads the next frame. Publishes the events before that frame.
    fn next_step(&mut self, stop: &AtomicBool) -> Result<Step, ReplayError> {
        loop {
            self.take_commands(stop);
            if self.replay.steering.is_stopped {
                return Ok(Step::End);
            }
            if let Some(position_ns) = self.replay.steering.sought_ns.take() {
                if !self.seek(position_ns, stop)? {
                    return Ok(Step::End);
                }
                continue;
            }
            if self.replay.steering.is_paused && self.shown.is_some() {
                return Ok(Step::Stand);
            }
            if self.next.is_some() {
                return Ok(Step::Play);
            }
            match self.run.items.recv_timeout(COMMAND_PERIOD) {
                Ok(item) => self.take(item)?,
                Err(RecvTimeoutError::Disconnected) if self.stays_here(stop)? => return Ok(Step::Stand),
                Err(RecvTimeoutError::Disconnected) => return Ok(Step::End),
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
    }

    fn take(&mut self, item: Planned) -> Result<(), BusError> {
        let shown_tick = self.shown.as_ref().map(|frame| frame.header.tick);
        match item {
            Planned::Frame(frame) => self.next = Some(frame),
            event if event.tick_of_event() > shown_tick => self.early.push(event),
            event => self.publish_event(&event)?,
        }
        Ok(())
    }

    /// Publishes the events whose frame is shown by now.
    fn publish_early(&mut self) -> Result<(), BusError> {
        let shown_tick = self.shown.as_ref().map(|frame| frame.header.tick);
        let early = std::mem::take(&mut self.early);
        let (due, early): (Vec<Planned>, Vec<Planned>) =
            early.into_iter().partition(|event| event.tick_of_event() <= shown_tick);
        self.early = early;
        due.iter().try_for_each(|event| self.publish_event(event))
    }

    fn publish_event(&mut self, event: &Planned) -> Result<(), BusError> {
        match event {
            Planned::Frame(_) => {}
            Planned::Alert(alert) => self.outlets.publish_alert(self.ports.run_id, *alert)?,
            Planned::Command(event) => {
                if let Some(event) = self.outlets.event(*event) {
                    self.ports.report.commands.record_again(event);
                }
            }
        }
        Ok(())
    }

    /// Whether the replay stands at the end of this run, because the recording ends with it.
    fn stays_here(&mut self, stop: &AtomicBool) -> Result<bool, ReplayError> {
        if !self.replay.settings.stays || self.shown.is_none() {
            return Ok(false);
        }
        if self.replay.sought_run.is_none() {
            self.replay.sought_run = self.replay.next_run(stop)?;
        }
        Ok(self.replay.sought_run.is_none() && !stop.load(Ordering::Relaxed))
    }

    /// Waits for the due time of the next frame, and plays it unless a client steers the replay before that.
    fn play_next(&mut self, stop: &AtomicBool) -> Result<(), BusError> {
        if self.standing_due_ns.take().is_some() {
            self.replay.clock.begin_lap();
        }
        let Some(planned) = self.next.take() else { return Ok(()) };
        let clock = self.replay.clock;
        let due_ns = self.replay.clock.due_ns(planned.due_ns, monotonic_ns());
        if self.wait_until(due_ns, stop) && !self.is_to_stand() {
            return self.play_frame(planned, due_ns);
        }
        // The frame is not played now, so its due time does not count. The clock begins anew, at the present pace.
        self.replay.clock = clock;
        self.replay.clock.set_rate(self.replay.steering.pace);
        self.next = Some(planned);
        Ok(())
    }

    /// Whether the replay is paused, and has a frame to stand on.
    fn is_to_stand(&self) -> bool {
        self.replay.steering.is_paused && self.shown.is_some()
    }

    fn play_frame(&mut self, PlannedFrame { frame, missing, .. }: PlannedFrame, due_ns: u64) -> Result<(), BusError> {
        if self.replay.steering.is_paused {
            self.show(frame);
            return self.publish_early();
        }
        let begun_ns = monotonic_ns();
        let header = FrameHeader { time_scale: frame.header.time_scale * self.replay.clock.rate(), ..frame.header };
        self.ports.publish_copy(&header, &frame.handles, self.tick, due_ns)?;
        self.missing = self.missing.saturating_add(missing);
        self.show(frame);
        self.report(&header);
        self.ports.report.report_stops(Stops::default());
        self.publish_early()?;
        self.ports.report.count(begun_ns - due_ns, monotonic_ns() - begun_ns);
        Ok(())
    }

    /// Keeps a frame as the last one.
    fn show(&mut self, frame: RecordedFrame) {
        self.outlets.note_tick(frame.header.tick, self.tick);
        if let Some(before) = self.shown.replace(frame) {
            // After the last frame the reading thread has ended. Then the frame is dropped here.
            let _ = self.run.played.send(before);
        }
    }

    /// Repeats the last frame as one of a head that stands.
    fn stand(&mut self, stop: &AtomicBool) -> Result<(), BusError> {
        let is_paused = self.replay.steering.is_paused;
        let (rate_hz, now_ns) =
            (if self.rate_hz == 0 { STANDING_HZ } else { self.rate_hz.min(MOST_STANDING_HZ) }, monotonic_ns());
        let due_ns = self.standing_due_ns.map_or(now_ns, |due_ns| due_ns.max(now_ns.saturating_sub(1_000_000_000)));
        let changes = self.replay.steering.changes;
        if !self.wait_until(due_ns, stop) || self.replay.steering.changes != changes {
            return Ok(());
        }
        let Some(frame) = &self.shown else { return Ok(()) };
        let begun_ns = monotonic_ns();
        let (state, stops) = if is_paused {
            (ShowState::Paused, Stops::from([Stop::Paused]))
        } else {
            (ShowState::Finished, Stops::from([Stop::RunEnd]))
        };
        let header = FrameHeader {
            run_id: self.ports.run_id,
            tick: self.tick,
            scheduled_ns: due_ns,
            time_scale: frame.header.time_scale * self.replay.steering.pace,
            state: state.to_wire(),
            ..frame.header
        }
        .at_rest();
        let handles = &frame.handles;
        self.ports.publish(|place| {
            for (standing, handle) in place.iter_mut().zip(handles) {
                *standing = HandleState { position_m: handle.position_m, velocity_mps: [0.0; 3] };
            }
            header
        })?;
        self.standing_due_ns = Some(due_ns + 1_000_000_000 / u64::from(rate_hz));
        self.report(&header);
        self.ports.report.report_stops(stops);
        self.ports.report.count(begun_ns.saturating_sub(due_ns), monotonic_ns() - begun_ns);
        Ok(())
    }

    /// Reports a published frame.
    fn report(&mut self, header: &FrameHeader) {
        let overruns = self.replay.clock.overruns() - self.overruns_before;
        self.ports.report.report_frame(&FrameHeader { tick: self.tick, ..*header }, overruns);
        self.ports.report.report_behind(self.replay.clock.behind_ns());
        self.tick += 1;
    }

    /// Reads from a position on. Returns whether the pass goes on: a position in another recorded run begins another pass.
    fn seek(&mut self, position_ns: u64, stop: &AtomicBool) -> Result<bool, ReplayError> {
        // The reading thread ends when nobody receives.
        let (_, nothing) = crossbeam::channel::bounded(0);
        drop(std::mem::replace(&mut self.run.items, nothing));
        self.next = None;
        self.early.clear();
        self.replay.sought_run = None;
        // Also for another pass: the recorded times of its frames are far from those before the seek.
        self.replay.clock.begin_elsewhere();
        let Some(run) = self.replay.run_at(position_ns, stop)? else { return Ok(false) };
        let is_same = run.configuration.run_id == self.recorded_run_id() && run.handle_count == self.run.handle_count;
        if !is_same || run.lap != self.run.lap {
            self.replay.sought_run = Some(run);
            return Ok(false);
        }
        self.run = run;
        // The next frame is shown at once, also by a paused replay.
        self.shown = None;
        Ok(true)
    }

    /// Waits for an instant. Returns early, with false, when the replay is stopped or steered.
    fn wait_until(&mut self, due_ns: u64, stop: &AtomicBool) -> bool {
        let changes = self.replay.steering.changes;
        self.take_commands(stop);
        while !self.replay.steering.is_stopped && self.replay.steering.changes == changes {
            let now_ns = monotonic_ns();
            if now_ns >= due_ns {
                return true;
            }
            let is_far = due_ns - now_ns > COMMAND_PERIOD.as_nanos() as u64;
            sleep_until(if is_far { now_ns + COMMAND_PERIOD.as_nanos() as u64 } else { due_ns });
            if is_far || stop.load(Ordering::Relaxed) {
                self.take_commands(stop);
            }
        }
        false
    }

    /// Replies to the waiting commands, and notes a stop by a signal. Publishes the status of the replay when it is due.
    fn take_commands(&mut self, stop: &AtomicBool) {
        let length_ns = self.replay.timeline.length_ns();
        let (pace, changes) = (self.replay.steering.pace, self.replay.steering.changes);
        let steering = &mut self.replay.steering;
        self.ports.take_unrecorded_commands(self.tick, |request| steering.take(request, length_ns));
        steering.is_stopped |= stop.load(Ordering::Relaxed);
        if self.replay.steering.pace != pace {
            self.change_pace();
        }
        if self.replay.steering.changes != changes || self.outlets.is_status_due() {
            self.publish_status();
        }
    }

    fn change_pace(&mut self) {
        let pace = self.replay.steering.pace;
        self.replay.clock.set_rate(pace);
        self.rate_hz = published_rate_hz(described_rate_hz(&self.run.configuration.toml), pace);
        self.ports.report.report_rate(self.rate_hz);
    }

    fn publish_status(&mut self) {
        let Replay { timeline, steering, .. } = &*self.replay;
        let log_time_ns = self.shown.as_ref().map_or(timeline.log_time_ns(0), |frame| frame.log_time_ns);
        let status = ReplayStatus {
            run_id: self.ports.run_id,
            recorded_run_id: self.run.configuration.run_id,
            position_ns: timeline.position_ns(log_time_ns),
            length_ns: timeline.length_ns(),
            wall_ns: i64::try_from(log_time_ns).unwrap_or(i64::MAX),
            pace: steering.pace,
            paused: steering.is_paused.into(),
            at_end: (self.standing_due_ns.is_some() && !steering.is_paused).into(),
        };
        self.outlets.publish_status(status);
    }

    fn wait_for_readers(&mut self, stop: &AtomicBool) {
        const LOOK_PERIOD: Duration = Duration::from_millis(1);
        let is_first = self.replay.summary.passes == 1;
        let expected = if is_first { self.replay.settings.readers } else { ExpectedReaders::NONE };
        let begun = Instant::now();
        while !self.replay.steering.is_stopped && self.ports.awaits_readers(expected, begun) {
            self.take_commands(stop);
            std::thread::sleep(LOOK_PERIOD);
        }
    }

    fn into_summary(self) -> PassSummary {
        let (run_id, recorded_run_id) = (self.run_id(), self.recorded_run_id());
        let overruns = self.replay.clock.overruns() - self.overruns_before;
        let Self { tick: frames, missing, ports, outlets, shown, .. } = self;
        let show_time_s = shown.map_or(0.0, |frame| frame.header.show_time_s());
        self.replay.summary.frames += frames;
        drop(outlets);
        let TimesOfAll { lateness_us, tick_us } = ports.finish();
        PassSummary { run_id, recorded_run_id, frames, missing, show_time_s, overruns, lateness_us, tick_us }
    }
}
