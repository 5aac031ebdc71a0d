//! The part of a route between two travels, segment by segment.

use std::ops::RangeInclusive;

use glam::DVec2;

use super::segment::PlacedSegment;
use super::{Route, count_while};

/// A part of one segment of a route, between two parameters of the route.
#[derive(Clone, Copy, Debug)]
pub(super) struct SegmentPart<'a> {
    /// Index of the segment on the route.
    pub(super) number: usize,
    pub(super) placed: &'a PlacedSegment,
    pub(super) rear: f64,
    pub(super) front: f64,
}

/// The tightest bend of a part of a route.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TightestBend {
    /// Radius of curvature in metres.
    pub radius_m: f64,
    /// Travel at the bend, or at its beginning.
    pub travel_m: f64,
    /// Position in metres.
    pub point: DVec2,
}

impl Route {
    /// The parts of the segments between two travels, in walking order. The end must lie on the curve.
    pub(super) fn segment_parts(&self, from_m: f64, to_m: f64) -> impl Iterator<Item = SegmentPart<'_>> {
        let [from_m, to_m] = [from_m, to_m].map(|travel_m| self.in_plan(travel_m));
        let first = count_while(&self.segments[1..], |placed| placed.begin_travel_m <= from_m);
        let reached =
            self.segments.iter().enumerate().skip(first).take_while(move |(_, placed)| placed.begin_travel_m < to_m);
        // Rounding may leave nothing of the first segment.
        reached.filter_map(move |(number, placed)| {
            let rear = if number == first { placed.parameter(from_m) } else { placed.begin };
            let goes_on = self.segments.get(number + 1).is_some_and(|next| next.begin_travel_m < to_m);
            let front = if goes_on { placed.end() } else { placed.parameter(to_m) };
            (rear < front).then_some(SegmentPart { number, placed, rear, front })
        })
    }

    /// The tightest bend of the plan between two travels, and the first of equal ones; `None` if the route is straight there.
    /// The end must lie on the curve.
    ///
    /// The curvature of a line or an arc is constant, and that of a spiral is monotone. So it is largest at an end of a
    /// segment.
    pub fn tightest_bend(&self, from_m: f64, to_m: f64) -> Option<TightestBend> {
        let ends = self.segment_parts(from_m, to_m).flat_map(|part| [(part, part.rear), (part, part.front)]);
        let curvature =
            |part: SegmentPart<'_>, at: f64| part.placed.segment.curve().curvature(part.placed.local(at)).abs();
        let bends = ends.map(|(part, at)| (part, at, curvature(part, at)));
        let tightest = bends.reduce(|tightest, bend| if bend.2 > tightest.2 { bend } else { tightest });
        let (part, at, curvature) = tightest.filter(|&(_, _, curvature)| curvature > 0.0)?;
        let (travel_m, point) = (self.in_space(part.placed.travel(at)), part.placed.kernel.at(at).position);
        Some(TightestBend { radius_m: curvature.recip(), travel_m, point })
    }

    /// Approximates the route between two travels by a polyline. Both ends are included.
    ///
    /// The polyline deviates from the route by at most `sagitta_m`, except where the step would be shorter than the allowed
    /// minimum. A chord of length s on a curve of curvature κ has a sagitta of κ·s²/8. A step ends at a seam, because the
    /// curvature jumps there.
    pub fn polyline(&self, from_m: f64, to_m: f64, sagitta_m: f64, steps_m: RangeInclusive<f64>) -> Vec<DVec2> {
        let [from_m, to_m] = [from_m, to_m].map(|travel_m| self.in_plan(travel_m));
        let mut points = Vec::new();
        let mut travel_m = from_m;
        while travel_m < to_m {
            let number = count_while(&self.segments[1..], |placed| placed.begin_travel_m <= travel_m);
            let placed = &self.segments[number];
            let parameter = placed.parameter(travel_m);
            points.push(placed.kernel.at(parameter).position);
            let local = placed.local(parameter);
            let step_m = (8.0 * sagitta_m / placed.segment.curvature_bound(local, local)).sqrt();
            let seam_m = self.segments.get(number + 1).map_or(f64::INFINITY, |next| next.begin_travel_m);
            let next_m = (travel_m + step_m.min(*steps_m.end())).min(seam_m);
            travel_m = next_m.max(travel_m + steps_m.start());
        }
        points.push(self.plan_point(self.plan_parameter(to_m)).position);
        points
    }
}
