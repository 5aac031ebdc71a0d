//! The head's way through the show: from ticks and requests to show time, travel, speed and state.
//!
//! Pure: no clock, no geometry. Every running tick advances show time by exactly one period, `time_scale / rate`; the one
//! in which the head comes to rest ends at that instant. Show time is counted in periods from the last seek, such a rest, or
//! change of the time scale, and travel in closed form from the last change of speed, so rounding does not grow.
//!
//! The show keeps time with the clock: before a tick, [`Motion::miss`] advances the show by the releases that were missed
//! ([`CatchUp`]). Nothing depends on how periods are grouped, so a show that missed releases has the same show time and
//! travel, to the bit, as one that did not.
//!
//! A guarded head starts where it is and goes no further than its guard has granted ([`Request::Grant`]); there it stands
//! held, until a further grant moves it on.

mod authority;
mod catch_up;
mod plan;
mod walk;

use bench_dragon_ipc::{Refusal, Request, ShowState, Stops};

pub use catch_up::{CatchUp, FASTEST};
pub use plan::{HeadState, Limits, MotionPlan, MotionPlanError, MotionSettings};

use authority::Authority;
use walk::Walk;

/// A stretch of the show in which time goes on evenly.
#[derive(Clone, Copy, Debug)]
struct Leg {
    start_s: f64,
    /// Tenths of a period since its start.
    parts: u64,
    /// Whether the tick that shows its start has begun.
    shown: bool,
}

/// The motion of the head.
#[allow(clippy::struct_excessive_bools, reason = "each is the word of somebody else")]
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    plan: MotionSettings,
    leg: Leg,
    walk: Walk,
    /// Speed to walk at unless something stops the head.
    speed_mps: f64,
    authority: Option<Authority>,
    catch_up: CatchUp,
    paused: bool,
    held: bool,
    follows: bool,
    stands: bool,
    ending: bool,
    /// Whether the show time at which the show is over has been reached.
    over: bool,
    /// Whether the head was repositioned and has not walked since.
    repositioned: bool,
}

impl Motion {
    /// The motion before tick 0, which begins with the first [`Motion::advance`].
    pub fn new(plan: MotionPlan) -> Self {
        let plan = plan.settings();
        let mut motion = Self {
            plan,
            leg: Leg { start_s: plan.start_s, parts: 0, shown: false },
            walk: Walk::at_rest(plan.tick_s, plan.accel_mps2, plan.start_travel_m),
            speed_mps: plan.start_speed_mps,
            authority: plan.guarded_run.map(Authority::none),
            catch_up: CatchUp::new(plan.most_jumped),
            paused: plan.paused,
            held: plan.held,
            follows: false,
            stands: false,
            ending: false,
            over: plan.until_s.is_some_and(|until_s| plan.start_s >= until_s),
            repositioned: false,
        };
        motion.steer();
        motion
    }

    /// Begins the next tick, after the requests that hold from it on.
    ///
    /// A tick that starts a leg, by a seek or as the first of all, shows the leg's start.
    pub fn advance(&mut self) {
        let starts_leg = !std::mem::replace(&mut self.leg.shown, true);
        let runs = !starts_leg && self.state().walks();
        let parts = self.catch_up.tick(runs);
        if runs {
            self.go_on(parts);
        }
    }

    /// Takes note of releases that were missed since the last tick, before the requests of the next one.
    ///
    /// A running show goes on by as many periods, as if it had ticked; where they are more than may be jumped, it is behind
    /// by them instead.
    pub fn miss(&mut self, releases: u64) {
        if releases > 0 && self.leg.shown && self.state().walks() {
            let parts = self.catch_up.miss(releases);
            self.go_on(parts);
        }
    }

    /// Forgets how far the show is behind: something else steers it to where it should be.
    pub fn forget_lag(&mut self) {
        self.catch_up.clear();
    }

    /// How the show keeps time.
    pub fn catch_up(&self) -> &CatchUp {
        &self.catch_up
    }

    /// Lets show time go on within a leg.
    fn go_on(&mut self, parts: u64) {
        if parts == 0 {
            return;
        }
        self.repositioned = false;
        let next = self.leg.parts + parts;
        if self.plan.until_s.is_some_and(|until_s| self.sim_s_at(periods(next)) >= until_s) {
            return self.end_show();
        }
        self.leg.parts = next;
        self.walk.advance_to(self.ticks());
        self.stop_time_at_rest();
    }

