//! Construction of a profile: walks along the route from t = 0, both ways, and fits piece after piece.

use std::ops::ControlFlow;

use glam::DVec2;

use super::piece::{Interpolation, ORDER, Piece, derivative_bounds, value_and_slope};
use super::{End, FIT_M, Profile, ProfileEnd};
use crate::ground::{Cell, Ground, MAX_SLOPE};
use crate::numerics::turning_point;
use crate::route::Route;

/// Longest part of the route that is fitted as a whole, in metres of the plan.
const STRIDE_M: f64 = 4.0;
/// Shortest piece, in metres of the plan. A shorter part belongs to the piece before, or else to the one behind, if that is on the
/// same segment: the surface has bounded second derivatives, so its height is off by about 10⁻¹¹ m at most. The rounding of heights
/// would give it no good slope.
const LEAST_M: f64 = 1e-5;
/// The ends of a part at which its fit and its cell are checked, from −1 to 1: an end itself may belong to the next cell.
const JUST_INSIDE: f64 = 1.0 - 1e-6;
/// Shortest part that is divided to find where the ground becomes too steep, in units of the parameter.
const STEEP: f64 = 1e-3;
/// Share by which the steepest slope may be exceeded: rounding.
const SLOPE_ROUNDING: f64 = 1e-9;
/// Distance of t = 0 from a seam, in roundings of the plan, within which it is at the seam.
const SEAM_ROUNDINGS: f64 = 16.0;
/// Greatest number of pieces: some hundred megabytes.
const MAX_PIECES: usize = 1_000_000;

/// The part of a route that a dragon may walk.
#[derive(Clone, Copy, Debug)]
pub(in crate::route) struct Walk {
    /// Travel in space at which the rearmost handle may stand.
    pub(in crate::route) from_m: f64,
    /// Travel in space at which the head's walk ends; infinite if it ends with the curve.
    pub(in crate::route) to_m: f64,
}

/// The profile of a route in the plan; `None` if it has too many pieces. An end at t = 0 means that there is no profile.
pub(in crate::route) fn build(route: &Route, ground: &Ground, walk: Walk) -> Option<Result<Profile, ProfileEnd>> {
    let begin = at_seam(route, route.plan_parameter(0.0));
    let [forward, backward] = [true, false].map(|is_forward| {
        let mut fitter = Fitter::new(route, ground, begin, is_forward);
        fitter.walk(if is_forward { walk.to_m } else { walk.from_m }).map(|reason| (fitter.fitted, reason))
    });
    let ((ahead, end), (behind, beginning)) = (forward?, backward?);
    if ahead.is_empty() {
        return Some(Err(end));
    }
    let all: Vec<Fitted> = behind.into_iter().rev().chain(ahead).collect();
    (all.len() <= MAX_PIECES).then(|| Ok(assembled(route, &all, [beginning, end])))
}

/// A parameter, or the seam from which it differs by rounding: a piece between the two would have no good slope.
fn at_seam(route: &Route, parameter: f64) -> f64 {
    let rounding = SEAM_ROUNDINGS * route.plan_rounding_m(parameter) / route.plan_point(parameter).speed_m_per_unit;
    route.seams().iter().copied().find(|seam| (seam - parameter).abs() <= rounding).unwrap_or(parameter)
}

fn assembled(route: &Route, fitted: &[Fitted], [beginning, end]: [ProfileEnd; 2]) -> Profile {
    let end_at = |fitted: &Fitted, parameter: f64, reason| {
        let ([height_m, growth], plan) = (fitted.piece.height(parameter), route.plan_point(parameter));
        let grade = (growth / plan.speed_m_per_unit).clamp(-MAX_SLOPE, MAX_SLOPE);
        let (travel_m, plan_m) = (fitted.piece.travel_m(parameter), route.plan_travel(parameter));
        End { parameter, travel_m, plan_m, height_m, grade, reason }
    };
    let (first, last) = (&fitted[0], &fitted[fitted.len() - 1]);
    let ends = [end_at(first, first.begin, beginning), end_at(last, last.end, end)];
    let highest_m = fitted.iter().map(|fitted| fitted.piece.heights[0].abs()).fold(0.0, f64::max);
    let mut cells: Vec<Cell> = fitted.iter().map(|fitted| fitted.cell).collect();
    cells.sort_unstable();
    cells.dedup();
    Profile {
        pieces: fitted.iter().map(|fitted| fitted.piece).collect(),
        begins: fitted.iter().map(|fitted| fitted.begin).collect(),
        begins_m: fitted.iter().map(|fitted| fitted.piece.travel_m(fitted.begin)).collect(),
        curvatures: fitted.iter().map(|fitted| fitted.curvature).collect(),
        steepest: fitted.iter().map(|fitted| fitted.length_per_plan).fold(1.0, f64::max),
        rounding_m: FIT_M + 4.0 * f64::EPSILON * highest_m,
        ends,
        cells,
    }
}

