//! Finds close approaches: intervals of travel on which two benches come near each other.
//!
//! The search evaluates a pair at both ends of an interval. The areas that its boards may cover in between (see `coverage`)
//! bound its clearance from below. An interval whose bound stays at or above a limit is done. Other intervals are bisected down
//! to pieces so short that the clearance is taken to have at most one minimum on each. So no approach under the limit is
//! missed, however short. Only two minima of the same pair within one piece would count as one.
//!
//! *Rigid intervals.* If all handles of a pair, and those between, stay on one line or one arc, each handle is at a constant arc
//! behind the one before it. So the pair moves as a rigid body, and its clearance is constant. Such an interval is a piece as a
//! whole. Without this rule the search would bisect the whole of an arc on which a pair is at its nearest.

use glam::DVec2;

use super::near_ground::NearGround;
use super::pair::{Pair, PairPose};
use super::pose::{Pose, PoseWalk};
use super::search::{ClearanceSearch, PairClearance};
use crate::dragon::board::Approach;
use crate::dragon::meter::{Meter, Spent};
use crate::dragon::{Dimensions, Dragon};

/// Longest interval evaluated as a whole, in lengths of the shorter link. On longer intervals the bounds are too weak.
const STRIDE_LINKS: f64 = 0.25;

/// Number of bisections from a stride to a piece: 256 pieces a link.
const HALVINGS: u32 = 6;

/// Work for storing a piece, in steps. It bounds the number of stored pieces.
const STEPS_PER_PIECE: u64 = 100;

/// Rounding of a clearance, in metres. On a rigid interval, clearances that differ by less are equal.
pub(crate) const ROUNDING_M: f64 = 1e-12;

/// A short interval of travel on which a pair's clearance may be under the limit. A rigid interval may be as long as a stride.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Piece {
    /// Indices of two benches that are not neighbours, the lower one first.
    pub(crate) benches: [usize; 2],
    /// Travel of the head at both ends.
    pub(crate) travels_m: [f64; 2],
    /// Parameter of the front handle of the first bench at both ends.
    pub(crate) places: [f64; 2],
    /// Clearance at both ends.
    pub(crate) clearances_m: [f64; 2],
    /// A lower and an upper bound on the clearance over the interval.
    pub(crate) bounds_m: [f64; 2],
    /// Whether the interval is rigid, so that the clearance is constant up to rounding.
    pub(crate) is_rigid: bool,
}

/// The pairs that a search evaluates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Pairs {
    /// Every pair.
    All,
    /// From this travel on, only pairs that do not repeat an earlier position of another pair. A handle repeats after it has
    /// reached the position that the handle before it had at this travel. After all handles repeat, only pairs with one of the
    /// first two benches are left. See [`ContactSearch`](super::ContactSearch).
    UnrepeatedSince(f64),
}

/// Searches intervals of travel for pairs that come near each other.
#[derive(Clone, Debug)]
pub(crate) struct ApproachSearch<'a> {
    dragon: &'a Dragon,
    pairs: Pairs,
    /// The ground on which repeated pairs are evaluated; `None` if the pairs that do not repeat are.
    repeated: Option<&'a NearGround>,
    /// Parameters of the handles at the travel from which pairs repeat, if it matters.
    beginning: Vec<f64>,
    earlier: Pose,
    later: Pose,
    walked: PoseWalk,
    near: ClearanceSearch,
}

impl<'a> ApproachSearch<'a> {
    /// A search placed at a travel of the run.
    pub(crate) fn new(dragon: &'a Dragon, pairs: Pairs, travel_m: f64) -> Self {
        let beginning = match pairs {
            Pairs::UnrepeatedSince(beginning_m) => {
                let chain = dragon.chain(beginning_m).expect("the travel lies within the run");
                chain.map(|handle| handle.parameter).collect()
            }
            Pairs::All => Vec::new(),
        };
        let mut search = Self {
            dragon,
            pairs,
            repeated: None,
            beginning,
            earlier: Pose::default(),
            later: Pose::default(),
            walked: PoseWalk::default(),
            near: ClearanceSearch::default(),
        };
        search.stand(travel_m);
        search
    }

