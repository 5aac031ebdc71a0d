//! One pair of benches on its way from one travel to a later one.
//!
//! The pair's poses at the two ends are known, and what its boards may cover in between: if that proves that the pair
//! stays apart, or stays in touch, it is done, else the way is halved. So no contact can be stepped over, however
//! short, and a near miss costs a few halvings. What is left is ways too short to matter; the pair touches or parts on
//! those at whose ends its state differs.

use std::ops::ControlFlow;

use super::Dragon;
use super::board::{Approach, Board};
use super::coil_motion::CoilMotion;
use super::contact::{Contact, PairEvent};
use super::passage::Passage;
use super::pose::{Pose, Seat};

/// Travel to which a touch or a parting is known, in metres: the rounding of a chain is some 10⁻¹³ m, and the clearance
/// mostly changes at a few hundredths of the travel at least.
const RESOLUTION_M: f64 = 1e-11;

/// Follows one pair.
pub(super) struct Follower<'a> {
    dragon: &'a Dragon,
    benches: [usize; 2],
    /// Bounds on the whole way, if it is on a coil.
    motion: Option<CoilMotion>,
}

/// The pair at one travel.
struct Moment {
    travel_m: f64,
    seats: [Seat; 2],
    /// The largest gap across an edge, which is above 0 exactly where the boards are apart.
    gap_m: f64,
}

impl Moment {
    fn new(travel_m: f64, first: Seat, second: Seat) -> Self {
        Self { travel_m, seats: [first, second], gap_m: first.board.separation(&second.board).0 }
    }

    fn touching(&self) -> bool {
        self.gap_m <= 0.0
    }

    fn boards(&self) -> [&Board; 2] {
        [&self.seats[0].board, &self.seats[1].board]
    }

    fn approach(&self) -> Approach {
        self.seats[0].board.approach(&self.seats[1].board)
    }
}

impl<'a> Follower<'a> {
    /// Hands out the changes of a pair of benches between two poses, in order, until `sink` breaks.
    pub(super) fn follow(
        dragon: &'a Dragon,
        benches: [usize; 2],
        earlier: &Pose,
        later: &Pose,
        sink: &mut impl FnMut(PairEvent) -> ControlFlow<PairEvent>,
    ) -> ControlFlow<PairEvent> {
        let follower = Self { dragon, benches, motion: CoilMotion::new(dragon, benches, earlier, later) };
        let at = |pose: &Pose| Moment::new(pose.travel_m, pose.seat(benches[0]), pose.seat(benches[1]));
        follower.walk(&at(earlier), &at(later), sink)
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

    fn walk(
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
        self.walk(earlier, &middle, sink)?;
        self.walk(&middle, later, sink)
    }

    /// Whether the pair provably stays apart, or in touch, all the way.
    fn settled(&self, earlier: &Moment, later: &Moment) -> bool {
        if earlier.touching() != later.touching() {
            return false;
        }
        let Some(motion) = &self.motion else { return self.settled_anywhere(earlier, later) };
        let angle = later.seats[0].front.place - earlier.seats[0].front.place;
        if earlier.touching() {
            motion.stays_touching(earlier.boards(), later.boards(), angle) || self.settled_anywhere(earlier, later)
        } else {
            motion.stays_apart(earlier.boards(), later.boards(), angle)
        }
    }

    /// The same by bounds that hold on any route.
    fn settled_anywhere(&self, earlier: &Moment, later: &Moment) -> bool {
        let [first, second] =
            [0, 1].map(|i| Passage::new(self.dragon, self.benches[i], &earlier.seats[i], &later.seats[i]));
        if earlier.touching() {
            return first.stays_touching(&second, -earlier.gap_m.min(later.gap_m));
        }
        [earlier, later].into_iter().any(|moment| {
            let (_, axis) = moment.seats[0].board.separation(&moment.seats[1].board);
            first.stays_apart(&second, axis) || first.stays_apart(&second, moment.approach().direction)
        })
    }

    fn change(&self, earlier: &Moment, later: &Moment) -> Option<PairEvent> {
        let contact = |moment: &Moment| Contact {
            travel_m: later.travel_m,
            benches: self.benches,
            point: moment.approach().point,
        };
        match (earlier.touching(), later.touching()) {
            (false, true) => Some(PairEvent::Touch(contact(later))),
            (true, false) => Some(PairEvent::Part(contact(earlier))),
            _ => None,
        }
    }
}
