//! One pair of benches on its way from one travel to a later one.
//!
//! The pair's poses at the two ends are known, and what its boards may cover in between: if that proves that the pair
//! stays apart, or stays in touch, it is done, else the way is halved. So no contact can be stepped over, however
//! short, and a near miss costs a few halvings. What is left is ways too short to matter; the pair touches or parts on
//! those at whose ends its state differs.

use std::ops::ControlFlow;

use super::Dragon;
use super::board::Approach;
use super::contact::{Contact, PairEvent};
use super::passage::Passage;
use super::pose::{Pose, Seat};

/// Travel to which a touch or a parting is known, in metres: the rounding of a chain is some 10⁻¹³ m, and the clearance
/// mostly changes at a few hundredths of the travel at least.
const RESOLUTION_M: f64 = 1e-11;

/// Follows one pair.
pub(super) struct Follower<'a> {
    pub(super) dragon: &'a Dragon,
    pub(super) benches: [usize; 2],
}

/// The pair at one travel.
pub(super) struct Moment {
    travel_m: f64,
    seats: [Seat; 2],
    approach: Approach,
}

impl Moment {
    fn new(travel_m: f64, first: Seat, second: Seat) -> Self {
        Self { travel_m, seats: [first, second], approach: first.board.approach(&second.board) }
    }
}

impl Follower<'_> {
    /// The pair in a pose of the whole dragon.
    pub(super) fn at(&self, pose: &Pose) -> Moment {
        let [first, second] = self.benches;
        Moment::new(pose.travel_m, pose.seat(first), pose.seat(second))
    }

    /// The pair at a travel within the run; solves the chain as far as the pair's second bench.
    fn solve(&self, travel_m: f64) -> Moment {
        let mut chain = self.dragon.chain(travel_m).expect("the travel lies within the run");
        let mut seat = |bench, ahead| {
            let front = chain.nth(ahead).expect("the chain reaches the second bench");
            let rear = chain.next().expect("the chain reaches the second bench");
            Seat::new(self.dragon, bench, front, rear)
        };
        let [first, second] = self.benches;
        Moment::new(travel_m, seat(first, first), seat(second, second - first - 2))
    }

    /// Hands out the pair's changes between two moments, in order, until `sink` breaks.
    pub(super) fn follow(
        &self,
        earlier: &Moment,
        later: &Moment,
        sink: &mut impl FnMut(PairEvent) -> ControlFlow<PairEvent>,
    ) -> ControlFlow<PairEvent> {
        if self.settled(earlier, later) {
            return ControlFlow::Continue(());
        }
        let middle_m = 0.5 * (earlier.travel_m + later.travel_m);
        let short = later.travel_m - earlier.travel_m <= RESOLUTION_M;
        if short || middle_m <= earlier.travel_m || middle_m >= later.travel_m {
            return self.change(earlier, later).map_or(ControlFlow::Continue(()), sink);
        }
        let middle = self.solve(middle_m);
        self.follow(earlier, &middle, sink)?;
        self.follow(&middle, later, sink)
    }

    /// Whether the pair provably stays apart, or in touch, all the way.
    fn settled(&self, earlier: &Moment, later: &Moment) -> bool {
        if earlier.approach.touching() != later.approach.touching() {
            return false;
        }
        let [first, second] =
            [0, 1].map(|i| Passage::new(self.dragon, self.benches[i], &earlier.seats[i], &later.seats[i]));
        if earlier.approach.touching() {
            let depth_m = -earlier.approach.clearance_m.min(later.approach.clearance_m);
            return first.stays_touching(&second, depth_m);
        }
        [earlier, later].into_iter().any(|moment| {
            let (_, axis) = moment.seats[0].board.separation(&moment.seats[1].board);
            first.stays_apart(&second, axis) || first.stays_apart(&second, moment.approach.direction)
        })
    }

    fn change(&self, earlier: &Moment, later: &Moment) -> Option<PairEvent> {
        let contact =
            |moment: &Moment| Contact { travel_m: later.travel_m, benches: self.benches, point: moment.approach.point };
        match (earlier.approach.touching(), later.approach.touching()) {
            (false, true) => Some(PairEvent::Touch(contact(later))),
            (true, false) => Some(PairEvent::Part(contact(earlier))),
            _ => None,
        }
    }
}
