//! Searches for contacts, or for pairs within a clearance, over a whole run or from one frame to the next.

use std::f64::consts::TAU;
use std::ops::ControlFlow;

use glam::DVec2;

use super::coil_reach::CoilReach;
use super::contact::{Contact, PairEvent};
use super::pair_tracker::PairTracker;
use super::pose::{Pose, PoseWalk};
use super::repeated_walk::RepeatedWalk;
use super::search::ClearanceSearch;
use crate::dragon::board::Board;
use crate::dragon::meter::Spent;
use crate::dragon::{Dimensions, Dragon};

/// Longest interval evaluated as a whole, in lengths of the shorter link. Longer intervals would be bisected anyway.
const STRIDE_LINKS: f64 = 0.25;

/// Finds the first contact with the head between two travels by [`ContactSearch::first`].
///
/// # Errors
/// The errors of [`ContactSearch::first`].
pub fn first_contact(dragon: &Dragon, from_travel_m: f64, to_travel_m: f64) -> Result<Option<Contact>, Spent> {
    ContactSearch::new(dragon).first(from_travel_m, to_travel_m)
}

/// Finds the first travel between two travels at which the clearance of some pair falls to `clearance_m`, by
/// [`ContactSearch::first`]. With a clearance of 0 it is [`first_contact`].
///
/// ```
/// use std::sync::Arc;
/// use bench_dragon_geometry::{clearance::first_within, dragon::{Dimensions, Dragon}, route::Route};
///
/// let paper = Dimensions::new(223, 3.41, 2.20, 0.30, 0.275)?;
/// let dragon = Dragon::new(paper, Arc::new(Route::spiral(0.55, 16.0)?))?;
/// let near = first_within(&dragon, 0.05, 0.0, dragon.end_travel_m())?.expect("the dragon touches itself");
/// assert!(near.travel_m < 412.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// The errors of [`ContactSearch::first`].
///
/// # Panics
/// Panics for a clearance that is negative or not finite.
pub fn first_within(
    dragon: &Dragon,
    clearance_m: f64,
    from_travel_m: f64,
    to_travel_m: f64,
) -> Result<Option<Contact>, Spent> {
    ContactSearch::within(dragon, clearance_m).first(from_travel_m, to_travel_m)
}

/// The result of a sweep.
#[derive(Clone, Copy, Debug)]
pub struct Sweep<'a> {
    /// The beginnings and ends of contacts, in order.
    pub events: &'a [PairEvent],
    /// Travel up to which `events` is complete. It is the end of the sweep, unless the work reached its limit.
    pub reached_m: f64,
}

/// Searches a dragon's run for contacts, or for pairs within a clearance. Here, *touch* means either. The search reuses its
/// buffers and its last pose. While no pair is near, each of several consecutive sweeps steps the chain to its end.
#[derive(Clone, Debug)]
pub struct ContactSearch {
    dragon: Dragon,
    /// Largest clearance that counts as contact.
    clearance_m: f64,
    reach: Option<CoilReach>,
    /// Travel before which no two benches touch, by the bounds of the coil.
    clear_to_m: f64,
    /// Parameter of handle 2 from which the first two benches touch no other bench, by the bounds of the way out.
    clear_from: f64,
    earlier: Pose,
    later: Pose,
    walked: PoseWalk,
    /// Parameters of the handles at the start of [`first`](Self::first). Empty once every body handle has reached the start
    /// position of the handle before it.
    beginning: Vec<f64>,
    /// Travel at which the last such search ended without a contact, if `earlier` is still at that travel.
    searched_to_m: Option<f64>,
    near: ClearanceSearch,
    /// The walk where the body repeats and no bound of a coil limits the pairs.
    walk: RepeatedWalk,
    pairs: Vec<[usize; 2]>,
    events: Vec<PairEvent>,
}

impl ContactSearch {
    /// A search for contacts over the run of `dragon`.
    pub fn new(dragon: &Dragon) -> Self {
        Self::within(dragon, 0.0)
    }

    /// A search for pairs with a clearance of at most `clearance_m`.
    ///
    /// # Panics
    /// Panics for a clearance that is negative or not finite.
    pub fn within(dragon: &Dragon, clearance_m: f64) -> Self {
        assert!(clearance_m >= 0.0 && clearance_m.is_finite(), "a search for a clearance of {clearance_m} m");
        let reach = CoilReach::of(dragon, clearance_m);
        Self {
            dragon: dragon.clone(),
            clearance_m,
            reach,
            clear_to_m: clear_to_m(dragon, clearance_m),
            clear_from: reach.and_then(|reach| reach.clear_out_from(dragon.end_parameter)).unwrap_or(f64::INFINITY),
            earlier: Pose::default(),
            later: Pose::default(),
            walked: PoseWalk::default(),
            beginning: Vec::new(),
            searched_to_m: None,
            near: ClearanceSearch::default(),
            walk: RepeatedWalk::default(),
            pairs: Vec::new(),
            events: Vec::new(),
        }
    }

