//! Heights of the handles of a section on ground that is not flat: for each handle a polynomial of the route's parameter.

use super::lanes::{HANDLES, Values};
use crate::numerics::multiply_add;
use crate::route::{ORDER, Piece};

/// The polynomials of the handles of a section.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Heights {
    anchors: Values,
    /// Coefficients of each power of the distance from the anchor, the constant first.
    coefficients: [Values; ORDER],
}

impl Heights {
    /// Heights of no handle.
    pub(super) fn new() -> Self {
        let none = [f64::NAN; HANDLES];
        Self { anchors: none, coefficients: [none; ORDER] }
    }

    pub(super) fn set(&mut self, k: usize, piece: &Piece) {
        self.anchors[k] = piece.anchor;
        for (values, coefficient) in self.coefficients.iter_mut().zip(piece.heights) {
            values[k] = coefficient;
        }
    }

    /// Height of a handle and its change per unit of the parameter, both in metres.
    #[inline(always)]
    pub(super) fn at<const FUSED: bool>(&self, k: usize, parameter: f64) -> [f64; 2] {
        let from_anchor = parameter - self.anchors[k];
        let (mut height_m, mut change_m) = (self.coefficients[ORDER - 1][k], 0.0);
        for values in self.coefficients[..ORDER - 1].iter().rev() {
            change_m = multiply_add::<FUSED>(change_m, from_anchor, height_m);
            height_m = multiply_add::<FUSED>(height_m, from_anchor, values[k]);
        }
        [height_m, change_m]
    }
}
