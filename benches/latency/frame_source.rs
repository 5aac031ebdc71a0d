//! The frames that all contestants except ours send: the server's own computation, from the start of the run.

use bench_dragon::source::server::Simulation;
use bench_dragon::source::server::motion::{MotionPlan, MotionSettings};
use bench_dragon_ipc::{FrameHeader, HandleState};
use test_support::dragons::{paper_dragon_of, plain_formation};

/// Benches of the paper's dragon.
pub(crate) const BENCHES: usize = 223;
/// Handles of a frame.
pub(crate) const HANDLES: usize = BENCHES + 1;
/// Frames per second.
pub(crate) const RATE_HZ: u32 = 1000;

/// Computes frames in order.
pub(crate) struct FrameSource {
    simulation: Simulation,
    tick: u64,
}

impl FrameSource {
    pub(crate) fn new() -> Self {
        let dragon = paper_dragon_of(BENCHES);
        let settings = MotionSettings::plain(1.0 / f64::from(RATE_HZ), 0.0, dragon.end_travel_m());
        let plan = MotionPlan::new(settings).expect("the travels are in order");
        Self { simulation: Simulation::new(plain_formation(dragon), plan, RATE_HZ, 1.0), tick: 0 }
    }

    /// Writes the next frame's handles. Returns its header, complete except for the instant of sending.
    pub(crate) fn fill(&mut self, handles: &mut [HandleState], due_ns: u64) -> FrameHeader {
        let tick = self.tick;
        self.tick += 1;
        self.simulation.tick(0, &mut ());
        self.simulation.write(handles).header(0, tick, due_ns, 1.0, BENCHES as u32)
    }
}
