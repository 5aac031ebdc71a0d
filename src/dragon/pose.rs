//! The whole dragon at one travel.

use super::Dragon;
use super::board::Board;
use super::chain::Handle;

/// Handles and boards at one travel, in buffers that are kept.
#[derive(Clone, Debug, Default)]
pub(super) struct Pose {
    pub(super) travel_m: f64,
    pub(super) handles: Vec<Handle>,
    pub(super) boards: Vec<Board>,
}

impl Pose {
    /// Puts the dragon's head at `travel_m`, which must lie within the run; the handles' buffers are empty until then.
    pub(super) fn place(&mut self, dragon: &Dragon, travel_m: f64) {
        let chain = dragon.chain(travel_m).expect("the travel lies within the run");
        self.travel_m = travel_m;
        self.handles.clear();
        self.handles.extend(chain);
        dragon.place_boards(&self.handles, &mut self.boards);
    }

    pub(super) fn is_at(&self, travel_m: f64) -> bool {
        !self.handles.is_empty() && self.travel_m == travel_m
    }

    /// A bench with its handles.
    pub(super) fn seat(&self, bench: usize) -> Seat {
        Seat { front: self.handles[bench], rear: self.handles[bench + 1], board: self.boards[bench] }
    }
}

/// A bench at one travel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seat {
    pub(super) front: Handle,
    pub(super) rear: Handle,
    pub(super) board: Board,
}