    /// Takes a request at the start of a tick, from which on it holds. After a `Stop` the head comes to rest, and the state
    /// there is [`ShowState::Ended`].
    ///
    /// # Errors
    /// The reason for which it is refused; then nothing has changed, but that a refused `Seek` of a guarded head is
    /// remembered for its guard.
    pub fn request(&mut self, request: Request) -> Result<(), Refusal> {
        match request {
            Request::Pause => self.paused = true,
            Request::Resume => self.resume()?,
            Request::Speed { speed_mps } => self.set_speed(speed_mps)?,
            Request::Seek { sim_time_s } => self.seek(sim_time_s)?,
            Request::Hold => self.held = true,
            Request::Release => self.release()?,
            Request::Grant { run_id, from_m, to_m, is_final } => self.grant(run_id, [from_m, to_m], is_final)?,
            Request::Stop => self.ending = true,
        }
        self.steer();
        Ok(())
    }

    /// Lets show time go on by so much with each running tick from the next one on.
    pub fn set_tick(&mut self, tick_s: f64) {
        if tick_s == self.plan.tick_s {
            return;
        }
        let shown = self.leg.shown;
        self.begin_leg(self.sim_s(), self.ticks());
        self.leg.shown = shown;
        self.walk.count_in(tick_s);
        self.plan.tick_s = tick_s;
    }

    /// Lets the show follow timecode: it stands until the first one.
    pub fn follow(&mut self) {
        self.follows = true;
        self.set_stands(true);
    }

    /// Has the show stand, paused, or walk on. The operator's pause and hold are kept beside it.
    pub fn set_stands(&mut self, stands: bool) {
        self.stands = stands;
        self.steer();
    }

    /// Whether the operator has paused or held the show.
    pub fn is_stopped(&self) -> bool {
        self.paused || self.held
    }

    /// Show time of the next tick if it runs, in seconds.
    pub fn next_sim_s(&self) -> f64 {
        let runs = self.leg.shown && self.state().walks();
        if runs { self.sim_s_at(self.ticks() + 1.0) } else { self.sim_s() }
    }

    /// The head at this tick.
    pub fn head(&self) -> HeadState {
        let state = self.state();
        let speed_mps = if state.walks() { self.walk.speed_mps(self.ticks()) } else { 0.0 };
        HeadState { sim_time_ns: (self.sim_s() * 1e9).round() as i64, travel_m: self.travel_m(), speed_mps, state }
    }

    /// What a guard has to do with this head.
    pub fn limits(&self) -> Limits {
        self.authority.map(|authority| authority.limits(self.travel_m())).unwrap_or_default()
    }

    /// What keeps the head from walking, or has it brake.
    pub fn stops(&self) -> Stops {
        let rests = self.walk.rests_since().is_some();
        Stops {
            paused: self.paused,
            held: self.held,
            guard_limit: rests && self.is_at_limit(),
            timecode: self.stands,
            ending: self.ending,
            run_end: self.over || rests && self.travel_m() >= self.plan.end_travel_m,
        }
    }

    fn granted_to_m(&self) -> Option<f64> {
        self.authority.map(|authority| authority.limit_m(self.travel_m()))
    }

    fn state(&self) -> ShowState {
        let rests = self.walk.rests_since().is_some();
        match self {
            Self { ending: true, .. } if rests || self.over => ShowState::Ended,
            Self { held: true, .. } if rests || self.over => ShowState::Held,
            Self { over: true, .. } => self.state_at_end(),
            _ if rests && self.travel_m() >= self.plan.end_travel_m => self.state_at_end(),
            _ if rests && self.is_at_limit() => ShowState::Held,
            Self { paused: true, .. } | Self { stands: true, .. } if rests => ShowState::Paused,
            _ if self.is_to_stand() => ShowState::Stopping,
            _ => ShowState::Running,
        }
    }

    /// A run that was given an end is over there; any other goes on publishing the finished show. A timecode that jumps
    /// beyond the end may jump back: with timecode only a walk there ends the run.
    fn state_at_end(&self) -> ShowState {
        let ends = self.plan.until_s.is_some() && !(self.follows && self.repositioned);
        if ends { ShowState::Ended } else { ShowState::Finished }
    }

    /// Whether somebody has the head come to rest.
    fn is_to_stand(&self) -> bool {
        self.held || self.paused || self.stands || self.ending
    }

    fn is_at_limit(&self) -> bool {
        self.granted_to_m().is_some_and(|granted_to_m| self.travel_m() >= granted_to_m)
    }

    fn ticks(&self) -> f64 {
        periods(self.leg.parts)
    }