/// A fitted part of the route.
#[derive(Clone, Copy, Debug)]
struct Fitted {
    begin: f64,
    end: f64,
    piece: Piece,
    /// Bound on the curvature in space.
    curvature: f64,
    /// Bound on the arc in space per metre of the plan.
    length_per_plan: f64,
    cell: Cell,
}

/// How well a polynomial fits, at the points of the check.
struct Fit {
    /// Whether heights and speeds are exact to [`FIT_M`], or to their rounding.
    is_exact: bool,
    /// Largest slope, in metres per metre of the plan.
    slope: f64,
}

/// The plan at a point of a check.
#[derive(Clone, Copy, Debug)]
struct Look {
    /// Distance from the middle of the part, in units of the parameter.
    from_middle: f64,
    position: DVec2,
    /// Metres of the plan per unit of the parameter.
    speed: f64,
}

/// Fits pieces one after the other, in one direction.
struct Fitter<'a> {
    route: &'a Route,
    ground: &'a Ground,
    is_forward: bool,
    interpolation: Interpolation,
    /// The nodes of the interpolation, the points between them, and the ends, at which a fit is checked, from −1 to 1.
    checks: Vec<f64>,
    /// The indices of the nodes among them.
    nodes: [usize; ORDER],
    /// The plan at each of them, on the present part.
    looks: Vec<Look>,
    fitted: Vec<Fitted>,
    /// Parameter and travel in space up to where the pieces reach.
    reached: f64,
    travel_m: f64,
    /// Whether no piece is on the present segment yet.
    is_fresh: bool,
    /// Parameter at which a part before the next piece begins that is too short for a piece of its own.
    left: Option<f64>,
}

impl<'a> Fitter<'a> {
    fn new(route: &'a Route, ground: &'a Ground, begin: f64, is_forward: bool) -> Self {
        let interpolation = Interpolation::new();
        let between = interpolation.nodes.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
        let ends = [-JUST_INSIDE, JUST_INSIDE];
        let mut checks: Vec<f64> = interpolation.nodes.into_iter().chain(between).chain(ends).collect();
        checks.sort_unstable_by(f64::total_cmp);
        let nodes = interpolation.nodes.map(|node| checks.partition_point(|&check| check < node));
        Self {
            route,
            ground,
            is_forward,
            interpolation,
            checks,
            nodes,
            looks: Vec::new(),
            fitted: Vec::new(),
            reached: begin,
            travel_m: 0.0,
            is_fresh: true,
            left: None,
        }
    }

    /// Fits the route up to a travel in space, or to the end of the curve. Returns why it ends there; `None` if there are too
    /// many pieces.
    fn walk(&mut self, to_m: f64) -> Option<ProfileEnd> {
        let mut at = self.reached;
        let stride_m = if self.is_forward { STRIDE_M } else { -STRIDE_M };
        while self.fitted.len() <= MAX_PIECES {
            let is_done = if self.is_forward { self.travel_m >= to_m } else { self.travel_m <= to_m };
            let next = self.route.plan_stride(at, stride_m);
            if next == at || is_done && !self.fitted.is_empty() {
                return Some(ProfileEnd::Enough);
            }
            self.is_fresh |= self.route.seams().contains(&at);
            if let ControlFlow::Break(reason) = self.fit(at.min(next), at.max(next)) {
                return Some(reason);
            }
            at = next;
        }
        None
    }

    /// Fits a part of one segment. Breaks where the profile ends.
    fn fit(&mut self, begin: f64, end: f64) -> ControlFlow<ProfileEnd> {
        let (middle, half) = (0.5 * (begin + end), 0.5 * (end - begin));
        let least = LEAST_M / self.route.plan_point(middle).speed_m_per_unit;
        let is_short = end - begin <= least;
        if is_short && !self.is_fresh {
            self.extend_last(begin, end);
            return ControlFlow::Continue(());
        }
        if is_short && !self.is_last_of_segment(begin, end) {
            self.left.get_or_insert(if self.is_forward { begin } else { end });
            return ControlFlow::Continue(());
        }
        self.look(middle, half);
        let cells: Vec<Option<Cell>> = self.looks.iter().map(|look| self.ground.cell(look.position)).collect();
        if let Some(k) = (1..cells.len()).find(|&k| !is_short && cells[k] != cells[k - 1]) {
            let ends = [k - 1, k].map(|k| middle + half * self.checks[k]);
            let cell_at = |parameter: f64| self.ground.cell(self.route.plan_point(parameter).position);
            let cut = turning_point(ends[0], ends[1], 0.0, |parameter| cell_at(parameter) != cells[k - 1]).1;
            return self.fit_both(begin, cut, end);
        }
        let Some(cell) = cells[0] else { return ControlFlow::Break(ProfileEnd::NoHeight) };
        let (part, fit) = self.fit_over(begin, end, cell);
        let is_steep = fit.slope > MAX_SLOPE * (1.0 + SLOPE_ROUNDING);
        if !is_steep && (fit.is_exact || end - begin <= 2.0 * least) {
            self.add(part);
            return ControlFlow::Continue(());
        }
        if is_steep && end - begin <= STEEP {
            return ControlFlow::Break(ProfileEnd::TooSteep);
        }
        self.fit_both(begin, middle, end)
    }

