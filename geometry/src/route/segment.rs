//! A segment of a route, and where it lies on the route.

use glam::DVec2;

use super::{CircularArc, Kernel, Line, RoutePoint, Spiral};

/// A segment of a route. Its own parameter grows in walking direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Segment {
    /// A straight line; its parameter is in metres.
    Line(Line),
    /// A circular arc; its parameter is the angle by which it has turned.
    Arc(CircularArc),
    /// A part of an Archimedean spiral; its parameter is θ on the way outward and −θ on the way inward.
    Spiral(Spiral),
}

impl Segment {
    /// Its own parameters at beginning and end. A beginning of −∞: it has none.
    pub fn span(&self) -> (f64, f64) {
        match self {
            Self::Line(line) => line.span(),
            Self::Arc(arc) => (0.0, arc.angle()),
            Self::Spiral(spiral) => spiral.span(),
        }
    }

    /// Position, walking direction and speed.
    pub fn point(&self, at: f64) -> RoutePoint {
        self.kernel(self.span().0, 0.0).at(at)
    }

    /// Arc length in metres, counted from wherever suits the segment.
    #[inline]
    pub(super) fn arc_m(&self, at: f64) -> f64 {
        match self {
            Self::Line(_) => at,
            Self::Arc(arc) => arc.radius_m() * at,
            Self::Spiral(spiral) => spiral.arc_m(at),
        }
    }

    /// The inverse of [`arc_m`](Self::arc_m).
    #[inline]
    fn at_arc(&self, arc_m: f64) -> f64 {
        match self {
            Self::Line(_) => arc_m,
            Self::Arc(arc) => arc_m / arc.radius_m(),
            Self::Spiral(spiral) => spiral.at_arc(arc_m),
        }
    }

    /// The same, quicker where `guess` is near.
    #[inline]
    fn at_arc_near(&self, arc_m: f64, guess: f64) -> f64 {
        match self {
            Self::Spiral(spiral) => spiral.at_arc_near(arc_m, guess),
            Self::Line(_) | Self::Arc(_) => self.at_arc(arc_m),
        }
    }

    /// How far to step back to cover at most `arc_m` of arc, and at least a third of it.
    #[inline]
    pub(super) fn step_back(&self, at: f64, arc_m: f64) -> f64 {
        match self {
            Self::Line(_) => arc_m,
            Self::Arc(arc) => arc_m / arc.radius_m(),
            Self::Spiral(spiral) => spiral.step_back(at, arc_m),
        }
    }

    /// The segment in a route's parameter, which begins at `begin` and is less than its own one by `offset`.
    fn kernel(&self, begin: f64, offset: f64) -> Kernel {
        match self {
            Self::Line(line) => line.kernel(begin, offset),
            Self::Arc(arc) => arc.kernel(begin, offset),
            Self::Spiral(spiral) => spiral.kernel(begin, offset),
        }
    }

    /// Distance from the origin to the point that positions are counted from.
    fn reference_distance_m(&self) -> f64 {
        match self {
            Self::Line(line) => line.origin().length(),
            Self::Arc(arc) => arc.centre().length(),
            Self::Spiral(spiral) => spiral.centre().length(),
        }
    }

    /// Distance between neighbouring turns, of a kind that has turns.
    pub(super) fn pitch_m(&self) -> Option<f64> {
        match self {
            Self::Spiral(spiral) => Some(spiral.pitch_m()),
            Self::Line(_) | Self::Arc(_) => None,
        }
    }

    /// A bound on the distance from a point to any point of a segment with a beginning; infinite for a kind without one.
    pub(super) fn furthest_m(&self, from: DVec2) -> f64 {
        match self {
            Self::Line(_) => [self.span().0, self.span().1]
                .map(|at| self.point(at).position.distance(from))
                .into_iter()
                .fold(0.0, f64::max),
            Self::Arc(arc) => arc.furthest_m(from),
            Self::Spiral(_) => f64::INFINITY,
        }
    }

    /// Signed curvature in 1/m, above 0 where it turns left.
    pub(super) fn curvature(&self, at: f64) -> f64 {
        match self {
            Self::Line(_) => 0.0,
            Self::Arc(arc) => arc.curvature(),
            Self::Spiral(spiral) => spiral.curvature(at),
        }
    }

    /// The greatest |curvature| in 1/m between two of its parameters.
    #[inline]
    pub(super) fn curvature_bound(&self, rear: f64, front: f64) -> f64 {
        match self {
            Self::Line(_) => 0.0,
            Self::Arc(arc) => arc.curvature().abs(),
            Self::Spiral(spiral) => spiral.curvature_bound(rear, front),
        }
    }
}

