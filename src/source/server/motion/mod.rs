//! Motion of the head: from ticks and requests to show time, travel, speed and state.
//!
//! Pure: no clock, no geometry. Every running tick advances show time by exactly one period, `time_scale / rate`. A
//! tick in which the head comes to rest ends at that instant. Show time is counted in periods from the last seek, such
//! a rest, or change of the time scale. Travel is in closed form from the last change of speed. So rounding does not
//! grow.
//!
//! The show keeps time with the clock: before a tick, [`Motion::miss`] advances the show by the missed periods
//! ([`CatchUp`]). The grouping of periods has no effect. So a show that missed periods has the same show time and
//! travel, to the bit, as one that did not.
//!
//! A plan may wait at places of its course. There the show rests until [`Request::Go`].
//!
//! A guarded head walks only up to the travel that its guard has granted ([`Request::Grant`]). There it is held until a
//! further grant.

mod authority;
mod catch_up;
mod plan;
mod walk;

use bench_dragon_ipc::{Refusal, Request, ShowState, Stop, Stops};

pub use catch_up::{CatchUp, FASTEST};
pub use plan::{HeadState, Limits, MotionPlan, MotionPlanError, MotionSettings};

use authority::Authority;
use walk::Walk;

/// An interval of the show with ticks of one length.
#[derive(Clone, Copy, Debug)]
struct Leg {
    start_s: f64,
    /// Tenths of a period since the leg's start.
    parts: u64,
    /// Whether the tick that shows the leg's start has begun.
    is_shown: bool,
}

/// The motion of the head.
#[allow(clippy::struct_excessive_bools, reason = "each flag has its own cause")]
#[derive(Clone, Debug)]
pub struct Motion {
    plan: MotionSettings,
    leg: Leg,
    walk: Walk,
    /// Speed to walk at while nothing stops the head.
    speed_mps: f64,
    authority: Option<Authority>,
    catch_up: CatchUp,
    is_paused: bool,
    is_held: bool,
    /// Whether the show waits at its start for its first release.
    is_ready: bool,
    /// Whether the hold is that of a restarted server.
    is_restarted: bool,
    follows: bool,
    stands: bool,
    is_ending: bool,
    /// Whether the show has reached its end time.
    is_over: bool,
    /// Whether a seek has moved the head, and it has not walked since.
    was_repositioned: bool,
    /// The wait that the last GO ended, as long as the head has not left it.
    ended_wait_m: Option<f64>,
}

impl Motion {
    /// Creates the motion before tick 0, which begins with the first [`Motion::advance`].
    pub fn new(plan: MotionPlan) -> Self {
        let plan = plan.settings();
        let mut motion = Self {
            leg: Leg { start_s: plan.start_s, parts: 0, is_shown: false },
            walk: Walk::at_rest(plan.tick_s, plan.accel_mps2, plan.start_travel_m),
            speed_mps: plan.start_speed_mps,
            authority: plan.guarded_run.map(Authority::none),
            catch_up: CatchUp::new(plan.most_jumped),
            is_paused: plan.is_paused,
            is_held: plan.is_held,
            is_ready: plan.is_ready,
            is_restarted: plan.is_restarted && plan.is_held,
            follows: false,
            stands: false,
            is_ending: false,
            is_over: plan.until_s.is_some_and(|until_s| plan.start_s >= until_s),
            was_repositioned: false,
            ended_wait_m: None,
            plan,
        };
        motion.steer();
        motion
    }

    /// Begins the next tick, after the requests that take effect at it.
    ///
    /// The first tick of a run, and the first after a seek, shows the start of its leg.
    pub fn advance(&mut self) {
        let starts_leg = !std::mem::replace(&mut self.leg.is_shown, true);
        let runs = !starts_leg && self.state().walks();
        let parts = self.catch_up.tick(runs);
        if runs {
            self.go_on(parts);
        }
    }

    /// Takes the number of periods that were missed since the last tick, before the requests of the next one.
    ///
    /// A running show advances by as many periods, as if it had ticked. Where they exceed the limit of a jump, the show
    /// falls behind by them instead.
    pub fn miss(&mut self, periods: u64) {
        if periods > 0 && self.leg.is_shown && self.state().walks() {
            let parts = self.catch_up.miss(periods);
            self.go_on(parts);
        }
    }

