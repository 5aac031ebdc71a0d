//! A segment of a route, and its position on the route.

use glam::DVec2;

use super::{CircularArc, Kernel, Line, Placement, RoutePoint, Spiral};

/// A segment of a route. The segment's own parameter grows in walking direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Segment {
    /// A straight line; its parameter is in metres.
    Line(Line),
    /// A circular arc; its parameter is in metres.
    Arc(CircularArc),
    /// A part of an Archimedean spiral; its parameter is θ if walked outward and −θ if walked inward.
    Spiral(Spiral),
}

impl Segment {
    /// The segment's own parameters at its beginning and end. The beginning is −∞ for a segment without one.
    pub fn span(&self) -> (f64, f64) {
        match self {
            Self::Line(line) => line.span(),
            Self::Arc(arc) => (0.0, arc.length_m()),
            Self::Spiral(spiral) => spiral.span(),
        }
    }

    /// The same segment, somewhere else.
    pub(super) fn placed(&self, placement: &Placement) -> Self {
        match self {
            Self::Line(line) => Self::Line(line.placed(placement)),
            Self::Arc(arc) => Self::Arc(arc.placed(placement)),
            Self::Spiral(spiral) => Self::Spiral(spiral.placed(placement)),
        }
    }

    /// Position, walking direction and speed.
    pub fn point(&self, at: f64) -> RoutePoint {
        self.kernel(self.span().0, 0.0).at(at)
    }

    /// Arc length in metres, from an origin that depends on the kind of segment.
    #[inline]
    pub(super) fn arc_m(&self, at: f64) -> f64 {
        match self {
            Self::Line(_) | Self::Arc(_) => at,
            Self::Spiral(spiral) => spiral.arc_m(at),
        }
    }

    /// The inverse of [`arc_m`](Self::arc_m).
    #[inline]
    fn at_arc(&self, arc_m: f64) -> f64 {
        match self {
            Self::Line(_) | Self::Arc(_) => arc_m,
            Self::Spiral(spiral) => spiral.at_arc(arc_m),
        }
    }

    /// The same, faster if `guess` is near the result.
    #[inline]
    fn at_arc_near(&self, arc_m: f64, guess: f64) -> f64 {
        match self {
            Self::Spiral(spiral) => spiral.at_arc_near(arc_m, guess),
            Self::Line(_) | Self::Arc(_) => self.at_arc(arc_m),
        }
    }

    /// Step back, in units of the parameter, that covers at most `arc_m` of arc and at least a third of it.
    #[inline]
    pub(super) fn step_back(&self, at: f64, arc_m: f64) -> f64 {
        match self {
            Self::Line(_) | Self::Arc(_) => arc_m,
            Self::Spiral(spiral) => spiral.step_back(at, arc_m),
        }
    }

    /// The segment as a function of the route's parameter. The segment begins at the route's parameter `begin`; its own
    /// parameter is greater by `offset`.
    fn kernel(&self, begin: f64, offset: f64) -> Kernel {
        match self {
            Self::Line(line) => line.kernel(begin, offset),
            Self::Arc(arc) => arc.kernel(begin, offset),
            Self::Spiral(spiral) => spiral.kernel(begin, offset),
        }
    }

    /// Distance from the origin to the point from which the segment computes positions.
    fn reference_distance_m(&self) -> f64 {
        match self {
            Self::Line(line) => line.origin().length(),
            Self::Arc(arc) => arc.centre().length(),
            Self::Spiral(spiral) => spiral.centre().length(),
        }
    }

    /// Distance between neighbouring turns; `None` for a segment without a whole turn of a spiral.
    pub(super) fn pitch_m(&self) -> Option<f64> {
        match self {
            Self::Spiral(spiral) => spiral.has_neighbouring_turns().then_some(spiral.pitch_m()),
            Self::Line(_) | Self::Arc(_) => None,
        }
    }

    /// A bound on the distance from a point to any point of a line or an arc with a beginning; infinite for a spiral.
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

