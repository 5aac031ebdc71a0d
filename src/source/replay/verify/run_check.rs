//! Check of one run of a recording: simulates it from tick 0 on, and compares frame by frame.

use std::sync::atomic::{AtomicBool, Ordering};

use bench_dragon_ipc::{CommandEvent, EventKind, FrameHeader, HandleState, Refusal, Request, RunStart};

use super::comparison::{Difference, Releases, difference};
use super::events::RunEvents;
use super::{RunVerdict, RunVerification};
use crate::config::Config;
use crate::recording::{Configuration, RecordedFrame};
use crate::source::server::motion::MotionPlan;
use crate::source::server::{Simulation, Steering};
use crate::source::timecode::Follower;

/// Greatest number of consecutive missing frames that are simulated: a day at 1 kHz.
const MOST_MISSING: u64 = 86_400_000;
/// Number of simulated missing frames between two checks of `stop`.
const STRIDE: u64 = 1024;

/// Length of a run's last moments, as a fraction of a second: 2 is half a second. A server publishes its events ten
/// times a second, or later on a busy machine.
const LAST_MOMENTS: u64 = 2;

/// Verdict that frames from a tick on cannot be verified.
fn unverifiable(from_tick: u64, reason: impl Into<String>) -> RunVerdict {
    RunVerdict::Unverifiable { from_tick, reason: reason.into() }
}

/// A run, simulated up to the last frame that has been read.
pub(super) struct RunCheck {
    run_id: u64,
    config: Config,
    start: RunStart,
    simulation: Simulation,
    events: RunEvents,
    /// The timecode's effect on the show, once the run has recorded one.
    timecode: Option<Timecode>,
    pub(super) releases: Releases,
    next_tick: u64,
    handles: Vec<HandleState>,
}

