//! The head's way through the show: from ticks and requests to show time, travel, speed and state.
//!
//! Pure: no clock, no geometry. Every running tick advances show time by exactly `time_scale / rate`. Show time and
//! travel are computed from the last seek and the last change of speed, never accumulated, so rounding does not grow.

use bench_dragon_ipc::{Refusal, Request, ShowState};

/// What a motion starts from. All values are finite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionPlan {
    /// Speed of the head that travel is planned with, above 0, in metres per show second.
    pub speed_mps: f64,
    /// Show seconds that one running tick advances.
    pub tick_s: f64,
    /// Show time at tick 0.
    pub start_s: f64,
    /// Travel at tick 0, in metres.
    pub start_travel_m: f64,
    /// Speed at tick 0, from 0 to [`Request::MAX_SPEED_MPS`], in metres per show second.
    pub start_speed_mps: f64,
    /// Show time of the run's start: the least that may be sought.
    pub first_s: f64,
    /// Show time of the run's end at the planned speed: the most that may be sought.
    pub last_s: f64,
    /// Travel at which the run ends, in metres.
    pub end_travel_m: f64,
    /// Show time at which the show is over, where that comes first.
    pub until_s: Option<f64>,
    /// Whether tick 0 is held.
    pub held: bool,
    /// Whether tick 0 is paused, or will be once the hold is lifted.
    pub paused: bool,
}

/// The head at one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeadState {
    /// Show time in nanoseconds.
    pub sim_time_ns: i64,
    /// Signed arc length walked since t = 0, in metres.
    pub travel_m: f64,
    /// Speed in metres per show second; 0 unless running.
    pub speed_mps: f64,
    /// What the show is doing.
    pub state: ShowState,
}

/// A stretch of the show without a seek.
#[derive(Clone, Copy, Debug)]
struct Leg {
    start_s: f64,
    /// Running ticks since its start.
    ticks: u64,
    /// Whether the tick that shows its start has begun.
    shown: bool,
}

/// A stretch of the show at one speed, counted in the ticks of its leg.
#[derive(Clone, Copy, Debug)]
struct Pace {
    start_travel_m: f64,
    start_ticks: u64,
    speed_mps: f64,
}

/// The motion of the head.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    plan: MotionPlan,
    leg: Leg,
    pace: Pace,
    paused: bool,
    held: bool,
    /// Show time and travel of the end, once it is reached.
    end: Option<(f64, f64)>,
}

impl Motion {
    /// The motion before tick 0, which begins with the first [`Motion::advance`].
    pub fn new(plan: MotionPlan) -> Self {
        let leg = Leg { start_s: plan.start_s, ticks: 0, shown: false };
        let pace = Pace { start_travel_m: plan.start_travel_m, start_ticks: 0, speed_mps: plan.start_speed_mps };
        let mut motion = Self { plan, leg, pace, paused: plan.paused, held: plan.held, end: None };
        motion.stop_at_end(motion.sim_s(), motion.travel_m());
        motion
    }

    /// Begins the next tick, after the requests that hold from it on.
    ///
    /// A tick that starts a leg, by a seek or as the first of all, shows the leg's start.
    pub fn advance(&mut self) {
        let starts_leg = !std::mem::replace(&mut self.leg.shown, true);
        if starts_leg || self.state() != ShowState::Running {
            return;
        }
        let (sim_s, travel_m) = (self.sim_s(), self.travel_m());
        self.leg.ticks += 1;
        self.stop_at_end(sim_s, travel_m);
    }

    /// Takes a request at the start of a tick, from which on it holds. `Stop` is accepted and changes nothing here.
    ///
    /// # Errors
    /// The reason for which it is refused; then nothing has changed.
    pub fn request(&mut self, request: Request) -> Result<(), Refusal> {
        match request {
            Request::Pause => self.paused = true,
            Request::Resume => self.resume()?,
            Request::Speed { speed_mps } => self.set_speed(speed_mps)?,
            Request::Seek { sim_time_s } => self.seek(sim_time_s)?,
            Request::Hold => self.held = true,
            Request::Release if self.held => self.held = false,
            Request::Release => return Err(Refusal::NotHeld),
            Request::Stop => {}
        }
        Ok(())
    }

    /// The head at this tick.
    pub fn head(&self) -> HeadState {
        let state = self.state();
        let (sim_s, travel_m) = self.end.unwrap_or_else(|| (self.sim_s(), self.travel_m()));
        let speed_mps = if state == ShowState::Running { self.pace.speed_mps } else { 0.0 };
        HeadState { sim_time_ns: (sim_s * 1e9).round() as i64, travel_m, speed_mps, state }
    }

