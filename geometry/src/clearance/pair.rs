//! Two benches at the ends of an interval of travel, and the areas that their boards may cover in between.

use super::coverage::BoardCoverage;
use super::pose::{BenchPose, Pose};
use crate::dragon::Dragon;

/// Work for evaluating a pair's bounds on an interval, in steps.
const STEPS_PER_LOOK: u64 = 16;

/// Two benches of a dragon.
#[derive(Clone, Copy)]
pub(super) struct Pair<'a> {
    pub(super) dragon: &'a Dragon,
    /// Indices of two benches that are not neighbours, the lower one first.
    pub(super) benches: [usize; 2],
}

/// Two benches with the head at one travel.
pub(super) struct PairPose {
    pub(super) travel_m: f64,
    pub(super) benches: [BenchPose; 2],
}

impl Pair<'_> {
    #[inline]
    pub(super) fn at(&self, pose: &Pose) -> PairPose {
        let [first, second] = self.benches;
        PairPose { travel_m: pose.travel_m, benches: [pose.bench_pose(first), pose.bench_pose(second)] }
    }

    /// Solves the pair at a travel within the run. The chain is solved up to the pair's second bench.
    #[inline]
    pub(super) fn solve(&self, travel_m: f64) -> PairPose {
        let mut chain = self.dragon.chain(travel_m).expect("the travel lies within the run");
        let mut bench_pose = |bench, ahead| {
            let front = chain.nth(ahead).expect("the chain reaches the second bench");
            let rear = chain.next().expect("the chain reaches the second bench");
            BenchPose::new(self.dragon, bench, front, rear)
        };
        let [first, second] = self.benches;
        PairPose { travel_m, benches: [bench_pose(first, first), bench_pose(second, second - first - 2)] }
    }

    /// Whether the pair moves as a rigid body between two poses: all its handles, and those between, stay on one line or arc.
    pub(super) fn is_rigid(&self, earlier: &PairPose, later: &PairPose) -> bool {
        let (rear, front) = (earlier.benches[1].rear.parameter, later.benches[0].front.parameter);
        self.dragon.route().is_one_line_or_arc(rear, front)
    }

    /// Counts one evaluation of the pair's bounds. Returns whether the dragon's meter allows it.
    pub(super) fn may_look(&self) -> bool {
        self.dragon.meter().add(STEPS_PER_LOOK);
        !self.dragon.meter().is_spent()
    }

    /// The areas that the boards may cover from one travel to a later one.
    #[inline]
    pub(super) fn coverages(&self, earlier: &PairPose, later: &PairPose) -> [BoardCoverage; 2] {
        let of = |i: usize| BoardCoverage::new(self.dragon, self.benches[i], &earlier.benches[i], &later.benches[i]);
        [of(0), of(1)]
    }
}
