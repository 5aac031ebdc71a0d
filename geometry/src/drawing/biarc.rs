//! Biarcs: two arcs with a common tangent, from one point and direction to another.
//!
//! Source: K. M. Bolton, *Biarc curves*, Computer-Aided Design 7 (1975); the choice of the joint as in D. S. Meek and
//! D. J. Walton, *Approximation of discrete data by G¹ arc splines* (1992).

use glam::DVec2;

use super::element::{Element, MAX_TURN};

/// Smallest turn of an arc. A smaller one is a line, and bends the rest of the route by no more.
const MIN_TURN: f64 = 1e-11;
/// Greatest radius of an arc, in metres: that of a path.
const MAX_RADIUS_M: f64 = 1e5;

/// The curve from a point and a direction to another point and direction, as lines and arcs with common tangents.
///
/// `ratio` is the length of the second control leg ÷ that of the first. `None` where an arc would turn by more than
/// [`MAX_TURN`].
pub(super) fn biarc(from: [DVec2; 2], to: [DVec2; 2], ratio: f64) -> Option<Elements> {
    let ([begin, tangent], [end, end_tangent]) = (from, to);
    let chord = end - begin;
    let square = chord.length_squared();
    // The legs a and r·a of the control polygon meet in the joint: |v − a·t₁ − r·a·t₂| = a + r·a. This is a quadratic
    // equation in a; 1 − t₁·t₂ is half the square of t₁ − t₂.
    let along = chord.dot(tangent + ratio * end_tangent);
    let root = (along * along + ratio * tangent.distance_squared(end_tangent) * square).sqrt();
    let leg_m = square / (along + root);
    if !(leg_m > 0.0 && leg_m.is_finite()) {
        return None;
    }
    let joint = (ratio * (begin + leg_m * tangent) + (end - ratio * leg_m * end_tangent)) / (1.0 + ratio);
    let first = Element::arc(begin, tangent, joint);
    let second = Element::arc(joint, first.end().1, end);
    let mut elements = Elements::default();
    for arc in [first, second] {
        if !(arc.turn().abs() <= MAX_TURN && arc.length_m.is_finite()) {
            return None;
        }
        elements.push_arc(&arc);
    }
    elements.join();
    Some(elements)
}

/// Up to six elements, without a heap.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Elements {
    elements: [Element; 6],
    count: usize,
}

impl Elements {
    /// The line between two points.
    pub(super) fn line(from: DVec2, to: DVec2) -> Self {
        let mut elements = Self::default();
        elements.push(Element::line(from, to));
        elements
    }

    pub(super) fn as_slice(&self) -> &[Element] {
        &self.elements[..self.count]
    }

    fn push(&mut self, element: Element) {
        self.elements[self.count] = element;
        self.count += 1;
    }

    /// Adds an arc. One of a radius that no path has becomes a line, an arc of the greatest radius, and a line, between the
    /// same tangents.
    fn push_arc(&mut self, arc: &Element) {
        for element in bounded(arc).into_iter().flatten() {
            self.push(element);
        }
    }

    /// Makes one element of two arcs of the same radius, or of two lines.
    fn join(&mut self) {
        let [first, second, ..] = self.elements;
        if self.count == 2 && (first.turn() - first.length_m * second.curvature).abs() <= MIN_TURN {
            let whole = if first.curvature == 0.0 {
                Element::line(first.begin, second.end().0)
            } else {
                Element::arc(first.begin, first.tangent, second.end().0)
            };
            if whole.turn().abs() <= MAX_TURN {
                *self = Self::default();
                self.push(whole);
            }
        }
    }
}

/// An arc as elements of radii that a path has.
pub(super) fn bounded(arc: &Element) -> [Option<Element>; 3] {
    let turn = arc.turn();
    if turn.abs() < MIN_TURN {
        return [Some(Element::line(arc.begin, arc.end().0)), None, None];
    }
    if arc.curvature.abs() * MAX_RADIUS_M >= 1.0 {
        return [Some(*arc), None, None];
    }
    let tangent_m = |radius_m: f64| radius_m * (0.5 * turn.abs()).tan();
    let line_m = tangent_m(1.0 / arc.curvature.abs()) - tangent_m(MAX_RADIUS_M);
    let before = Element { curvature: 0.0, length_m: line_m, ..*arc };
    let begin = before.end().0;
    let middle =
        Element { begin, curvature: turn.signum() / MAX_RADIUS_M, length_m: MAX_RADIUS_M * turn.abs(), ..*arc };
    let (begin, tangent) = middle.end();
    [Some(before), Some(middle), Some(Element { begin, tangent, curvature: 0.0, length_m: line_m })]
}
