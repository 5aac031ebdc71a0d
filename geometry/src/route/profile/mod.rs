//! Profiles: the heights along a route, and the arc of the curve that they lift into space.
//!
//! A profile is a table of pieces. Each lies over one segment and one cell of the ground, and has height and speed as
//! polynomials of the route's parameter, fitted to [`FIT_M`]. So nothing that walks needs the ground. A profile reaches over
//! the part of the route that a dragon may walk. It ends earlier where the ground has no height or is too steep. Beyond its
//! ends the curve goes on at a constant grade, and no handle may walk there.
//!
//! *Curvature.* Let the plan of a curve have the curvature κ, and let its height be z(s), where s is the arc of the plan. With
//! q = 1 + z'², the curvature in space is √(κ²/q² + z″²/q³), at most √(κ² + z″²). Bounds on z″ follow from the coefficients.

mod builder;
mod piece;

use std::fmt::{self, Debug, Formatter};

use crate::ground::Cell;

pub(super) use builder::{Walk, build};
pub(crate) use piece::{ORDER, Piece};

/// Largest error of a height of a piece, in metres, and of its speed, in metres per metre.
const FIT_M: f64 = 2e-13;
/// Bound on steps of Newton's method for the parameter of a travel.
const MAX_STEPS: usize = 32;
/// Number of samples on each piece.
const SAMPLES: u32 = 8;
/// Half of the length of a piece beyond the ends, in metres of the plan.
const PIECE_BEYOND_M: f64 = 0.25;

/// Reason why a profile ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ProfileEnd {
    /// No dragon walks further.
    Enough,
    /// The ground has no height.
    NoHeight,
    /// The ground is steeper along the route than [`MAX_SLOPE`](crate::ground::MAX_SLOPE).
    TooSteep,
}

/// One end of a profile.
#[derive(Clone, Copy, Debug, PartialEq)]
struct End {
    parameter: f64,
    /// Travel in space, in metres.
    travel_m: f64,
    /// Travel in the plan, in metres.
    plan_m: f64,
    height_m: f64,
    /// Growth of the height per metre of the plan.
    grade: f64,
    reason: ProfileEnd,
}

/// The heights along a route.
#[derive(Clone, PartialEq)]
pub(crate) struct Profile {
    /// In walking order; at least one.
    pieces: Vec<Piece>,
    /// Parameters and travels at which the pieces begin.
    begins: Vec<f64>,
    begins_m: Vec<f64>,
    /// Bounds on the curvature in space of the pieces, in 1/m.
    curvatures: Vec<f64>,
    ends: [End; 2],
    /// Greatest arc in space per metre of the plan.
    steepest: f64,
    /// Rounding of heights and error of the fit, in metres.
    rounding_m: f64,
    /// Cells of the ground under the pieces, in order, without repetition.
    cells: Vec<Cell>,
}

impl Profile {
    /// Height at a parameter in metres, and its growth per metre of the plan. `plan` gives the travel in the plan, `speed` is
    /// the speed of the plan.
    pub(super) fn height(&self, parameter: f64, plan: impl FnOnce() -> f64, speed: f64) -> [f64; 2] {
        if let Some(end) = self.beyond(parameter) {
            return [end.height_m + end.grade * (plan() - end.plan_m), end.grade];
        }
        let [height_m, growth] = self.piece_at(parameter).height(parameter);
        [height_m, growth / speed]
    }

    /// Travel in space at a parameter.
    pub(super) fn travel_m(&self, parameter: f64, plan: impl FnOnce() -> f64) -> f64 {
        match self.beyond(parameter) {
            Some(end) => end.travel_m + end.length_per_plan() * (plan() - end.plan_m),
            None => self.piece_at(parameter).travel_m(parameter),
        }
    }

    /// The parameter at a travel in space. `of_plan` gives the parameter at a travel in the plan.
    pub(super) fn parameter(&self, travel_m: f64, of_plan: impl FnOnce(f64) -> f64) -> f64 {
        let [first, last] = &self.ends;
        let beyond = if travel_m < first.travel_m { Some(first) } else { (travel_m > last.travel_m).then_some(last) };
        if let Some(end) = beyond {
            return of_plan(end.plan_m + (travel_m - end.travel_m) / end.length_per_plan());
        }
        let number = self.begins_m.partition_point(|&begin_m| begin_m <= travel_m).max(1) - 1;
        self.parameter_on(number, travel_m)
    }

    /// The parameter at a travel on the piece of this number, by Newton's method: the arc grows steadily and almost evenly.
    fn parameter_on(&self, number: usize, travel_m: f64) -> f64 {
        let piece = &self.pieces[number];
        let (low, high) = (self.begins[number], self.end_of(number));
        let mut parameter = piece.anchor;
        for _ in 0..MAX_STEPS {
            let next = parameter + (travel_m - piece.travel_m(parameter)) / piece.speed(parameter);
            let next = next.clamp(low, high);
            let is_last = (next - parameter).abs() <= 2.0 * f64::EPSILON * parameter.abs();
            parameter = next;
            if is_last {
                break;
            }
        }
        parameter
    }

