//! Check of one run of a recording: simulates it from tick 0 on, and compares frame by frame.

use std::sync::atomic::{AtomicBool, Ordering};

use bench_dragon_ipc::{CommandEvent, FrameHeader, HandleState, Request, RunStart};

use super::comparison::{Difference, Periods, difference};
use super::events::RunEvents;
use super::recorded_inputs::{RecordedInputs, Timecode};
use super::{RunVerdict, RunVerification};
use crate::config::Config;
use crate::recording::{Configuration, RecordedFrame};
use crate::source::server::Simulation;

/// Greatest number of consecutive missing frames that are simulated: a day at 1 kHz.
const MOST_MISSING: u64 = 86_400_000;
/// Number of simulated missing frames between two checks of `stop`.
const STRIDE: u64 = 1024;

/// Length of a run's last moments, in seconds: what a power loss may take. It may take a command and leave later frames.
const LAST_MOMENTS_S: u64 = 3;

/// Verdict that frames from a tick on cannot be verified.
pub(super) fn unverifiable(from_tick: u64, reason: impl Into<String>) -> RunVerdict {
    RunVerdict::Unverifiable { from_tick, reason: reason.into() }
}

/// A run, simulated up to the last frame that has been read.
pub(super) struct RunCheck {
    run_id: u64,
    config: Config,
    start: RunStart,
    simulation: Simulation,
    events: RunEvents,
    /// The timecode's effect on the show as last recorded.
    timecode: Option<Timecode>,
    pub(super) periods: Periods,
    next_tick: u64,
    /// The last tick whose frame is missing before a later one.
    last_missing: Option<u64>,
    /// Tick of the first frame of a recording that begins late, as long as periods missed before it may have an effect that no
    /// frame has shown.
    open_begin: Option<u64>,
    handles: Vec<HandleState>,
}

/// The end of a run without a recorded end.
pub(super) struct OpenEnd {
    /// Tick of its last event.
    event_tick: u64,
    /// Length of its last moments in ticks.
    moments: u64,
    /// The last tick whose frame is missing before a later one.
    missing_tick: Option<u64>,
}

impl OpenEnd {
    /// Whether a command that was not recorded may be the cause of a difference at a tick of a run with this last tick: the last
    /// moments may lack commands, and so may a gap in the frames, as after a power loss between two recorders.
    pub(super) fn explains(&self, tick: u64, last_tick: u64) -> bool {
        let is_last = last_tick.saturating_sub(tick) <= self.moments;
        tick >= self.event_tick && (is_last || self.missing_tick.is_some_and(|missing| missing >= self.event_tick))
    }
}

impl RunCheck {
    /// Creates the run before tick 0. The error is the reason why it cannot be simulated.
    pub(super) fn begin(
        run_id: u64,
        configuration: Option<&Configuration>,
        events: Vec<CommandEvent>,
    ) -> Result<Self, String> {
        let Configuration { toml, .. } = configuration.ok_or("its configuration is not in the recording")?;
        let config = Config::from_toml(toml).map_err(|error| format!("its configuration is not valid: {error}"))?;
        let events = RunEvents::new(events)?;
        let start = events.start;
        require_start(&config, &start)?;
        Ok(Self {
            run_id,
            simulation: Simulation::of_run(&config, &start, run_id).map_err(|error| error.to_string())?,
            handles: vec![HandleState::default(); config.formation().layout().handles()],
            periods: Periods::at(config.tables().serve.rate_hz),
            config,
            start,
            events,
            timecode: None,
            next_tick: 0,
            last_missing: None,
            open_begin: None,
        })
    }

    /// The end of a run without a recorded end.
    pub(super) fn open_end(&self) -> Option<OpenEnd> {
        let moments = u64::from(self.config.tables().serve.rate_hz) * LAST_MOMENTS_S;
        Some(OpenEnd { event_tick: self.events.open_end_tick?, moments, missing_tick: self.last_missing })
    }

    /// Simulates up to a frame and compares it. Adds the simulated missing frames, events and commands to `found`.
    pub(super) fn take(
        &mut self,
        frame: &RecordedFrame,
        found: &mut RunVerification,
        stop: &AtomicBool,
    ) -> Result<(), RunVerdict> {
        let header = &frame.header;
        let missing = header.tick.checked_sub(self.next_tick).ok_or_else(|| {
            unverifiable(header.tick, "its frames are not in the recorded order: name the files oldest first")
        })?;
        if self.periods.is_empty() && missing > 0 {
            self.open_begin = Some(header.tick);
        }
        let missed = self.periods.take(header, missing)?;
        let compared = self.compare(frame, missed, found, stop);
        // A walking show shows its lag. From then on, equal frames have equal states.
        let Some(begin) = self.open_begin.take_if(|_| compared.is_err() || !self.simulation.hides_missed_periods())
        else {
            return compared;
        };
        match compared {
            Err(RunVerdict::Differs { difference })
                if !self.periods.are_known_from_tick_0() && !difference.is_of_overruns() =>
            {
                Err(begins_late(begin, header.tick, &difference))
            }
            compared => compared,
        }
    }

