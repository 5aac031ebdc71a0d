//! Two dragons, each at a time of its own: the time since it leaves.
//!
//! Before its own time 0 a dragon stands at its start, and after its end it stands there. The boards of two dragons depend on
//! their own times alone, whenever the dragons leave. In a plan in which the second dragon leaves `delay` after the first one,
//! the own times differ by that delay: time of the first − time of the second = delay.

use std::cell::RefCell;
use std::collections::HashMap;
use std::hash::Hash;
use std::sync::Arc;

use super::board_tree::BoardTree;
use super::pose::{BenchPose, Pose, PoseWalk};
use crate::dragon::Dragon;
use crate::dragon::board::{Approach, Board};
use crate::dragon::chain::Handle;
use crate::formation::Planned;
use crate::numerics::peak;

/// The nearest boards of two dragons.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Own times of both dragons, in seconds.
    pub times_s: [f64; 2],
    /// Index of a bench of each dragon.
    pub benches: [usize; 2],
    /// Distance of their boards, and its point.
    pub approach: Approach,
}

/// The nearest boards of two dragons, with their benches and handles.
#[derive(Clone, Copy)]
pub(super) struct NearestBenches {
    pub(super) nearest: Nearest,
    pub(super) poses: [BenchPose; 2],
}

/// A dragon over its own time.
#[derive(Clone, Debug)]
pub(super) struct Walker {
    /// It leaves at 0.
    pub(super) planned: Planned,
    /// Own time at which it reaches its end.
    pub(super) end_s: f64,
    /// Steps from pose to pose.
    pub(super) walk: PoseWalk,
    /// The poses at ends of cells, by the bits of their own times.
    ends: Kept<u64, Arc<Posed>>,
    /// Rectangles around all places of each board on sides of cells, by the bits of their travels.
    swept: Kept<[u64; 2], Arc<BoardTree>>,
}

/// A dragon at one own time.
#[derive(Debug)]
pub(super) struct Posed {
    pub(super) pose: Pose,
    pub(super) tree: BoardTree,
}

/// Trees that many cells of a search share.
#[derive(Clone, Debug)]
struct Kept<K, T>(RefCell<HashMap<K, T>>);

/// Most boards of the trees that are kept: some 60 MB with poses, 25 MB without.
const MOST_KEPT_BOARDS: usize = 1 << 18;

impl<K: Eq + Hash, T: Clone> Kept<K, T> {
    fn none() -> Self {
        Self(RefCell::default())
    }

    /// The tree of this key, which has `boards` boards. It is made if it is not kept.
    fn tree(&self, key: K, boards: usize, make: impl FnOnce() -> T) -> T {
        let known = self.0.borrow().get(&key).cloned();
        known.unwrap_or_else(|| {
            let tree = make();
            let mut kept = self.0.borrow_mut();
            if (kept.len() + 1) * boards > MOST_KEPT_BOARDS {
                kept.clear();
            }
            kept.insert(key, tree.clone());
            tree
        })
    }
}

/// Boards that one step of work places into their tree.
const BOARDS_PER_STEP: usize = 4;

impl Walker {
    pub(super) fn new(planned: &Planned) -> Self {
        let planned = planned.leaving_at(0.0);
        let end_s = planned.timetable.end_s();
        Self { planned, end_s, walk: PoseWalk::default(), ends: Kept::none(), swept: Kept::none() }
    }

    /// The dragon at an own time, which may be infinite.
    pub(super) fn at(&self, time_s: f64) -> Arc<Posed> {
        let dragon = &self.planned.dragon;
        let mut pose = Pose::default();
        self.walk.place(&mut pose, dragon, self.planned.travel_m(time_s.clamp(0.0, self.end_s)));
        Posed::new(dragon, pose)
    }

    /// The same at an end of a cell.
    pub(super) fn end_at(&self, time_s: f64) -> Arc<Posed> {
        let (time_s, dragon) = (time_s.clamp(0.0, self.end_s), &self.planned.dragon);
        self.ends.tree(time_s.to_bits(), dragon.dimensions().benches(), || {
            Posed::new(dragon, self.walk.pose(dragon, self.planned.travel_m(time_s), usize::MAX))
        })
    }

    /// Rectangles around all places of each board between two times.
    pub(super) fn swept(&self, [earlier, later]: [&Posed; 2]) -> Arc<BoardTree> {
        let (ends, dragon) = ([&earlier.pose, &later.pose], &self.planned.dragon);
        self.swept.tree(ends.map(|pose| pose.travel_m.to_bits()), dragon.dimensions().benches(), || {
            let rectangle = |bench| ends[0].extent(ends[1], dragon, bench).rectangle();
            Arc::new(tree_of(dragon, &(0..ends[0].boards.len()).map(rectangle).collect::<Vec<Board>>()))
        })
    }

    /// Forgets all poses, which take much memory.
    pub(super) fn forget(&self) {
        self.ends.0.take();
        self.swept.0.take();
        self.walk.forget();
    }

    /// The drift of the boards between two own times: see [`drift_m`].
    pub(super) fn drift_m(&self, earlier: &Posed, later: &Posed) -> f64 {
        drift_m(&self.planned.dragon, earlier, later)
    }

