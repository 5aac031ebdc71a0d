//! The whole dragon at one travel.

use super::Dragon;
use super::board::Board;
use super::chain::Handle;

/// Handles and boards at one travel, in buffers that are kept.
#[derive(Clone, Debug, Default)]
pub(super) struct Pose {
    pub(super) travel_m: f64,
    pub(super) handles: Vec<Handle>,
    /// Travel of each handle.
    handle_travels_m: Vec<f64>,
    pub(super) boards: Vec<Board>,
}

impl Pose {
    /// Puts the dragon's head at `travel_m`, which must lie within the run.
    pub(super) fn place(&mut self, dragon: &Dragon, travel_m: f64) {
        let chain = dragon.chain(travel_m).expect("the travel lies within the run");
        self.travel_m = travel_m;
        self.handles.clear();
        self.handles.extend(chain);
        self.handle_travels_m.clear();
        self.handle_travels_m.extend(self.handles.iter().map(|handle| dragon.route().travel(handle.place)));
        dragon.place_boards(&self.handles, &mut self.boards);
    }

    pub(super) fn is_at(&self, travel_m: f64) -> bool {
        !self.handles.is_empty() && self.travel_m == travel_m
    }

    pub(super) fn seat(&self, bench: usize) -> Seat {
        Seat {
            front: self.handles[bench],
            rear: self.handles[bench + 1],
            front_travel_m: self.handle_travels_m[bench],
            rear_travel_m: self.handle_travels_m[bench + 1],
            board: self.boards[bench],
        }
    }
}

/// A bench with its handles at one travel of the head.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seat {
    pub(super) front: Handle,
    pub(super) rear: Handle,
    /// The front handle's travel.
    pub(super) front_travel_m: f64,
    /// The rear handle's travel.
    pub(super) rear_travel_m: f64,
    pub(super) board: Board,
}

impl Seat {
    pub(super) fn new(dragon: &Dragon, bench: usize, front: Handle, rear: Handle) -> Self {
        let [front_travel_m, rear_travel_m] = [front, rear].map(|handle| dragon.route().travel(handle.place));
        Self { front, rear, front_travel_m, rear_travel_m, board: dragon.board(bench, &front, &rear) }
    }
}
