//! The pieces of the route on which the handles of a section are, one for each handle.
//!
//! A piece is a part of a segment about an anchor, short enough to derive the sine and cosine of every direction on it from
//! those at the anchor. It lasts while its handle walks some distance, so it is rarely renewed. Lines, arcs and spirals have
//! pieces of one form. So neighbouring handles on different segments are calculated by the same vector instructions.

use super::Curve;
use super::heights::Heights;
use super::lanes::{HANDLES, LANES, ROWS, Values};
use crate::numerics::multiply_add;
use crate::numerics::small_sine_and_versine;
use crate::route::PlanPiece;

/// The pieces of the handles of a section.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Places {
    /// Parameters of the anchors.
    anchors: Values,
    /// Largest distances from the anchors, in units of the parameter.
    reaches: Values,
    /// Centres, in metres.
    x_m: Values,
    y_m: Values,
    /// Directions from the centres to the anchors.
    cosines: Values,
    sines: Values,
    /// Changes of these directions per unit of the parameter, in radians.
    turns: Values,
    /// Distances from the centres to the anchors, in metres.
    radii_m: Values,
    /// Changes of these distances per unit of the parameter, in metres.
    slopes_m: Values,
    /// Heights, once a handle is on ground that is not flat.
    heights: Option<Box<Heights>>,
}

impl Places {
    /// Pieces that no handle is on.
    pub(super) fn new() -> Self {
        let none = [f64::NAN; HANDLES];
        Self {
            anchors: none,
            reaches: none,
            x_m: none,
            y_m: none,
            cosines: none,
            sines: none,
            turns: none,
            radii_m: none,
            slopes_m: none,
            heights: None,
        }
    }

    /// Whether every handle is on its piece.
    #[inline(always)]
    pub(super) fn has_all(&self, parameters: &Values) -> bool {
        let mut beyond = [f64::NEG_INFINITY; LANES];
        for row in 0..ROWS {
            for (lane, beyond) in beyond.iter_mut().enumerate() {
                let k = row * LANES + lane;
                let over = (parameters[k] - self.anchors[k]).abs() - self.reaches[k];
                // Keeps a NaN.
                *beyond = if over <= *beyond { *beyond } else { over };
            }
        }
        beyond.into_iter().all(|over| over <= 0.0)
    }

    /// Finds the pieces of the handles that are not on theirs. Returns whether there are any: a NaN parameter has none, and
    /// neither has a segment without pieces.
    #[cold]
    #[inline(never)]
    pub(super) fn renew(&mut self, parameters: &Values, curve: Curve<'_>) -> bool {
        for (k, &parameter) in parameters.iter().enumerate() {
            let is_on = (parameter - self.anchors[k]).abs() <= self.reaches[k];
            if is_on {
                continue;
            }
            if parameter.is_nan() {
                return false;
            }
            let lift = curve.route.profile_piece(parameter);
            let ends = lift.as_ref().map_or([f64::NEG_INFINITY, f64::INFINITY], |(_, ends)| *ends);
            let Some(piece) = curve.piece_at(parameter, ends) else { return false };
            self.set(k, &piece);
            if let Some((lift, _)) = lift {
                self.heights.get_or_insert_with(|| Box::new(Heights::new())).set(k, &lift);
            }
        }
        true
    }

    fn set(&mut self, k: usize, piece: &PlanPiece) {
        let PlanPiece { anchor, reach, centre, cosine, sine, turn, radius_m, slope_m } = *piece;
        (self.anchors[k], self.reaches[k]) = (anchor, reach);
        [self.x_m[k], self.y_m[k]] = centre.into();
        (self.cosines[k], self.sines[k], self.turns[k]) = (cosine, sine, turn);
        (self.radii_m[k], self.slopes_m[k]) = (radius_m, slope_m);
    }

    /// Position of a handle and its change per unit of the parameter, both in metres.
    #[inline(always)]
    pub(super) fn point<const FUSED: bool>(&self, k: usize, parameter: f64) -> [f64; 4] {
        let from_anchor = parameter - self.anchors[k];
        let (turn, slope_m) = (self.turns[k], self.slopes_m[k]);
        let (small_sine, versine) = small_sine_and_versine::<FUSED>(turn * from_anchor);
        let (sine, cosine) = (self.sines[k], self.cosines[k]);
        let sine_here = sine + multiply_add::<FUSED>(sine, versine, cosine * small_sine);
        let cosine_here = cosine + multiply_add::<FUSED>(cosine, versine, -(sine * small_sine));
        let radius_m = multiply_add::<FUSED>(slope_m, from_anchor, self.radii_m[k]);
        let turned_m = turn * radius_m;
        [
            multiply_add::<FUSED>(radius_m, cosine_here, self.x_m[k]),
            multiply_add::<FUSED>(radius_m, sine_here, self.y_m[k]),
            multiply_add::<FUSED>(slope_m, cosine_here, -(turned_m * sine_here)),
            multiply_add::<FUSED>(slope_m, sine_here, turned_m * cosine_here),
        ]
    }

    /// Height of a handle and its change per unit of the parameter, both in metres.
    #[inline(always)]
    pub(super) fn height<const FUSED: bool>(&self, k: usize, parameter: f64) -> [f64; 2] {
        self.heights.as_ref().map_or([f64::NAN; 2], |heights| heights.at::<FUSED>(k, parameter))
    }
}
