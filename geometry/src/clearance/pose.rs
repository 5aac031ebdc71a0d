//! The dragon at one travel, or its front part.

use std::cell::{RefCell, RefMut};
use std::sync::Arc;

use super::stride_extent::{PLACE_ERROR_M, StrideExtent, WalkedArc, is_kept_apart};
use crate::dragon::board::Board;
use crate::dragon::chain::Handle;
use crate::dragon::{ChainStepper, Dragon};

/// Handles and boards at one travel, in reused buffers.
#[derive(Clone, Debug, Default)]
pub(super) struct Pose {
    pub(super) travel_m: f64,
    pub(super) handles: Vec<Handle>,
    /// Travel of each handle.
    pub(super) handle_travels_m: Vec<f64>,
    pub(super) boards: Vec<Board>,
}

impl Pose {
    /// The pose of the first `benches` benches, or of all, with the head at a travel of the run.
    pub(super) fn of(dragon: &Dragon, travel_m: f64, benches: usize) -> Self {
        let mut pose = Self::default();
        pose.place_head(dragon, travel_m);
        pose.extend_to(dragon, benches);
        pose
    }

    /// Places the dragon's head at `travel_m`, which must lie within the run, and removes everything behind it.
    pub(super) fn place_head(&mut self, dragon: &Dragon, travel_m: f64) {
        self.travel_m = travel_m;
        self.handles.clear();
        self.handle_travels_m.clear();
        self.boards.clear();
        let mut chain = dragon.chain(travel_m).expect("the travel lies within the run");
        self.push(dragon, chain.next().expect("a dragon has a head"));
    }

    /// Takes the values of another pose of the same dragon.
    pub(super) fn copy_from(&mut self, other: &Self) {
        self.travel_m = other.travel_m;
        self.handles.clone_from(&other.handles);
        self.handle_travels_m.clone_from(&other.handle_travels_m);
        self.boards.clone_from(&other.boards);
    }

    /// Adds benches behind the present ones, until there are `benches` of them, or all.
    pub(super) fn extend_to(&mut self, dragon: &Dragon, benches: usize) {
        self.extend_while(dragon, |index, _| index < benches);
    }

    /// Adds benches behind the present ones, as long as `wanted` accepts the index and the parameter of the next front handle.
    pub(super) fn extend_while(&mut self, dragon: &Dragon, wanted: impl Fn(usize, f64) -> bool) {
        let mut chain = dragon.chain_behind(self.boards.len(), &self.handles[self.boards.len()]);
        let benches = dragon.dimensions().benches();
        while self.boards.len() < benches && wanted(self.boards.len(), self.handles[self.boards.len()].parameter) {
            self.push(dragon, chain.next().expect("every link meets the route during the run"));
        }
    }

    fn push(&mut self, dragon: &Dragon, handle: Handle) {
        if let Some(front) = self.handles.last() {
            self.boards.push(dragon.board(self.boards.len(), front, &handle));
        }
        self.handles.push(handle);
        self.handle_travels_m.push(dragon.route().travel(handle.parameter));
    }

    /// Places the whole dragon at `travel_m`, which must lie within the run.
    fn place_by(&mut self, stepper: &mut ChainStepper, travel_m: f64) {
        self.travel_m = travel_m;
        stepper.place(travel_m, &mut self.handles);
        let dragon = stepper.dragon();
        dragon.place_boards(&self.handles, &mut self.boards);
        let travels_m = self.handles.iter().map(|handle| dragon.route().travel(handle.parameter));
        self.handle_travels_m.clear();
        self.handle_travels_m.extend(travels_m);
    }

    pub(super) fn is_at(&self, travel_m: f64) -> bool {
        !self.handles.is_empty() && self.travel_m == travel_m
    }

    /// Bound on the distance of any point of a bench's board from its position at either pose, on the interval to a later pose.
    pub(super) fn drift_m(&self, later: &Self, dragon: &Dragon, bench: usize) -> f64 {
        let walked_m = |handle: usize| later.handle_travels_m[handle] - self.handle_travels_m[handle];
        drift_m(dragon, bench, &self.boards[bench], [bench, bench + 1].map(walked_m))
    }

    /// Where a handle may be up to a later pose.
    fn arc(&self, later: &Self, handle: usize) -> WalkedArc {
        let ends = [self, later].map(|pose| pose.handles[handle].position);
        let walked_m = later.handle_travels_m[handle] - self.handle_travels_m[handle];
        WalkedArc::new(ends, walked_m + 4.0 * PLACE_ERROR_M)
    }

    /// Where a bench may be up to a later pose.
    pub(super) fn extent(&self, later: &Self, dragon: &Dragon, bench: usize) -> StrideExtent {
        StrideExtent::new(dragon, bench, [bench, bench + 1].map(|handle| self.arc(later, handle)))
    }

    /// Whether two benches are proved to stay further apart than a clearance up to a later pose.
    pub(super) fn keeps_apart(&self, later: &Self, dragon: &Dragon, benches: [usize; 2], clearance_m: f64) -> bool {
        let [one, other] = benches.map(|bench| self.extent(later, dragon, bench));
        one.stays_apart(&other, clearance_m)
            || !dragon.route().is_on_ground()
                && is_kept_apart(dragon, benches, |handle| self.arc(later, handle), clearance_m)
    }

