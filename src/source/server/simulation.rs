//! Simulation of all dragons from tick to tick. Pure: no clock, no bus.

use std::sync::Arc;

use bench_dragon_geometry::formation::{Formation, FormationStepper};
use bench_dragon_ipc::{
    CommandEvent, DragonMotion, DragonState, EventKind, FrameHeader, HandleState, Refusal, Request, RunStart, Sender,
};
use glam::DVec3;

use super::cue_track::CueTrack;
use crate::config::Config;
use crate::source::server::motion::{HeadState, Motion, MotionPlan, MotionPlanError};
use crate::source::timecode::ShowPosition;

/// What a tick takes from outside. A server has it from the bus and from a timecode, a verification from a recording.
pub trait TickInputs {
    /// Passes every request that takes effect at this tick to `decide`, which returns its reply: the speed along the course that the head
    /// walks at from now on, if nothing stops it. `head` is the head before.
    fn requests(&mut self, _head: HeadState, _decide: &mut dyn FnMut(Request) -> Result<f64, Refusal>) {}

    /// Returns the timecode's effect on the show from this tick on; `None` without timecode. `seek` moves the show at once. `head`
    /// is the head after the requests, and `show` the position of a show that runs on.
    fn steering(
        &mut self,
        _head: HeadState,
        _show: ShowPosition,
        _seek: &mut dyn FnMut(f64) -> Result<(), Refusal>,
    ) -> Option<Steering> {
        None
    }

    /// Notes that the show has reached a cue at this tick, by walking or by a seek to it. `head` is the head after the tick.
    fn reached(&mut self, _head: HeadState, _cue: ReachedCue) {}
}

/// A cue that the show has reached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReachedCue {
    /// Its number in the configuration, from 0.
    pub number: usize,
    /// Its plan time in seconds.
    pub at_s: f64,
}

impl ReachedCue {
    /// Returns its event for the record of commands.
    pub fn event(&self, tick: u64) -> CommandEvent {
        let event = CommandEvent::plain(EventKind::Cue, Sender::Server, tick);
        CommandEvent { values: [self.number as f64, self.at_s, 0.0, 0.0], ..event }
    }
}

/// A tick without requests and timecode.
impl TickInputs for () {}

/// The timecode's effect on the show from a tick on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steering {
    /// Whether the timecode makes the show stand. The operator's pause and hold apply in addition.
    pub stands: bool,
    /// Whether the timecode determines the show time. Then seeks of operators are refused, and the show is never behind the clock.
    pub leads: bool,
    /// Show seconds per second of wall time.
    pub time_scale: f64,
}

/// The state of all dragons as a function of ticks and requests.
#[derive(Debug)]
pub struct Simulation {
    motion: Motion,
    stepper: FormationStepper,
    rate_hz: u32,
    /// Show seconds per second of wall time at present, without the pace of catching up.
    time_scale: f64,
    /// Whether a timecode determines the show time.
    is_led: bool,
    cues: CueTrack,
    /// Periods since the last GO, also missed ones.
    since_go: Option<u64>,
}

impl Simulation {
    /// Creates the dragons before tick 0. A tick of the plan takes `time_scale / rate_hz` show seconds.
    pub fn new(formation: Arc<Formation>, plan: MotionPlan, rate_hz: u32, time_scale: f64) -> Self {
        let stepper = FormationStepper::new(formation);
        let cues = CueTrack::default();
        Self { motion: Motion::new(plan), stepper, rate_hz, time_scale, is_led: false, cues, since_go: None }
    }

    /// Creates the dragons of a server's run before tick 0.
    ///
    /// # Errors
    /// As [`MotionPlan::new`].
    pub fn of_run(config: &Config, start: &RunStart, run_id: u64) -> Result<Self, MotionPlanError> {
        let plan = MotionPlan::of_run(config, start, run_id)?;
        let serve = &config.tables().serve;
        let mut simulation = Self::new(Arc::clone(config.formation()), plan, serve.rate_hz, serve.time_scale);
        simulation.cues = CueTrack::of(config);
        if start.follows_timecode {
            simulation.follow();
        }
        Ok(simulation)
    }

    /// Makes the show follow timecode. The show stands until the first timecode.
    pub fn follow(&mut self) {
        self.motion.follow();
    }

    /// Advances by one tick, after `missed` missed periods. This is the order of a tick: the missed periods, the requests, the
    /// timecode, one period.
    pub fn tick(&mut self, missed: u64, inputs: &mut impl TickInputs) {
        self.since_go = self.since_go.map(|periods| periods + missed + 1);
        let before_m = self.motion.head().travel_m;
        self.motion.miss(missed);
        self.cues.walk(before_m, self.motion.head().travel_m);
        if self.is_led {
            // The follower compensates the timecode's lead instead.
            self.motion.forget_lag();
        }
        let mut is_resumed = false;
        inputs.requests(self.motion.head(), &mut |request| {
            let outcome = self.answer(request);
            is_resumed |= request == Request::Resume && outcome.is_ok();
            outcome
        });
        let Self { motion, .. } = self;
        let head = motion.head();
        let show = ShowPosition { show_time_s: motion.next_sim_s(), is_stopped: motion.is_stopped(), is_resumed };
        let mut seek = |show_time_s| motion.request(Request::Seek { show_time_s });
        if let Some(Steering { stands, leads, time_scale }) = inputs.steering(head, show, &mut seek) {
            self.motion.set_stands(stands);
            self.motion.set_tick(time_scale / f64::from(self.rate_hz));
            self.time_scale = time_scale;
            self.is_led = leads;
        }
        let begin_m = self.motion.head().travel_m;
        self.motion.advance();
        let head = self.motion.head();
        self.cues.walk(begin_m, head.travel_m);
        self.cues.take(|cue| inputs.reached(head, cue));
    }

