//! Finds the delays at which two dragons meet in one zone: by how much the second one leaves after the first one.
//!
//! *Terms.* A point is a pair of own times of both dragons (see `own_time`). At a point of the zone some pair of boards is within
//! the clearance. A plan with a delay d passes the points whose times differ by d, so it meets exactly if one of these is in the
//! zone. The search encloses the set of such delays:
//!
//! 1. *Climb.* From a point of the zone, the clearance of its nearest pair stays within the limit while a board moves by less
//!    than the depth, which is the limit minus the clearance. So the delay changes in proved steps. After each step, the point
//!    slides along its plan to about where the boards are nearest. Where the moving dragon stands, every further delay meets. A climb
//!    ends where it reaches delays that are known.
//! 2. *Cells.* A cell is a rectangle of own times. It needs no look if all of its delays are known to meet. It is free if the
//!    places that the boards of both dragons may take on its sides (see `stride_extent`) are further apart than the limit: this proves
//!    most where dragons walk beside each other. It is free as well if the mean of the clearances at two opposite corners, minus half of
//!    the boards' displacements in between, exceeds the limit. Else it is halved, down to a quarter of a link.
//! 3. *Tubes.* Such a cell is divided into intervals of delays. Let a pair stay apart by the limit plus V·w on the plan with the
//!    middle delay, where w is half of the interval, and V bounds the speeds of both boards. Then it stays apart by the limit at
//!    all delays of the interval, because each of its points is reached from that plan if one of the dragons, or both, move for
//!    w in all. [`PairTracker`] proves the first part. Else the interval is halved, down to [`RESOLUTION_S`]; what is left then
//!    counts as meeting.
//!
//! So outside the result no plan meets. At each of its delays two boards come within the limit, plus at most what they move in
//! twice [`RESOLUTION_S`]: about 2 mm.

use std::sync::Arc;

use super::meeting_zone::Tip;
use super::own_time::{Nearest, NearestBenches, Posed, Walker, met_between, nearest_at, nearest_benches_at};
use super::pair::{Member, Members, Pair};
use super::pair_motion::GRAZE_M;
use super::pair_tracker::PairTracker;
use super::plan_motion::point_speed_mps;
use super::pose::{Pose, drift_m};
use crate::formation::DelaySet;

/// Delays that differ by less are not told apart, in seconds.
pub(super) const RESOLUTION_S: f64 = 1.0 / 4096.0;
/// Shortest proved step of a climb, in seconds. A climb that would take shorter steps ends.
const LEAST_STEP_S: f64 = RESOLUTION_S / 32.0;
/// A climb ends where the delays ahead of it are known over this time, in seconds. An earlier climb has gone on from there. Delays
/// that were given up without a climb are fewer.
const KNOWN_AHEAD_S: f64 = 4.0 * RESOLUTION_S;
/// Share of the step on which a board moves by the depth at its present speed that is tried first.
const FIRST_SHARE: f64 = 0.98;
/// Points that are tried to find the nearest boards along a plan.
const SLIDES: u32 = 10;
/// Distance of these points, in the longest one, at which the search for the nearest boards ends.
const LAST_SLIDE: f64 = 0.125;

/// An interval of own times of one dragon.
#[derive(Clone, Debug)]
pub(super) struct Side {
    /// Own times. An end is infinite if the dragon stands.
    pub(super) span_s: [f64; 2],
    pub(super) ends: [Arc<Posed>; 2],
}

impl Side {
    pub(super) fn stands(&self) -> bool {
        self.span_s[0].is_infinite() || self.span_s[1].is_infinite()
    }

    pub(super) fn halves(&self, walker: &Walker) -> [Self; 2] {
        let middle_s = 0.5 * (self.span_s[0] + self.span_s[1]);
        let middle = walker.end_at(middle_s);
        let [first, last] = self.ends.clone();
        [
            Self { span_s: [self.span_s[0], middle_s], ends: [first, Arc::clone(&middle)] },
            Self { span_s: [middle_s, self.span_s[1]], ends: [middle, last] },
        ]
    }

