//! Frames as the monitor receives them.

use bench_dragon_geometry::dragon::{ChainSolver, Dragon};

use crate::shared::HandleState;

/// Travel just before the first contact of the paper's dragon, whose head walks at 1 m/s.
const LAST_M: f64 = 412.4;
/// Distance that the head walks between two frames at 1 kHz, in metres.
const STEP_M: f64 = 0.001;
const FRAMES_A_BURST: usize = 50;

/// Frames in the order of publication.
pub(crate) struct Frames(Vec<Vec<HandleState>>);

impl Frames {
    fn new(dragon: &Dragon, travels_m: impl Iterator<Item = f64>) -> Self {
        let mut chain = ChainSolver::new(dragon);
        let mut frame = |travel_m| {
            let handles = chain.solve(dragon, travel_m).expect("within the run").iter();
            let state = |position: glam::DVec2, velocity: glam::DVec2| HandleState {
                position_m: [position.x, position.y, 0.0],
                velocity_mps: [velocity.x, velocity.y, 0.0],
            };
            handles.map(|handle| state(handle.position, handle.tangent * handle.speed_ratio)).collect()
        };
        Self(travels_m.map(&mut frame).collect())
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &[HandleState]> {
        self.0.iter().map(Vec::as_slice)
    }

    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    pub(crate) fn first(&self, count: usize) -> Self {
        Self(self.0[..count].to_vec())
    }

    /// Every `count`-th frame, from the first on.
    pub(crate) fn every(&self, count: usize) -> Self {
        Self(self.0.iter().step_by(count).cloned().collect())
    }
}

/// Bursts of successive frames, spread evenly over the run.
pub(crate) fn walking(dragon: &Dragon, bursts: usize) -> Frames {
    let burst_m = LAST_M / bursts as f64;
    let travel_m = move |frame: usize| {
        let (burst, step) = (frame / FRAMES_A_BURST, frame % FRAMES_A_BURST);
        burst_m * (burst as f64 + 0.5) + STEP_M * step as f64
    };
    Frames::new(dragon, (0..bursts * FRAMES_A_BURST).map(travel_m))
}

/// `count` frames, each far from the one before.
pub(crate) fn scattered(dragon: &Dragon, count: usize) -> Frames {
    // Multiples of the golden ratio fill the unit interval evenly for every count, and each step is long.
    let share = |i: usize| (0.618_033_988_749_895 * i as f64).fract();
    Frames::new(dragon, (0..count).map(|i| LAST_M * share(i)))
}