    /// Finds the first travel between two travels at which some pair touches. Travels outside the run are ignored. If pairs touch
    /// at the beginning already, the result is the deepest of them, and of equal ones that with the lowest indices.
    ///
    /// Boards touch from a gap of 10⁻¹² m down, the rounding of positions, over the searched clearance. Some pair touches at the
    /// result, and none up to 10⁻¹¹ m before it. So boards that close at a rate r per metre of travel touch at most 10⁻¹¹ m +
    /// 10⁻¹² m / r from where their edges meet.
    ///
    /// The chain behind a handle is a function of that handle's parameter, and body links are alike. Pairs repeat after every
    /// body handle has reached the start position of the handle before it: each pair takes an earlier position of the pair one
    /// bench further ahead. From then on, only pairs with one of the first two benches are evaluated. If the bounds of the coil
    /// rule out all contacts up to the beginning, only these pairs are evaluated from the beginning. A search that starts where
    /// the last one ended, or where its work was spent, continues it. The search ends as soon as the bounds rule out all contacts
    /// of these two benches.
    ///
    /// # Errors
    /// The dragon's meter is spent before the search is finished, or too many pairs are near each other. No benches touch up to
    /// the travel in the error.
    pub fn first(&mut self, from_travel_m: f64, to_travel_m: f64) -> Result<Option<Contact>, Spent> {
        let Some((from_m, to_m)) = self.within_run(from_travel_m, to_travel_m) else { return Ok(None) };
        let from_m = from_m.max(self.clear_to_m);
        if from_m > to_m || self.dragon.dimensions().benches() < 3 {
            return Ok(None);
        }
        let goes_on = self.searched_to_m.take() == Some(from_m);
        if goes_on {
            self.resume();
        } else if let Some(contact) = self.begin(from_m) {
            return Ok(Some(contact));
        }
        while self.earlier.travel_m < to_m {
            let reached_m = self.earlier.travel_m;
            let all_collected = if !self.repeats() {
                self.stride(to_m);
                let all_collected = self.collect_pairs();
                if self.reach.is_none() {
                    self.walk.add(&self.dragon, &self.later);
                }
                all_collected
            } else if self.reach.is_none() {
                self.stride_repeating(to_m);
                true
            } else if self.is_clear_from_here() {
                break;
            } else {
                self.stride(to_m);
                self.collect_leading_pairs();
                true
            };
            let touch = self.earliest_touch();
            if !all_collected || self.dragon.meter().is_spent() {
                // The walk has gone over a stride whose pairs are not all searched.
                self.walk.clear();
                self.searched_to_m = Some(reached_m);
                return Err(self.dragon.meter().spent(reached_m));
            }
            if touch.is_some() {
                return Ok(touch);
            }
            self.advance();
        }
        self.searched_to_m = Some(to_m);
        Ok(None)
    }

    /// Places the dragon at the beginning of a search. Returns the contact of a pair that touches there, which ends the search.
    fn begin(&mut self, from_m: f64) -> Option<Contact> {
        self.beginning.clear();
        if from_m == self.clear_to_m {
            self.earlier.place_head(&self.dragon, from_m);
            return None;
        }
        self.place(from_m);
        let nearest = self.near.nearest(&self.earlier.boards)?;
        // The nearest pair has the lowest indices of equal ones. It may be above the clearance by rounding, and another pair not.
        let is_within = nearest.clearance_m <= self.clearance_m;
        let within = is_within.then_some(nearest);
        let within = within.or_else(|| self.near.within(&self.earlier.boards, self.clearance_m).first().copied());
        if let Some(touching) = within {
            return Some(Contact { travel_m: from_m, benches: touching.benches, point: touching.point });
        }
        self.beginning.extend(self.earlier.handles.iter().map(|handle| handle.parameter));
        self.walk.clear();
        self.resume();
        None
    }

    /// Begins the walk at the present pose, unless it has come here.
    fn resume(&mut self) {
        if self.reach.is_none() && self.walk.is_empty() {
            self.earlier.extend_to(&self.dragon, usize::MAX);
            self.walk.add(&self.dragon, &self.earlier);
        }
    }

