//! The dragon from tick to tick. Pure: no clock, no bus.

use std::sync::Arc;

use bench_dragon_geometry::dragon::{ChainStepper, Dragon};
use bench_dragon_ipc::{FrameHeader, HandleState};
use glam::DVec2;

use crate::source::server::motion::{HeadState, Motion, MotionPlan};
use crate::source::timecode::ShowPosition;

/// What a timecode has a show do from a tick on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steering {
    /// Whether the show stands, beside what the operator wants.
    pub stands: bool,
    /// Show seconds per second of wall time.
    pub time_scale: f64,
    /// Ticks a second.
    pub rate_hz: u32,
}

/// The state of a whole dragon as a function of ticks and requests.
#[derive(Debug)]
pub struct Simulation {
    /// The head.
    pub motion: Motion,
    chain: ChainStepper,
}

impl Simulation {
    /// The dragon before tick 0, which begins with the first [`Motion::advance`].
    pub fn new(dragon: Arc<Dragon>, plan: MotionPlan) -> Self {
        Self { motion: Motion::new(plan), chain: ChainStepper::new(dragon) }
    }

    /// Begins a tick, after so many missed releases: the show goes on through those. Then come the requests that hold from this
    /// tick on, and [`Simulation::advance`]. A server's run and the verification of its recording keep this order.
    ///
    /// `is_led`: whether a timecode said where the show is at the tick before. Then the show is never behind the clock.
    pub fn begin_tick(&mut self, missed: u64, is_led: bool) {
        self.motion.miss(missed);
        if is_led {
            // The follower makes up what the timecode is ahead by.
            self.motion.forget_lag();
        }
    }

    /// Goes on by one period, to the tick's frame, as the timecode has it.
    pub fn advance(&mut self, steering: Option<Steering>) {
        if let Some(Steering { stands, time_scale, rate_hz }) = steering {
            self.motion.set_stands(stands);
            self.motion.set_tick(time_scale / f64::from(rate_hz));
        }
        self.motion.advance();
    }

    /// What a follower of timecode has to know.
    pub fn show(&self) -> ShowPosition {
        ShowPosition { sim_time_s: self.motion.next_sim_s(), is_stopped: self.motion.is_stopped() }
    }

    /// The header of this tick's frame, at a time scale of the show. The publisher stamps when it is sent.
    pub fn header(&self, run_id: u64, tick: u64, scheduled_ns: u64, time_scale: f64) -> FrameHeader {
        let bench_count = self.chain.dragon().dimensions().benches() as u32;
        self.motion.head().header(run_id, tick, scheduled_ns, time_scale * self.motion.catch_up().pace(), bench_count)
    }

    /// Writes every handle at this tick. The slice has one handle more than there are benches.
    ///
    /// # Panics
    /// Where the slice has another length.
    pub fn write(&mut self, handles: &mut [HandleState]) -> HeadState {
        let head = self.motion.head();
        self.chain
            .step(head.travel_m, head.speed_mps, handles, on_level_ground)
            .expect("the motion stays within the run");
        head
    }
}

fn on_level_ground(position_m: DVec2, velocity_mps: DVec2) -> HandleState {
    HandleState { position_m: [position_m.x, position_m.y, 0.0], velocity_mps: [velocity_mps.x, velocity_mps.y, 0.0] }
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
