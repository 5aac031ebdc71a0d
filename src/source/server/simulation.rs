//! Simulation of the dragon from tick to tick. Pure: no clock, no bus.

use std::sync::Arc;

use bench_dragon_geometry::dragon::{ChainStepper, Dragon};
use bench_dragon_ipc::{FrameHeader, HandleState};
use glam::DVec3;

use crate::source::server::motion::{HeadState, Motion, MotionPlan};
use crate::source::timecode::ShowPosition;

/// The timecode's effect on the show from a tick on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steering {
    /// Whether the timecode makes the show stand. The operator's pause and hold apply in addition.
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
    /// Creates the dragon before tick 0, which begins with the first [`Motion::advance`].
    pub fn new(dragon: Arc<Dragon>, plan: MotionPlan) -> Self {
        Self { motion: Motion::new(plan), chain: ChainStepper::new(dragon) }
    }

    /// Begins a tick, and advances the show by `missed` missed releases. Afterwards the caller makes the requests that
    /// take effect at this tick, then calls [`Simulation::advance`]. A server's run and the verification of its
    /// recording use the same order.
    ///
    /// `is_led`: whether a timecode determined the show time at the tick before. Then the show is never behind the
    /// clock.
    pub fn begin_tick(&mut self, missed: u64, is_led: bool) {
        self.motion.miss(missed);
        if is_led {
            // The follower compensates the timecode's lead instead.
            self.motion.forget_lag();
        }
    }

    /// Advances by one period to the tick's frame, with the timecode's steering.
    pub fn advance(&mut self, steering: Option<Steering>) {
        if let Some(Steering { stands, time_scale, rate_hz }) = steering {
            self.motion.set_stands(stands);
            self.motion.set_tick(time_scale / f64::from(rate_hz));
        }
        self.motion.advance();
    }

    /// The show's position for a follower of timecode.
    pub fn show(&self) -> ShowPosition {
        ShowPosition { sim_time_s: self.motion.next_sim_s(), is_stopped: self.motion.is_stopped() }
    }

    /// Returns the header of this tick's frame, at a time scale of the show. The publisher sets `published_ns`.
    pub fn header(&self, run_id: u64, tick: u64, scheduled_ns: u64, time_scale: f64) -> FrameHeader {
        let bench_count = self.chain.dragon().dimensions().benches() as u32;
        self.motion.head().header(run_id, tick, scheduled_ns, time_scale * self.motion.catch_up().pace(), bench_count)
    }

    /// Writes every handle at this tick. `handles` has one handle more than there are benches.
    ///
    /// # Panics
    /// Panics if `handles` has another length.
    pub fn write(&mut self, handles: &mut [HandleState]) -> HeadState {
        let head = self.motion.head();
        self.chain.step(head.travel_m, head.speed_mps, handles, handle_state).expect("the motion stays within the run");
        head
    }
}

fn handle_state(position_m: DVec3, velocity_mps: DVec3) -> HandleState {
    HandleState { position_m: position_m.into(), velocity_mps: velocity_mps.into() }
}

impl HeadState {
    /// Returns the header of the frame that shows this head. The publisher sets `published_ns`.
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