    /// Sets the lag of the show to zero. The follower of timecode corrects the show time instead.
    pub fn forget_lag(&mut self) {
        self.catch_up.clear();
    }

    /// The show's lag and pace.
    pub fn catch_up(&self) -> &CatchUp {
        &self.catch_up
    }

    /// Advances show time within a leg.
    fn go_on(&mut self, parts: u64) {
        if parts == 0 {
            return;
        }
        self.was_repositioned = false;
        let next = self.leg.parts + parts;
        if self.plan.until_s.is_some_and(|until_s| self.sim_s_at(periods(next)) >= until_s) {
            return self.end_show();
        }
        self.leg.parts = next;
        self.walk.advance_to(self.ticks());
        self.stop_time_at_rest();
    }

    /// Takes a request at the start of a tick. It takes effect at this tick. After a `Stop` the head brakes to rest,
    /// and the state is then [`ShowState::Ended`].
    ///
    /// # Errors
    /// The reason of the refusal. A refused request changes nothing, with one exception: the travel of a refused `Seek`
    /// is kept for the guard.
    pub fn request(&mut self, request: Request) -> Result<(), Refusal> {
        match request {
            Request::Pause => self.is_paused = true,
            Request::Resume => self.resume()?,
            Request::Speed { speed_mps } => self.set_speed(speed_mps)?,
            Request::Seek { show_time_s } => self.seek(show_time_s)?,
            Request::Hold => self.hold(),
            Request::Release => self.release()?,
            Request::Grant { run_id, from_m, to_m, is_final } => self.grant(run_id, [from_m, to_m], is_final)?,
            Request::Stop => self.is_ending = true,
            Request::Pace { factor } => self.set_pace(factor)?,
            Request::Go => self.go()?,
        }
        self.steer();
        Ok(())
    }

    /// Sets the show seconds by which each running tick advances, from the next tick on.
    pub fn set_tick(&mut self, tick_s: f64) {
        if tick_s == self.plan.tick_s {
            return;
        }
        let shown = self.leg.is_shown;
        self.begin_leg(self.sim_s(), self.ticks());
        self.leg.is_shown = shown;
        self.walk.count_in(tick_s);
        self.plan.tick_s = tick_s;
    }

    /// Makes the show follow timecode. The show stands until the first timecode.
    pub fn follow(&mut self) {
        self.follows = true;
        self.set_stands(true);
    }

    /// Makes the show stand, paused, or walk on. The operator's pause and hold stay as they are.
    pub fn set_stands(&mut self, stands: bool) {
        self.stands = stands;
        self.steer();
    }

    /// Whether the operator has paused or held the show, or has not started it yet.
    pub fn is_stopped(&self) -> bool {
        self.is_paused || self.is_held || self.is_ready
    }

    /// Show time of the next tick if the show runs, in seconds.
    pub fn next_sim_s(&self) -> f64 {
        let runs = self.leg.is_shown && self.state().walks();
        if runs { self.sim_s_at(self.ticks() + 1.0) } else { self.sim_s() }
    }

    /// The head at this tick.
    pub fn head(&self) -> HeadState {
        let state = self.state();
        let speed_mps = if state.walks() { self.walk.speed_mps(self.ticks()) } else { 0.0 };
        HeadState { show_time_ns: (self.sim_s() * 1e9).round() as i64, travel_m: self.travel_m(), speed_mps, state }
    }

    /// The speed at which the head walks along the course if nothing stops it, in metres per show second.
    pub fn ordered_mps(&self) -> f64 {
        self.speed_mps
    }

    /// Limits of this head, for its guard.
    pub fn limits(&self) -> Limits {
        self.authority.map(|authority| authority.limits(self.travel_m())).unwrap_or_default()
    }

    /// The reasons for which the head stands or brakes.
    pub fn stops(&self) -> Stops {
        let rests = self.walk.rests_since().is_some();
        let stops = [
            (Stop::Paused, self.is_paused),
            (Stop::Held, self.is_held),
            (Stop::GuardLimit, rests && self.is_at_limit()),
            (Stop::Timecode, self.stands),
            (Stop::Ending, self.is_ending),
            (Stop::RunEnd, self.is_over || rests && self.travel_m() >= self.plan.end_travel_m),
            (Stop::Ready, self.is_ready),
            (Stop::Restarted, self.is_restarted),
            (Stop::Waiting, self.waits()),
        ];
        stops.into_iter().filter_map(|(stop, holds)| holds.then_some(stop)).collect()
    }

