//! A segment of a route, and where it lies on the route.

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
    #[inline]
    pub fn point(&self, at: f64) -> RoutePoint {
        match self {
            Self::Line(line) => line.point(at),
            Self::Arc(arc) => arc.point(at),
            Self::Spiral(spiral) => spiral.point(at),
        }
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

    /// Distance from the origin to the point that positions are counted from.
    fn reference_distance_m(&self) -> f64 {
        match self {
            Self::Line(line) => line.origin().length(),
            Self::Arc(arc) => arc.centre().length(),
            Self::Spiral(spiral) => spiral.centre().length(),
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
pub(super) struct Piece {
    pub(super) segment: Segment,
    /// The route's parameter at its beginning; −∞ where it has none.
    pub(super) begin: f64,
    /// Travel there.
    pub(super) begin_travel_m: f64,
    /// What its own parameter is more than the route's.
    offset: f64,
    /// A travel, and the segment's own arc length at the same point.
    anchor_m: (f64, f64),
    rounding: Rounding,
}

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
    fn of(segment: &Segment) -> Self {
        // The direction from a spiral's centre is rounded once more than θ, unless it is θ.
        let axis = if let Segment::Spiral(spiral) = segment { spiral.axis().abs() } else { 0.0 };
        let parameters = if axis == 0.0 { 1.0 } else { 2.0 };
        Self { parameters, units: axis, from_origin_m: segment.reference_distance_m() }
    }
}

impl Piece {
    /// The first segment, which has no beginning and ends at this travel. Its own parameter is the route's.
    pub(super) fn first(segment: Segment, end_travel_m: f64) -> Self {
        let end_arc_m = segment.arc_m(segment.span().1);
        Self {
            segment,
            begin: f64::NEG_INFINITY,
            begin_travel_m: f64::NEG_INFINITY,
            offset: 0.0,
            anchor_m: (end_travel_m, end_arc_m),
            rounding: Rounding::of(&segment),
        }
    }

    /// The segment that begins where another piece ends.
    pub(super) fn behind(before: &Self, segment: Segment) -> Self {
        let (begin, begin_travel_m) = (before.end(), before.travel(before.end()));
        let own = segment.span().0;
        Self {
            begin,
            begin_travel_m,
            offset: own - begin,
            anchor_m: (begin_travel_m, segment.arc_m(own)),
            rounding: Rounding::of(&segment),
            segment,
        }
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

    /// The segment as the stepper computes it.
    pub(super) fn kernel(&self) -> Kernel {
        match &self.segment {
            Segment::Line(line) => line.kernel(self.begin, self.offset),
            Segment::Arc(arc) => arc.kernel(self.begin, self.offset),
            Segment::Spiral(spiral) => spiral.kernel(self.begin, self.offset),
        }
    }
}
