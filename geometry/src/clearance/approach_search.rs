//! Where benches come near to each other without touching.
//!
//! A pair is followed from one travel to the next by its poses at both ends and by what its boards may cover in between
//! (see `coverage`), which bounds its clearance from below. Ways on which the bound stays over a limit are done; others
//! are halved down to pieces so short that the clearance is taken to have one valley at most on each. So no approach
//! under the limit is passed over, however short; only two of the same pair within one piece would be taken for one.

use glam::DVec2;

use super::pair::{Pair, PairPose};
use super::pose::Pose;
use super::search::{ClearanceSearch, PairClearance};
use crate::dragon::board::Approach;
use crate::dragon::meter::{Meter, Spent};
use crate::dragon::{Dimensions, Dragon};

/// Longest way looked at as one, in lengths of the shorter link: on longer ones the bounds tell little.
const STRIDE_LINKS: f64 = 0.25;

/// A stride is halved this often for pieces: 256 a link.
const HALVINGS: u32 = 6;

/// What it takes to keep a piece, in steps of work, which bounds how many are kept.
const STEPS_PER_PIECE: u64 = 100;

/// A short part of a pair's way on which its clearance may be under the limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Piece {
    /// Lower index first; not neighbours.
    pub(crate) benches: [usize; 2],
    /// Travel of the head at both ends.
    pub(crate) travels_m: [f64; 2],
    /// Clearance at both ends.
    pub(crate) clearances_m: [f64; 2],
}

/// Which pairs to look at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Pairs {
    /// Every pair.
    All,
    /// Those that do not stand where another pair has stood before, from this travel on: those with one of the first two
    /// benches, once every handle has come to where the one before it stood there (see
    /// [`ContactSearch`](super::ContactSearch)).
    UnrepeatedSince(f64),
}

/// Searches ways for pairs that come near.
#[derive(Clone, Debug)]
pub(crate) struct ApproachSearch<'a> {
    dragon: &'a Dragon,
    pairs: Pairs,
    /// Parameters of the handles where the beginning is.
    beginning: Vec<f64>,
    earlier: Pose,
    later: Pose,
    near: ClearanceSearch,
}

impl<'a> ApproachSearch<'a> {
    /// A search that stands at a travel of the run.
    pub(crate) fn new(dragon: &'a Dragon, pairs: Pairs, travel_m: f64) -> Self {
        let beginning_m = match pairs {
            Pairs::UnrepeatedSince(beginning_m) => beginning_m,
            Pairs::All => travel_m,
        };
        let chain = dragon.chain(beginning_m).expect("the travel lies within the run");
        let mut search = Self {
            dragon,
            pairs,
            beginning: chain.map(|handle| handle.parameter).collect(),
            earlier: Pose::default(),
            later: Pose::default(),
            near: ClearanceSearch::default(),
        };
        search.stand(travel_m);
        search
    }

    /// Stands at another travel of the run.
    pub(crate) fn stand(&mut self, travel_m: f64) {
        if !self.earlier.is_at(travel_m) {
            self.earlier.place_head(self.dragon, travel_m);
        }
        self.earlier.extend_to(self.dragon, usize::MAX);
    }

    /// Longest way looked at as one.
    pub(crate) fn stride_m(dragon: &Dragon) -> f64 {
        STRIDE_LINKS * dragon.dimensions().link_m(0).min(dragon.dimensions().link_m(1))
    }

    /// Where the work is counted.
    pub(crate) fn meter(&self) -> &Meter {
        self.dragon.meter()
    }

