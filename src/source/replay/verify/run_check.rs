//! One run of a recording, simulated again from tick 0 on and compared frame by frame.

use std::sync::atomic::{AtomicBool, Ordering};

use bench_dragon_ipc::{CommandEvent, EventKind, FrameHeader, HandleState, Refusal, Request, RunStart};

use super::difference::{Difference, difference};
use super::events::RunEvents;
use super::releases::Releases;
use super::{OpenEnd, RunVerification};
use crate::config::Config;
use crate::recording::{Configuration, RecordedFrame};
use crate::source::server::motion::MotionPlan;
use crate::source::server::{Simulation, Steering};
use crate::source::timecode::Follower;

/// Ticks in a row without a frame that are simulated at most: a day at 1 kHz.
const MOST_MISSING: u64 = 86_400_000;
/// Ticks without a frame that are simulated before it is looked whether to go on.
const STRIDE: u64 = 1024;

/// Why a verification cannot go on.
#[derive(Debug)]
pub(super) enum Stop {
    Differs(Difference),
    Unverifiable { from_tick: u64, reason: String },
}

impl Stop {
    fn unverifiable(from_tick: u64, reason: impl Into<String>) -> Self {
        Self::Unverifiable { from_tick, reason: reason.into() }
    }
}

/// What has been simulated.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counts {
    missing: u64,
    overruns: u64,
    commands: u64,
    grants: u64,
    timecode: u64,
}

impl Counts {
    pub(super) fn write_to(self, found: &mut RunVerification) {
        let Self { missing, overruns, commands, grants, timecode } = self;
        (found.missing, found.overruns) = (missing, overruns);
        (found.commands, found.grants, found.timecode) = (commands, grants, timecode);
    }
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
    releases: Releases,
    next_tick: u64,
    handles: Vec<HandleState>,
    counts: Counts,
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
    /// The run before tick 0.
    ///
    /// # Errors
    /// Why it cannot be simulated.
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
        let plan = MotionPlan::of_run(&config, &start, run_id);
        let mut simulation = Simulation::new(config.dragon().clone(), plan);
        if start.follows_timecode {
            simulation.follow();
        }
        Ok(Self {
            run_id,
            simulation,
            handles: vec![HandleState::default(); config.dragon().dimensions().handles()],
            releases: Releases::at(config.rate_hz()),
            config,
            start,
            events,
            timecode: None,
            next_tick: 0,
            counts: Counts::default(),
        })
    }

    /// The end of the record of commands, where no event says that the run has ended there.
    pub(super) fn open_end(&self) -> Option<OpenEnd> {
        let last_tick = self.events.open_end_tick?;
        Some(OpenEnd { last_tick, rate_hz: self.config.rate_hz() })
    }

    pub(super) fn counts(&self) -> Counts {
        Counts { overruns: self.releases.overruns(), ..self.counts }
    }

    /// Simulates up to a frame and compares it.
    ///
    /// # Errors
    /// Why this is the first frame that is not verified.
    pub(super) fn take(&mut self, frame: &RecordedFrame, stop: &AtomicBool) -> Result<(), Stop> {
        let header = &frame.header;
        let missing = header.tick.checked_sub(self.next_tick).ok_or_else(|| {
            Stop::unverifiable(header.tick, "its frames are not in the recorded order: name the files oldest first")
        })?;
        let begins_late = self.releases.is_empty() && missing > 0;
        let missed = self.releases.take(header, missing)?;
        self.simulate_missing(header.tick, missed, stop)?;
        let time_scale = self.simulate(header.tick, missed, Some(header))?;
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
                Err(Stop::unverifiable(header.tick, reason))
            }
            Some(difference) => Err(Stop::Differs(difference)),
        }
    }

    /// Simulates the ticks before `tick` whose frames are missing.
    fn simulate_missing(&mut self, tick: u64, missed: u64, stop: &AtomicBool) -> Result<(), Stop> {
        let (first, missing) = (self.next_tick, tick - self.next_tick);
        if missing == 0 {
            return Ok(());
        }
        let unverifiable =
            |what: &str| Err(Stop::unverifiable(first, format!("{missing} frames are missing there, {what}")));
        if missed > 0 {
            return unverifiable(&format!(
                "and the server missed {missed} releases meanwhile: between which is not known"
            ));
        }
        if missing > MOST_MISSING {
            return unverifiable(&format!("at most {MOST_MISSING} in a row are simulated"));
        }
        for tick in first..tick {
            if tick % STRIDE == 0 && stop.load(Ordering::Relaxed) {
                return Err(Stop::unverifiable(tick, "it was broken off"));
            }
            self.simulate(tick, 0, None)?;
            // The stepper's rounding depends on each step.
            self.simulation.write(&mut self.handles);
            self.counts.missing += 1;
        }
        Ok(())
    }

    /// Simulates a tick. Returns the time scale of its frame, but for the pace of catching up.
    fn simulate(&mut self, tick: u64, missed: u64, header: Option<&FrameHeader>) -> Result<f64, Stop> {
        if let Some(gap) = self.events.gap.filter(|gap| tick >= gap.from_tick) {
            let reason = format!("{} events of its commands are missing there", gap.missing);
            return Err(Stop::unverifiable(tick, reason));
        }
        let is_led = self.timecode.is_some_and(|timecode| timecode.leads);
        let mut steering = Ok(None);
        let Self { simulation, events, timecode, releases, counts, config, start, .. } = self;
        simulation.tick(missed, is_led, |simulation| {
            let mut turn = Turn { simulation, timecode, releases, counts, has_changed: false };
            steering = turn.take_events(events, tick, header).and_then(|()| turn.steering(tick, header));
            steering.as_ref().ok().copied().flatten().map(|(stands, time_scale)| Steering {
                stands,
                time_scale,
                rate_hz: config.rate_hz(),
            })
        });
        let time_scale = steering?.map(|(_, time_scale)| time_scale);
        match time_scale {
            None if start.follows_timecode => {
                Err(Stop::unverifiable(tick, "what the timecode had the show do is not recorded"))
            }
            time_scale => Ok(time_scale.unwrap_or(config.time_scale())),
        }
    }
}