    /// Signed curvature in 1/m, above 0 where the segment turns left.
    pub(super) fn curvature(&self, at: f64) -> f64 {
        match self {
            Self::Line(_) => 0.0,
            Self::Arc(arc) => arc.curvature(),
            Self::Spiral(spiral) => spiral.curvature(at),
        }
    }

    /// The greatest |curvature| in 1/m between two of the segment's own parameters.
    #[inline]
    pub(super) fn curvature_bound(&self, rear: f64, front: f64) -> f64 {
        match self {
            Self::Line(_) => 0.0,
            Self::Arc(arc) => arc.curvature().abs(),
            Self::Spiral(spiral) => spiral.curvature_bound(rear, front),
        }
    }
}

/// A segment and its position on the route.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PlacedSegment {
    pub(super) segment: Segment,
    /// The route's parameter at the beginning of the segment; −∞ if it has none.
    pub(super) begin: f64,
    /// Travel at the beginning of the segment.
    pub(super) begin_travel_m: f64,
    /// The segment's own parameter minus the route's parameter.
    offset: f64,
    /// A travel, and the segment's own arc length at the same point.
    anchor_m: (f64, f64),
    /// The segment as a function of the route's parameter.
    pub(super) kernel: Kernel,
    rounding: Rounding,
}

/// Error of a sine or cosine, in units of `f64::EPSILON`.
const SINE_ERROR_EPSILONS: f64 = 2.0;

/// Rounding between a parameter and its point.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Rounding {
    /// Number of roundings of the size of the parameter.
    parameters: f64,
    /// Further rounding, in units of the parameter.
    units: f64,
    /// Distance of the segment's reference point from the origin, in metres.
    from_origin_m: f64,
}

impl Rounding {
    fn of(segment: &Segment, kernel: &Kernel) -> Self {
        let from_origin_m = segment.reference_distance_m();
        let Kernel::Polar(polar) = kernel else { return Self { parameters: 1.0, units: 0.0, from_origin_m } };
        // The direction from a centre is rounded once more than the parameter, unless it equals the parameter.
        let angle = polar.angle().abs();
        let parameters = if angle == 0.0 { 1.0 } else { 2.0 };
        Self { parameters, units: (angle + SINE_ERROR_EPSILONS) / polar.turn.abs(), from_origin_m }
    }
}

impl PlacedSegment {
    /// The first segment of a route, which has no beginning and ends at a given travel. Its own parameter is the route's.
    pub(super) fn first(segment: Segment, end_travel_m: f64) -> Self {
        let end_arc_m = segment.arc_m(segment.span().1);
        let unbounded = f64::NEG_INFINITY;
        Self::new(segment, (unbounded, unbounded), 0.0, (end_travel_m, end_arc_m))
    }

    /// The segment that begins at the end of another one.
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

    /// Bound on the displacement that rounding causes at a parameter of the route, in metres.
    #[inline]
    pub(super) fn rounding_m(&self, parameter: f64, speed_m_per_unit: f64) -> f64 {
        let Rounding { parameters, units, from_origin_m } = self.rounding;
        let units = parameters * parameter.abs().max(self.local(parameter).abs()) + units;
        f64::EPSILON * (units * speed_m_per_unit + from_origin_m)
    }

    /// The route's parameter at the end of the segment.
    #[inline]
    pub(super) fn end(&self) -> f64 {
        self.segment.span().1 - self.offset
    }

    /// The segment's own parameter at a parameter of the route.
    #[inline]
    pub(super) fn local(&self, parameter: f64) -> f64 {
        parameter + self.offset
    }

    /// The route's parameter at one of the segment's own.
    pub(super) fn parameter_of(&self, local: f64) -> f64 {
        local - self.offset
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

    /// The same, faster if `guess` is near the result.
    #[inline]
    pub(super) fn parameter_near(&self, travel_m: f64, guess: f64) -> f64 {
        let arc_m = self.anchor_m.1 + (travel_m - self.anchor_m.0);
        let local = self.segment.at_arc_near(arc_m, self.local(guess));
        local - self.offset
    }

    /// The greatest |curvature| on this segment between two parameters of the route. The parameters may lie on other segments.
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