    /// The nearest of the pairs where the search stands; none with fewer than three benches.
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
            nearest.filter(|nearest| nearest.order(&pair).is_le()).or(Some(pair))
        })
    }

    /// Walks on to `to_m`, at most a stride away, and hands out the pieces on which a pair's clearance may be under the
    /// limit, which may fall meanwhile; in order for each pair.
    ///
    /// # Errors
    /// With some of the pieces, where the dragon's meter is spent or too many pairs are near each other.
    pub(crate) fn walk(
        &mut self,
        to_m: f64,
        limit_m: &impl Fn() -> f64,
        sink: &mut impl FnMut(Piece),
    ) -> Result<(), Spent> {
        let reached_m = self.earlier.travel_m;
        self.later.place_head(self.dragon, to_m);
        self.later.extend_to(self.dragon, usize::MAX);
        for benches in self.pairs_within(limit_m()).ok_or(self.meter().spent(reached_m))? {
            self.meter().check(reached_m)?;
            let pair = Pair { dragon: self.dragon, benches };
            pair.halve(&pair.at(&self.earlier).into(), &pair.at(&self.later).into(), HALVINGS, limit_m, sink);
        }
        std::mem::swap(&mut self.earlier, &mut self.later);
        self.meter().check(reached_m)
    }

    /// Walks on to `to_m`, at most a stride away, unless a pair's clearance falls under the limit on the way: then it stays
    /// where it is. No clearance is under the limit where it stands.
    ///
    /// # Errors
    /// The travel up to which every clearance is proved to be at or over the limit; there, a bound that is met to
    /// `resolution_m` of travel can no longer tell.
    pub(crate) fn walk_over(&mut self, to_m: f64, limit_m: f64, resolution_m: f64) -> Result<(), f64> {
        self.later.place_head(self.dragon, to_m);
        self.later.extend_to(self.dragon, usize::MAX);
        // Where there are too many of them, or the meter is spent, nothing is proved.
        let nothing = self.earlier.travel_m;
        let pairs = self.pairs_within(limit_m).ok_or(nothing)?;
        let violations_m = pairs.into_iter().take_while(|_| !self.meter().is_spent()).filter_map(|benches| {
            let pair = Pair { dragon: self.dragon, benches };
            let (earlier, later) = (pair.at(&self.earlier).into(), pair.at(&self.later).into());
            pair.violation_m(&earlier, &later, limit_m, resolution_m)
        });
        let first_m = violations_m.min_by(f64::total_cmp);
        if self.meter().is_spent() {
            return Err(nothing);
        }
        if let Some(violation_m) = first_m {
            return Err(violation_m);
        }
        std::mem::swap(&mut self.earlier, &mut self.later);
        Ok(())
    }

    /// Whether each pair but those with one of the first two benches stands where another has stood before.
    fn repeats(&self) -> bool {
        let body = self.earlier.handles.iter().skip(2);
        self.pairs != Pairs::All
            && body.zip(self.beginning.iter().skip(1)).all(|(handle, &parameter)| handle.parameter >= parameter)
    }

    /// The pairs whose clearance may be under the limit somewhere on the way; none where there are too many.
    fn pairs_within(&mut self, limit_m: f64) -> Option<Vec<[usize; 2]>> {
        let Self { dragon, earlier, later, .. } = self;
        let drifts_m: Vec<f64> = (0..earlier.boards.len()).map(|bench| earlier.drift_m(later, dragon, bench)).collect();
        if !self.repeats() {
            let furthest_m = drifts_m.iter().copied().fold(0.0, f64::max);
            let reach_m = limit_m + 2.0 * furthest_m;
            let pairs = self.near.within(&self.earlier.boards, reach_m).iter().map(|pair| pair.benches).collect();
            let has_all = self.earlier.boards.len() < 3 || self.near.has_found_all(reach_m);
            self.dragon.meter().add(self.near.take_steps());
            return has_all.then_some(pairs);
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
    /// How two benches lie to each other with the head at a travel of the run.
    pub(crate) fn approach(&self, benches: [usize; 2], travel_m: f64) -> Approach {
        Moment::from(Pair { dragon: self, benches }.solve(travel_m)).approach
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
        self.solve(0.5 * (earlier.pose.travel_m + later.pose.travel_m)).into()
    }

    fn halve(
        &self,
        earlier: &Moment,
        later: &Moment,
        halvings: u32,
        limit_m: &impl Fn() -> f64,
        sink: &mut impl FnMut(Piece),
    ) {
        if !self.may_look() || self.least_m(earlier, later) >= limit_m() {
            return;
        }
        if halvings == 0 {
            self.dragon.meter().add(STEPS_PER_PIECE);
            return sink(Piece {
                benches: self.benches,
                travels_m: [earlier.pose.travel_m, later.pose.travel_m],
                clearances_m: [earlier.approach.clearance_m, later.approach.clearance_m],
            });
        }
        let middle = self.middle(earlier, later);
        self.halve(earlier, &middle, halvings - 1, limit_m, sink);
        self.halve(&middle, later, halvings - 1, limit_m, sink);
    }

    /// Where the bound of the clearance first falls under the limit, on pieces as short as the resolution; `None` where it
    /// does not. At most log₂ of their number of pieces are halved at a time.
    fn violation_m(&self, earlier: &Moment, later: &Moment, limit_m: f64, resolution_m: f64) -> Option<f64> {
        if !self.may_look() || self.least_m(earlier, later) >= limit_m {
            return None;
        }
        if later.pose.travel_m - earlier.pose.travel_m <= resolution_m || earlier.approach.clearance_m < limit_m {
            return Some(earlier.pose.travel_m);
        }
        let middle = self.middle(earlier, later);
        self.violation_m(earlier, &middle, limit_m, resolution_m)
            .or_else(|| self.violation_m(&middle, later, limit_m, resolution_m))
    }

    /// A bound that the clearance does not fall under on the way.
    fn least_m(&self, earlier: &Moment, later: &Moment) -> f64 {
        let [first, second] = self.coverages(&earlier.pose, &later.pose);
        let gap_m = |direction: DVec2| first.gap_m(&second, direction);
        let gaps_m = [earlier, later].map(|moment| gap_m(moment.approach.direction));
        let least_m = first.least_between_m(&second, [earlier, later].map(|moment| moment.approach.clearance_m));
        gaps_m.into_iter().fold(least_m, f64::max)
    }
}