    fn state(&self) -> ShowState {
        match self {
            Self { held: true, .. } => ShowState::Held,
            Self { end: Some(_), .. } => ShowState::Finished,
            Self { paused: true, .. } => ShowState::Paused,
            _ => ShowState::Running,
        }
    }

    fn sim_s(&self) -> f64 {
        self.leg.start_s + self.leg.ticks as f64 * self.plan.tick_s
    }

    fn travel_m(&self) -> f64 {
        let ticks = self.leg.ticks - self.pace.start_ticks;
        self.pace.start_travel_m + self.pace.speed_mps * (ticks as f64 * self.plan.tick_s)
    }

    /// Ends the motion exactly where the run or the time asked for ends, if this tick has reached it. The tick before
    /// was at `last_s` and `last_travel_m`.
    fn stop_at_end(&mut self, last_s: f64, last_travel_m: f64) {
        let past_end_m = self.travel_m() >= self.plan.end_travel_m;
        let end_s = past_end_m.then(|| match self.pace.speed_mps {
            0.0 => last_s,
            speed_mps => last_s + (self.plan.end_travel_m - last_travel_m).max(0.0) / speed_mps,
        });
        let until_s = self.plan.until_s.filter(|&until_s| self.sim_s() >= until_s);
        self.end = match (end_s, until_s) {
            (None, None) => None,
            (Some(end_s), None) => Some((end_s, self.plan.end_travel_m)),
            (Some(end_s), Some(until_s)) if end_s <= until_s => Some((end_s, self.plan.end_travel_m)),
            (_, Some(until_s)) => {
                let at_s = until_s.max(last_s);
                Some((at_s, last_travel_m + self.pace.speed_mps * (at_s - last_s)))
            }
        };
    }

    fn resume(&mut self) -> Result<(), Refusal> {
        match self.state() {
            ShowState::Held => return Err(Refusal::Held),
            ShowState::Finished => return Err(Refusal::Finished),
            ShowState::Running | ShowState::Paused => self.paused = false,
        }
        Ok(())
    }

    fn set_speed(&mut self, speed_mps: f64) -> Result<(), Refusal> {
        if !(0.0..=Request::MAX_SPEED_MPS).contains(&speed_mps) {
            return Err(Refusal::OutOfRange { lowest: 0.0, highest: Request::MAX_SPEED_MPS });
        }
        self.pace = Pace { start_travel_m: self.travel_m(), start_ticks: self.leg.ticks, speed_mps };
        Ok(())
    }

