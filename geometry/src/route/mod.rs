//! Routes: the curves that the handles of a dragon follow.
//!
//! A [`Route`] is a list of [`Segment`]s in walking order: lines, arcs and spirals. Each segment begins at the end of the one
//! before, with the same tangent. *Travel* is signed arc length in metres, 0 where t = 0. A *parameter* identifies a point of
//! the route. It grows in walking direction, by 1 per metre on a line or an arc, and by 1 per radian on a spiral. A *seam* is
//! the parameter at which one segment ends and the next begins. Angles are counter-clockwise from +x, with x to the right and y
//! away.

mod arc;
mod capability;
mod coil;
mod crossing;
mod error;
mod family;
mod kernel;
mod kinds;
mod lifted_variation;
mod line;
mod on_ground;
mod path;
mod path_error;
mod path_segment;
mod placement;
mod profile;
mod segment;
mod segment_part;
mod spec;
mod spiral;
mod spiral_chord;
mod turnaround;

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DVec2, DVec3};

pub use arc::{CircularArc, Turn};
pub use coil::{Coil, WayOut};
pub use crossing::{Crossing, Crossings};
pub use error::{RADIUS_RATIO, RouteError};
pub use family::{RouteFamily, RouteMeasure, RouteVariation};
pub use line::Line;
pub use on_ground::{GroundGap, RouteHeights};
pub use path::PathSpec;
pub use path_error::PathError;
pub use path_segment::{PathSegment, SEGMENT_M};
pub use placement::Placement;
pub use segment::Segment;
pub use segment_part::TightestBend;
pub use spec::{RouteShape, RouteSpec, SpiralSpec, TurnaroundSpec};
pub use spiral::Spiral;
pub(crate) use spiral::SpiralPart;
pub use turnaround::Turnaround;

pub(crate) use capability::{CHORD_BEND, CHORD_MARGIN};
pub(crate) use kernel::{Kernel, PlanPiece};
pub(crate) use profile::{ORDER, Piece};

use capability::ArcLength;
use on_ground::lifted;
use profile::Profile;
use segment::PlacedSegment;

use crate::numerics::Interval;

/// Largest gap between two segments at a seam, relative to 1 m plus the seam's distance from the origin. Also the largest
/// difference of their unit tangents.
const SEAM_TOLERANCE: f64 = 1e-9;

/// The route at one parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoutePoint {
    /// Position in the plan, in metres.
    pub position: DVec2,
    /// The part in the plan of the unit vector in walking direction; the whole of it on level ground.
    pub tangent: DVec2,
    /// Metres of arc per unit of the parameter. Above 0, except possibly at the end of the curve.
    pub speed_m_per_unit: f64,
    /// Height in metres; 0 without ground.
    pub height_m: f64,
    /// The upward part of the unit vector in walking direction; 0 on level ground.
    pub climb: f64,
}

impl RoutePoint {
    /// Position in space, in metres.
    pub(crate) fn in_space(&self) -> DVec3 {
        self.position.extend(self.height_m)
    }

    /// A point of a curve in the plan.
    pub(crate) fn level(position: DVec2, tangent: DVec2, speed_m_per_unit: f64) -> Self {
        Self { position, tangent, speed_m_per_unit, height_m: 0.0, climb: 0.0 }
    }
}

/// A continuously differentiable curve with a walking direction, made of segments.
///
/// The first segment has no beginning, so a whole dragon can stand behind the start. Every method is a pure function, accepts
/// any parameter of the curve, and does not allocate.
///
/// ```
/// use bench_dragon_geometry::route::Route;
///
/// let spiral = Route::spiral(0.55, 16.0)?;
/// let start = spiral.point(spiral.parameter(0.0));
/// assert!((start.position.x - 8.8).abs() < 1e-12 && start.tangent.y < -0.99);
/// # Ok::<(), bench_dragon_geometry::route::RouteError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Route {
    segments: Vec<PlacedSegment>,
    seams: Vec<f64>,
    /// The first seam; infinite for a route of one segment.
    first_seam: f64,
    coil: Option<Coil>,
    /// Whether searches use the bounds of spirals.
    has_spiral_bounds: bool,
    start_travel_m: f64,
    end_travel_m: f64,
    /// Parameter behind which no handle may stand.
    standing_begin: f64,
    /// The heights along the route; `None` without ground.
    profile: Option<Arc<Profile>>,
}