    fn length_s(&self) -> f64 {
        self.span_s[1] - self.span_s[0]
    }
}

/// A rectangle of own times.
pub(super) type Cell = [Side; 2];

/// Facts about a cell in which boards may be within the clearance.
pub(super) struct Look {
    /// Whether boards are within the clearance at each of two opposite corners.
    pub(super) is_met: [bool; 2],
    /// Displacement of the boards of each dragon.
    drifts_m: [f64; 2],
}

/// Looks at a cell: where are boards within the clearance? `None` if nowhere.
pub(super) fn look(walkers: &[Walker; 2], cell: &Cell, clearance_m: f64) -> Option<Look> {
    let limit_m = clearance_m + GRAZE_M;
    let swept = [0, 1].map(|i| walkers[i].swept(cell[i].ends.each_ref().map(|end| &**end)));
    if !swept[0].comes_within(&swept[1], limit_m) {
        return None;
    }
    let corners = [0, 1].map(|corner| cell.each_ref().map(|side| &*side.ends[corner]));
    let drifts_m = [0, 1].map(|i| walkers[i].drift_m(corners[0][i], corners[1][i]));
    Some(Look { is_met: met_between(corners, drifts_m, limit_m)?, drifts_m })
}

/// The delays of a cell.
fn delays_of(cell: &Cell) -> [f64; 2] {
    delays_between(cell.each_ref().map(|side| side.span_s))
}

/// The delays of two intervals of own times.
fn delays_between([ours, theirs]: [[f64; 2]; 2]) -> [f64; 2] {
    [ours[0] - theirs[1], ours[1] - theirs[0]]
}

/// The side that is to be halved next, of those that are long and on which the dragon walks.
fn longer_side(cell: &Cell, drifts_m: [f64; 2], is_long: impl Fn(usize) -> bool) -> Option<usize> {
    match [0, 1].map(|i| !cell[i].stands() && is_long(i)) {
        [true, true] => Some(usize::from(drifts_m[1] > drifts_m[0])),
        [false, false] => None,
        [is_first, _] => Some(usize::from(!is_first)),
    }
}

/// The work of a search has reached its limit.
pub(super) struct OutOfWork;

/// The search in one zone.
pub(super) struct DelaySearch<'a> {
    walkers: &'a [Walker; 2],
    clearance_m: f64,
    /// Delays that meet, or that are not told apart from such.
    delays: DelaySet,
    /// Points of the least and of the greatest delay that climbs have reached.
    tips: [Option<Tip>; 2],
}

/// A pair of benches, and a bound on the speeds of its boards in a cell.
#[derive(Clone, Copy)]
struct Tube {
    benches: [usize; 2],
    speed_mps: f64,
}

impl<'a> DelaySearch<'a> {
    pub(super) fn new(walkers: &'a [Walker; 2], clearance_m: f64) -> Self {
        Self { walkers, clearance_m, delays: DelaySet::default(), tips: [None, None] }
    }

    /// The delays found, and the points of the least and of the greatest one.
    pub(super) fn finish(mut self) -> (DelaySet, [Option<Tip>; 2]) {
        self.delays.close_gaps(RESOLUTION_S);
        (self.delays, self.tips)
    }

    fn check(&self) -> Result<(), OutOfWork> {
        let is_spent = self.walkers.iter().any(|walker| walker.planned.dragon.meter().is_spent());
        if is_spent { Err(OutOfWork) } else { Ok(()) }
    }

    /// Whether all delays of a cell of these own times are known to meet, so that it needs no look.
    pub(super) fn covers(&self, spans_s: [[f64; 2]; 2]) -> bool {
        self.delays.covers(delays_between(spans_s))
    }