    pub(super) fn bench_pose(&self, bench: usize) -> BenchPose {
        BenchPose {
            front: self.handles[bench],
            rear: self.handles[bench + 1],
            front_travel_m: self.handle_travels_m[bench],
            rear_travel_m: self.handle_travels_m[bench + 1],
            board: self.boards[bench],
        }
    }
}

/// Poses of a dragon, one after the other. Where one is near the last one, the chain is stepped.
#[derive(Clone, Debug, Default)]
pub(super) struct PoseWalk(RefCell<Option<ChainStepper>>);

impl PoseWalk {
    /// Places the whole dragon, the same one in each call, at `travel_m`, which must lie within the run.
    pub(super) fn place(&self, pose: &mut Pose, dragon: &Dragon, travel_m: f64) {
        pose.place_by(&mut self.stepper(dragon), travel_m);
    }

    /// At least the first `benches` benches. The chain is solved, and the last pose stays, if they are few or far from it.
    pub(super) fn pose(&self, dragon: &Dragon, travel_m: f64, benches: usize) -> Pose {
        let is_near = self.0.borrow().as_ref().is_some_and(|stepper| stepper.is_near(travel_m));
        if !is_near || are_few(dragon, benches) {
            return Pose::of(dragon, travel_m, benches);
        }
        let mut pose = Pose::default();
        self.place(&mut pose, dragon, travel_m);
        pose
    }

    /// A bench. If it is near the head, the chain is solved up to it, and the last pose stays.
    pub(super) fn bench_pose(&self, dragon: &Dragon, bench: usize, travel_m: f64) -> BenchPose {
        let [front, rear] = if are_few(dragon, bench + 1) {
            let mut chain = dragon.chain(travel_m).expect("the travel lies within the run").skip(bench);
            [(); 2].map(|()| chain.next().expect("every link meets the route during the run"))
        } else {
            self.stepper(dragon).bench_at(travel_m, bench)
        };
        BenchPose::new(dragon, bench, front, rear)
    }

    /// Forgets the last pose.
    pub(super) fn forget(&self) {
        self.0.take();
    }

    fn stepper(&self, dragon: &Dragon) -> RefMut<'_, ChainStepper> {
        let stepper = || ChainStepper::new(Arc::new(dragon.clone()));
        RefMut::map(self.0.borrow_mut(), |walked| walked.get_or_insert_with(stepper))
    }
}

/// Whether a chain of so many benches is sooner solved than that of the whole dragon is stepped.
fn are_few(dragon: &Dragon, benches: usize) -> bool {
    const STEPPED_PER_SOLVED: usize = 16;
    benches < dragon.dimensions().benches() / STEPPED_PER_SOLVED
}

/// A bench and its handles at one travel of the head.
#[derive(Clone, Copy, Debug)]
pub(super) struct BenchPose {
    pub(super) front: Handle,
    pub(super) rear: Handle,
    /// The front handle's travel.
    pub(super) front_travel_m: f64,
    /// The rear handle's travel.
    pub(super) rear_travel_m: f64,
    pub(super) board: Board,
}

impl BenchPose {
    pub(super) fn new(dragon: &Dragon, bench: usize, front: Handle, rear: Handle) -> Self {
        let [front_travel_m, rear_travel_m] = [front, rear].map(|handle| dragon.route().travel(handle.parameter));
        Self { front, rear, front_travel_m, rear_travel_m, board: dragon.board(bench, &front, &rear) }
    }

    /// Both handles, each with its travel.
    pub(super) fn handles(&self) -> [(Handle, f64); 2] {
        [(self.front, self.front_travel_m), (self.rear, self.rear_travel_m)]
    }

    /// Arcs that the two handles walk up to a later pose.
    pub(super) fn walks_m(&self, later: &Self) -> [f64; 2] {
        [later.front_travel_m - self.front_travel_m, later.rear_travel_m - self.rear_travel_m]
    }
}

/// Bound on the distance of any point of a bench's board from its position at either end of an interval. `front_m` and `rear_m`
/// are the arcs that its handles walk on it.
///
/// The handles move at most by the arcs that they walk. A corner is a handle plus a vector of length ρ fixed to the board, and
/// the heading changes by at most the sum of the arcs divided by d. Of all points of a rigid board, a corner moves furthest.
///
/// On ground, the direction of the link changes by that sum, ε. Two vectors of the lengths q and at least q − ε that differ by ε
/// have directions that differ by at most ε/(q − ε/2).
pub(super) fn drift_m(dragon: &Dragon, bench: usize, earlier: &Board, [front_m, rear_m]: [f64; 2]) -> f64 {
    let turn = (front_m + rear_m) / dragon.dimensions().link_m(bench);
    let seen_turn = if dragon.route().is_on_ground() {
        let mean_share = dragon.seen_share(bench, earlier) - 0.5 * turn;
        if mean_share > 0.0 { (turn / mean_share).min(2.0) } else { 2.0 }.max(turn)
    } else {
        turn
    };
    front_m.max(rear_m) + dragon.corner_arm_m() * seen_turn
}