    /// Whether a part of a segment ends with the segment, in the direction of the walk.
    fn is_last_of_segment(&self, begin: f64, end: f64) -> bool {
        let (far, stride_m) = if self.is_forward { (end, STRIDE_M) } else { (begin, -STRIDE_M) };
        self.route.seams().contains(&far) || self.route.plan_stride(far, stride_m) == far
    }

    /// Looks at the plan at the points of the check of a part.
    fn look(&mut self, middle: f64, half: f64) {
        let route = self.route;
        self.looks.clear();
        self.looks.extend(self.checks.iter().map(|check| {
            let (from_middle, point) = (half * check, route.plan_point(middle + half * check));
            Look { from_middle, position: point.position, speed: point.speed_m_per_unit }
        }));
    }

    /// Fits a piece over one cell to the part of a segment that was looked at.
    fn fit_over(&self, begin: f64, end: f64, cell: Cell) -> (Fitted, Fit) {
        let (anchor, half) = (0.5 * (begin + end), 0.5 * (end - begin));
        let patch = self.ground.patch(cell);
        let relief_m = patch.relief_m(self.route.plan_point(anchor).position);
        let rounding_m = self.route.plan_rounding_m(anchor) + 2.0 * f64::EPSILON * relief_m.abs();
        let nodes = self.nodes.map(|node| self.looks[node]);
        let reliefs_m = nodes.map(|look| patch.relief_m(look.position));
        let mut heights = self.interpolation.polynomial(&reliefs_m, half, rounding_m);
        let speed = |look: &Look| look.speed.hypot(value_and_slope(&heights, look.from_middle)[1]);
        let speeds = self.interpolation.polynomial(&nodes.map(|look| speed(&look)), half, f64::EPSILON);
        let (mut off, mut slowest) = ([0.0; 2], f64::INFINITY);
        let mut fitting = Fit { is_exact: true, slope: 0.0 };
        for look in &self.looks {
            let [height_m, slope] = value_and_slope(&heights, look.from_middle);
            let off_m = (height_m - patch.relief_m(look.position)).abs();
            let off_speed = (value_and_slope(&speeds, look.from_middle)[0] / look.speed.hypot(slope) - 1.0).abs();
            off = [off_m.max(off[0]), off_speed.max(off[1])];
            fitting.slope = fitting.slope.max(slope.abs() / look.speed);
            slowest = slowest.min(look.speed);
        }
        // Rounding of heights tilts a short piece.
        let tilt = 64.0 * rounding_m / (half * slowest);
        fitting.is_exact = off[0] <= FIT_M.max(4.0 * rounding_m) && off[1] <= FIT_M + tilt;
        let bounds = derivative_bounds(&heights, half);
        let curvature = self.route.plan_curvature_bound(begin, end).hypot(self.bend(bounds, anchor, slowest));
        heights[0] += patch.base_m;
        let length_per_plan = (bounds[0] / slowest).hypot(1.0);
        let piece = Piece { anchor, heights, speeds, travel_m: 0.0 };
        (Fitted { begin, end, piece, curvature, length_per_plan, cell }, fitting)
    }

    /// A bound on the second derivative of the height over the arc of the plan, from bounds on its derivatives over the
    /// parameter. With the speed v of the plan it is z″/v² − z'·v'/v³.
    fn bend(&self, [first, second]: [f64; 2], anchor: f64, slowest: f64) -> f64 {
        second / slowest.powi(2) + first * self.route.plan_acceleration_bound(anchor) / slowest.powi(3)
    }

    /// Extends the last piece over a part that is too short for a piece of its own.
    fn extend_last(&mut self, begin: f64, end: f64) {
        let last = self.fitted.last_mut().expect("a piece is on the present segment");
        (last.begin, last.end) = (last.begin.min(begin), last.end.max(end));
        self.reached = if self.is_forward { end } else { begin };
        self.travel_m = last.piece.travel_m(self.reached);
    }

    /// Adds a part at the present end.
    fn add(&mut self, mut part: Fitted) {
        if let Some(left) = self.left.take() {
            (part.begin, part.end) = (part.begin.min(left), part.end.max(left));
        }
        let (near, far) = if self.is_forward { (part.begin, part.end) } else { (part.end, part.begin) };
        part.piece.travel_m = self.travel_m - part.piece.arc_m(near);
        (self.reached, self.is_fresh) = (far, false);
        self.travel_m = part.piece.travel_m(far);
        self.fitted.push(part);
    }

    /// Fits the two parts of an interval, the nearer one first.
    fn fit_both(&mut self, begin: f64, cut: f64, end: f64) -> ControlFlow<ProfileEnd> {
        if self.is_forward {
            self.fit(begin, cut)?;
            self.fit(cut, end)
        } else {
            self.fit(cut, end)?;
            self.fit(begin, cut)
        }
    }
}