    /// Evaluates a cell of the zone.
    pub(super) fn add(&mut self, cell: &Cell) -> Result<(), OutOfWork> {
        self.check()?;
        if self.covers(cell.each_ref().map(|side| side.span_s)) {
            return Ok(());
        }
        let Some(Look { is_met, drifts_m }) = look(self.walkers, cell, self.clearance_m) else { return Ok(()) };
        if let Some(corner) = is_met.iter().position(|is_met| *is_met) {
            self.climb([0, 1].map(|i| self.time_s(i, cell[i].span_s[corner])))?;
            if self.delays.covers(delays_of(cell)) {
                return Ok(());
            }
        }
        let is_long = |i: usize| cell[i].length_s() > self.walkers[i].stride_s();
        match longer_side(cell, drifts_m, is_long) {
            Some(side) => self.add_halves(cell, side),
            None => self.add_short(cell, drifts_m),
        }
    }

    fn add_halves(&mut self, cell: &Cell, side: usize) -> Result<(), OutOfWork> {
        for half in cell[side].halves(&self.walkers[side]) {
            let mut part = cell.clone();
            part[side] = half;
            self.add(&part)?;
        }
        Ok(())
    }

    /// A finite own time of the same pose.
    fn time_s(&self, i: usize, time_s: f64) -> f64 {
        time_s.clamp(0.0, self.walkers[i].end_s)
    }

    /// Evaluates a cell of at most a stride.
    fn add_short(&mut self, cell: &Cell, drifts_m: [f64; 2]) -> Result<(), OutOfWork> {
        let reach_m = self.clearance_m + drifts_m[0] + drifts_m[1] + GRAZE_M;
        let pairs = cell[0].ends[0].tree.within(&cell[1].ends[0].tree, reach_m);
        let speed_mps = |i: usize, bench: usize| {
            let ends = cell[i].ends.each_ref().map(|end| &end.pose);
            if cell[i].stands() { 0.0 } else { point_speed_mps(&self.walkers[i].planned, bench, ends) }
        };
        let tube =
            |benches: [usize; 2]| Tube { benches, speed_mps: speed_mps(0, benches[0]).max(speed_mps(1, benches[1])) };
        let tubes: Vec<Tube> = pairs.into_iter().map(tube).collect();
        if tubes.iter().any(|tube| !tube.speed_mps.is_finite())
            && let Some(side) = longer_side(cell, drifts_m, |i| cell[i].length_s() > RESOLUTION_S)
        {
            // A tight bend, for which only shorter intervals have a bound.
            return self.add_halves(cell, side);
        }
        match [cell[0].stands(), cell[1].stands()] {
            [false, false] => self.add_tubes(cell, delays_of(cell), &tubes),
            // Two poses, which the corners have shown to be apart.
            [true, true] => Ok(()),
            [is_first, _] => self.add_passage(cell, usize::from(is_first), &tubes),
        }
    }

    /// Evaluates a cell of which the dragon `moving` passes the other one, which stands.
    fn add_passage(&mut self, cell: &Cell, moving: usize, tubes: &[Tube]) -> Result<(), OutOfWork> {
        let [from_s, to_s] = cell[moving].span_s;
        let standing = &cell[1 - moving];
        // A delay at which the other dragon stands throughout: until it leaves, or from its end on.
        let is_before = standing.span_s[0].is_infinite();
        let stands_s = self.walkers[1 - moving].end_s;
        let (delay_s, line_s) = match (moving, is_before) {
            (0, true) => (to_s, [from_s, to_s]),
            (0, false) => (from_s - stands_s, [from_s, to_s]),
            (_, true) => (-to_s, [from_s - to_s, 0.0]),
            (_, false) => (stands_s - from_s, [stands_s, stands_s + to_s - from_s]),
        };
        let mut touches = tubes.iter().filter_map(|tube| self.touch_s(tube, 0.0, delay_s, line_s));
        let Some(touch_s) = touches.next() else { return Ok(()) };
        drop(touches);
        if to_s - from_s <= RESOLUTION_S {
            self.give_up(delays_of(cell), [touch_s, touch_s - delay_s]);
            return Ok(());
        }
        self.climb([touch_s, touch_s - delay_s])?;
        self.add_halves(cell, moving)
    }