    fn seek(&mut self, sim_time_s: f64) -> Result<(), Refusal> {
        let last_s = self.plan.until_s.map_or(self.plan.last_s, |until_s| until_s.min(self.plan.last_s));
        if !(self.plan.first_s..=last_s).contains(&sim_time_s) {
            return Err(Refusal::OutOfRange { lowest: self.plan.first_s, highest: last_s });
        }
        self.leg = Leg { start_s: sim_time_s, ticks: 0, shown: false };
        self.pace.start_travel_m = self.plan.speed_mps * sim_time_s;
        self.pace.start_ticks = 0;
        self.stop_at_end(sim_time_s, self.pace.start_travel_m);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan() -> MotionPlan {
        MotionPlan {
            speed_mps: 1.0,
            tick_s: 0.001,
            start_s: 0.0,
            start_travel_m: 0.0,
            start_speed_mps: 1.0,
            first_s: 0.0,
            last_s: 400.0,
            end_travel_m: 400.0,
            until_s: None,
            held: false,
            paused: false,
        }
    }

    /// The motion at tick 0.
    fn start(plan: MotionPlan) -> Motion {
        after(Motion::new(plan), 1)
    }

    fn after(mut motion: Motion, ticks: u64) -> Motion {
        for _ in 0..ticks {
            motion.advance();
        }
        motion
    }

    #[test]
    fn running_ticks_advance_show_time_by_exactly_one_step() {
        let motion = after(start(MotionPlan { tick_s: 20.0 / 1000.0, ..plan() }), 12_345);
        assert_eq!(motion.head().sim_time_ns, 246_900_000_000);
        assert_eq!(motion.head().travel_m, 12_345.0 * 0.02);
    }

    #[test]
    fn a_paused_show_stands_and_resumes_where_it_stood() {
        let mut motion = after(start(plan()), 5);
        motion.request(Request::Pause).expect("pause is always accepted");
        let paused = after(motion, 100).head();
        assert_eq!((paused.state, paused.speed_mps, paused.sim_time_ns), (ShowState::Paused, 0.0, 5_000_000));
        motion.request(Request::Resume).expect("a paused show resumes");
        assert_eq!(after(motion, 1).head().sim_time_ns, 6_000_000);
    }

    #[test]
    fn only_release_lifts_a_hold() {
        let mut motion = after(start(plan()), 5);
        motion.request(Request::Hold).expect("hold is always accepted");
        assert_eq!(motion.request(Request::Resume), Err(Refusal::Held));
        assert_eq!(after(motion, 9).head().state, ShowState::Held);
        motion.request(Request::Release).expect("a held show is released");
        assert_eq!(motion.head().state, ShowState::Running);
        assert_eq!(motion.request(Request::Release), Err(Refusal::NotHeld));
    }

    #[test]
    fn a_pause_outlasts_a_hold() {
        let mut motion = start(plan());
        for request in [Request::Pause, Request::Hold, Request::Release] {
            motion.request(request).expect("the three are accepted");
        }
        assert_eq!(motion.head().state, ShowState::Paused);
    }

    #[test]
    fn a_new_speed_bends_the_travel_and_not_the_show_time() {
        let mut motion = after(start(plan()), 1000);
        motion.request(Request::Speed { speed_mps: 2.0 }).expect("2 m/s is allowed");
        let head = after(motion, 500).head();
        assert_eq!(head.sim_time_ns, 1_500_000_000);
        assert!((head.travel_m - 2.0).abs() < 1e-12, "{}", head.travel_m);
    }

    #[test]
    fn impossible_speeds_are_refused_with_the_range() {
        let mut motion = start(plan());
        for speed_mps in [-0.1, 10.1, f64::NAN, f64::INFINITY] {
            let refusal = motion.request(Request::Speed { speed_mps });
            assert_eq!(refusal, Err(Refusal::OutOfRange { lowest: 0.0, highest: 10.0 }), "{speed_mps}");
        }
    }

    #[test]
    fn a_seek_goes_to_the_configured_speed_times_the_time() {
        let mut motion = after(start(MotionPlan { speed_mps: 0.5, start_speed_mps: 0.5, last_s: 800.0, ..plan() }), 10);
        motion.request(Request::Speed { speed_mps: 3.0 }).expect("3 m/s is allowed");
        motion.request(Request::Seek { sim_time_s: 100.0 }).expect("100 s is inside the run");
        assert_eq!(motion.head().travel_m, 50.0);
        assert_eq!(motion.head().speed_mps, 3.0);
        let refusal = motion.request(Request::Seek { sim_time_s: 800.1 });
        assert_eq!(refusal, Err(Refusal::OutOfRange { lowest: 0.0, highest: 800.0 }));
    }

    #[test]
    fn a_run_that_starts_before_0_may_be_sought_as_far_back() {
        let plan = MotionPlan { start_s: -2.0, start_travel_m: -2.0, first_s: -2.0, ..plan() };
        let mut motion = after(start(plan), 100);
        assert_eq!(motion.head().sim_time_ns, -1_900_000_000);
        motion.request(Request::Seek { sim_time_s: -1.5 }).expect("-1.5 s is inside the run");
        assert_eq!(motion.head().travel_m, -1.5);
        let refusal = motion.request(Request::Seek { sim_time_s: -2.1 });
        assert_eq!(refusal, Err(Refusal::OutOfRange { lowest: -2.0, highest: 400.0 }));
    }

    #[test]
    fn the_run_ends_exactly_at_its_end() {
        let motion = after(start(MotionPlan { tick_s: 0.3, end_travel_m: 1.0, ..plan() }), 50);
        let head = motion.head();
        assert_eq!((head.state, head.travel_m, head.sim_time_ns), (ShowState::Finished, 1.0, 1_000_000_000));
        assert_eq!(motion.clone().request(Request::Resume), Err(Refusal::Finished));
    }

    #[test]
    fn the_show_ends_exactly_at_the_time_asked_for() {
        let motion = after(start(MotionPlan { tick_s: 0.3, until_s: Some(0.5), ..plan() }), 50);
        let head = motion.head();
        assert_eq!((head.state, head.sim_time_ns), (ShowState::Finished, 500_000_000));
        assert!((head.travel_m - 0.5).abs() < 1e-12);
    }

    #[test]
    fn a_seek_starts_a_finished_show_again() {
        let mut motion = after(start(MotionPlan { end_travel_m: 0.002, ..plan() }), 9);
        assert_eq!(motion.head().state, ShowState::Finished);
        motion.request(Request::Seek { sim_time_s: 0.0 }).expect("the start is inside the run");
        assert_eq!(after(motion, 1).head().sim_time_ns, 0, "the tick of a seek shows its target");
        assert_eq!(after(motion, 2).head().sim_time_ns, 1_000_000);
    }

    #[test]
    fn a_show_that_starts_at_its_end_is_finished() {
        assert_eq!(
            start(MotionPlan { start_s: 400.0, start_travel_m: 400.0, ..plan() }).head().state,
            ShowState::Finished
        );
    }
}
