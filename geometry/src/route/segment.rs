//! A segment of a route, and its position on the route.

use super::capability::{ArcLength, Bounds, Crosses, PlaneCurve};
use super::kernel::Rounding;
use super::kinds::kinds;
use super::spiral::SpiralPart;
use super::{CircularArc, Kernel, Line, Placement, RoutePoint, Spiral};
use crate::numerics::Interval;

kinds! {
    $ as of_kind;
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
}

impl Segment {
    /// The segment's own parameters at its beginning and end. The beginning is −∞ for a segment without one.
    #[inline]
    pub fn span(&self) -> (f64, f64) {
        of_kind!(self, curve => curve.span())
    }

    /// Position, walking direction and speed.
    pub fn point(&self, at: f64) -> RoutePoint {
        self.curve().kernel(self.span().0, 0.0).at(at)
    }

    /// The same segment, somewhere else.
    pub(super) fn placed(mut self, placement: &Placement) -> Self {
        of_kind!(&mut self, curve => curve.place(placement));
        self
    }

    /// All that the kind can do. Work for each handle calls the kind itself instead.
    pub(super) fn curve(&self) -> &dyn Crosses {
        of_kind!(self, curve => curve)
    }

    /// The greatest |curvature| in 1/m between two of the segment's own parameters.
    #[inline]
    pub(super) fn curvature_bound(&self, rear: f64, front: f64) -> f64 {
        of_kind!(self, curve => curve.curvature_bound(rear, front))
    }
}

impl ArcLength for Segment {
    #[inline]
    fn arc_m(&self, at: f64) -> f64 {
        of_kind!(self, curve => curve.arc_m(at))
    }

    #[inline]
    fn at_arc(&self, arc_m: f64) -> f64 {
        of_kind!(self, curve => curve.at_arc(arc_m))
    }

    #[inline]
    fn at_arc_near(&self, arc_m: f64, guess: f64) -> f64 {
        of_kind!(self, curve => curve.at_arc_near(arc_m, guess))
    }

    #[inline]
    fn step_back(&self, at: f64, arc_m: f64) -> f64 {
        of_kind!(self, curve => curve.step_back(at, arc_m))
    }

    #[inline]
    fn chord_back(&self, at: f64, chord_m: f64) -> Option<f64> {
        of_kind!(self, curve => curve.chord_back(at, chord_m))
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
    /// Distance from the origin to the point from which the segment computes positions, in metres.
    from_origin_m: f64,
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
        let kernel = segment.curve().kernel(begin, offset);
        let (rounding, from_origin_m) = (kernel.rounding(), segment.curve().reference().length());
        Self { segment, begin, begin_travel_m, offset, anchor_m, kernel, rounding, from_origin_m }
    }

    /// The segment as a spiral; `None` for another curve.
    pub(super) fn spiral_part(&self) -> Option<SpiralPart> {
        let Segment::Spiral(spiral) = self.segment else { return None };
        let (is_inward, radius_per_radian_m) = (spiral.is_inward(), spiral.radius_per_radian_m());
        Some(SpiralPart { radius_per_radian_m, is_inward, angle_at_0: spiral.angle(self.local(0.0)) })
    }

    /// Bound on the displacement that rounding causes at a parameter of the route, in metres.
    #[inline]
    pub(super) fn rounding_m(&self, parameter: f64, speed_m_per_unit: f64) -> f64 {
        let Rounding { parameters, units } = self.rounding;
        let units = parameters * parameter.abs().max(self.local(parameter).abs()) + units;
        f64::EPSILON * (units * speed_m_per_unit + self.from_origin_m)
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

    /// The signed curvatures on this segment between two parameters of the route, which may lie on other segments.
    pub(super) fn curvatures(&self, rear: f64, front: f64) -> Interval {
        let ends = [rear.max(self.begin), front.min(self.end())].map(|at| self.local(at));
        let [rear, front] = ends.map(|at| of_kind!(&self.segment, curve => curve.curvature(at)));
        Interval::hull(rear, front)
    }

    pub(super) fn begin_point(&self) -> RoutePoint {
        self.segment.point(self.segment.span().0)
    }

    pub(super) fn end_point(&self) -> RoutePoint {
        self.segment.point(self.segment.span().1)
    }
}