    /// Takes a request as [`request`](Self::request). Returns the speed along the course that the head walks at from now on, if nothing
    /// stops it.
    ///
    /// # Errors
    /// As `request`.
    pub fn answer(&mut self, request: Request) -> Result<f64, Refusal> {
        self.request(request).map(|()| self.motion.ordered_mps())
    }

    /// Takes an operator's or a guard's request, as [`Motion::request`]. It takes effect at the next tick.
    ///
    /// # Errors
    /// The reason of the refusal; [`Refusal::Followed`] for a seek that the timecode would undo at once.
    pub fn request(&mut self, request: Request) -> Result<(), Refusal> {
        match request {
            Request::Seek { .. } if self.is_led => Err(Refusal::Followed),
            Request::Speed { speed_mps } => self.set_speed(speed_mps),
            // A GO that is sent twice is one.
            Request::Go if self.has_just_gone() => Ok(()),
            Request::Go => {
                self.motion.request(request)?;
                self.since_go = Some(0);
                Ok(())
            }
            _ => self.motion.request(request),
        }
    }

    fn has_just_gone(&self) -> bool {
        self.since_go.is_some_and(|periods| periods * 10 < 3 * u64::from(self.rate_hz))
    }

    /// Whether its frame may be the same although periods were missed before it, and a later one not: a standing show does not show
    /// its lag, and no frame shows the time since the last GO.
    pub fn hides_missed_periods(&self) -> bool {
        !self.motion.head().state.walks() || self.has_just_gone()
    }

    /// Plays at the pace at which the planned speed of the leading head becomes this speed.
    fn set_speed(&mut self, speed_mps: f64) -> Result<(), Refusal> {
        let formation = self.stepper.formation();
        let planned_mps = formation.timetable().planned_mps();
        let ordered_mps = match formation.ordered_mps(self.motion.head().travel_m) {
            _ if !formation.has_plan_course() => planned_mps,
            // The leading dragon is planned to stand here.
            0.0 => planned_mps,
            ordered_mps => ordered_mps,
        };
        let along_mps = if ordered_mps == planned_mps { speed_mps } else { speed_mps * (planned_mps / ordered_mps) };
        self.motion.request(Request::Speed { speed_mps: along_mps }).map_err(|refusal| match refusal {
            Refusal::OutOfRange { lowest, highest } if ordered_mps < planned_mps => {
                Refusal::OutOfRange { lowest, highest: highest * (ordered_mps / planned_mps) }
            }
            refusal => refusal,
        })
    }

    /// The head, and the reasons for which it stands.
    pub fn motion(&self) -> &Motion {
        &self.motion
    }

    /// Lag of the show behind the clock now, and the greatest so far, in nanoseconds of wall time.
    pub fn behind_ns(&self) -> [u64; 2] {
        let catch_up = self.motion.catch_up();
        [catch_up.behind_ns(self.rate_hz), catch_up.most_behind_ns(self.rate_hz)]
    }

    /// Returns the header of this tick's frame. The publisher sets `published_ns`.
    pub fn header(&self, run_id: u64, tick: u64, scheduled_ns: u64) -> FrameHeader {
        let formation = self.stepper.formation();
        let time_scale = self.time_scale * self.motion.catch_up().pace();
        let bench_count = formation.layout().benches() as u32;
        let header = self.motion.head().header(run_id, tick, scheduled_ns, time_scale, bench_count);
        if formation.has_plan_course() { of_formation(header, formation) } else { header }
    }

    /// Writes every handle at this tick, dragon after dragon.
    ///
    /// # Panics
    /// Panics if `handles` has another length than the layout of the formation.
    pub fn write(&mut self, handles: &mut [HandleState]) -> HeadState {
        let head = self.motion.head();
        self.stepper
            .step(head.travel_m, head.speed_mps, handles, handle_state)
            .expect("the motion stays on the course");
        head
    }
}

/// The header of a frame of several dragons, from one whose head is a place of the course.
fn of_formation(mut header: FrameHeader, formation: &Formation) -> FrameHeader {
    (header.dragon_count, header.is_plan) = (formation.layout().dragons() as u32, 1);
    for (number, dragon) in header.dragons.iter_mut().enumerate().take(formation.layout().dragons()) {
        let at = formation.motion(number, header.course_m, header.course_mps);
        *dragon = DragonMotion {
            travel_m: at.travel_m,
            speed_mps: at.speed_mps,
            first_handle: formation.layout().handles_of(number).start as u32,
            bench_count: formation.layout().benches_of(number).len() as u32,
            state: DragonState::of(at.speed_mps, at.has_ended).to_wire(),
            reserved: 0,
        };
    }
    (header.head_travel_m, header.head_speed_mps) = (header.dragons[0].travel_m, header.dragons[0].speed_mps);
    header
}

fn handle_state(position_m: DVec3, velocity_mps: DVec3) -> HandleState {
    HandleState { position_m: position_m.into(), velocity_mps: velocity_mps.into() }
}

impl HeadState {
    /// Returns the header of the frame of one dragon that shows this head. The publisher sets `published_ns`.
    pub fn header(&self, run_id: u64, tick: u64, scheduled_ns: u64, time_scale: f64, bench_count: u32) -> FrameHeader {
        let header = FrameHeader {
            run_id,
            tick,
            show_time_ns: self.show_time_ns,
            scheduled_ns,
            head_travel_m: self.travel_m,
            head_speed_mps: self.speed_mps,
            time_scale,
            bench_count,
            state: self.state.to_wire(),
            ..FrameHeader::default()
        };
        header.of_one_dragon()
    }
}
