//! A piece of a profile: height and speed of the lifted curve as polynomials of the route's parameter.

use std::f64::consts::PI;

/// Number of coefficients of a polynomial.
pub(crate) const ORDER: usize = 8;

/// Coefficients of a polynomial of the distance from an anchor, in units of the parameter, the constant first.
pub(super) type Polynomial = [f64; ORDER];

/// The lifted curve over a part of one segment, about an anchor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Piece {
    /// Parameter of the anchor.
    pub(crate) anchor: f64,
    /// Height of a handle in metres.
    pub(crate) heights: Polynomial,
    /// Metres of arc in space per unit of the parameter.
    pub(super) speeds: Polynomial,
    /// Travel at the anchor, in metres.
    pub(super) travel_m: f64,
}

impl Piece {
    /// Height at a parameter, in metres, and its growth per unit of the parameter.
    pub(super) fn height(&self, parameter: f64) -> [f64; 2] {
        value_and_slope(&self.heights, parameter - self.anchor)
    }

    /// Arc in space from the anchor to a parameter, in metres.
    pub(super) fn arc_m(&self, parameter: f64) -> f64 {
        let from_anchor = parameter - self.anchor;
        let terms = self.speeds.iter().enumerate().rev();
        terms.fold(0.0, |sum, (power, &speed)| sum * from_anchor + speed / (power + 1) as f64) * from_anchor
    }

    /// Travel at a parameter, in metres.
    pub(super) fn travel_m(&self, parameter: f64) -> f64 {
        self.travel_m + self.arc_m(parameter)
    }

    /// Metres of arc in space per unit of the parameter, at a parameter.
    pub(super) fn speed(&self, parameter: f64) -> f64 {
        value_and_slope(&self.speeds, parameter - self.anchor)[0]
    }
}

/// Value and derivative of a polynomial.
pub(super) fn value_and_slope(polynomial: &Polynomial, at: f64) -> [f64; 2] {
    polynomial.iter().rev().fold([0.0; 2], |[value, slope], &next| [value * at + next, slope * at + value])
}

/// Interpolation at the zeros of the Chebyshev polynomial T₈, between −1 and 1.
pub(super) struct Interpolation {
    /// The zeros, in order.
    pub(super) nodes: [f64; ORDER],
    /// Coefficients of the Chebyshev polynomials T₀ to T₇.
    chebyshev: [Polynomial; ORDER],
    /// Their values at the nodes.
    at_nodes: [[f64; ORDER]; ORDER],
}

impl Interpolation {
    pub(super) fn new() -> Self {
        let nodes: [f64; ORDER] = std::array::from_fn(|k| -(PI * (k as f64 + 0.5) / ORDER as f64).cos());
        let mut chebyshev = [[0.0; ORDER]; ORDER];
        (chebyshev[0][0], chebyshev[1][1]) = (1.0, 1.0);
        for order in 2..ORDER {
            // T(n + 1) = 2·t·T(n) − T(n − 1).
            for power in 0..ORDER {
                let raised = if power == 0 { 0.0 } else { chebyshev[order - 1][power - 1] };
                chebyshev[order][power] = 2.0 * raised - chebyshev[order - 2][power];
            }
        }
        let at_nodes = chebyshev.map(|chebyshev| nodes.map(|node| value_and_slope(&chebyshev, node)[0]));
        Self { nodes, chebyshev, at_nodes }
    }

    /// The polynomial through a value at each node, of the distance in units of which the interval is ±`half`. Terms within
    /// rounding, from the second order on, are left out: a straight line stays straight.
    pub(super) fn polynomial(&self, values: &[f64; ORDER], half: f64, rounding: f64) -> Polynomial {
        let mut polynomial = [0.0; ORDER];
        for (order, (chebyshev, at_nodes)) in self.chebyshev.iter().zip(&self.at_nodes).enumerate() {
            let sum: f64 = values.iter().zip(at_nodes).map(|(value, at_node)| value * at_node).sum();
            let share = if order == 0 { sum / ORDER as f64 } else { 2.0 * sum / ORDER as f64 };
            if order < 2 || share.abs() > rounding {
                for (coefficient, chebyshev) in polynomial.iter_mut().zip(chebyshev) {
                    *coefficient += share * chebyshev;
                }
            }
        }
        let mut scale = 1.0;
        polynomial.map(|coefficient| {
            let scaled = coefficient / scale;
            scale *= half;
            scaled
        })
    }
}

/// Bounds on the first and the second derivative of a polynomial up to a distance.
pub(super) fn derivative_bounds(polynomial: &Polynomial, reach: f64) -> [f64; 2] {
    let terms = polynomial.iter().enumerate().skip(1).rev();
    let [mut first, mut second] = [0.0; 2];
    for (power, coefficient) in terms {
        let rate = power as f64 * coefficient.abs();
        first = first * reach + rate;
        if power >= 2 {
            second = second * reach + rate * (power - 1) as f64;
        }
    }
    [first, second]
}