    /// Evaluates an interval of delays of a cell, for these pairs.
    fn add_tubes(&mut self, cell: &Cell, [low_s, high_s]: [f64; 2], tubes: &[Tube]) -> Result<(), OutOfWork> {
        self.check()?;
        if tubes.is_empty() || self.delays.covers([low_s, high_s]) {
            return Ok(());
        }
        let delay_s = 0.5 * (low_s + high_s);
        let [ours, theirs] = [cell[0].span_s, cell[1].span_s];
        let from_s = ours[0].max(theirs[0] + delay_s);
        let line_s = [from_s, ours[1].min(theirs[1] + delay_s).max(from_s)];
        let wide = |tube: &&Tube| self.touch_s(tube, 0.5 * (high_s - low_s), delay_s, line_s).is_some();
        let unproved: Vec<Tube> = tubes.iter().filter(wide).copied().collect();
        if unproved.is_empty() {
            return Ok(());
        }
        let touch_s = unproved.iter().find_map(|tube| self.touch_s(tube, 0.0, delay_s, line_s));
        if let Some(touch_s) = touch_s {
            self.climb([touch_s, touch_s - delay_s])?;
        }
        if high_s - low_s <= RESOLUTION_S {
            self.give_up([low_s, high_s], [from_s, from_s - delay_s]);
            return Ok(());
        }
        self.add_tubes(cell, [low_s, delay_s], &unproved)?;
        self.add_tubes(cell, [delay_s, high_s], &unproved)
    }

    /// An own time of the first dragon at which a pair is within the clearance, or may be, of plans whose delays differ by at
    /// most `half_s` from this one.
    fn touch_s(&self, tube: &Tube, half_s: f64, delay_s: f64, [from_s, to_s]: [f64; 2]) -> Option<f64> {
        // Without a bound on the speeds, the product has no value either.
        let allowance_m = if half_s > 0.0 { tube.speed_mps * half_s } else { 0.0 };
        if !allowance_m.is_finite() {
            return Some(from_s);
        }
        let limit_m = self.clearance_m + allowance_m;
        let later = self.walkers[1].planned.leaving_at(delay_s);
        let planned = [&self.walkers[0].planned, &later];
        let member = |i: usize| Member { planned: planned[i], bench: tube.benches[i], walk: &self.walkers[i].walk };
        let pair = Pair { members: Members::TwoDragons([0, 1].map(member)), benches: tube.benches };
        PairTracker::touch_between(pair, limit_m, [pair.solve(from_s), pair.solve(to_s)])
    }

    /// Counts delays as meeting, which is not proved.
    fn give_up(&mut self, delays_s: [f64; 2], times_s: [f64; 2]) {
        self.delays.insert(delays_s);
        let tip = Tip::of(&nearest_at(self.walkers, times_s));
        let finite_s = delays_s.map(f64::is_finite);
        if finite_s[0] && self.tips[0].is_none() {
            self.tips[0] = Some(tip);
        }
        if finite_s[1] && self.tips[1].is_none() {
            self.tips[1] = Some(tip);
        }
    }

    /// Climbs from a point of the zone to greater and to smaller delays, if its own delay is new.
    fn climb(&mut self, times_s: [f64; 2]) -> Result<(), OutOfWork> {
        let delay_s = times_s[0] - times_s[1];
        if self.delays.covers([delay_s - LEAST_STEP_S, delay_s + LEAST_STEP_S]) {
            return Ok(());
        }
        let nearest = self.slide(nearest_benches_at(self.walkers, times_s));
        self.climb_from(nearest, 1.0)?;
        self.climb_from(nearest, -1.0)
    }

