//! When boards touch, over a whole run or from one frame to the next.

use std::ops::ControlFlow;

use super::Dragon;
use super::clearance::ClearanceSearch;
use super::contact::{Contact, PairEvent};
use super::follower::Follower;
use super::passage::drift_m;
use super::pose::Pose;

/// Longest way looked at as one, in lengths of the shorter link: longer ones would be halved anyway.
const STRIDE_LINKS: f64 = 0.25;

/// The first contact with the head between two travels, as [`ContactSearch::first`] finds it.
pub fn first_contact(dragon: &Dragon, from_travel_m: f64, to_travel_m: f64) -> Option<Contact> {
    ContactSearch::new(dragon).first(from_travel_m, to_travel_m)
}

/// Searches a dragon's run for contacts. Keeps its buffers and its last pose: sweeps that follow on each other solve
/// one chain each as long as nothing is near.
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
    /// Once every handle has come to where the one before it stood at the beginning, only pairs with one of the first
    /// two benches are looked at: body links are alike, so any other pair lies where the pair one bench further ahead
    /// has lain before.
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
    /// A pair touches where its clearance comes down to 0, and parts where it comes up from there; whether it is in
    /// touch at `from_travel_m` is for the caller to know. Allocates nothing when no pair is near and the search has
    /// swept before.
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
                if gap_m <= drift_m + self.drift_m(second) {
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
