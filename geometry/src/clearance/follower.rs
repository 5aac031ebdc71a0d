//! One pair of benches on its way from one travel to a later one: when it comes within a clearance, and when it leaves it.
//! A pair within it is called *in touch* here; with a clearance of 0 it is.
//!
//! The pair's poses at the two ends are known, and what its boards may cover in between: if that proves that the pair
//! stays apart, or stays in touch, it is done, else the way is halved. So no contact can be stepped over, however
//! short, and a near miss costs a few halvings. What is left is ways too short to matter; the pair touches or parts on
//! those at whose ends its state differs.
//!
//! The search ends even where boards slide along each other, for a way of some 10⁻⁶ m is settled by `pair_motion`: its
//! bounds are of second order, and what they bound by rounding counts as nothing.

use std::ops::ControlFlow;

use glam::DVec2;

use super::contact::{Contact, PairEvent};
use super::pair::{Pair, PairPose};
use super::pair_motion::{GRAZE_M, PairMotion};
use super::pose::Pose;
use crate::dragon::Dragon;
use crate::dragon::board::{Approach, Board};

/// Travel to which a touch or a parting is known, in metres: the rounding of a chain is some 10⁻¹³ m, and the clearance
/// mostly changes at a few hundredths of the travel at least. Where it hardly changes, it is known to [`GRAZE_M`].
const RESOLUTION_M: f64 = 1e-11;

/// Off a coil, bounds on how the pair moves are first taken for this part of a way, and anew for this part of that: they
/// cost as much as many looks, so that only a pair that stays unsettled for ten halvings is worth them.
const RENEWAL: f64 = 1.0 / 1024.0;

/// Follows one pair.
pub(super) struct Follower<'a> {
    pair: Pair<'a>,
    clearance_m: f64,
    /// Length of the way.
    length_m: f64,
    /// Bounds on it and all parts of it, if they were taken.
    motion: Option<PairMotion>,
}

/// The pair at one travel.
struct Moment {
    pose: PairPose,
    /// How much further apart than the clearance the boards are, below 0 where they are nearer. With a clearance of 0 it is
    /// the largest gap across an edge, whose sign is the same.
    gap_m: f64,
}

impl Moment {
    #[inline]
    fn new(pose: PairPose, clearance_m: f64) -> Self {
        let [first, second] = &pose.benches;
        let gap_m = if clearance_m == 0.0 {
            first.board.separation(&second.board).0
        } else {
            first.board.clearance(&second.board) - clearance_m
        };
        Self { pose, gap_m }
    }

    fn touching(&self) -> bool {
        self.gap_m <= GRAZE_M
    }

    fn approach(&self) -> Approach {
        self.pose.benches[0].board.approach(&self.pose.benches[1].board)
    }

    /// The direction in which the clearance is measured, from either board to the other, along and across that board.
    fn directions(&self) -> [DVec2; 2] {
        let direction = self.approach().direction;
        let seen_from =
            |board: &Board, direction: DVec2| direction.rotate(DVec2::new(board.heading.x, -board.heading.y));
        let [first, second] = &self.pose.benches;
        [seen_from(&first.board, direction), seen_from(&second.board, -direction)]
    }
}

impl<'a> Follower<'a> {
    /// Hands out the changes of a pair of benches between two poses, in order, until `sink` breaks, or the dragon's meter is
    /// spent: where it comes within the clearance, which is not negative, and where it leaves it.
    pub(super) fn follow(
        dragon: &'a Dragon,
        benches: [usize; 2],
        clearance_m: f64,
        earlier: &Pose,
        later: &Pose,
        sink: &mut impl FnMut(PairEvent) -> ControlFlow<PairEvent>,
    ) -> ControlFlow<PairEvent> {
        dragon.meter().add((benches[1] - benches[0]) as u64);
        let motion = PairMotion::on_coil(dragon, benches, earlier, later);
        let pair = Pair { dragon, benches };
        let follower = Self { pair, clearance_m, length_m: later.travel_m - earlier.travel_m, motion };
        let at = |pose| Moment::new(pair.at(pose), clearance_m);
        follower.walk(&at(earlier), &at(later), sink)
    }