    /// Where the board of a bench, whose pose at an own time is known, is about at another own time nearby: each handle walks at the
    /// speed, as a share of the head's, at which it does at the known one. The error is of the order of the square of the way.
    fn board_near(&self, bench: usize, pose: &BenchPose, [known_s, time_s]: [f64; 2]) -> Board {
        let dragon = &self.planned.dragon;
        let [from_m, to_m] = [known_s, time_s].map(|time_s| self.planned.travel_m(time_s.clamp(0.0, self.end_s)));
        let [front, rear] = pose.handles().map(|(handle, travel_m)| {
            let walked_m = (to_m - from_m) * handle.speed_ratio;
            let parameter = dragon.route().parameter((travel_m + walked_m).min(dragon.end_travel_m()));
            Handle::new(parameter, dragon.route().point(parameter), handle.speed_ratio)
        });
        dragon.board(bench, &front, &rear)
    }

    /// Longest interval of own time that is evaluated as a whole: the head walks at most a quarter of its shorter link.
    pub(super) fn stride_s(&self) -> f64 {
        let dimensions = self.planned.dragon.dimensions();
        0.25 * dimensions.link_m(0).min(dimensions.link_m(1)) / self.planned.timetable.most_speed_mps()
    }
}

impl Posed {
    /// The whole dragon at a travel of its run.
    pub(super) fn of(dragon: &Dragon, travel_m: f64) -> Arc<Self> {
        Self::new(dragon, Pose::of(dragon, travel_m, usize::MAX))
    }

    fn new(dragon: &Dragon, pose: Pose) -> Arc<Self> {
        Arc::new(Self { tree: tree_of(dragon, &pose.boards), pose })
    }
}

/// A tree of boards. Counts the work.
fn tree_of(dragon: &Dragon, boards: &[Board]) -> BoardTree {
    dragon.meter().add((boards.len() / BOARDS_PER_STEP) as u64);
    BoardTree::new(boards)
}

/// Bound on the sum of the displacements of any board from its positions at two travels, at any travel in between.
pub(super) fn drift_m(dragon: &Dragon, earlier: &Posed, later: &Posed) -> f64 {
    if earlier.pose.travel_m == later.pose.travel_m {
        return 0.0;
    }
    let drifts_m = (0..earlier.pose.boards.len()).map(|bench| earlier.pose.drift_m(&later.pose, dragon, bench));
    drifts_m.fold(0.0, f64::max)
}

/// Whether two boards are within a limit at each of two moments with two dragons; `None` if all clearances in between are proved to exceed
/// it. That is so if the mean of the clearances exceeds it by more than half of the drifts: `drifts_m` bound the sums of the displacements
/// of the boards of each dragon from both moments.
pub(super) fn met_between(moments: [[&Posed; 2]; 2], drifts_m: [f64; 2], limit_m: f64) -> Option<[bool; 2]> {
    let [first, second] = moments.map(|posed| posed.map(|posed| &posed.tree));
    let drift_m = drifts_m[0] + drifts_m[1];
    // Boards that are further from each other are not within the limit at the second moment either.
    let (_, first_m) = first[0].nearest_within(first[1], [limit_m, limit_m + drift_m])?;
    let is_met = first_m <= limit_m;
    if !is_met && !second[0].comes_within(second[1], 2.0 * limit_m + drift_m - first_m) {
        return None;
    }
    Some([is_met, second[0].comes_within(second[1], limit_m)])
}

/// Least clearance of two poses, with its benches.
pub(super) fn nearest(ours: &Posed, theirs: &Posed) -> ([usize; 2], f64) {
    ours.tree.nearest(&theirs.tree)
}

/// The nearest boards of two walkers at their own times.
pub(super) fn nearest_at(walkers: &[Walker; 2], times_s: [f64; 2]) -> Nearest {
    nearest_benches_at(walkers, times_s).nearest
}

/// The same with their benches.
pub(super) fn nearest_benches_at(walkers: &[Walker; 2], times_s: [f64; 2]) -> NearestBenches {
    let posed = [walkers[0].at(times_s[0]), walkers[1].at(times_s[1])];
    let (benches, _) = nearest(&posed[0], &posed[1]);
    let poses = [0, 1].map(|i| posed[i].pose.bench_pose(benches[i]));
    let approach = poses[0].board.approach(&poses[1].board);
    NearestBenches { nearest: Nearest { times_s, benches, approach }, poses }
}

impl NearestBenches {
    /// About the clearance of the same boards on their plan, `shift_s` later.
    pub(super) fn clearance_near_m(&self, walkers: &[Walker; 2], shift_s: f64) -> f64 {
        let Nearest { times_s, benches, .. } = self.nearest;
        let [ours, theirs] =
            [0, 1].map(|i| walkers[i].board_near(benches[i], &self.poses[i], [times_s[i], times_s[i] + shift_s]));
        ours.clearance(&theirs)
    }
}

/// Part of the least clearance to which a search for it is exact.
const SHARE: f64 = 0.01;
/// Least clearance that such a search tells from another one, in metres.
const LEAST_M: f64 = 0.002;

