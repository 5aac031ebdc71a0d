//! When boards touch.
//!
//! A pair is followed from one travel to a later one by its poses at the two ends and by what its boards may cover in
//! between: if that proves that it stays apart, or stays in touch, it is done, else the way is halved. So no contact can be
//! stepped over, however short, and a near miss costs a few halvings. What is left is ways too short to matter; the pair
//! touches or parts on those at whose ends its state differs.

use std::cmp::Ordering;
use std::ops::ControlFlow;

use glam::DVec2;

use super::Dragon;
use super::board::Approach;
use super::clearance::ClearanceSearch;
use super::passage::{Passage, drift_m};
use super::pose::{Pose, Seat};

/// Travel to which a touch or a parting is known, in metres.
const RESOLUTION_M: f64 = 1e-11;

/// Longest way looked at as one, in lengths of the shorter link: longer ones are halved anyway.
const STRIDE_LINKS: f64 = 0.25;

/// Two boards touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Travel of the head.
    pub travel_m: f64,
    /// Lower index first; not neighbours.
    pub benches: [usize; 2],
    /// Where they touch.
    pub point: DVec2,
}

/// A change between apart and in touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PairEvent {
    /// A pair that was apart touches.
    Touch(Contact),
    /// A pair that was in touch is apart from here on.
    Part(Contact),
}

impl PairEvent {
    /// Where and when.
    pub fn contact(&self) -> &Contact {
        match self {
            Self::Touch(contact) | Self::Part(contact) => contact,
        }
    }

    fn order(&self, other: &Self) -> Ordering {
        let (ours, theirs) = (self.contact(), other.contact());
        ours.travel_m.total_cmp(&theirs.travel_m).then(ours.benches.cmp(&theirs.benches))
    }
}

/// The first contact with the head between two travels, as [`ContactSearch::first`] finds it.
pub fn first_contact(dragon: &Dragon, from_travel_m: f64, to_travel_m: f64) -> Option<Contact> {
    ContactSearch::new(dragon).first(from_travel_m, to_travel_m)
}

/// Searches a dragon's run for contacts. Keeps its buffers and its last pose: sweeps that follow on each other solve one
/// chain each as long as nothing is near.
#[derive(Clone, Debug)]
pub struct ContactSearch {
    dragon: Dragon,
    earlier: Pose,
    later: Pose,
    near: ClearanceSearch,
    pairs: Vec<[usize; 2]>,
    events: Vec<PairEvent>,
}

impl ContactSearch {
    /// A search over the run of `dragon`.
    pub fn new(dragon: &Dragon) -> Self {
        Self {
            dragon: dragon.clone(),
            earlier: Pose::default(),
            later: Pose::default(),
            near: ClearanceSearch::default(),
            pairs: Vec::new(),
            events: Vec::new(),
        }
    }

    /// The first travel between two at which some pair touches, to 10⁻¹¹ m; what lies outside the run is left out.
    ///
    /// Once every handle has come to where the one before it stood at the beginning, only pairs with one of the first two
    /// benches are looked at: body links are alike, so any other pair lies where the pair one bench further ahead has lain
    /// before.
    pub fn first(&mut self, from_travel_m: f64, to_travel_m: f64) -> Option<Contact> {
        let (from_m, to_m) = self.within_run(from_travel_m, to_travel_m)?;
        self.begin(from_m);
        let touching = self.near.nearest(&self.earlier.boards).filter(|nearest| nearest.clearance_m <= 0.0);
        if let Some(nearest) = touching {
            return Some(Contact { travel_m: from_m, benches: nearest.benches, point: nearest.point });
        }
        let beginning: Vec<f64> = self.earlier.handles.iter().map(|handle| handle.place).collect();
        while self.earlier.travel_m < to_m {
            self.stride(to_m);
            if self.repeats(&beginning) {
                self.collect_leading_pairs();
            } else {
                self.collect_pairs();
            }
            if let Some(contact) = self.earliest_touch() {
                return Some(contact);
            }
            self.advance();
        }
        None
    }

    /// Every change of a pair between two travels, in order, each to 10⁻¹¹ m; what lies outside the run is left out.
    ///
    /// A pair touches where its clearance comes down to 0, and parts where it comes up from there; whether it is in touch
    /// at `from_travel_m` is for the caller to know. Allocates nothing when no pair is near and the search has swept before.
    pub fn sweep(&mut self, from_travel_m: f64, to_travel_m: f64) -> &[PairEvent] {
        self.events.clear();
        let Some((from_m, to_m)) = self.within_run(from_travel_m, to_travel_m) else { return &self.events };
        self.begin(from_m);
        while self.earlier.travel_m < to_m {
            self.stride(to_m);
            self.collect_pairs();
            let Self { dragon, earlier, later, pairs, events, .. } = self;
            for &benches in &*pairs {
                let follower = Follower { dragon, benches };
                let _ = follower.follow(&follower.at(earlier), &follower.at(later), &mut |event| {
                    events.push(event);
                    ControlFlow::Continue(())
                });
            }
            self.advance();
        }
        self.events.sort_unstable_by(PairEvent::order);
        &self.events
    }