impl Route {
    /// The route of these segments, walked between two travels. `first_end_m` is the travel at the end of the first segment.
    ///
    /// ```
    /// use bench_dragon_geometry::route::{CircularArc, Line, Route, Segment, Turn};
    /// use glam::DVec2;
    ///
    /// let line = Line::up_to(DVec2::ZERO, DVec2::X);
    /// let arc = CircularArc::from_begin(DVec2::ZERO, DVec2::X, 2.0, 1.0, Turn::CounterClockwise);
    /// let bend = Route::new(&[Segment::Line(line), Segment::Arc(arc)], 0.0, [-1.0, 2.0])?;
    /// assert_eq!((bend.travel(bend.seams()[0]), bend.point(bend.parameter(-1.0)).position), (0.0, -DVec2::X));
    /// # Ok::<(), bench_dragon_geometry::route::RouteError>(())
    /// ```
    ///
    /// # Errors
    /// The first segment must have no beginning, all others must have one. Each segment must begin at the end of the one
    /// before, with the same tangent. The route must start before it ends, and end on its last segment.
    ///
    /// # Panics
    /// Panics without a segment.
    pub fn new(
        segments: &[Segment],
        first_end_m: f64,
        [start_travel_m, end_travel_m]: [f64; 2],
    ) -> Result<Self, RouteError> {
        let segments = joined(segments, first_end_m)?;
        let route = Self {
            seams: segments[1..].iter().map(|placed| placed.begin).collect(),
            first_seam: segments.get(1).map_or(f64::INFINITY, |placed| placed.begin),
            coil: Coil::of(&segments),
            has_spiral_bounds: true,
            start_travel_m,
            end_travel_m,
            standing_begin: f64::NEG_INFINITY,
            profile: None,
            segments,
        };
        route.between(start_travel_m, end_travel_m)
    }

    /// The spiral r = b·θ with pitch 2π·b about the origin, walked clockwise from θ = 2π·`start_turns` into the centre. t = 0
    /// is at the start, which lies on +x if `start_turns` is whole. The parameter is −θ.
    ///
    /// # Errors
    /// The pitch must be above 0 and at most 1000 m; the turns must be above 0 and at most 10 000.
    pub fn spiral(pitch_m: f64, start_turns: f64) -> Result<Self, RouteError> {
        RouteError::check_pitch(pitch_m)?;
        RouteError::check_start_turns(start_turns)?;
        let spiral = Spiral::new(pitch_m, f64::INFINITY, 0.0);
        let length_m = -spiral.arc_m(-TAU * start_turns);
        Self::new(&[Segment::Spiral(spiral)], length_m, [0.0, length_m])
    }

    /// The same curve, walked between two other travels.
    ///
    /// # Errors
    /// Both travels must be finite, the start must be before the end, and the end must lie on the curve.
    pub fn between(self, start_travel_m: f64, end_travel_m: f64) -> Result<Self, RouteError> {
        RouteError::check_span(start_travel_m, end_travel_m)?;
        let curve_end_m = self.curve_end_m();
        if end_travel_m > curve_end_m + SEAM_TOLERANCE * (1.0 + curve_end_m.abs()) {
            return Err(RouteError::End { end_travel_m, curve_end_m });
        }
        Ok(Self { start_travel_m, end_travel_m, ..self })
    }

    /// The same route, on which no handle may stand behind this travel.
    #[must_use]
    pub(crate) fn standing_from(self, travel_m: f64) -> Self {
        Self { standing_begin: self.parameter(travel_m), ..self }
    }

