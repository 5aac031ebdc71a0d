//! Elements of a fitted curve: lines and arcs that lie in the plane, and their distance from a drawn outline.

use std::f64::consts::TAU;

use glam::DVec2;

use super::curve::to_segment_m;

/// Largest turn of an element: the normals at its two ends bound a convex wedge around it.
pub(super) const MAX_TURN: f64 = 2.2;
/// Distance by which a point may lie outside its wedge, by rounding, in metres.
const SLACK_M: f64 = 1e-9;

/// A line or an arc.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Element {
    /// Where it begins, in metres.
    pub(super) begin: DVec2,
    /// Unit vector in walking direction at its beginning.
    pub(super) tangent: DVec2,
    /// Signed curvature in 1/m, above 0 where it turns left; 0: a line.
    pub(super) curvature: f64,
    /// Length in metres.
    pub(super) length_m: f64,
}

impl Element {
    /// The line between two points.
    pub(super) fn line(from: DVec2, to: DVec2) -> Self {
        Self { begin: from, tangent: (to - from).normalize_or_zero(), curvature: 0.0, length_m: from.distance(to) }
    }

    /// The arc that begins at a point in a direction, and ends at another point.
    pub(super) fn arc(begin: DVec2, tangent: DVec2, end: DVec2) -> Self {
        let chord = end - begin;
        let half = f64::atan2(tangent.perp_dot(chord), tangent.dot(chord));
        let curvature = 2.0 * half.sin() / chord.length();
        let sinc = if half == 0.0 { 1.0 } else { half.sin() / half };
        Self { begin, tangent, curvature, length_m: chord.length() / sinc }
    }

    /// Angle by which it turns.
    pub(super) fn turn(&self) -> f64 {
        self.curvature * self.length_m
    }

    /// Position and direction at this distance from its beginning.
    pub(super) fn at(&self, distance_m: f64) -> (DVec2, DVec2) {
        let half = 0.5 * self.curvature * distance_m;
        let sinc = if half == 0.0 { 1.0 } else { half.sin() / half };
        let chord = DVec2::from_angle(half).rotate(self.tangent) * (distance_m * sinc);
        (self.begin + chord, DVec2::from_angle(2.0 * half).rotate(self.tangent))
    }

    /// Where it ends, and its direction there.
    pub(super) fn end(&self) -> (DVec2, DVec2) {
        self.at(self.length_m)
    }

    /// Its ends, and the points between them at which it runs along an axis. It turns by at most a whole turn.
    pub(super) fn extremes(&self) -> impl Iterator<Item = DVec2> {
        let axes = [DVec2::X, DVec2::Y, DVec2::NEG_X, DVec2::NEG_Y];
        let turn_to = |axis: DVec2| (self.tangent.angle_to(axis) * self.curvature.signum()).rem_euclid(TAU);
        let between_m = axes.map(|axis| turn_to(axis) / self.curvature.abs());
        let inner_m = between_m.into_iter().filter(|&distance_m| distance_m < self.length_m);
        [0.0, self.length_m].into_iter().chain(inner_m).map(|distance_m| self.at(distance_m).0)
    }

    /// The part between two distances from its beginning.
    pub(super) fn part(&self, from_m: f64, to_m: f64) -> Self {
        let (begin, tangent) = self.at(from_m);
        Self { begin, tangent, length_m: to_m - from_m, ..*self }
    }

    /// The element in equal parts that turn by at most [`MAX_TURN`].
    pub(super) fn parts(self) -> impl Iterator<Item = Self> {
        let count = (self.turn().abs() / MAX_TURN).ceil().max(1.0);
        let step_m = self.length_m / count;
        (0..count as usize).map(move |i| self.part(i as f64 * step_m, (i + 1) as f64 * step_m))
    }

    /// Signed distance of a point from the whole line or circle, above 0 to the left.
    ///
    /// With the centre at 1/κ to the left it is (1 − √(1 − 2κy + κ²ρ²)) / κ, written so that it holds for κ = 0.
    pub(super) fn offset_m(&self, point: DVec2) -> f64 {
        let lead = point - self.begin;
        let left = self.tangent.perp_dot(lead);
        let square = lead.length_squared();
        let root = (1.0 - 2.0 * self.curvature * left + self.curvature * self.curvature * square).max(0.0).sqrt();
        (2.0 * left - self.curvature * square) / (1.0 + root)
    }

