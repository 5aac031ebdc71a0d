//! B-splines as Bézier curves.
//!
//! Source: L. Ramshaw, *Blossoms are polar forms* (1989): a control point of a polynomial part is the polar form of the spline
//! at the ends of the part's interval.

use glam::{DVec2, DVec3};

use super::Bezier;

/// A B-spline, rational if its weights differ.
#[derive(Clone, Debug, PartialEq)]
pub struct Spline {
    /// Degree of its parts.
    pub degree: usize,
    /// Knots, in order: as many as control points, and the degree and 1 more.
    pub knots: Vec<f64>,
    /// Control points.
    pub points: Vec<DVec2>,
    /// A weight for each control point; none: all are 1.
    pub weights: Vec<f64>,
}

/// Greatest degree of a spline.
const MAX_DEGREE: usize = 11;

impl Spline {
    /// The Bézier curves of the spline, in their order; `None` if the numbers are not those of a spline.
    pub fn beziers(&self) -> Option<Vec<Bezier>> {
        let (degree, count) = (self.degree, self.points.len());
        let weights = if self.weights.is_empty() { vec![1.0; count] } else { self.weights.clone() };
        let are_ordered = self.knots.windows(2).all(|pair| pair[0] <= pair[1]);
        let is_spline = (1..=MAX_DEGREE).contains(&degree)
            && count > degree
            && self.knots.len() == count + degree + 1
            && weights.len() == count
            && weights.iter().all(|&weight| weight > 0.0 && weight.is_finite());
        if !is_spline || !are_ordered {
            return None;
        }
        let homogeneous = |(point, &weight): (&DVec2, &f64)| (*point * weight).extend(weight);
        let controls: Vec<DVec3> = self.points.iter().zip(&weights).map(homogeneous).collect();
        let spans = (degree..count).filter(|&span| self.knots[span] < self.knots[span + 1]);
        spans.map(|span| self.bezier(span, &controls)).collect()
    }

    /// The part between a knot and the next one.
    fn bezier(&self, span: usize, controls: &[DVec3]) -> Option<Bezier> {
        let [from, to] = [self.knots[span], self.knots[span + 1]];
        let polar = |ends: usize| self.polar(span, controls, |i| if i <= ends { to } else { from });
        let controls: Vec<DVec3> = (0..=self.degree).map(polar).collect();
        let weights: Vec<f64> = controls.iter().map(|control| control.z).collect();
        let is_valid = controls.iter().all(|control| control.is_finite() && control.z > 0.0);
        is_valid
            .then(|| Bezier::rational(controls.iter().map(|control| control.truncate() / control.z).collect(), weights))
    }

    /// The polar form of a part at the arguments 1 to the degree, by de Boor's algorithm.
    fn polar(&self, span: usize, controls: &[DVec3], argument: impl Fn(usize) -> f64) -> DVec3 {
        let degree = self.degree;
        let mut points: Vec<DVec3> = controls[span - degree..=span].to_vec();
        for level in 1..=degree {
            for i in (level..=degree).rev() {
                let [low, high] = [self.knots[span - degree + i], self.knots[span + 1 + i - level]];
                points[i] = points[i - 1].lerp(points[i], (argument(level) - low) / (high - low));
            }
        }
        points[degree]
    }
}
