//! Whether the benches are where the proof says: each frame's measured clearance against the reference solver's.

use std::sync::Arc;

use bench_dragon_geometry::clearance::{ClearanceSearch, PairClearance};
use bench_dragon_geometry::dragon::{Board, ChainSolver, Dragon};
use bench_dragon_ipc::FrameHeader;

/// A difference of clearance over this, in metres, is a fault: far above the rounding of any pose, far below any margin.
pub const FAULT_M: f64 = 1e-8;

/// Checks the frames of one run.
#[derive(Debug)]
pub struct ClearanceCheck {
    dragon: Arc<Dragon>,
    solver: ChainSolver,
    boards: Vec<Board>,
    search: ClearanceSearch,
}

impl ClearanceCheck {
    /// A check of this dragon.
    pub fn new(dragon: Arc<Dragon>) -> Self {
        let solver = ChainSolver::new(&dragon);
        Self { dragon, solver, boards: Vec::new(), search: ClearanceSearch::default() }
    }

    /// The nearest pair with the head at a travel, by the reference solver; `None` outside the run and with fewer than
    /// three benches.
    pub fn nearest(&mut self, travel_m: f64) -> Option<PairClearance> {
        let handles = self.solver.solve(&self.dragon, travel_m).ok()?;
        self.dragon.place_boards(handles, &mut self.boards);
        self.search.nearest(&self.boards)
    }

    /// Whether the nearest pair that was measured in a frame is as near as it should be, to [`FAULT_M`].
    pub fn agrees(&mut self, header: &FrameHeader, measured: Option<PairClearance>) -> bool {
        match (self.nearest(header.head_travel_m), measured) {
            (Some(expected), Some(measured)) => (expected.clearance_m - measured.clearance_m).abs() <= FAULT_M,
            (None, None) => self.dragon.dimensions().benches() < 3,
            _ => false,
        }
    }
}