    fn sim_s(&self) -> f64 {
        self.sim_s_at(self.ticks())
    }

    fn sim_s_at(&self, ticks: f64) -> f64 {
        self.leg.start_s + ticks * self.plan.tick_s
    }

    fn travel_m(&self) -> f64 {
        self.walk.travel_m(self.ticks())
    }

    /// Tells the walk what all requests so far come to.
    fn steer(&mut self) {
        let target_mps = if self.is_to_stand() { 0.0 } else { self.speed_mps };
        let granted_to_m = self.granted_to_m().unwrap_or(f64::INFINITY);
        self.walk.steer(self.ticks(), target_mps, granted_to_m.min(self.plan.end_travel_m));
    }

    /// Lets a leg begin at the instant at which the head has come to rest, where that is within this tick.
    fn stop_time_at_rest(&mut self) {
        if let Some(since) = self.walk.rests_since()
            && since <= self.ticks()
            && !self.state().walks()
        {
            self.begin_leg(self.sim_s_at(since), since);
        }
    }

    /// Ends the show at the time asked for, unless the head has come to rest for good before.
    fn end_show(&mut self) {
        let until_s = self.plan.until_s.expect("asked for only where there is such a time");
        let until = (until_s - self.leg.start_s) / self.plan.tick_s;
        self.walk.advance_to(until);
        match self.walk.rests_since() {
            Some(since) if !self.state().walks() => self.begin_leg(self.sim_s_at(since), since),
            _ => {
                self.over = true;
                self.begin_leg(until_s.max(self.sim_s()), until);
            }
        }
    }

    /// Begins a leg at an instant of the present one, which has been shown.
    fn begin_leg(&mut self, start_s: f64, ticks: f64) {
        self.walk.count_from(ticks);
        self.leg = Leg { start_s, parts: 0, shown: true };
    }

    fn resume(&mut self) -> Result<(), Refusal> {
        match self.state() {
            _ if self.held => return Err(Refusal::Held),
            ShowState::Held => return Err(Refusal::HeldByGuard),
            ShowState::Finished | ShowState::Ended => return Err(Refusal::Finished),
            ShowState::Running | ShowState::Stopping | ShowState::Paused => self.paused = false,
        }
        Ok(())
    }

    fn release(&mut self) -> Result<(), Refusal> {
        if !self.held {
            let by_guard = self.state() == ShowState::Held;
            return Err(if by_guard { Refusal::HeldByGuard } else { Refusal::NotHeld });
        }
        self.held = false;
        Ok(())
    }

    fn set_speed(&mut self, speed_mps: f64) -> Result<(), Refusal> {
        require(speed_mps, 0.0, Request::MAX_SPEED_MPS)?;
        self.speed_mps = speed_mps;
        Ok(())
    }

    fn seek(&mut self, sim_time_s: f64) -> Result<(), Refusal> {
        let last_s = self.plan.until_s.map_or(self.plan.last_s, |until_s| until_s.min(self.plan.last_s));
        require(sim_time_s, self.plan.first_s, last_s)?;
        let travel_m = self.plan.speed_mps * sim_time_s;
        if let Some(authority) = &mut self.authority {
            authority.seek(travel_m)?;
        }
        self.catch_up.clear();
        self.leg = Leg { start_s: sim_time_s, parts: 0, shown: false };
        self.walk = Walk::at_rest(self.plan.tick_s, self.plan.accel_mps2, travel_m);
        self.over = self.plan.until_s.is_some_and(|until_s| sim_time_s >= until_s);
        self.repositioned = true;
        Ok(())
    }

    fn grant(&mut self, run_id: u64, [from_m, to_m]: [f64; 2], is_final: bool) -> Result<(), Refusal> {
        let travel_m = self.travel_m();
        let Some(authority) = &mut self.authority else { return Err(Refusal::NotGuarded) };
        let (first_m, end_m) = (self.plan.speed_mps * self.plan.first_s, self.plan.end_travel_m);
        require(from_m, first_m, end_m)?;
        require(to_m, from_m, end_m)?;
        authority.grant(run_id, [from_m, to_m], is_final, travel_m)
    }
}

/// Periods of so many parts: exact where they are whole, and the same bits however they were counted up.
fn periods(parts: u64) -> f64 {
    parts as f64 / catch_up::PARTS as f64
}

fn require(value: f64, lowest: f64, highest: f64) -> Result<(), Refusal> {
    if (lowest..=highest).contains(&value) { Ok(()) } else { Err(Refusal::OutOfRange { lowest, highest }) }
}