    /// The same on a part of the way, with bounds on that.
    fn renewed(&self, earlier: &Moment, later: &Moment) -> Self {
        let Pair { dragon, benches } = self.pair;
        let [from, to] = [earlier, later].map(|moment| Pose::of(dragon, moment.pose.travel_m, benches[1] + 1));
        let motion = PairMotion::along_curve(dragon, benches, &from, &to);
        Self { length_m: later.pose.travel_m - earlier.pose.travel_m, motion: Some(motion), ..*self }
    }

    fn walk(
        &self,
        earlier: &Moment,
        later: &Moment,
        sink: &mut impl FnMut(PairEvent) -> ControlFlow<PairEvent>,
    ) -> ControlFlow<PairEvent> {
        if !self.pair.may_look() || self.settled(earlier, later) {
            return ControlFlow::Continue(());
        }
        let (earlier_m, later_m) = (earlier.pose.travel_m, later.pose.travel_m);
        let length_m = later_m - earlier_m;
        if length_m <= RENEWAL * self.length_m && !self.motion.is_some_and(|motion| motion.is_on_coil) {
            return self.renewed(earlier, later).walk(earlier, later, sink);
        }
        let middle_m = 0.5 * (earlier_m + later_m);
        if length_m <= RESOLUTION_M || middle_m <= earlier_m || middle_m >= later_m {
            return self.change(earlier, later).map_or(ControlFlow::Continue(()), sink);
        }
        let middle = Moment::new(self.pair.solve(middle_m), self.clearance_m);
        self.walk(earlier, &middle, sink)?;
        self.walk(&middle, later, sink)
    }

    /// Whether the pair provably stays apart, or in touch, all the way.
    fn settled(&self, earlier: &Moment, later: &Moment) -> bool {
        if earlier.touching() != later.touching() {
            return false;
        }
        let is_settled = self.motion.is_some_and(|motion| {
            let encounter = motion.between(&earlier.pose.benches, &later.pose.benches);
            if earlier.touching() {
                return encounter.stays_touching(self.clearance_m);
            }
            // Apart by a clearance, boards may be nearest at two corners, which no edge keeps apart.
            let corners_stay_apart =
                |moment: &Moment| encounter.stays_apart_along(moment.directions(), self.clearance_m);
            encounter.stays_apart(self.clearance_m)
                || (self.clearance_m > 0.0 && [earlier, later].into_iter().any(corners_stay_apart))
        });
        is_settled || self.settled_separately(earlier, later)
    }

    /// The same from what either board may cover, whenever the other one is where.
    fn settled_separately(&self, earlier: &Moment, later: &Moment) -> bool {
        let [first, second] = self.pair.coverages(&earlier.pose, &later.pose);
        if earlier.touching() {
            return first.stays_touching(&second, -earlier.gap_m.min(later.gap_m));
        }
        if first.least_between_m(&second, [earlier.gap_m, later.gap_m]) > 0.0 {
            return true;
        }
        [earlier, later].into_iter().any(|moment| {
            let (_, axis) = moment.pose.benches[0].board.separation(&moment.pose.benches[1].board);
            [axis, moment.approach().direction]
                .into_iter()
                .any(|direction| first.gap_m(&second, direction) > self.clearance_m)
        })
    }

    fn change(&self, earlier: &Moment, later: &Moment) -> Option<PairEvent> {
        let contact = |moment: &Moment| Contact {
            travel_m: later.pose.travel_m,
            benches: self.pair.benches,
            point: moment.approach().point,
        };
        match (earlier.touching(), later.touching()) {
            (false, true) => Some(PairEvent::Touch(contact(later))),
            (true, false) => Some(PairEvent::Part(contact(earlier))),
            _ => None,
        }
    }
}