    /// Climbs to greater delays, or to smaller ones if `sign` is −1.
    fn climb_from(&mut self, mut here: NearestBenches, sign: f64) -> Result<(), OutOfWork> {
        let end = usize::from(sign > 0.0);
        let mut delay_s = here.nearest.times_s[0] - here.nearest.times_s[1];
        loop {
            self.check()?;
            let Nearest { mut times_s, approach, .. } = here.nearest;
            let depth_m = self.clearance_m - approach.clearance_m;
            if self.stands_at(0, times_s[0], sign) || self.stands_at(1, times_s[1], -sign) {
                self.delays.insert(if end == 1 { [delay_s, f64::INFINITY] } else { [f64::NEG_INFINITY, delay_s] });
                return Ok(());
            }
            let steps_s = [self.step_s(&here, 0, sign, depth_m), self.step_s(&here, 1, -sign, depth_m)];
            let moved = usize::from(steps_s[1].abs() > steps_s[0].abs());
            if steps_s[moved].abs() < LEAST_STEP_S {
                self.note_tip(end, &here.nearest);
                return Ok(());
            }
            times_s[moved] += steps_s[moved];
            let next_s = times_s[0] - times_s[1];
            let ahead_s = next_s + sign * KNOWN_AHEAD_S;
            let is_known = self.delays.covers([next_s.min(ahead_s), next_s.max(ahead_s)]);
            self.delays.insert([delay_s.min(next_s), delay_s.max(next_s)]);
            if is_known {
                return Ok(());
            }
            delay_s = next_s;
            here = self.slide(nearest_benches_at(self.walkers, times_s));
        }
    }

    /// Whether a dragon stands at this time and at all later ones, or at all earlier ones if `sign` is −1.
    fn stands_at(&self, i: usize, time_s: f64, sign: f64) -> bool {
        if sign > 0.0 { time_s >= self.walkers[i].end_s } else { time_s <= 0.0 }
    }

    fn note_tip(&mut self, end: usize, nearest: &Nearest) {
        let tip = Tip::of(nearest);
        let is_further =
            |known: Tip| if end == 1 { tip.delay_s() > known.delay_s() } else { tip.delay_s() < known.delay_s() };
        if self.tips[end].is_none_or(is_further) {
            self.tips[end] = Some(tip);
        }
    }

    /// A step of a dragon's own time on which the board of the nearest pair moves by at most `depth_m`.
    fn step_s(&self, here: &NearestBenches, i: usize, sign: f64, depth_m: f64) -> f64 {
        let walker = &self.walkers[i];
        let (dragon, bench, time_s) = (&walker.planned.dragon, here.nearest.benches[i], here.nearest.times_s[i]);
        if depth_m <= 0.0 {
            return 0.0;
        }
        let stands = &here.poses[i];
        let per_metre = drift_m(dragon, bench, &stands.board, stands.handles().map(|(handle, _)| handle.speed_ratio));
        let mut step_s = FIRST_SHARE * depth_m / (walker.planned.timetable.most_speed_mps() * per_metre.max(1.0));
        for _ in 0..SLIDES {
            let moved_s = (time_s + sign * step_s).clamp(time_s.min(0.0), time_s.max(walker.end_s));
            let moved = Pose::of(dragon, walker.planned.travel_m(moved_s), bench + 1).bench_pose(bench);
            let [earlier, later] = if sign > 0.0 { [stands, &moved] } else { [&moved, stands] };
            let moved_m = drift_m(dragon, bench, &earlier.board, earlier.walks_m(later));
            if moved_m <= depth_m {
                return moved_s - time_s;
            }
            step_s *= 0.9 * depth_m / moved_m;
        }
        0.0
    }

    /// Moves a point along its plan towards the least clearance of its two boards near it.
    fn slide(&self, here: NearestBenches) -> NearestBenches {
        // Steps are short, so that the point stays in its zone.
        let longest_s = self.walkers[0].stride_s().min(self.walkers[1].stride_s());
        let mut step_s = 0.5 * longest_s;
        let (mut shift_s, mut least_m) = (0.0, here.nearest.approach.clearance_m);
        for _ in 0..SLIDES {
            if step_s.abs() < LAST_SLIDE * longest_s {
                break;
            }
            let trial_m = here.clearance_near_m(self.walkers, shift_s + step_s);
            if trial_m < least_m {
                (shift_s, least_m) = (shift_s + step_s, trial_m);
                step_s = (1.5 * step_s).clamp(-longest_s, longest_s);
            } else {
                step_s *= -0.6;
            }
        }
        if shift_s == 0.0 {
            return here;
        }
        let there = nearest_benches_at(self.walkers, here.nearest.times_s.map(|time_s| time_s + shift_s));
        if there.nearest.approach.clearance_m < here.nearest.approach.clearance_m { there } else { here }
    }
}