    /// Parameter behind which no handle may stand: the first of the laps of a closed path. −∞ for other routes.
    pub(crate) fn standing_begin(&self) -> f64 {
        self.standing_begin
    }

    /// The same route, somewhere else.
    #[must_use]
    pub fn placed(self, placement: &Placement) -> Self {
        if placement.is_identity() {
            return self;
        }
        let segments: Vec<Segment> = self.segments.iter().map(|placed| placed.segment.placed(placement)).collect();
        let first_end_m = self.segments[0].travel(self.segments[0].end());
        let placed = Self::new(&segments, first_end_m, [self.start_travel_m, self.end_travel_m]);
        Self { standing_begin: self.standing_begin, ..placed.expect("placed segments still join") }
    }

    /// The same curve without its [`coil`](Self::coil) and the bounds on motion along spirals. Tests compare the proofs that use
    /// these with searches on this route.
    #[must_use]
    pub fn without_spiral_bounds(self) -> Self {
        Self { coil: None, has_spiral_bounds: false, ..self }
    }

    /// Travel at which the run begins, in metres. It is 0, or negative if the start lies before t = 0.
    pub fn start_travel_m(&self) -> f64 {
        self.start_travel_m
    }

    /// Travel at which the route ends, in metres.
    pub fn end_travel_m(&self) -> f64 {
        self.end_travel_m
    }

    /// The smallest pitch of the route's spirals with more than one turn, in metres; infinite for a route without one.
    pub fn pitch_m(&self) -> f64 {
        let pitches_m = self.segments.iter().filter_map(|placed| placed.segment.curve().pitch_m());
        pitches_m.fold(f64::INFINITY, f64::min)
    }

    /// The parameters of the seams, in walking order: one fewer than the segments. The curvature jumps there.
    pub fn seams(&self) -> &[f64] {
        &self.seams
    }

    /// The rear part of the route, if it is an inward spiral on level ground. Bounds rule out contacts there without a search.
    pub fn coil(&self) -> Option<Coil> {
        self.coil.filter(|_| self.profile.is_none())
    }

    /// Whether the rear part of the plan is an inward spiral.
    pub fn is_coiled(&self) -> bool {
        self.coil.is_some()
    }

    /// Signed arc length from t = 0 to a parameter. Strictly increasing.
    pub fn travel(&self, parameter: f64) -> f64 {
        let plan = || self.plan_travel(parameter);
        self.profile.as_ref().map_or_else(plan, |profile| profile.travel_m(parameter, plan))
    }

    /// The inverse of [`travel`](Self::travel). Travel beyond the route's end returns the parameter of the end.
    pub fn parameter(&self, travel_m: f64) -> f64 {
        let travel_m = travel_m.min(self.end_travel_m);
        match &self.profile {
            None => self.plan_parameter(travel_m),
            Some(profile) => profile.parameter(travel_m, |plan_m| self.plan_parameter(plan_m)),
        }
    }

    /// The same as [`parameter`](Self::parameter) up to rounding, and faster if `guess` is near the result.
    pub fn parameter_near(&self, travel_m: f64, guess: f64) -> f64 {
        if self.profile.is_some() {
            return self.parameter(travel_m);
        }
        let travel_m = travel_m.min(self.end_travel_m);
        self.segment_of_travel(travel_m).parameter_near(travel_m, guess)
    }

    /// Position, walking direction and speed at a parameter.
    #[inline]
    pub fn point(&self, parameter: f64) -> RoutePoint {
        let plan = self.plan_point(parameter);
        match &self.profile {
            None => plan,
            Some(profile) => lifted(profile, parameter, plan, || self.plan_travel(parameter)),
        }
    }

    /// Signed curvature in the plan, in 1/m, at a parameter, above 0 where the route turns left. At a seam: the curvature of
    /// the segment before it.
    pub fn curvature(&self, parameter: f64) -> f64 {
        let placed = self.segment_at(parameter);
        placed.segment.curve().curvature(placed.local(parameter))
    }

