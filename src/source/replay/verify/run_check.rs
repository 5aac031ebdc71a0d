//! One run of a recording, simulated again from tick 0 on and compared frame by frame.

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

/// Ticks in a row without a frame that are simulated at most: a day at 1 kHz.
const MOST_MISSING: u64 = 86_400_000;
/// Ticks without a frame that are simulated before it is looked whether to go on.
const STRIDE: u64 = 1024;

/// A server publishes its events ten times a second; on a busy machine later. In parts of a second.
const LAST_MOMENTS: u64 = 2;

/// That frames from a tick on cannot be verified.
fn unverifiable(from_tick: u64, reason: impl Into<String>) -> RunVerdict {
    RunVerdict::Unverifiable { from_tick, reason: reason.into() }
}

/// The run, simulated as far as its frames have been read.
pub(super) struct RunCheck {
    run_id: u64,
    config: Config,
    start: RunStart,
    simulation: Simulation,
    events: RunEvents,
    /// What the timecode has the show do, where the show follows one.
    timecode: Option<Timecode>,
    pub(super) releases: Releases,
    next_tick: u64,
    handles: Vec<HandleState>,
}

/// What a timecode was last recorded to have the show do.
#[derive(Clone, Copy, Debug)]
struct Timecode {
    stands: bool,
    /// Whether it says where the show is. Then the time scale is the frames'.
    leads: bool,
    time_scale: f64,
}

impl RunCheck {
    /// The run before tick 0, or why it cannot be simulated.
    pub(super) fn begin(
        run_id: u64,
        configuration: Option<&Configuration>,
        events: Vec<CommandEvent>,
    ) -> Result<Self, String> {
        let Configuration { toml, .. } = configuration.ok_or("its configuration is not in the recording")?;
        let config = Config::from_toml(toml).map_err(|error| format!("its configuration: {error}"))?;
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

    /// Where no event says that the run has ended: the tick of the last event, and how many ticks before the run's end are its
    /// last moments.
    pub(super) fn open_end(&self) -> Option<(u64, u64)> {
        Some((self.events.open_end_tick?, u64::from(self.config.tables().serve.rate_hz) / LAST_MOMENTS))
    }

    /// Simulates up to a frame and compares it. Counts in `found` what was simulated.
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
                    "the recording begins at tick {}, and its first frame is not as simulated without a missed release: {}",
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
            return stop_at_first(&format!(
                "and the server missed {missed} releases meanwhile: between which is not known"
            ));
        }
        if missing > MOST_MISSING {
            return stop_at_first(&format!("at most {MOST_MISSING} in a row are simulated"));
        }
        for tick in first..tick {
            if tick % STRIDE == 0 && stop.load(Ordering::Relaxed) {
                return Err(unverifiable(tick, "it was broken off"));
            }
            self.simulate(tick, 0, None, found)?;
            // The stepper's rounding depends on each step.
            self.simulation.write(&mut self.handles);
            found.missing += 1;
        }
        Ok(())
    }

    /// Simulates a tick. Returns the time scale of its frame, but for the pace of catching up.
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
                Err(unverifiable(tick, "what the timecode had the show do is not recorded"))
            }
            None => Ok(self.config.tables().serve.time_scale),
            Some((_, time_scale)) => Ok(time_scale),
        }
    }

    /// Takes the events of a tick. Returns whether one of them is what the timecode has the show do.
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
        require_time_scale(time_scale).map_err(|reason| unverifiable(event.tick, reason))?;
        let stands = event.event_kind() == Some(EventKind::Stand);
        self.timecode = Some(Timecode { stands, leads: leads != 0.0, time_scale });
        Ok(())
    }

    /// Makes a recorded request again, which must be answered in the same way.
    fn request(
        &mut self,
        request: Request,
        event: &CommandEvent,
        header: Option<&FrameHeader>,
        found: &mut RunVerification,
    ) -> Result<(), RunVerdict> {
        let recorded = event.outcome();
        // Refused by the server and not by the simulation; and of a grant for another run that run is not recorded.
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

    /// Whether the timecode has the show stand, and the time scale, from this tick on; `None` without timecode.
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
        // While the timecode leads, nothing is made up for, so that a frame has the very time scale.
        let Some(header) = header else {
            let reason = "its frame is missing, and with it the time scale by which the show followed the timecode";
            return Err(unverifiable(tick, reason));
        };
        require_time_scale(header.time_scale)
            .map_err(|range| Difference::in_words(header, "time_scale", header.time_scale.to_string(), range))?;
        Ok(Some((timecode.stands, header.time_scale)))
    }
}

/// What a server checks of its arguments.
fn require_start(config: &Config, start: &RunStart) -> Result<(), String> {
    let dragon = config.dragon();
    let travels = dragon.start_travel_m()..=dragon.end_travel_m();
    let is_sound = start.start_s.is_finite()
        && travels.contains(&start.travel_m)
        && (0.0..=Request::MAX_SPEED_MPS).contains(&start.speed_mps)
        && start.until_s.is_none_or(f64::is_finite);
    if is_sound { Ok(()) } else { Err("its start is not one of this dragon".to_owned()) }
}

/// What a follower of timecode makes of the time scale.
fn require_time_scale(time_scale: f64) -> Result<(), String> {
    let (least, greatest) = (Follower::LEAST_TIME_SCALE, Follower::GREATEST_TIME_SCALE);
    if (least - 1e-9..=greatest + 1e-9).contains(&time_scale) {
        return Ok(());
    }
    Err(format!("from {least} to {greatest} while it follows timecode"))
}
