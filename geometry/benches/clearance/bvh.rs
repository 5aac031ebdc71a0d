//! Parry2d's bounding volume hierarchy, used as its documentation recommends.
//!
//! As in our search, the last nearest pair and all other pairs of its first bench bound the search. The boxes are wider by half
//! of that bound, so all pairs within it have overlapping boxes. Parry measures only the pairs that its separating axis test
//! does not rule out.

use bench_dragon_geometry::dragon::Dragon;
use parry2d_f64::bounding_volume::{Aabb, BoundingVolume};
use parry2d_f64::partitioning::{Bvh, BvhBuildStrategy, BvhWorkspace};
use parry2d_f64::query::{self, ClosestPoints};

use super::bench_shapes::BenchShapes;
use super::contestant::{Contestant, Found, Near};
use crate::shared::HandleState;

/// How the hierarchy follows the benches from one frame to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Upkeep {
    /// The boxes of the old tree are updated.
    Refit,
    /// The boxes of the old tree are updated, and a different part of the tree is rebuilt in each frame.
    RefitAndOptimise,
    /// The tree is rebuilt.
    Build,
}

pub(crate) struct BvhPairs {
    reach_m: f64,
    upkeep: Upkeep,
    shapes: BenchShapes,
    boxes: Vec<Aabb>,
    tree: Bvh,
    workspace: BvhWorkspace,
    last_nearest: [usize; 2],
    within: Vec<Near>,
}

impl BvhPairs {
    pub(crate) fn new(dragon: &Dragon, reach_m: f64, upkeep: Upkeep) -> Self {
        Self {
            reach_m,
            upkeep,
            shapes: BenchShapes::new(dragon),
            boxes: Vec::new(),
            tree: Bvh::new(),
            workspace: BvhWorkspace::default(),
            last_nearest: [0, 2],
            within: Vec::new(),
        }
    }

    fn keep_up(&mut self, limit_m: f64) {
        let shapes = self.shapes.cuboids.iter().zip(&self.shapes.poses);
        self.boxes.clear();
        self.boxes.extend(shapes.map(|(cuboid, pose)| cuboid.aabb(pose).loosened(0.5 * limit_m)));
        if self.upkeep == Upkeep::Build || self.tree.is_empty() {
            self.tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &self.boxes);
            return;
        }
        for (&aabb, bench) in self.boxes.iter().zip(0..) {
            self.tree.insert_or_update_partially(aabb, bench, 0.0);
        }
        self.tree.refit(&mut self.workspace);
        if self.upkeep == Upkeep::RefitAndOptimise {
            self.tree.optimize_incremental(&mut self.workspace);
        }
    }
}

impl BenchShapes {
    /// The distance of two benches; `None` if it exceeds a limit.
    fn distance_m(&self, [first, second]: [usize; 2], limit_m: f64) -> Option<f64> {
        let (ours, theirs) = (&self.poses[first], &self.poses[second]);
        let points = query::closest_points(ours, &self.cuboids[first], theirs, &self.cuboids[second], limit_m);
        match points.expect("parry supports cuboids") {
            ClosestPoints::Intersecting => Some(0.0),
            ClosestPoints::WithinMargin(ours, theirs) => Some(ours.distance(theirs)),
            ClosestPoints::Disjoint => None,
        }
    }

    /// The nearest pair that contains a bench.
    fn nearest_of(&self, bench: usize) -> Near {
        let others = (0..self.poses.len()).filter(|other| other.abs_diff(bench) > 1);
        others.fold(Near { benches: [0, 2], clearance_m: f64::MAX }, |nearest, other| {
            let benches = [bench.min(other), bench.max(other)];
            let distance_m = self.distance_m(benches, nearest.clearance_m);
            distance_m.map_or(nearest, |clearance_m| Near { benches, clearance_m })
        })
    }
}

impl Contestant for BvhPairs {
    fn measure(&mut self, handles: &[HandleState]) -> Found<'_> {
        self.shapes.place(handles);
        let guess = self.shapes.nearest_of(self.last_nearest[0]);
        self.keep_up(guess.clearance_m.max(self.reach_m));
        self.within.clear();
        let Self { reach_m, shapes, tree, workspace, within, .. } = self;
        let mut nearest = guess;
        tree.traverse_bvtt_single_tree::<false>(workspace, &mut |first, second| {
            let benches = [first.min(second) as usize, first.max(second) as usize];
            if benches[1] == benches[0] + 1 {
                return;
            }
            let Some(clearance_m) = shapes.distance_m(benches, nearest.clearance_m.max(*reach_m)) else { return };
            let near = Near { benches, clearance_m };
            if clearance_m < nearest.clearance_m {
                nearest = near;
            }
            if clearance_m <= *reach_m {
                within.push(near);
            }
        });
        self.last_nearest = nearest.benches;
        Found { nearest, within }
    }
}
