//! Intermediate values of a pass: positions and velocities of the handles, and the linear equations of their links.

use super::lanes::{HANDLES, LANES, LedValues, ROWS, Values};
use crate::numerics::multiply_add;

/// Constants of the links of a section.
#[derive(Clone, Debug)]
pub(super) struct Links {
    /// Squared lengths of the links ahead of each handle, in m².
    pub(super) squares: Values,
    /// Largest sum of the squared corrections of a section after which no others follow, in m².
    pub(super) exact_m2: f64,
    /// Largest sum of the squared corrections of a section after which others may follow, in m².
    pub(super) far_m2: f64,
}

/// The handle ahead of a section.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ahead {
    pub(super) parameter: f64,
    pub(super) position_m: [f64; 2],
    /// Change of the position per unit of the parameter, in metres.
    pub(super) tangent_m: [f64; 2],
    /// Change of the parameter per metre of the head's travel.
    pub(super) rate: f64,
}

/// Intermediate values of a pass. One section after the other uses the same memory.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Scratch {
    pub(super) x_m: LedValues,
    pub(super) y_m: LedValues,
    /// Changes of the position per unit of the parameter.
    pub(super) tangent_x_m: LedValues,
    pub(super) tangent_y_m: LedValues,
    /// Change of each parameter that gives its link its length while the handle ahead stays. After
    /// [`sum_up_lanes`](Self::sum_up_lanes): while the handle ahead of the lane stays.
    pub(super) corrections: LedValues,
    /// Change of each parameter per change of the parameter of the handle ahead. After [`sum_up_lanes`](Self::sum_up_lanes): of
    /// the handle ahead of the lane.
    pub(super) ratios: LedValues,
    pub(super) velocity_x_mps: Values,
    pub(super) velocity_y_mps: Values,
}

impl Scratch {
    pub(super) fn new() -> Self {
        let (zero, led_zero) = ([0.0; HANDLES], [0.0; LANES + HANDLES]);
        Self {
            x_m: led_zero,
            y_m: led_zero,
            tangent_x_m: led_zero,
            tangent_y_m: led_zero,
            corrections: led_zero,
            ratios: led_zero,
            velocity_x_mps: zero,
            velocity_y_mps: zero,
        }
    }

    /// Sets position and change of a handle.
    #[inline(always)]
    pub(super) fn set(&mut self, index: usize, point: [f64; 4]) {
        let led = LANES + index;
        [self.x_m[led], self.y_m[led], self.tangent_x_m[led], self.tangent_y_m[led]] = point;
    }

    /// Position and velocity of a handle.
    #[inline(always)]
    pub(super) fn moving(&self, index: usize) -> ([f64; 2], [f64; 2]) {
        let led = LANES + index;
        ([self.x_m[led], self.y_m[led]], [self.velocity_x_mps[index], self.velocity_y_mps[index]])
    }

    /// Writes the handles ahead of the lanes in front of the others. The first lane follows the handle ahead of the section,
    /// each other lane the last handle of the lane before.
    #[inline(always)]
    pub(super) fn lead(&mut self, ahead: &Ahead) {
        let ([x_m, y_m], [tangent_x_m, tangent_y_m]) = (ahead.position_m, ahead.tangent_m);
        let Self { x_m: xs, y_m: ys, tangent_x_m: tangent_xs, tangent_y_m: tangent_ys, .. } = self;
        for (values, first) in [(xs, x_m), (ys, y_m), (tangent_xs, tangent_x_m), (tangent_ys, tangent_y_m)] {
            values.copy_within(HANDLES..HANDLES + LANES - 1, 1);
            values[0] = first;
        }
    }

    /// Linearises each link's length in the parameters of its two handles.
    ///
    /// Let c be the chord from a handle to the one ahead, t the tangent here and t' the tangent there. To first order, c·t·δ =
    /// (|c|² − d²)/2 + c·t'·δ' restores |c|² = d². Returns whether every handle moves towards the one ahead, at an angle under
    /// about 75° to the chord. Then no other parameter nearby has the same distance.
    #[inline(always)]
    pub(super) fn linearise<const FUSED: bool>(&mut self, links: &Links) -> bool {
        const LEAST_COSINE_SQUARE: f64 = 1.0 / 16.0;
        let Scratch { x_m, y_m, tangent_x_m, tangent_y_m, corrections, ratios, .. } = self;
        let mut least = [f64::INFINITY; LANES];
        for row in 0..ROWS {
            for (lane, least) in least.iter_mut().enumerate() {
                let (k, led) = (row * LANES + lane, (row + 1) * LANES + lane);
                let (chord_x, chord_y) = (x_m[k] - x_m[led], y_m[k] - y_m[led]);
                let (tangent_x, tangent_y) = (tangent_x_m[led], tangent_y_m[led]);
                let square_m2 = links.squares[k];
                let excess_m2 =
                    multiply_add::<FUSED>(chord_x, chord_x, multiply_add::<FUSED>(chord_y, chord_y, -square_m2));
                let rear = multiply_add::<FUSED>(chord_x, tangent_x, chord_y * tangent_y);
                let front = multiply_add::<FUSED>(chord_x, tangent_x_m[k], chord_y * tangent_y_m[k]);
                let per_rear = 1.0 / rear;
                corrections[led] = 0.5 * excess_m2 * per_rear;
                ratios[led] = front * per_rear;
                let speed_m2 = multiply_add::<FUSED>(tangent_x, tangent_x, tangent_y * tangent_y);
                let margin = multiply_add::<FUSED>(rear.abs(), rear, -(LEAST_COSINE_SQUARE * square_m2) * speed_m2);
                *least = if margin < *least { margin } else { *least };
            }
        }
        least.into_iter().fold(f64::INFINITY, f64::min) > 0.0
    }

    /// Accumulates the corrections and the ratios from the front of each lane.
    #[inline(always)]
    pub(super) fn sum_up_lanes<const FUSED: bool>(&mut self) {
        let Scratch { corrections, ratios, .. } = self;
        let (mut correction, mut ratio) = ([0.0; LANES], [1.0; LANES]);
        for row in 1..=ROWS {
            for lane in 0..LANES {
                let led = row * LANES + lane;
                correction[lane] = multiply_add::<FUSED>(ratios[led], correction[lane], corrections[led]);
                ratio[lane] *= ratios[led];
                corrections[led] = correction[lane];
                ratios[led] = ratio[lane];
            }
        }
    }
}