    /// A bound on the curvature in space from one parameter to a later one; `plan` gives the bound in the plan.
    pub(super) fn curvature_bound(&self, rear: f64, front: f64, plan: impl FnOnce() -> f64) -> f64 {
        let [first, last] = &self.ends;
        let outside = if rear < first.parameter || front > last.parameter { plan() } else { 0.0 };
        if front < first.parameter || rear > last.parameter {
            return outside;
        }
        let (from, to) = (self.number_of_begin(rear), self.number_at(front));
        let from = from.min(to);
        self.curvatures[from..=to].iter().copied().fold(outside, f64::max)
    }

    /// Parameters from one to a later one, a few on each piece.
    pub(super) fn samples(&self, from: f64, to: f64) -> impl Iterator<Item = f64> {
        let (first, last) = (self.number_of_begin(from), self.number_at(to));
        let on_piece = move |number: usize| {
            let (begin, end) = (self.begins[number].max(from), self.end_of(number).min(to));
            (0..SAMPLES).map(move |k| begin + (end - begin) * f64::from(k) / f64::from(SAMPLES))
        };
        (first..=last).flat_map(on_piece).chain([to])
    }

    /// Greatest arc in space per metre of the plan.
    pub(super) fn steepest(&self) -> f64 {
        self.steepest
    }

    /// Rounding of heights, in metres.
    pub(super) fn rounding_m(&self) -> f64 {
        self.rounding_m
    }

    /// Parameters of both ends, and why the profile ends there.
    pub(super) fn ends(&self) -> [(f64, ProfileEnd); 2] {
        self.ends.map(|end| (end.parameter, end.reason))
    }

    /// Number of pieces.
    pub(super) fn pieces(&self) -> usize {
        self.pieces.len()
    }

    /// Cells of the ground under the profile.
    pub(super) fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// The parameters at which the pieces begin, and at which the last one ends.
    pub(super) fn cuts(&self) -> impl Iterator<Item = f64> {
        self.begins.iter().copied().chain([self.ends[1].parameter])
    }

    /// The index of the piece at a parameter, the parameter at which it begins, and its anchor. Beyond the ends: of the nearest
    /// piece.
    pub(super) fn place(&self, parameter: f64) -> (usize, f64, f64) {
        let number = self.number_at(parameter);
        (number, self.begins[number], self.pieces[number].anchor)
    }

    /// The piece at a parameter, or that which begins there, and the parameters at which it begins and ends; `None` beyond the
    /// ends.
    pub(super) fn piece(&self, parameter: f64) -> Option<(Piece, [f64; 2])> {
        let number = self.number_of_begin(parameter);
        self.beyond(parameter).is_none().then(|| (self.pieces[number], [self.begins[number], self.end_of(number)]))
    }

    /// The curve beyond an end as a piece about a parameter, and the parameters between which it is exact enough for benches
    /// that only fill a vector. `plan` gives travel and speed in the plan at a parameter.
    pub(super) fn piece_beyond(&self, parameter: f64, plan: impl Fn(f64) -> [f64; 2]) -> (Piece, [f64; 2]) {
        let [first, last] = &self.ends;
        let [plan_m, speed] = plan(parameter);
        let half = PIECE_BEYOND_M / speed;
        let (end, ends) = if parameter < first.parameter {
            (first, [parameter - half, first.parameter.min(parameter + half)])
        } else {
            (last, [last.parameter.max(parameter - half), parameter + half])
        };
        let mut piece = Piece { anchor: parameter, heights: [0.0; ORDER], speeds: [0.0; ORDER], travel_m: 0.0 };
        piece.heights[0] = end.height_m + end.grade * (plan_m - end.plan_m);
        piece.heights[1] = end.grade * speed;
        (piece, ends)
    }

    /// The end beyond which a parameter is.
    fn beyond(&self, parameter: f64) -> Option<&End> {
        let [first, last] = &self.ends;
        if parameter < first.parameter { Some(first) } else { (parameter > last.parameter).then_some(last) }
    }

    fn piece_at(&self, parameter: f64) -> &Piece {
        &self.pieces[self.number_at(parameter)]
    }

    /// The index of the piece at a parameter. Between two pieces: the one before, as the route takes the segment before a seam.
    fn number_at(&self, parameter: f64) -> usize {
        self.begins.partition_point(|&begin| begin < parameter).max(1) - 1
    }

    /// The same, except between two pieces: the one behind.
    fn number_of_begin(&self, parameter: f64) -> usize {
        self.begins.partition_point(|&begin| begin <= parameter).max(1) - 1
    }

    fn end_of(&self, number: usize) -> f64 {
        self.begins.get(number + 1).copied().unwrap_or(self.ends[1].parameter)
    }
}

impl Debug for Profile {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        let pieces = self.pieces.len();
        formatter.debug_struct("Profile").field("pieces", &pieces).field("ends", &self.ends).finish_non_exhaustive()
    }
}

impl End {
    /// Arc in space per metre of the plan, beyond the end.
    fn length_per_plan(&self) -> f64 {
        self.grade.hypot(1.0)
    }
}