    fn granted_to_m(&self) -> Option<f64> {
        self.authority.map(|authority| authority.limit_m(self.travel_m()))
    }

    fn state(&self) -> ShowState {
        let rests = self.walk.rests_since().is_some();
        match self {
            Self { is_ending: true, .. } if rests || self.is_over => ShowState::Ended,
            Self { is_held: true, .. } if rests || self.is_over => ShowState::Held,
            Self { is_ready: true, .. } => ShowState::Ready,
            Self { is_over: true, .. } => self.state_at_end(),
            _ if rests && self.travel_m() >= self.plan.end_travel_m => self.state_at_end(),
            Self { is_paused: true, .. } | Self { stands: true, .. } if self.waits() => ShowState::Paused,
            _ if self.waits() => ShowState::Waiting,
            _ if rests && self.is_at_limit() => ShowState::Held,
            Self { is_paused: true, .. } | Self { stands: true, .. } if rests => ShowState::Paused,
            _ if self.is_to_stand() => ShowState::Stopping,
            _ => ShowState::Running,
        }
    }

    /// State at the end of the run. A run with an end time ends there, unless it stays; any other continues to publish the
    /// finished show. A timecode that jumps past the end may jump back, so with timecode the run ends only when the head walks
    /// to its end.
    fn state_at_end(&self) -> ShowState {
        let ends = self.plan.until_s.is_some() && !self.plan.stays && !(self.follows && self.was_repositioned);
        if ends { ShowState::Ended } else { ShowState::Finished }
    }