    /// Simulates up to a frame, and compares replies and frame.
    fn compare(
        &mut self,
        frame: &RecordedFrame,
        missed: u64,
        found: &mut RunVerification,
        stop: &AtomicBool,
    ) -> Result<(), RunVerdict> {
        let header = &frame.header;
        self.simulate_missing(header.tick, missed, found, stop)?;
        self.simulate(header.tick, missed, Some(header), found)?;
        let simulated = self.simulation.header(self.run_id, header.tick, header.scheduled_ns);
        self.simulation.write(&mut self.handles);
        self.next_tick = header.tick.saturating_add(1);
        difference(frame, &simulated, &self.handles)
            .map_or(Ok(()), |difference| Err(RunVerdict::Differs { difference }))
    }

    fn simulate_missing(
        &mut self,
        tick: u64,
        missed: u64,
        found: &mut RunVerification,
        stop: &AtomicBool,
    ) -> Result<(), RunVerdict> {
        let (first, missing) = (self.next_tick, tick - self.next_tick);
        if missing == 0 {
            return Ok(());
        }
        // A recorder that begins late gets the events before its first frame.
        if first > 0 {
            self.last_missing = Some(tick - 1);
        }
        let stop_at_first =
            |what: &str| Err(unverifiable(first, format!("{missing} frames are missing there, {what}")));
        if missed > 0 {
            return stop_at_first(&format!("and the server missed {missed} periods among them, at unknown ticks"));
        }
        if missing > MOST_MISSING {
            return stop_at_first(&format!("more than the {MOST_MISSING} in a row that can be simulated"));
        }
        for tick in first..tick {
            if tick % STRIDE == 0 && stop.load(Ordering::Relaxed) {
                return Err(unverifiable(tick, "the verification was interrupted"));
            }
            self.simulate(tick, 0, None, found)?;
            // Each step of the stepper affects its rounding.
            self.simulation.write(&mut self.handles);
            found.missing += 1;
        }
        Ok(())
    }

    /// Simulates a tick.
    fn simulate(
        &mut self,
        tick: u64,
        missed: u64,
        header: Option<&FrameHeader>,
        found: &mut RunVerification,
    ) -> Result<(), RunVerdict> {
        if let Some((_, missing)) = self.events.gap.filter(|(from_tick, _)| tick >= *from_tick) {
            let reason = format!("{missing} events of its commands are missing there");
            return Err(unverifiable(tick, reason));
        }
        let Self { events, timecode, periods, simulation, .. } = self;
        let mut inputs = RecordedInputs { events, timecode, periods, tick, header, found, fault: None };
        simulation.tick(missed, &mut inputs);
        match inputs.fault {
            Some(fault) => Err(fault),
            None if self.start.follows_timecode && self.timecode.is_none() => {
                Err(unverifiable(tick, "the timecode's effect on the show is not recorded"))
            }
            None => Ok(()),
        }
    }
}

/// Verdict on a difference that periods missed before the first frame may explain, at unknown ticks: the first frame, the replies
/// to the commands before it, or the first frame of a show that stood until then.
fn begins_late(begin: u64, tick: u64, difference: &Difference) -> RunVerdict {
    let what = match () {
        () if difference.tick != tick => "its record of commands",
        () if tick == begin => "its first frame",
        () => "its show, which stood until then,",
    };
    let reason = format!(
        "the recording begins at tick {begin}, and {what} differs from a simulation without missed periods: {difference}"
    );
    unverifiable(tick, reason)
}

/// Checks the start of the run as a server checks its arguments.
fn require_start(config: &Config, start: &RunStart) -> Result<(), String> {
    let formation = config.formation();
    let course = formation.begin_m()..=formation.end_m();
    let is_sound = start.start_s.is_finite()
        && course.contains(&start.travel_m)
        && (0.0..=Request::MAX_SPEED_MPS).contains(&start.speed_mps)
        && start.until_s.is_none_or(f64::is_finite);
    if is_sound { Ok(()) } else { Err("its start is out of range for its dragon".to_owned()) }
}