/// The least clearance of two dragons over times of a plan.
pub(super) struct LeastClearance<'a> {
    walkers: &'a [Walker; 2],
    /// By how much the second dragon leaves after the first one.
    delay_s: f64,
    best: Option<Nearest>,
}

impl<'a> LeastClearance<'a> {
    pub(super) fn new(walkers: &'a [Walker; 2], delay_s: f64) -> Self {
        Self { walkers, delay_s, best: None }
    }

    /// Searches own times of the first dragon from `from_s` to `to_s`. The result is exact to [`LEAST_M`], or to [`SHARE`] of it.
    /// The least clearance near it is then found exactly.
    pub(super) fn over(mut self, [from_s, to_s]: [f64; 2]) -> Nearest {
        let ends = [from_s, to_s].map(|time_s| self.look(time_s, f64::INFINITY));
        self.halve(&ends[0], &ends[1]);
        let best = self.best.expect("an end is noted");
        let time_s = best.times_s[0];
        let reach_s = 0.5 * self.walkers[0].stride_s().min(self.walkers[1].stride_s());
        let [low_s, high_s] = [(time_s - reach_s).max(from_s), (time_s + reach_s).min(to_s)];
        let peak = peak(low_s, high_s, 1e-9, |time_s| -self.at(time_s).approach.clearance_m);
        if -peak.value < best.approach.clearance_m { self.at(peak.at) } else { best }
    }

    fn at(&self, time_s: f64) -> Nearest {
        nearest_at(self.walkers, [time_s, time_s - self.delay_s])
    }

    /// Places both dragons, and keeps their nearest boards. These are searched up to a clearance of `reach_m`.
    fn look(&mut self, time_s: f64, reach_m: f64) -> Moment {
        let posed = [self.walkers[0].at(time_s), self.walkers[1].at(time_s - self.delay_s)];
        let found = posed[0].tree.nearest_within(&posed[1].tree, [f64::NEG_INFINITY, reach_m]);
        if let Some((benches, clearance_m)) = found
            && self.best.is_none_or(|best| clearance_m < best.approach.clearance_m)
        {
            let approach = posed[0].tree.boards()[benches[0]].approach(&posed[1].tree.boards()[benches[1]]);
            self.best = Some(Nearest { times_s: [time_s, time_s - self.delay_s], benches, approach });
        }
        Moment { time_s, posed, least_m: found.map_or(reach_m, |(_, clearance_m)| clearance_m) }
    }

    fn halve(&mut self, earlier: &Moment, later: &Moment) {
        let drift_m = |i: usize| self.walkers[i].drift_m(&earlier.posed[i], &later.posed[i]);
        let drift_m = drift_m(0) + drift_m(1);
        let best_m = self.best.expect("an end is noted").approach.clearance_m;
        let least_m = 0.5 * (earlier.least_m + later.least_m - drift_m);
        let middle_s = 0.5 * (earlier.time_s + later.time_s);
        let is_spent = self.walkers[0].planned.dragon.meter().is_spent();
        let is_short = middle_s <= earlier.time_s || middle_s >= later.time_s || is_spent;
        if is_short || least_m >= best_m - (SHARE * best_m.abs()).max(LEAST_M) {
            return;
        }
        // With a greater clearance in the middle, both halves are done.
        let reach_m = (2.0 * best_m + drift_m - earlier.least_m.min(later.least_m)).max(best_m);
        let middle = self.look(middle_s, reach_m);
        self.halve(earlier, &middle);
        self.halve(&middle, later);
    }
}

/// Both dragons at a time of a plan.
struct Moment {
    /// Own time of the first dragon.
    time_s: f64,
    posed: [Arc<Posed>; 2],
    /// A lower bound on their clearance.
    least_m: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dragon::Dimensions;
    use crate::formation::Timetable;
    use crate::route::Route;

    #[test]
    fn a_board_nearby_is_off_by_the_square_of_the_way() {
        let dimensions = Dimensions::new(40, 3.41, 2.20, 0.30, 0.275).expect("the paper's benches are valid");
        let route = Arc::new(Route::spiral(0.55, 16.0).expect("the paper's spiral is valid"));
        let dragon = Dragon::new(dimensions, route).expect("the dragon stands on the spiral");
        let timetable = Timetable::leaving(0.0, 0.0, 1.0, None, dragon.end_travel_m());
        let walker = Walker::new(&Planned { dragon: Arc::new(dragon), timetable });
        let (known_s, bench) = (380.0, 30);
        let known = walker.at(known_s).pose.bench_pose(bench);
        let off_m = |shift_s: f64| {
            let time_s = known_s + shift_s;
            let near = walker.board_near(bench, &known, [known_s, time_s]);
            near.centre.distance(walker.at(time_s).pose.boards[bench].centre)
        };
        assert_eq!(off_m(0.0), 0.0);
        for shift_s in [-0.5, 0.5] {
            let [whole_m, half_m] = [off_m(shift_s), off_m(0.5 * shift_s)];
            assert!(whole_m < 1e-3 && (3.9..4.1).contains(&(whole_m / half_m)), "{whole_m} m, {half_m} m");
        }
    }
}