    /// Whether the operator, the timecode or a stop brings the head to rest.
    fn is_to_stand(&self) -> bool {
        self.is_held || self.is_ready || self.is_paused || self.stands || self.is_ending
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

    /// Sets the walk's target speed and limit from all requests so far.
    fn steer(&mut self) {
        let target_mps = if self.is_to_stand() { 0.0 } else { self.speed_mps };
        let granted_to_m = self.granted_to_m().unwrap_or(f64::INFINITY);
        let rest_m = self.wait_m().min(self.plan.end_travel_m);
        let rests_at_limit = self.plan.has_planned_ends && granted_to_m >= rest_m;
        self.walk.leave_at_once(self.planned_rest_m());
        self.walk.steer(self.ticks(), target_mps, granted_to_m.min(rest_m), rests_at_limit);
    }

    /// The place of the head, if the plan itself rests there.
    fn planned_rest_m(&self) -> Option<f64> {
        let begin_m = self.plan.speed_mps * self.plan.first_s;
        let is_rest = |travel_m: &f64| *travel_m == begin_m || self.plan.waits_m.contains(travel_m);
        Some(self.travel_m()).filter(|travel_m| self.plan.has_planned_ends && is_rest(travel_m))
    }

    /// The next place at which the show waits for GO; infinite if there is none.
    fn wait_m(&self) -> f64 {
        let travel_m = self.travel_m();
        let is_ahead = |wait_m: &f64| *wait_m > travel_m || *wait_m == travel_m && self.ended_wait_m != Some(travel_m);
        self.plan.waits_m.iter().copied().find(is_ahead).unwrap_or(f64::INFINITY)
    }

    /// Whether the show stands at a wait.
    fn waits(&self) -> bool {
        self.walk.rests_since().is_some() && self.wait_m() == self.travel_m()
    }

    /// Begins a leg at the instant at which the head came to rest, if that is within this tick.
    fn stop_time_at_rest(&mut self) {
        if let Some(since) = self.walk.rests_since()
            && since <= self.ticks()
            && !self.state().walks()
        {
            self.begin_leg(self.sim_s_at(since), since);
        }
    }

    /// Ends the show at its end time, unless the head has come to rest permanently before.
    fn end_show(&mut self) {
        let until_s = self.plan.until_s.expect("called only where the plan has an end time");
        let until = (until_s - self.leg.start_s) / self.plan.tick_s;
        self.walk.advance_to(until);
        match self.walk.rests_since() {
            Some(since) if !self.state().walks() => self.begin_leg(self.sim_s_at(since), since),
            _ => {
                self.is_over = true;
                self.begin_leg(until_s.max(self.sim_s()), until);
            }
        }
    }

    /// Begins a leg inside the present one. A tick has already shown its start, so the next tick moves on.
    fn begin_leg(&mut self, start_s: f64, ticks: f64) {
        self.walk.count_from(ticks);
        self.leg = Leg { start_s, parts: 0, is_shown: true };
    }

    fn resume(&mut self) -> Result<(), Refusal> {
        match self.state() {
            _ if self.is_held => return Err(Refusal::Held),
            ShowState::Ready => return Err(Refusal::Ready),
            ShowState::Held => return Err(Refusal::HeldByGuard),
            ShowState::Finished | ShowState::Ended => return Err(Refusal::Finished),
            ShowState::Running | ShowState::Stopping | ShowState::Paused | ShowState::Waiting => self.is_paused = false,
        }
        Ok(())
    }

    /// Holds the show by request: the hold is no longer that of a start or restart.
    fn hold(&mut self) {
        (self.is_held, self.is_ready, self.is_restarted) = (true, false, false);
    }

    fn release(&mut self) -> Result<(), Refusal> {
        if !self.is_held && !self.is_ready {
            let by_guard = self.state() == ShowState::Held;
            return Err(if by_guard { Refusal::HeldByGuard } else { Refusal::NotHeld });
        }
        (self.is_held, self.is_ready, self.is_restarted) = (false, false, false);
        Ok(())
    }

    fn set_speed(&mut self, speed_mps: f64) -> Result<(), Refusal> {
        require(speed_mps, 0.0, Request::MAX_SPEED_MPS)?;
        self.speed_mps = speed_mps;
        Ok(())
    }

    /// Sets the speed along the course by its ratio to the planned one.
    fn set_pace(&mut self, factor: f64) -> Result<(), Refusal> {
        require(factor, 0.0, Request::MAX_SPEED_MPS / self.plan.speed_mps)?;
        self.speed_mps = factor * self.plan.speed_mps;
        Ok(())
    }

    /// Walks on from a wait.
    fn go(&mut self) -> Result<(), Refusal> {
        match self.state() {
            ShowState::Waiting => self.ended_wait_m = Some(self.travel_m()),
            _ if self.is_held => return Err(Refusal::Held),
            ShowState::Ready => return Err(Refusal::Ready),
            ShowState::Finished | ShowState::Ended => return Err(Refusal::Finished),
            _ if self.waits() => return Err(Refusal::Paused),
            _ => return Err(Refusal::NothingWaits),
        }
        Ok(())
    }

    fn seek(&mut self, show_time_s: f64) -> Result<(), Refusal> {
        let last_s = self.plan.until_s.map_or(self.plan.last_s, |until_s| until_s.min(self.plan.last_s));
        require(show_time_s, self.plan.first_s, last_s)?;
        // Rounding must put the head neither past the end of its run nor just before it: there, a timecode beyond the end would
        // seek at each tick, and the run would never be finished.
        let travel_m = (self.plan.speed_mps * show_time_s).min(self.plan.end_travel_m);
        let is_at_end = self.plan.end_travel_m - travel_m <= 2.0 * f64::EPSILON * self.plan.end_travel_m.abs();
        let travel_m = if is_at_end && !self.plan.has_planned_ends { self.plan.end_travel_m } else { travel_m };
        if let Some(authority) = &mut self.authority {
            authority.seek(travel_m)?;
        }
        self.catch_up.clear();
        self.leg = Leg { start_s: show_time_s, parts: 0, is_shown: false };
        self.walk = Walk::at_rest(self.plan.tick_s, self.plan.accel_mps2, travel_m);
        self.ended_wait_m = None;
        self.is_over = self.plan.until_s.is_some_and(|until_s| show_time_s >= until_s);
        self.was_repositioned = true;
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

/// Converts parts to periods. Whole periods are exact, and the result does not depend on how the parts were added up.
fn periods(parts: u64) -> f64 {
    parts as f64 / catch_up::PARTS as f64
}

fn require(value: f64, lowest: f64, highest: f64) -> Result<(), Refusal> {
    if (lowest..=highest).contains(&value) { Ok(()) } else { Err(Refusal::OutOfRange { lowest, highest }) }
}