/// What takes the events of a tick.
struct Turn<'a> {
    simulation: &'a mut Simulation,
    timecode: &'a mut Option<Timecode>,
    releases: &'a mut Releases,
    counts: &'a mut Counts,
    /// Whether what the timecode has the show do is recorded at this tick.
    has_changed: bool,
}

impl Turn<'_> {
    fn take_events(&mut self, events: &mut RunEvents, tick: u64, header: Option<&FrameHeader>) -> Result<(), Stop> {
        while let Some(event) = events.events.next_if(|event| event.tick <= tick) {
            self.releases.agree_with(&event, header)?;
            match (event.event_kind(), event.request()) {
                (Some(EventKind::Stand | EventKind::Follow), _) => self.take_timecode(&event)?,
                (_, Some(request)) => self.request(request, &event, header)?,
                _ => {}
            }
        }
        Ok(())
    }

    fn take_timecode(&mut self, event: &CommandEvent) -> Result<(), Stop> {
        let [leads, time_scale, ..] = event.values;
        require_time_scale(time_scale).map_err(|reason| Stop::unverifiable(event.tick, reason))?;
        let stands = event.event_kind() == Some(EventKind::Stand);
        *self.timecode = Some(Timecode { stands, leads: leads != 0.0, time_scale });
        self.has_changed = true;
        self.counts.timecode += 1;
        Ok(())
    }

    /// Makes a recorded request again, which must be answered in the same way.
    fn request(&mut self, request: Request, event: &CommandEvent, header: Option<&FrameHeader>) -> Result<(), Stop> {
        let recorded = event.outcome();
        // Refused by the server and not by the simulation; and of a grant for another run that run is not recorded.
        if let Err(Refusal::Followed | Refusal::OtherRun | Refusal::Unknown) = recorded {
            return Ok(());
        }
        let simulated = self.simulation.request(request);
        if simulated != recorded {
            let of_event = FrameHeader { tick: event.tick, sim_time_ns: event.sim_time_ns, ..FrameHeader::default() };
            let [recorded, simulated] = [recorded, simulated].map(|outcome| match outcome {
                Ok(()) => "accepted".to_owned(),
                Err(refusal) => format!("refused ({refusal})"),
            });
            let field = format!("command event {}", event.number);
            let difference = Difference::in_words(header.unwrap_or(&of_event), &field, recorded, simulated);
            return Err(Stop::Differs(difference));
        }
        let is_grant = matches!(request, Request::Grant { .. });
        self.counts.grants += u64::from(simulated.is_ok() && is_grant);
        self.counts.commands += u64::from(simulated.is_ok() && !is_grant);
        Ok(())
    }

    /// Whether the timecode has the show stand, and the time scale, from this tick on; `None` without timecode.
    fn steering(&self, tick: u64, header: Option<&FrameHeader>) -> Result<Option<(bool, f64)>, Stop> {
        let Some(timecode) = *self.timecode else { return Ok(None) };
        if !timecode.leads || self.has_changed {
            return Ok(Some((timecode.stands, timecode.time_scale)));
        }
        // While the timecode leads, nothing is made up for, so that a frame has the very time scale.
        let Some(header) = header else {
            let reason = "its frame is missing, and with it the time scale by which the show followed the timecode";
            return Err(Stop::unverifiable(tick, reason));
        };
        require_time_scale(header.time_scale).map_err(|range| {
            Stop::Differs(Difference::in_words(header, "time_scale", header.time_scale.to_string(), range))
        })?;
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
