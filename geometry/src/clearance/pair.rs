//! Two benches at the ends of an interval, and the areas that their boards may cover in between.
//!
//! The *parameter* of a pair grows steadily over the interval. For two benches of one dragon it is the travel of its head, in
//! metres. For benches of two dragons it is plan time, in seconds, from which each dragon's timetable gives its travel.

use super::coverage::BoardCoverage;
use super::pose::{BenchPose, Pose, PoseWalk};
use crate::dragon::{Chain, Dragon, Meter};
use crate::formation::Planned;

/// Work for evaluating a pair's bounds on an interval, in steps.
const STEPS_PER_LOOK: u64 = 16;

/// Two benches.
#[derive(Clone, Copy)]
pub(super) struct Pair<'a> {
    pub(super) members: Members<'a>,
    /// Indices of two benches that are not neighbours, the lower one first. In a formation they are numbered on from dragon to
    /// dragon.
    pub(super) benches: [usize; 2],
}

/// The dragon or the two dragons of a pair.
#[derive(Clone, Copy)]
pub(super) enum Members<'a> {
    /// Both are of this dragon.
    OneDragon(&'a Dragon),
    /// Each is of another dragon.
    TwoDragons([Member<'a>; 2]),
}

/// A bench of a dragon with a timetable.
#[derive(Clone, Copy)]
pub(super) struct Member<'a> {
    pub(super) planned: &'a Planned,
    pub(super) bench: usize,
    pub(super) walk: &'a PoseWalk,
}

impl Member<'_> {
    fn at(&self, time_s: f64) -> BenchPose {
        self.walk.bench_pose(&self.planned.dragon, self.bench, self.planned.travel_m(time_s))
    }

    /// The dragon, at least up to the bench.
    pub(super) fn pose(&self, time_s: f64) -> Pose {
        self.walk.pose(&self.planned.dragon, self.planned.travel_m(time_s), self.bench + 1)
    }
}

/// Two benches at one value of the pair's parameter.
pub(super) struct PairPose {
    pub(super) parameter: f64,
    pub(super) benches: [BenchPose; 2],
}

impl<'a> Pair<'a> {
    /// Two benches of one dragon.
    pub(super) fn of(dragon: &'a Dragon, benches: [usize; 2]) -> Self {
        Self { members: Members::OneDragon(dragon), benches }
    }

    /// The pair in two poses of one dragon, or of its two dragons.
    #[inline]
    pub(super) fn at(&self, pose: &Pose) -> PairPose {
        PairPose { parameter: pose.travel_m, benches: self.benches.map(|bench| pose.bench_pose(bench)) }
    }

    /// Solves the pair at a parameter within the run. Chains are solved up to the benches of the pair.
    #[inline]
    pub(super) fn solve(&self, parameter: f64) -> PairPose {
        let benches = match self.members {
            Members::OneDragon(dragon) => solve(dragon, self.benches, parameter),
            Members::TwoDragons(members) => members.map(|member| member.at(parameter)),
        };
        PairPose { parameter, benches }
    }

    /// Whether the pair moves as a rigid body between two poses: all its handles, and those between, stay on one line or arc.
    pub(super) fn is_rigid(&self, earlier: &PairPose, later: &PairPose) -> bool {
        let Members::OneDragon(dragon) = self.members else { return false };
        let (rear, front) = (earlier.benches[1].rear.parameter, later.benches[0].front.parameter);
        dragon.route().is_one_line_or_arc(rear, front)
    }

    /// The meter that counts the work for the pair.
    pub(super) fn meter(&self) -> &'a Meter {
        match self.members {
            Members::OneDragon(dragon) => dragon.meter(),
            Members::TwoDragons([member, _]) => member.planned.dragon.meter(),
        }
    }

    /// Counts one evaluation of the pair's bounds. Returns whether the meter allows it.
    pub(super) fn may_look(&self) -> bool {
        self.meter().add(STEPS_PER_LOOK);
        !self.meter().is_spent()
    }

    /// The areas that the boards may cover from one pose to a later one.
    #[inline]
    pub(super) fn coverages(&self, earlier: &PairPose, later: &PairPose) -> [BoardCoverage; 2] {
        let members = match self.members {
            Members::OneDragon(dragon) => self.benches.map(|bench| (dragon, bench)),
            Members::TwoDragons(members) => members.map(|member| (&*member.planned.dragon, member.bench)),
        };
        [0, 1].map(|i| {
            let (dragon, bench) = members[i];
            BoardCoverage::new(dragon, bench, &earlier.benches[i], &later.benches[i])
        })
    }
}

/// Two benches of one dragon, of which one chain is solved.
#[inline]
fn solve(dragon: &Dragon, [first, second]: [usize; 2], travel_m: f64) -> [BenchPose; 2] {
    let mut chain = dragon.chain(travel_m).expect("the travel lies within the run");
    let front = next_bench(dragon, &mut chain, first, first);
    [front, next_bench(dragon, &mut chain, second, second - first - 2)]
}

/// A bench whose front handle comes after `ahead` others in a chain.
#[inline]
fn next_bench(dragon: &Dragon, chain: &mut Chain<'_>, bench: usize, ahead: usize) -> BenchPose {
    let front = chain.nth(ahead).expect("the chain reaches the bench");
    let rear = chain.next().expect("the chain reaches the bench");
    BenchPose::new(dragon, bench, front, rear)
}