/// A segment on its route.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PlacedSegment {
    pub(super) segment: Segment,
    /// The route's parameter at its beginning; −∞ where it has none.
    pub(super) begin: f64,
    /// Travel there.
    pub(super) begin_travel_m: f64,
    /// What its own parameter is more than the route's.
    offset: f64,
    /// A travel, and the segment's own arc length at the same point.
    anchor_m: (f64, f64),
    /// The segment in the route's parameter.
    pub(super) kernel: Kernel,
    rounding: Rounding,
}

/// Error of a sine or cosine, in units of `f64::EPSILON`.
const SINE_ERROR_EPSILONS: f64 = 2.0;

/// What is rounded on the way from a parameter to a point.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Rounding {
    /// How often the size of the parameter is.
    parameters: f64,
    /// What is added to that, in units of the parameter.
    units: f64,
    /// Distance from the origin, in metres.
    from_origin_m: f64,
}

impl Rounding {
    fn of(segment: &Segment, kernel: &Kernel) -> Self {
        let from_origin_m = segment.reference_distance_m();
        let Kernel::Polar(polar) = kernel else { return Self { parameters: 1.0, units: 0.0, from_origin_m } };
        // The direction from a centre is rounded once more than the parameter, unless it is the parameter.
        let angle = polar.angle().abs();
        let parameters = if angle == 0.0 { 1.0 } else { 2.0 };
        Self { parameters, units: angle + SINE_ERROR_EPSILONS, from_origin_m }
    }
}

impl PlacedSegment {
    /// The first segment, which has no beginning and ends at this travel. Its own parameter is the route's.
    pub(super) fn first(segment: Segment, end_travel_m: f64) -> Self {
        let end_arc_m = segment.arc_m(segment.span().1);
        let unbounded = f64::NEG_INFINITY;
        Self::new(segment, (unbounded, unbounded), 0.0, (end_travel_m, end_arc_m))
    }

    /// The segment that begins where another one ends.
    pub(super) fn behind(before: &Self, segment: Segment) -> Self {
        let (begin, begin_travel_m) = (before.end(), before.travel(before.end()));
        let own = segment.span().0;
        Self::new(segment, (begin, begin_travel_m), own - begin, (begin_travel_m, segment.arc_m(own)))
    }

    fn new(segment: Segment, (begin, begin_travel_m): (f64, f64), offset: f64, anchor_m: (f64, f64)) -> Self {
        let kernel = segment.kernel(begin, offset);
        let rounding = Rounding::of(&segment, &kernel);
        Self { segment, begin, begin_travel_m, offset, anchor_m, kernel, rounding }
    }

    /// How far rounding may move the point at a parameter of the route.
    #[inline]
    pub(super) fn rounding_m(&self, parameter: f64, speed_m_per_unit: f64) -> f64 {
        let Rounding { parameters, units, from_origin_m } = self.rounding;
        let units = parameters * parameter.abs().max(self.local(parameter).abs()) + units;
        f64::EPSILON * (units * speed_m_per_unit + from_origin_m)
    }

    /// The route's parameter at its end.
    #[inline]
    pub(super) fn end(&self) -> f64 {
        self.segment.span().1 - self.offset
    }

    /// The segment's own parameter.
    #[inline]
    pub(super) fn local(&self, parameter: f64) -> f64 {
        parameter + self.offset
    }

    #[inline]
    pub(super) fn travel(&self, parameter: f64) -> f64 {
        self.anchor_m.0 + (self.segment.arc_m(self.local(parameter)) - self.anchor_m.1)
    }

    /// The route's parameter at a travel.
    #[inline]
    pub(super) fn parameter(&self, travel_m: f64) -> f64 {
        let local = self.segment.at_arc(self.anchor_m.1 + (travel_m - self.anchor_m.0));
        local - self.offset
    }

    /// The same, quicker where `guess` is near.
    #[inline]
    pub(super) fn parameter_near(&self, travel_m: f64, guess: f64) -> f64 {
        let arc_m = self.anchor_m.1 + (travel_m - self.anchor_m.0);
        let local = self.segment.at_arc_near(arc_m, self.local(guess));
        local - self.offset
    }

    /// The greatest |curvature| between two parameters of the route, of which parts may lie on other segments.
    #[inline]
    pub(super) fn curvature_bound(&self, rear: f64, front: f64) -> f64 {
        let [rear, front] = [rear.max(self.begin), front.min(self.end())].map(|at| self.local(at));
        self.segment.curvature_bound(rear, front)
    }

    pub(super) fn begin_point(&self) -> RoutePoint {
        self.segment.point(self.segment.span().0)
    }

    pub(super) fn end_point(&self) -> RoutePoint {
        self.segment.point(self.segment.span().1)
    }
}