    /// The same search for the pairs that it leaves out because they repeat earlier positions of other pairs: those on `ground`,
    /// which is that of the other pairs.
    pub(crate) fn of_repeated(self, ground: &'a NearGround) -> Self {
        Self { repeated: Some(ground), ..self }
    }

    /// Moves the search to another travel of the run.
    pub(crate) fn stand(&mut self, travel_m: f64) {
        if !self.earlier.is_at(travel_m) {
            self.earlier.place_head(self.dragon, travel_m);
        }
        self.earlier.extend_to(self.dragon, usize::MAX);
    }

    /// Longest interval evaluated as a whole, in metres.
    pub(crate) fn stride_m(dragon: &Dragon) -> f64 {
        STRIDE_LINKS * dragon.dimensions().link_m(0).min(dragon.dimensions().link_m(1))
    }

    /// The meter that counts the work.
    pub(crate) fn meter(&self) -> &Meter {
        self.dragon.meter()
    }

    /// The nearest of the pairs at the current travel; `None` with fewer than three benches.
    pub(crate) fn nearest(&mut self) -> Option<PairClearance> {
        if !self.repeats() {
            let nearest = self.near.nearest(&self.earlier.boards);
            self.dragon.meter().add(self.near.take_steps());
            return nearest;
        }
        self.meter().add(self.earlier.boards.len() as u64);
        let boards = &self.earlier.boards;
        let pairs = Dimensions::leading_pairs(boards.len());
        pairs.fold(None, |nearest: Option<PairClearance>, [first, second]| {
            if nearest.is_some_and(|nearest| boards[first].is_beyond(&boards[second], nearest.clearance_m)) {
                return nearest;
            }
            let pair = PairClearance::of(boards, [first, second]);
            // Pairs come in the order of their indices. The first of equal ones stays.
            nearest.filter(|nearest| !pair.is_nearer(nearest)).or(Some(pair))
        })
    }

    /// Advances to `to_m`, at most a stride away. It passes `sink` the pieces on which a pair's clearance may be under the
    /// limit, in order for each pair. The limit may fall during the search.
    ///
    /// # Errors
    /// The dragon's meter reaches its limit, or too many pairs are near each other. `sink` may have received some of the
    /// pieces.
    pub(crate) fn walk(
        &mut self,
        to_m: f64,
        limit_m: &impl Fn() -> f64,
        sink: &mut impl FnMut(Piece),
    ) -> Result<(), Spent> {
        let reached_m = self.earlier.travel_m;
        self.walked.place(&mut self.later, self.dragon, to_m);
        for benches in self.pairs_within(limit_m()).ok_or(self.meter().spent(reached_m))? {
            self.meter().check(reached_m)?;
            let pair = Pair::of(self.dragon, benches);
            pair.halve(&pair.at(&self.earlier).into(), &pair.at(&self.later).into(), HALVINGS, limit_m, sink);
        }
        std::mem::swap(&mut self.earlier, &mut self.later);
        self.meter().check(reached_m)
    }

    /// Whether every pair without one of the first two benches repeats an earlier position of another pair.
    fn repeats(&self) -> bool {
        let body = self.earlier.handles.iter().skip(2);
        self.pairs != Pairs::All
            && body.zip(self.beginning.iter().skip(1)).all(|(handle, &parameter)| handle.parameter >= parameter)
    }