    /// Finds all beginnings and ends of contacts between two travels, in order, each as exact as the result of
    /// [`first`](Self::first). Travels outside the run are ignored.
    ///
    /// A contact begins where the clearance of a pair falls to the searched clearance, and ends where it rises from there. A
    /// pair that touches already at `from_travel_m` has no beginning in the result. After its first sweep, the search allocates
    /// nothing while no pair is near.
    ///
    /// If the dragon's meter is spent, the sweep ends with the last finished stride, which [`Sweep::reached_m`] reports.
    pub fn sweep(&mut self, from_travel_m: f64, to_travel_m: f64) -> Sweep<'_> {
        self.events.clear();
        let Some((from_m, to_m)) = self.within_run(from_travel_m, to_travel_m) else {
            return Sweep { events: &self.events, reached_m: to_travel_m };
        };
        self.place(from_m);
        while self.earlier.travel_m < to_m {
            self.stride(to_m);
            let begin = self.events.len();
            if !self.collect_pairs() || !self.track_pairs() {
                self.events.truncate(begin);
                self.searched_to_m = None;
                break;
            }
            self.advance();
        }
        let reached_m = if self.earlier.travel_m < to_m { self.earlier.travel_m } else { to_travel_m };
        self.events.sort_unstable_by(PairEvent::order);
        Sweep { events: &self.events, reached_m }
    }

    /// The pose up to which the search has got.
    pub(super) fn last_pose(&self) -> &Pose {
        &self.earlier
    }

    /// Records the events of the collected pairs on a stride. Returns whether the meter's limit allowed it.
    fn track_pairs(&mut self) -> bool {
        let Self { dragon, clearance_m, earlier, later, pairs, events, .. } = self;
        for &benches in &*pairs {
            let _ = PairTracker::track(dragon, benches, *clearance_m, earlier, later, &mut |event| {
                events.push(event);
                ControlFlow::Continue(())
            });
            if dragon.meter().is_spent() {
                return false;
            }
        }
        true
    }

    fn within_run(&self, from_travel_m: f64, to_travel_m: f64) -> Option<(f64, f64)> {
        let from_m = from_travel_m.max(self.dragon.start_travel_m());
        let to_m = to_travel_m.min(self.dragon.end_travel_m());
        (from_m <= to_m).then_some((from_m, to_m))
    }

    /// Places the whole dragon, unless it is already at this travel.
    fn place(&mut self, travel_m: f64) {
        self.searched_to_m = None;
        if !self.earlier.is_at(travel_m) {
            self.earlier.place_head(&self.dragon, travel_m);
        }
        self.earlier.extend_to(&self.dragon, usize::MAX);
    }

    /// Places the head of `later` at the end of the next stride, at most at `to_m`.
    fn stride(&mut self, to_m: f64) {
        let dimensions = self.dragon.dimensions();
        let stride_m = STRIDE_LINKS * dimensions.link_m(0).min(dimensions.link_m(1));
        self.later.place_head(&self.dragon, to_m.min(self.earlier.travel_m + stride_m));
    }

    /// Places the head of `later` at the end of a stride after which the body repeats, or else at most at `to_m`. Collects the pairs of
    /// a leading bench that may touch on it, and places their benches.
    fn stride_repeating(&mut self, to_m: f64) {
        let travel_m = self.walk.stride(&self.dragon, self.clearance_m, to_m, &mut self.pairs);
        if let Some(travel_m) = travel_m {
            self.later.place_head(&self.dragon, travel_m);
        } else {
            self.stride(to_m);
            self.place_later();
            self.walk.walk_to(&self.dragon, &self.later, self.clearance_m, &mut self.pairs);
        }
        let placed = self.pairs.iter().map(|[_, second]| second + 1).max().unwrap_or(0);
        self.earlier.extend_to(&self.dragon, placed);
        self.later.extend_to(&self.dragon, placed);
    }

    /// Places the whole dragon at the end of the stride.
    fn place_later(&mut self) {
        let travel_m = self.later.travel_m;
        self.walked.place(&mut self.later, &self.dragon, travel_m);
    }

    fn advance(&mut self) {
        std::mem::swap(&mut self.earlier, &mut self.later);
    }

    /// Whether each body handle has reached the start position of the handle before it.
    fn repeats(&mut self) -> bool {
        let body = self.earlier.handles.iter().skip(2);
        if body.zip(self.beginning.iter().skip(1)).all(|(handle, &parameter)| handle.parameter >= parameter) {
            self.beginning.clear();
        }
        self.beginning.is_empty()
    }

    /// Whether the first two benches touch no other bench from here on.
    fn is_clear_from_here(&mut self) -> bool {
        self.earlier.extend_to(&self.dragon, 2);
        self.earlier.handles[2].parameter >= self.clear_from
    }

    /// Collects all pairs that may touch on the stride. Returns false if there are too many.
    fn collect_pairs(&mut self) -> bool {
        self.place_later();
        let furthest_m = (0..self.earlier.boards.len()).map(|bench| self.drift_m(bench)).fold(0.0, f64::max);
        let reach_m = self.clearance_m + 2.0 * furthest_m;
        self.pairs.clear();
        let near = self.near.all_within(&self.earlier.boards, reach_m);
        let Self { dragon, clearance_m, earlier, later, pairs, .. } = self;
        let may_touch = |benches: &[usize; 2]| !earlier.keeps_apart(later, dragon, *benches, *clearance_m);
        let has_all = near.map(|near| pairs.extend(near.iter().map(|pair| pair.benches).filter(may_touch))).is_some();
        self.dragon.meter().add(self.near.take_steps());
        has_all
    }

    /// Collects the pairs of a leading bench that may touch on the stride.
    fn collect_leading_pairs(&mut self) {
        self.pairs.clear();
        self.extend_within_reach(Dimensions::LEADING);
        for first in 0..Dimensions::LEADING.min(self.later.boards.len()) {
            let drift_m = self.drift_m(first);
            self.dragon.meter().add(self.later.boards.len() as u64);
            for second in Dimensions::partners(first, self.later.boards.len()) {
                let boards = &self.earlier.boards;
                let (ours, theirs) = (&boards[first], &boards[second]);
                let gap_m = ours.centre.distance(theirs.centre) - ours.radius_m() - theirs.radius_m();
                if gap_m <= self.clearance_m + drift_m + self.drift_m(second) {
                    self.pairs.push([first, second]);
                }
            }
        }
    }

    /// Places benches at both ends of the stride until none of the rest can touch the first `leading` ones.
    fn extend_within_reach(&mut self, leading: usize) {
        let Self { dragon, clearance_m, reach, earlier, later, .. } = self;
        earlier.extend_to(dragon, leading);
        later.extend_to(dragon, leading);
        let limit = reach.and_then(|reach| {
            let Some(front_angle) = reach.coil.angle(later.handles[0].parameter) else {
                let reach_m = |bench| {
                    furthest_m(&earlier.boards[bench], reach.coil.centre) + earlier.drift_m(later, dragon, bench)
                };
                return reach.beyond(*clearance_m + (0..leading).map(reach_m).fold(0.0, f64::max));
            };
            let turns = reach.turns(0, front_angle)?.max(reach.turns(1, front_angle)?);
            let rear_angle = reach.coil.angle(earlier.handles[leading].parameter)?;
            Some(reach.coil.parameter(rear_angle + TAU * turns + 2.0 * reach.overhang_angle(front_angle)))
        });
        later.extend_while(dragon, |_, parameter| limit.is_none_or(|limit| parameter >= limit));
        earlier.extend_to(dragon, later.boards.len());
    }

    fn drift_m(&self, bench: usize) -> f64 {
        self.earlier.drift_m(&self.later, &self.dragon, bench)
    }

    /// The first contact of the collected pairs on the stride.
    fn earliest_touch(&self) -> Option<Contact> {
        let Self { dragon, clearance_m, earlier, later, .. } = self;
        let touch = |&benches: &[usize; 2]| PairTracker::first_touch(dragon, benches, *clearance_m, earlier, later);
        let allowed = |_: &&[usize; 2]| !dragon.meter().is_spent();
        self.pairs.iter().take_while(allowed).filter_map(touch).min_by(Contact::order)
    }
}

/// Distance from a point to the furthest point of a board.
fn furthest_m(board: &Board, from: DVec2) -> f64 {
    board.corners().into_iter().map(|corner| corner.distance(from)).fold(0.0, f64::max)
}

/// Travel before which no two benches come within a clearance, by the bounds of the coil; negative infinity if they prove none.
pub(crate) fn clear_to_m(dragon: &Dragon, clearance_m: f64) -> f64 {
    let clear_to_m = |reach: CoilReach| {
        let start = dragon.route().parameter(dragon.start_travel_m());
        let angle = reach.clear_from(reach.coil.angle(start)?)?;
        Some(dragon.route().travel(reach.coil.parameter(angle)))
    };
    CoilReach::of(dragon, clearance_m).and_then(clear_to_m).unwrap_or(f64::NEG_INFINITY)
}