    fn within_run(&self, from_travel_m: f64, to_travel_m: f64) -> Option<(f64, f64)> {
        let from_m = from_travel_m.max(self.dragon.start_travel_m());
        let to_m = to_travel_m.min(self.dragon.end_travel_m());
        (from_m <= to_m).then_some((from_m, to_m))
    }

    fn begin(&mut self, travel_m: f64) {
        if !self.earlier.is_at(travel_m) {
            self.earlier.place(&self.dragon, travel_m);
        }
    }

    /// Places `later` at the end of the next way, at most at `to_m`.
    fn stride(&mut self, to_m: f64) {
        let dimensions = self.dragon.dimensions();
        let stride_m = STRIDE_LINKS * dimensions.link_m(0).min(dimensions.link_m(1));
        self.later.place(&self.dragon, to_m.min(self.earlier.travel_m + stride_m));
    }

    fn advance(&mut self) {
        std::mem::swap(&mut self.earlier, &mut self.later);
    }

    /// Whether each body handle has come to where the one before it stood at the beginning.
    fn repeats(&self, beginning: &[f64]) -> bool {
        let body = &self.earlier.handles[2.min(self.earlier.handles.len())..];
        body.iter().zip(&beginning[1..]).all(|(handle, &place)| handle.place >= place)
    }

    /// Collects all pairs that could be in touch somewhere on the way.
    fn collect_pairs(&mut self) {
        let furthest_m = (0..self.earlier.boards.len()).map(|bench| self.drift_m(bench)).fold(0.0, f64::max);
        self.pairs.clear();
        self.pairs.extend(self.near.within(&self.earlier.boards, 2.0 * furthest_m).iter().map(|pair| pair.benches));
    }

    /// The same for pairs with the head or the bench behind it.
    fn collect_leading_pairs(&mut self) {
        self.pairs.clear();
        let boards = &self.earlier.boards;
        for first in 0..2.min(boards.len()) {
            let drift_m = self.drift_m(first);
            for second in first + 2..boards.len() {
                let (ours, theirs) = (&boards[first], &boards[second]);
                let gap_m = ours.centre.distance(theirs.centre) - ours.radius_m() - theirs.radius_m();
                if gap_m <= drift_m || gap_m <= drift_m + self.drift_m(second) {
                    self.pairs.push([first, second]);
                }
            }
        }
    }

    fn drift_m(&self, bench: usize) -> f64 {
        drift_m(&self.dragon, bench, &self.earlier.seat(bench), &self.later.seat(bench))
    }

    /// The first touch of any of the collected pairs.
    fn earliest_touch(&self) -> Option<Contact> {
        let touch = |&benches: &[usize; 2]| {
            let follower = Follower { dragon: &self.dragon, benches };
            let touched =
                follower.follow(&follower.at(&self.earlier), &follower.at(&self.later), &mut ControlFlow::Break);
            touched.break_value()
        };
        self.pairs.iter().filter_map(touch).min_by(PairEvent::order).map(|event| *event.contact())
    }
}

/// Follows one pair.
struct Follower<'a> {
    dragon: &'a Dragon,
    benches: [usize; 2],
}

/// The pair at one travel.
struct Moment {
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
    fn at(&self, pose: &Pose) -> Moment {
        let [first, second] = self.benches;
        Moment::new(pose.travel_m, pose.seat(first), pose.seat(second))
    }

    /// The pair at a travel within the run; solves the chain as far as the pair's second bench.
    fn solve(&self, travel_m: f64) -> Moment {
        let mut chain = self.dragon.chain(travel_m).expect("the travel lies within the run");
        let mut seat = |bench, ahead| {
            let front = chain.nth(ahead).expect("the chain reaches the second bench");
            let rear = chain.next().expect("the chain reaches the second bench");
            Seat { front, rear, board: self.dragon.board(bench, &front, &rear) }
        };
        let [first, second] = self.benches;
        Moment::new(travel_m, seat(first, first), seat(second, second - first - 2))
    }

    /// Hands out the pair's changes between two moments, in order, until `sink` breaks.
    fn follow(
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
