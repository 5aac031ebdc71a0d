//! Rounded corners: the arc of a given radius that touches two chains of lines and arcs, which meet in a corner.

use std::f64::consts::{PI, TAU};

use glam::{DMat2, DVec2};

use super::biarc::bounded;
use super::element::Element;

/// Most elements on each side that an arc may replace.
const MAX_CONSUMED: usize = 400;
/// Most steps of Newton's method.
const MAX_STEPS: usize = 30;
/// Largest turn of an arc. Above half a turn where the curves bend away from each other.
const MAX_TURN: f64 = 1.2 * PI;
/// Part of an element's length by which a foot may miss it, by rounding.
const SLACK: f64 = 1e-9;

/// An arc that touches the elements on both sides of a corner.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rounding {
    /// Number of the last element before the arc, counted from the corner.
    before: usize,
    /// Number of the first element after the arc, counted from the corner.
    after: usize,
    /// Distance from the beginning of each of the two to where the arc touches it.
    feet_m: [f64; 2],
}

impl Rounding {
    /// The arc of a radius nearest to the corner between the end of `before` and the beginning of `after`; `None` if it does
    /// not fit. `turn` is the angle of the corner, above 0 to the left.
    pub(super) fn find(before: &[Element], after: &[Element], turn: f64, radius_m: f64) -> Option<Self> {
        let side_m = radius_m * turn.signum();
        for sum in 0..2 * MAX_CONSUMED {
            if sum + 1 >= before.len() + after.len() {
                break;
            }
            for i in sum.saturating_sub(after.len() - 1)..=sum.min(before.len() - 1) {
                let j = sum - i;
                let [first, second] = [&before[before.len() - 1 - i], &after[j]];
                let feet_m = feet_m(first, second, side_m).filter(|&[first_m, second_m]| {
                    // An arc that turns further goes round the wrong way.
                    arc_turn(first.at(first_m).1, second.at(second_m).1, turn) <= MAX_TURN
                });
                if let Some(feet_m) = feet_m {
                    return Some(Self { before: i, after: j, feet_m });
                }
            }
        }
        None
    }

    /// The longer of the two lengths that the arc replaces, before and after the corner.
    pub(super) fn replaced_m(&self, before: &[Element], after: &[Element]) -> f64 {
        let length_m = |elements: &[Element]| elements.iter().map(|element| element.length_m).sum::<f64>();
        let before_m = length_m(&before[before.len() - 1 - self.before..]) - self.feet_m[0];
        f64::max(before_m, length_m(&after[..self.after]) + self.feet_m[1])
    }

    /// Replaces the elements at the corner by the arc. Returns the arc.
    pub(super) fn apply(
        &self,
        before: &mut Vec<Element>,
        after: &mut Vec<Element>,
        turn: f64,
        radius_m: f64,
    ) -> Vec<Element> {
        before.truncate(before.len() - self.before);
        after.drain(..self.after);
        let [first, second] = [before.pop().expect("the arc touches it"), after[0]];
        let first = first.part(0.0, self.feet_m[0]);
        let second = second.part(self.feet_m[1], second.length_m);
        let (begin, tangent) = first.end();
        before.push(first);
        after[0] = second;
        let angle = arc_turn(tangent, second.tangent, turn);
        let arc = Element { begin, tangent, curvature: turn.signum() / radius_m, length_m: radius_m * angle };
        bounded(&arc).into_iter().flatten().collect()
    }
}

/// Angle by which an arc turns from one direction to another, to the same side as a corner; from 0 to a whole turn.
fn arc_turn(from: DVec2, to: DVec2, turn: f64) -> f64 {
    (from.angle_to(to) * turn.signum()).rem_euclid(TAU)
}

/// Where a circle touches two elements, which lie at a signed distance from its centre; `None` if it does not touch both.
///
/// Newton's method solves for the centre, first from where the offset tangents meet.
fn feet_m(first: &Element, second: &Element, side_m: f64) -> Option<[f64; 2]> {
    [[1.0, 0.0], [0.5, 0.5], [0.0, 1.0]].into_iter().find_map(|starts| {
        let lines = [(first, starts[0]), (second, starts[1])].map(|(element, part)| {
            let (begin, tangent) = element.at(part * element.length_m);
            Element { begin, tangent, curvature: 0.0, length_m: 0.0 }
        });
        let mut centre = newton_step(DVec2::ZERO, &lines, side_m)?;
        for _ in 0..MAX_STEPS {
            let next = newton_step(centre, &[*first, *second], side_m)?;
            let moved_m = next.distance(centre);
            centre = next;
            if moved_m <= 1e-12 * (side_m.abs() + centre.length()) {
                break;
            }
        }
        let is_solved = [first, second].iter().all(|element| (element.offset_m(centre) - side_m).abs() < SLACK);
        let feet_m = [first, second].map(|element| (element.foot_m(centre), element.length_m));
        let on = |(foot_m, length_m): (f64, f64)| (-SLACK..=length_m + SLACK).contains(&foot_m);
        (is_solved && feet_m.into_iter().all(on)).then(|| feet_m.map(|(foot_m, length_m)| foot_m.clamp(0.0, length_m)))
    })
}

/// A point whose distances from two elements are nearer to `side_m`.
fn newton_step(point: DVec2, elements: &[Element; 2], side_m: f64) -> Option<DVec2> {
    let [first, second] = elements.map(|element| {
        let (_, tangent) = element.at(element.foot_m(point));
        (tangent.perp(), element.offset_m(point) - side_m)
    });
    let gradients = DMat2::from_cols(first.0, second.0).transpose();
    let determinant = gradients.determinant();
    let step = gradients.inverse() * DVec2::new(first.1, second.1);
    (determinant.abs() > 1e-9 && step.is_finite()).then_some(point - step)
}