    /// Distance from its beginning to the foot of a point, along the element; negative before the beginning.
    pub(super) fn foot_m(&self, point: DVec2) -> f64 {
        let lead = point - self.begin;
        let (ahead, left) = (self.tangent.dot(lead), self.tangent.perp_dot(lead));
        let angle = f64::atan2(self.curvature * ahead, 1.0 - self.curvature * left);
        if angle.abs() < 1e-9 { ahead / (1.0 - self.curvature * left) } else { angle / self.curvature }
    }

    /// The largest distance of a line segment from the whole line or circle. It is at one end, or where the segment is nearest
    /// to the centre.
    fn farthest_m(&self, from: DVec2, to: DVec2) -> f64 {
        let ends_m = self.offset_m(from).abs().max(self.offset_m(to).abs());
        let edge = to - from;
        let near =
            (self.tangent.perp_dot(edge) / self.curvature - (from - self.begin).dot(edge)) / edge.length_squared();
        if near > 0.0 && near < 1.0 { ends_m.max(self.offset_m(from + near * edge).abs()) } else { ends_m }
    }
}

/// The largest distance between elements and the outline that they follow; `None` if it is above a limit.
///
/// 1. Neighbouring elements have a common tangent, so a common normal. The normals at the two ends of an element bound a wedge.
/// 2. The first crossing of each normal divides the outline into parts. A part in the wedge of its element is as far from the
///    element as from the whole line or circle.
/// 3. A part is continuous from one normal to the other, so it crosses every normal of its element. No point of the element is
///    further from the outline than the outline's points are from the element.
/// 4. Where a part leaves its wedge, by rounding or because it turns back, the distance of each edge is bounded by those of its
///    ends and its length.
pub(super) fn distance_m(elements: &[Element], outline: &[DVec2], limit_m: f64) -> Option<f64> {
    let mut rest = elements.iter();
    let mut wedge = Wedge::of(rest.next()?);
    let mut largest_m = 0.0;
    for edge in outline.windows(2) {
        let (mut from, to) = (edge[0], edge[1]);
        loop {
            let ahead_m = wedge.ahead_m(to);
            if ahead_m <= 0.0 || rest.len() == 0 {
                largest_m = f64::max(largest_m, wedge.distance_m(from, to));
                break;
            }
            let behind_m = wedge.ahead_m(from).min(0.0);
            let cut = from.lerp(to, behind_m / (behind_m - ahead_m));
            largest_m = f64::max(largest_m, wedge.distance_m(from, cut));
            wedge = Wedge::of(rest.next().expect("there is another element"));
            from = cut;
        }
        if largest_m.is_nan() || largest_m > limit_m {
            return None;
        }
    }
    // Elements that the outline has not reached are as far as their ends.
    let last = *outline.last()?;
    for wedge in std::iter::once(wedge).chain(rest.map(Wedge::of)) {
        if wedge.ahead_m(last) < -SLACK_M {
            largest_m = f64::max(largest_m, wedge.end.distance(last));
        }
    }
    (largest_m <= limit_m).then_some(largest_m)
}

/// An element and the normals at its two ends.
struct Wedge<'a> {
    element: &'a Element,
    end: DVec2,
    end_tangent: DVec2,
}

impl<'a> Wedge<'a> {
    fn of(element: &'a Element) -> Self {
        let (end, end_tangent) = element.end();
        Self { element, end, end_tangent }
    }

    /// Distance of a point from the normal at the end, above 0 beyond it.
    fn ahead_m(&self, point: DVec2) -> f64 {
        (point - self.end).dot(self.end_tangent)
    }

    fn contains(&self, point: DVec2) -> bool {
        (point - self.element.begin).dot(self.element.tangent) >= -SLACK_M && self.ahead_m(point) <= SLACK_M
    }

    /// A bound on the distance of a line segment from the element.
    fn distance_m(&self, from: DVec2, to: DVec2) -> f64 {
        if from == to {
            return 0.0;
        }
        if self.contains(from) && self.contains(to) {
            return self.element.farthest_m(from, to);
        }
        let begin = self.element.begin;
        if self.element.curvature == 0.0 {
            // A line is convex: the distance from it is largest at an end.
            return to_segment_m(from, begin, self.end).max(to_segment_m(to, begin, self.end));
        }
        let point_m = |point: DVec2| {
            if self.contains(point) {
                self.element.offset_m(point).abs()
            } else {
                point.distance(begin).min(point.distance(self.end))
            }
        };
        // The distance changes by at most a metre a metre.
        0.5 * (point_m(from) + point_m(to) + from.distance(to))
    }
}
