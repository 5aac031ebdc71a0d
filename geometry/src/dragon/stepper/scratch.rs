//! What is worked out on the way to a pose: where handles stand and move to, and how their links hang together.

use super::lanes::{HANDLES, LANES, LedValues, ROWS, Values};
use crate::numerics::multiply_add;

/// What a section knows of its links.
#[derive(Clone, Debug)]
pub(super) struct Links {
    /// Squares of the lengths of the links ahead of each handle, in m².
    pub(super) squares: Values,
    /// What the corrections of a pose may come to at most, squared and summed up, for it to be taken as it is.
    pub(super) exact_m2: f64,
    /// What they may come to for a pose to be corrected any further.
    pub(super) far_m2: f64,
}

/// A handle as the section behind it sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ahead {
    pub(super) parameter: f64,
    pub(super) position_m: [f64; 2],
    /// Change of the position per unit of parameter.
    pub(super) tangent_m: [f64; 2],
    /// Change of the parameter per metre of the head's travel.
    pub(super) rate: f64,
}

/// What is worked out on the way to a pose, one section after the other in the same memory.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Scratch {
    pub(super) x_m: LedValues,
    pub(super) y_m: LedValues,
    /// Changes of the position per unit of parameter.
    pub(super) tangent_x_m: LedValues,
    pub(super) tangent_y_m: LedValues,
    /// By how much each parameter must change for a link to have its length, the handle ahead staying; then from the lane's
    /// front on.
    pub(super) corrections: LedValues,
    /// By how much each parameter changes as that of the handle ahead does; then of the handle ahead of the lane.
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

    /// Position and change of the position per unit of parameter, both in metres, of a handle.
    #[inline(always)]
    pub(super) fn get(&self, index: usize) -> [f64; 4] {
        let led = LANES + index;
        [self.x_m[led], self.y_m[led], self.tangent_x_m[led], self.tangent_y_m[led]]
    }

    /// Sets the same.
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

    /// Puts the handles ahead of the lanes before the others: of the first lane that ahead of the section, of each other
    /// lane the last handle of the one before.
    #[inline(always)]
    pub(super) fn lead(&mut self, ahead: &Ahead) {
        let ([x_m, y_m], [tangent_x_m, tangent_y_m]) = (ahead.position_m, ahead.tangent_m);
        let Self { x_m: xs, y_m: ys, tangent_x_m: tangent_xs, tangent_y_m: tangent_ys, .. } = self;
        for (values, first) in [(xs, x_m), (ys, y_m), (tangent_xs, tangent_x_m), (tangent_ys, tangent_y_m)] {
            values.copy_within(HANDLES..HANDLES + LANES - 1, 1);
            values[0] = first;
        }
    }

    /// How each link's length goes with the parameters of its two handles.
    ///
    /// With the chord c from a handle to the one ahead and the tangents t here and t' there, |c|² = d² is corrected to first
    /// order by c·t·δ = (|c|² − d²)/2 + c·t'·δ'. Returns whether every handle moves towards the one ahead, by an angle under
    /// some 75° to the chord: then no other parameter at the same distance is near.
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

    /// Makes each correction and ratio one from the front of its lane on.
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