    /// Returns a parameter behind `parameter`. The arc between the two is at most `arc_m`, which callers rely on. Multiplied
    /// with `steepest`, it is at least a third of `arc_m`.
    ///
    /// Cheaper than [`parameter`](Self::parameter), which would step back by exactly `arc_m`.
    pub fn step_back(&self, parameter: f64, arc_m: f64) -> f64 {
        let arc_m = if self.profile.is_some() { arc_m / self.steepest() } else { arc_m };
        let number = self.number_at(parameter);
        let placed = &self.segments[number];
        let next = parameter - placed.segment.step_back(placed.local(parameter), arc_m);
        if next >= placed.begin { next } else { self.step_back_over_seams(number, parameter, arc_m) }
    }

    /// Returns a parameter behind `parameter`, at a distance of about `chord_m` from it. On the way back to it, and on a share of
    /// [`CHORD_MARGIN`] of that way beyond, the distance from `parameter` only grows, and |curvature| is at most [`CHORD_BEND`]
    /// divided by `chord_m`. `None` where no such parameter is known: over a seam, on ground, or where the route bends too much.
    pub(crate) fn chord_back(&self, parameter: f64, chord_m: f64) -> Option<f64> {
        if self.profile.is_some() {
            return None;
        }
        let placed = self.segment_at(parameter);
        let step = placed.segment.chord_back(placed.local(parameter), chord_m)?;
        // Ten times the margin, for a speed that falls along the step.
        (parameter - (1.0 + 10.0 * CHORD_MARGIN) * step >= placed.begin).then_some(parameter - step)
    }

    #[cold]
    fn step_back_over_seams(&self, number: usize, mut parameter: f64, mut left_m: f64) -> f64 {
        for placed in self.segments[..=number].iter().rev() {
            let next = parameter - placed.segment.step_back(placed.local(parameter), left_m.max(0.0));
            if next >= placed.begin {
                return next;
            }
            left_m -= placed.travel(parameter) - placed.begin_travel_m;
            parameter = placed.begin;
        }
        parameter
    }

    /// A bound on |curvature| in 1/m between two parameters, `rear <= front`: without ground the exact maximum over all
    /// segments between them, on ground a bound on the curvature in space.
    pub fn curvature_bound(&self, rear: f64, front: f64) -> f64 {
        let plan = || self.plan_curvature_bound(rear, front);
        self.profile.as_ref().map_or_else(plan, |profile| profile.curvature_bound(rear, front, plan))
    }

    /// A bound on |curvature| in the plan between two parameters, in 1/m.
    pub(crate) fn plan_curvature_bound(&self, rear: f64, front: f64) -> f64 {
        let (first, last) = (self.number_at(rear), self.number_of_begin(front));
        if first == last {
            return self.segments[first].curvature_bound(rear, front);
        }
        self.segments[first..=last].iter().map(|placed| placed.curvature_bound(rear, front)).fold(0.0, f64::max)
    }

    /// The interval of the signed curvatures in the plan between two parameters, in 1/m, `rear <= front`: on a segment the
    /// curvature is monotone.
    pub(crate) fn plan_curvatures(&self, rear: f64, front: f64) -> Interval {
        let (first, last) = (self.number_at(rear), self.number_of_begin(front));
        let all = self.segments[first..=last].iter().map(|placed| placed.curvatures(rear, front));
        all.reduce(|all, next| all.with(next.low).with(next.high)).expect("a parameter lies on a segment")
    }

    /// Whether one line or one arc contains the route between two parameters, `rear <= front`. It may be made of several segments, as the
    /// laps of a circle are.
    pub(crate) fn is_one_line_or_arc(&self, rear: f64, front: f64) -> bool {
        let curvature = |placed: &PlacedSegment| placed.segment.curve().constant_curvature();
        let segments = self.segments.get(self.number_of_begin(rear)..=self.number_at(front)).unwrap_or_default();
        let first = segments.first().and_then(curvature);
        self.profile.is_none() && first.is_some() && segments.iter().all(|placed| curvature(placed) == first)
    }