    /// The pairs whose clearance may be under the limit somewhere on the interval; `None` if there are too many.
    fn pairs_within(&mut self, limit_m: f64) -> Option<Vec<[usize; 2]>> {
        if let Some(ground) = self.repeated {
            let pairs = if self.repeats() { ground.pairs(&self.earlier, &self.later) } else { Vec::new() };
            return Some(pairs);
        }
        let Self { dragon, earlier, later, .. } = self;
        let drifts_m: Vec<f64> = (0..earlier.boards.len()).map(|bench| earlier.drift_m(later, dragon, bench)).collect();
        if !self.repeats() {
            let furthest_m = drifts_m.iter().copied().fold(0.0, f64::max);
            let reach_m = limit_m + 2.0 * furthest_m;
            let pairs = self.near.all_within(&self.earlier.boards, reach_m);
            let pairs = pairs.map(|pairs| pairs.iter().map(|pair| pair.benches).collect());
            self.dragon.meter().add(self.near.take_steps());
            return pairs;
        }
        self.meter().add(self.earlier.boards.len() as u64);
        let boards = &self.earlier.boards;
        let pairs = Dimensions::leading_pairs(boards.len());
        let within = |&[first, second]: &[usize; 2]| {
            let reach_m = limit_m + drifts_m[first] + drifts_m[second];
            !boards[first].is_beyond(&boards[second], reach_m)
        };
        Some(pairs.filter(within).collect())
    }
}

impl Dragon {
    /// Clearance of two benches, with its point and direction, with the head at a travel of the run.
    pub(crate) fn approach(&self, benches: [usize; 2], travel_m: f64) -> Approach {
        Moment::from(Pair::of(self, benches).solve(travel_m)).approach
    }
}

/// Two benches at one travel.
struct Moment {
    pose: PairPose,
    approach: Approach,
}

impl From<PairPose> for Moment {
    fn from(pose: PairPose) -> Self {
        Self { approach: pose.benches[0].board.approach(&pose.benches[1].board), pose }
    }
}

impl Pair<'_> {
    fn middle(&self, earlier: &Moment, later: &Moment) -> Moment {
        self.solve(0.5 * (earlier.pose.parameter + later.pose.parameter)).into()
    }

    fn halve(
        &self,
        earlier: &Moment,
        later: &Moment,
        halvings: u32,
        limit_m: &impl Fn() -> f64,
        sink: &mut impl FnMut(Piece),
    ) {
        let is_rigid = self.is_rigid(&earlier.pose, &later.pose);
        let limit_below_m = if is_rigid { ROUNDING_M } else { 0.0 };
        if !self.may_look() {
            return;
        }
        let bounds_m = self.bounds_m(earlier, later);
        if bounds_m[0] >= limit_m() - limit_below_m {
            return;
        }
        if halvings == 0 || is_rigid {
            self.meter().add(STEPS_PER_PIECE);
            return sink(Piece {
                benches: self.benches,
                travels_m: [earlier.pose.parameter, later.pose.parameter],
                places: [earlier, later].map(|moment| moment.pose.benches[0].front.parameter),
                clearances_m: [earlier.approach.clearance_m, later.approach.clearance_m],
                bounds_m,
                is_rigid,
            });
        }
        let middle = self.middle(earlier, later);
        self.halve(earlier, &middle, halvings - 1, limit_m, sink);
        self.halve(&middle, later, halvings - 1, limit_m, sink);
    }

    /// A lower and an upper bound on the clearance over the interval. On a rigid interval they are exact up to rounding.
    fn bounds_m(&self, earlier: &Moment, later: &Moment) -> [f64; 2] {
        let clearances_m = [earlier, later].map(|moment| moment.approach.clearance_m);
        if self.is_rigid(&earlier.pose, &later.pose) {
            return [clearances_m[0].min(clearances_m[1]), clearances_m[0].max(clearances_m[1])];
        }
        let [first, second] = self.coverages(&earlier.pose, &later.pose);
        let gap_m = |direction: DVec2| first.gap_m(&second, direction);
        let gaps_m = [earlier, later].map(|moment| gap_m(moment.approach.direction));
        let least_m = first.least_between_m(&second, clearances_m);
        // The clearance rises above the mean of both ends by no more than it falls below it.
        [gaps_m.into_iter().fold(least_m, f64::max), clearances_m[0] + clearances_m[1] - least_m]
    }
}
