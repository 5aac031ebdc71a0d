//! The dragon from tick to tick. Pure: no clock, no bus.

use std::sync::Arc;

use bench_dragon_ipc::{FrameHeader, HandleState, Refusal, Request, Stops};
use glam::DVec2;

use crate::dragon::{ChainStepper, Dragon, HandleRecord};
use crate::server::motion::{CatchUp, HeadState, Limits, Motion, MotionPlan};
use crate::timecode::Show;

/// The state of a whole dragon as a function of ticks and requests.
#[derive(Debug)]
pub struct Simulation {
    motion: Motion,
    chain: ChainStepper,
}

impl Simulation {
    /// The dragon before tick 0, which begins with the first [`Simulation::advance`].
    pub fn new(dragon: Arc<Dragon>, plan: MotionPlan) -> Self {
        Self { motion: Motion::new(plan), chain: ChainStepper::new(dragon) }
    }

    /// Begins the next tick, after the requests that hold from it on.
    pub fn advance(&mut self) {
        self.motion.advance();
    }

    /// Takes note of releases that were missed since the last tick, before the requests of the next one.
    pub fn miss(&mut self, releases: u64) {
        self.motion.miss(releases);
    }

    /// Forgets how far the show is behind: something else steers it to where it should be.
    pub fn forget_lag(&mut self) {
        self.motion.forget_lag();
    }

    /// How the show keeps time.
    pub fn catch_up(&self) -> &CatchUp {
        self.motion.catch_up()
    }

    /// Takes a request at the start of a tick, from which on it holds.
    ///
    /// # Errors
    /// The reason for which it is refused; then nothing has changed.
    pub fn request(&mut self, request: Request) -> Result<(), Refusal> {
        self.motion.request(request)
    }

    /// Lets show time go on by so much with each running tick from the next one on.
    pub fn set_tick(&mut self, tick_s: f64) {
        self.motion.set_tick(tick_s);
    }

    /// Lets the show follow timecode: it stands until the first one.
    pub fn follow(&mut self) {
        self.motion.follow();
    }

    /// Has the show stand, paused, or walk on, beside what the operator wants.
    pub fn set_stands(&mut self, stands: bool) {
        self.motion.set_stands(stands);
    }

    /// What a follower of timecode has to know.
    pub fn show(&self) -> Show {
        Show { sim_time_s: self.motion.next_sim_s(), is_stopped: self.motion.is_stopped() }
    }

    /// The head at this tick.
    pub fn head(&self) -> HeadState {
        self.motion.head()
    }

    /// What a guard has to do with this head.
    pub fn limits(&self) -> Limits {
        self.motion.limits()
    }

    /// What keeps the head from walking, or has it brake.
    pub fn stops(&self) -> Stops {
        self.motion.stops()
    }

    /// Writes every handle at this tick. The slice has one handle more than there are benches.
    ///
    /// # Panics
    /// Where the slice has another length.
    pub fn write(&mut self, handles: &mut [HandleState]) -> HeadState {
        let head = self.motion.head();
        self.chain.step(head.travel_m, head.speed_mps, handles).expect("the motion stays within the run");
        head
    }
}

/// The dragon dances on level ground.
impl HandleRecord for HandleState {
    fn of(position_m: DVec2, velocity_mps: DVec2) -> Self {
        Self { position_m: [position_m.x, position_m.y, 0.0], velocity_mps: [velocity_mps.x, velocity_mps.y, 0.0] }
    }
}

impl HeadState {
    /// The header of the frame that shows this head. The publisher stamps when it is sent.
    pub fn header(&self, run_id: u64, tick: u64, scheduled_ns: u64, time_scale: f64, bench_count: u32) -> FrameHeader {
        FrameHeader {
            run_id,
            tick,
            sim_time_ns: self.sim_time_ns,
            scheduled_ns,
            published_ns: 0,
            head_travel_m: self.travel_m,
            head_speed_mps: self.speed_mps,
            time_scale,
            bench_count,
            state: self.state.to_wire(),
        }
    }
}