    /// The spiral that contains the route between two parameters, the rear one first; `None` without one, or on ground.
    pub(crate) fn spiral_between(&self, [rear, front]: [f64; 2]) -> Option<SpiralPart> {
        let number = self.number_of_begin(rear);
        let is_known = self.has_spiral_bounds && self.profile.is_none() && number == self.number_at(front);
        if is_known { self.segments[number].spiral_part() } else { None }
    }

    /// Bound on the displacement along the curve that rounding causes at a parameter, in metres. `speed_m_per_unit` is the
    /// speed of the route there.
    ///
    /// Rounding affects the route's parameter and the segment's own parameter: near 0 of one, the other may be large. It also
    /// affects the angle computed from them, and the distance from the origin.
    pub fn rounding_m(&self, parameter: f64, speed_m_per_unit: f64) -> f64 {
        let of_heights_m = self.profile.as_ref().map_or(0.0, |profile| profile.rounding_m());
        self.segment_at(parameter).rounding_m(parameter, speed_m_per_unit) + of_heights_m
    }

    /// All segments as functions of the route's parameter, in walking order.
    pub(crate) fn kernels(&self) -> Vec<Kernel> {
        self.segments.iter().map(|placed| placed.kernel).collect()
    }

    /// The index of the segment at a parameter. At a seam: the segment before it.
    #[inline]
    fn number_at(&self, parameter: f64) -> usize {
        if parameter <= self.first_seam { 0 } else { count_while(&self.seams, |&seam| seam < parameter) }
    }

    /// The same, except at a seam: the segment behind it.
    #[inline]
    fn number_of_begin(&self, parameter: f64) -> usize {
        if parameter < self.first_seam { 0 } else { count_while(&self.seams, |&seam| seam <= parameter) }
    }

    #[inline]
    fn segment_at(&self, parameter: f64) -> &PlacedSegment {
        &self.segments[self.number_at(parameter)]
    }

    fn segment_of_travel(&self, travel_m: f64) -> &PlacedSegment {
        let number = count_while(&self.segments[1..], |placed| placed.begin_travel_m < travel_m);
        &self.segments[number]
    }
}

/// Places segments on a route. The first segment ends at the travel `first_end_m`.
///
/// # Errors
/// The first segment must have no beginning, all others must have one. Each segment must begin at the end of the one before,
/// with the same tangent.
fn joined(segments: &[Segment], first_end_m: f64) -> Result<Vec<PlacedSegment>, RouteError> {
    let mut placed: Vec<PlacedSegment> = Vec::with_capacity(segments.len());
    for (number, &segment) in segments.iter().enumerate() {
        let unbounded = segment.span().0 == f64::NEG_INFINITY;
        if unbounded != (number == 0) {
            return Err(RouteError::Beginning { segment: number });
        }
        placed.push(match placed.last() {
            None => PlacedSegment::first(segment, first_end_m),
            Some(before) => PlacedSegment::behind(before, segment),
        });
    }
    for (number, pair) in placed.windows(2).enumerate() {
        let (before, after) = (pair[0].end_point(), pair[1].begin_point());
        let gap_m = before.position.distance(after.position);
        let turn = before.tangent.distance(after.tangent);
        if !(gap_m <= SEAM_TOLERANCE * (1.0 + before.position.length()) && turn <= SEAM_TOLERANCE) {
            return Err(RouteError::Seam { segment: number + 1, gap_m, turn });
        }
    }
    Ok(placed)
}

/// Counts the leading items that meet a condition, which none of the later items meets.
///
/// A linear search is faster for few items: neighbouring handles lie on the same segment, so the processor predicts the
/// branches.
fn count_while<T>(items: &[T], condition: impl Fn(&T) -> bool) -> usize {
    const FEW: usize = 8;
    if items.len() > FEW {
        return items.partition_point(condition);
    }
    let mut count = items.len();
    while count > 0 && !condition(&items[count - 1]) {
        count -= 1;
    }
    count
}