/// The timecode's effect on the show as last recorded.
#[derive(Clone, Copy, Debug)]
struct Timecode {
    stands: bool,
    /// Whether the timecode determines the show time. Then the time scale comes from the frames.
    leads: bool,
    time_scale: f64,
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
        let plan = MotionPlan::of_run(&config, &start, run_id).map_err(|error| error.to_string())?;
        let mut simulation = Simulation::new(config.dragon().clone(), plan);
        if start.follows_timecode {
            simulation.motion.follow();
        }
        Ok(Self {
            run_id,
            simulation,
            handles: vec![HandleState::default(); config.dragon().dimensions().handles()],
            releases: Releases::at(config.tables().serve.rate_hz),
            config,
            start,
            events,
            timecode: None,
            next_tick: 0,
        })
    }

    /// For a run without a recorded end: the tick of its last event, and the length of its last moments in ticks.
    pub(super) fn open_end(&self) -> Option<(u64, u64)> {
        Some((self.events.open_end_tick?, u64::from(self.config.tables().serve.rate_hz) / LAST_MOMENTS))
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
        let begins_late = self.releases.is_empty() && missing > 0;
        let missed = self.releases.take(header, missing)?;
        self.simulate_missing(header.tick, missed, found, stop)?;
        let time_scale = self.simulate(header.tick, missed, Some(header), found)?;
        let simulated = self.simulation.header(self.run_id, header.tick, header.scheduled_ns, time_scale);
        self.simulation.write(&mut self.handles);
        self.next_tick = header.tick.saturating_add(1);
        match difference(frame, &simulated, &self.handles) {
            None => Ok(()),
            Some(difference) if begins_late => {
                let reason = format!(
                    "the recording begins at tick {}, and its first frame differs from a simulation without missed \
                     releases: {}",
                    header.tick, difference
                );
                Err(unverifiable(header.tick, reason))
            }
            Some(difference) => Err(RunVerdict::Differs { difference }),
        }
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
        let stop_at_first =
            |what: &str| Err(unverifiable(first, format!("{missing} frames are missing there, {what}")));
        if missed > 0 {
            return stop_at_first(&format!("and the server missed {missed} releases among them, at unknown ticks"));
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

    /// Simulates a tick. Returns the time scale of its frame, without the pace of catching up.
    fn simulate(
        &mut self,
        tick: u64,
        missed: u64,
        header: Option<&FrameHeader>,
        found: &mut RunVerification,
    ) -> Result<f64, RunVerdict> {
        if let Some((_, missing)) = self.events.gap.filter(|(from_tick, _)| tick >= *from_tick) {
            let reason = format!("{missing} events of its commands are missing there");
            return Err(unverifiable(tick, reason));
        }
        self.simulation.begin_tick(missed, self.timecode.is_some_and(|timecode| timecode.leads));
        let has_changed = self.take_events(tick, header, found)?;
        let steering = self.steering(tick, header, has_changed)?;
        let rate_hz = self.config.tables().serve.rate_hz;
        self.simulation.advance(steering.map(|(stands, time_scale)| Steering { stands, time_scale, rate_hz }));
        match steering {
            None if self.start.follows_timecode => {
                Err(unverifiable(tick, "the timecode's effect on the show is not recorded"))
            }
            None => Ok(self.config.tables().serve.time_scale),
            Some((_, time_scale)) => Ok(time_scale),
        }
    }

    /// Takes the events of a tick. Returns whether one of them changes the timecode's effect on the show.
    fn take_events(
        &mut self,
        tick: u64,
        header: Option<&FrameHeader>,
        found: &mut RunVerification,
    ) -> Result<bool, RunVerdict> {
        let timecode_before = found.timecode;
        while let Some(event) = self.events.events.next_if(|event| event.tick <= tick) {
            self.releases.agree_with(&event, header)?;
            match (event.event_kind(), event.request()) {
                (Some(EventKind::Stand | EventKind::Follow), _) => {
                    self.take_timecode(&event)?;
                    found.timecode += 1;
                }
                (_, Some(request)) => self.request(request, &event, header, found)?,
                _ => {}
            }
        }
        Ok(found.timecode > timecode_before)
    }

    fn take_timecode(&mut self, event: &CommandEvent) -> Result<(), RunVerdict> {
        let [leads, time_scale, ..] = event.values;
        require_time_scale(time_scale).map_err(|range| {
            unverifiable(event.tick, format!("the recorded time scale is {time_scale}, must be {range}"))
        })?;
        let stands = event.event_kind() == Some(EventKind::Stand);
        self.timecode = Some(Timecode { stands, leads: leads != 0.0, time_scale });
        Ok(())
    }

    /// Repeats a recorded request. The simulation must give the recorded reply.
    fn request(
        &mut self,
        request: Request,
        event: &CommandEvent,
        header: Option<&FrameHeader>,
        found: &mut RunVerification,
    ) -> Result<(), RunVerdict> {
        let recorded = event.outcome();
        // The server, not its simulation, refuses seeks under timecode (`Followed`) and unknown commands. The other run of
        // a grant (`OtherRun`) is not recorded.
        if let Err(Refusal::Followed | Refusal::OtherRun | Refusal::Unknown) = recorded {
            return Ok(());
        }
        let simulated = self.simulation.motion.request(request);
        if simulated != recorded {
            let of_event = FrameHeader { tick: event.tick, sim_time_ns: event.sim_time_ns, ..FrameHeader::default() };
            let [recorded, simulated] = [recorded, simulated].map(|outcome| match outcome {
                Ok(()) => "accepted".to_owned(),
                Err(refusal) => format!("refused ({refusal})"),
            });
            let field = format!("command event {}", event.number);
            return Err(Difference::in_words(header.unwrap_or(&of_event), &field, recorded, simulated));
        }
        let is_grant = matches!(request, Request::Grant { .. });
        found.grants += u64::from(simulated.is_ok() && is_grant);
        found.commands += u64::from(simulated.is_ok() && !is_grant);
        Ok(())
    }

    /// The timecode's effect from this tick on: whether the show stands, and the time scale. `None` without timecode.
    fn steering(
        &self,
        tick: u64,
        header: Option<&FrameHeader>,
        has_changed: bool,
    ) -> Result<Option<(bool, f64)>, RunVerdict> {
        let Some(timecode) = self.timecode else { return Ok(None) };
        if !timecode.leads || has_changed {
            return Ok(Some((timecode.stands, timecode.time_scale)));
        }
        // While the timecode leads, the show does not catch up, so the frame contains the timecode's time scale itself.
        let Some(header) = header else {
            let reason = "its frame is missing, and with it the time scale by which the show followed the timecode";
            return Err(unverifiable(tick, reason));
        };
        require_time_scale(header.time_scale).map_err(|range| {
            Difference::in_words(header, "time_scale", header.time_scale.to_string(), format!("a value {range}"))
        })?;
        Ok(Some((timecode.stands, header.time_scale)))
    }
}

/// Checks the start of the run as a server checks its arguments.
fn require_start(config: &Config, start: &RunStart) -> Result<(), String> {
    let dragon = config.dragon();
    let travels = dragon.start_travel_m()..=dragon.end_travel_m();
    let is_sound = start.start_s.is_finite()
        && travels.contains(&start.travel_m)
        && (0.0..=Request::MAX_SPEED_MPS).contains(&start.speed_mps)
        && start.until_s.is_none_or(f64::is_finite);
    if is_sound { Ok(()) } else { Err("its start is out of range for its dragon".to_owned()) }
}

/// Checks that a follower of timecode can give this time scale.
fn require_time_scale(time_scale: f64) -> Result<(), String> {
    let (least, greatest) = (Follower::LEAST_TIME_SCALE, Follower::GREATEST_TIME_SCALE);
    if (least - 1e-9..=greatest + 1e-9).contains(&time_scale) {
        return Ok(());
    }
    Err(format!("from {least} to {greatest} with timecode"))
}
