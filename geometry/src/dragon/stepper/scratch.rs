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
    pub(super) position_m: [f64; 3],
    /// Change of the position per unit of the parameter, in metres.
    pub(super) tangent_m: [f64; 3],
    /// Change of the parameter per metre of the head's travel.
    pub(super) rate: f64,
}

/// Intermediate values of a pass. One section after the other uses the same memory.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Scratch {
    pub(super) x_m: LedValues,
    pub(super) y_m: LedValues,
    /// Used on ground only, as all values in z.
    pub(super) z_m: LedValues,
    /// Changes of the position per unit of the parameter.
    pub(super) tangent_x_m: LedValues,
    pub(super) tangent_y_m: LedValues,
    pub(super) tangent_z_m: LedValues,
    /// Change of each parameter that gives its link its length while the handle ahead stays. After
    /// [`sum_up_lanes`](Self::sum_up_lanes): while the handle ahead of the lane stays.
    pub(super) corrections: LedValues,
    /// Change of each parameter per change of the parameter of the handle ahead. After [`sum_up_lanes`](Self::sum_up_lanes): of
    /// the handle ahead of the lane.
    pub(super) ratios: LedValues,
    pub(super) velocity_x_mps: Values,
    pub(super) velocity_y_mps: Values,
    pub(super) velocity_z_mps: Values,
}

impl Scratch {
    pub(super) fn new() -> Self {
        let (zero, led_zero) = ([0.0; HANDLES], [0.0; LANES + HANDLES]);
        Self {
            x_m: led_zero,
            y_m: led_zero,
            z_m: led_zero,
            tangent_x_m: led_zero,
            tangent_y_m: led_zero,
            tangent_z_m: led_zero,
            corrections: led_zero,
            ratios: led_zero,
            velocity_x_mps: zero,
            velocity_y_mps: zero,
            velocity_z_mps: zero,
        }
    }

    /// Sets position and change of a handle.
    #[inline(always)]
    pub(super) fn set(&mut self, index: usize, point: [f64; 4]) {
        let led = LANES + index;
        [self.x_m[led], self.y_m[led], self.tangent_x_m[led], self.tangent_y_m[led]] = point;
    }

    /// Sets height of a handle and its change.
    #[inline(always)]
    pub(super) fn set_height(&mut self, index: usize, height: [f64; 2]) {
        [self.z_m[LANES + index], self.tangent_z_m[LANES + index]] = height;
    }

    /// Position and velocity of a handle.
    #[inline(always)]
    pub(super) fn moving<const ON_GROUND: bool>(&self, index: usize) -> ([f64; 3], [f64; 3]) {
        let led = LANES + index;
        let [z_m, velocity_z_mps] = if ON_GROUND { [self.z_m[led], self.velocity_z_mps[index]] } else { [0.0; 2] };
        let velocity_mps = [self.velocity_x_mps[index], self.velocity_y_mps[index], velocity_z_mps];
        ([self.x_m[led], self.y_m[led], z_m], velocity_mps)
    }

    /// Writes the handles ahead of the lanes in front of the others. The first lane follows the handle ahead of the section,
    /// each other lane the last handle of the lane before.
    #[inline(always)]
    pub(super) fn lead<const ON_GROUND: bool>(&mut self, ahead: &Ahead) {
        let ([x_m, y_m, z_m], [tangent_x_m, tangent_y_m, tangent_z_m]) = (ahead.position_m, ahead.tangent_m);
        for (values, first) in [
            (&mut self.x_m, x_m),
            (&mut self.y_m, y_m),
            (&mut self.tangent_x_m, tangent_x_m),
            (&mut self.tangent_y_m, tangent_y_m),
        ] {
            lead(values, first);
        }
        if ON_GROUND {
            lead(&mut self.z_m, z_m);
            lead(&mut self.tangent_z_m, tangent_z_m);
        }
    }

    /// Linearises each link's length in the parameters of its two handles.
    ///
    /// Let c be the chord from a handle to the one ahead, t the tangent here and t' the tangent there. To first order, c·t·δ =
    /// (|c|² − d²)/2 + c·t'·δ' restores |c|² = d². Returns whether every handle moves towards the one ahead, at an angle under
    /// about 75° to the chord. Then no other parameter nearby has the same distance.
    #[inline(always)]
    pub(super) fn linearise<const FUSED: bool, const ON_GROUND: bool>(&mut self, links: &Links) -> bool {
        const LEAST_COSINE_SQUARE: f64 = 1.0 / 16.0;
        let Scratch { x_m, y_m, z_m, tangent_x_m, tangent_y_m, tangent_z_m, corrections, ratios, .. } = self;
        let mut least = [f64::INFINITY; LANES];
        for row in 0..ROWS {
            for (lane, least) in least.iter_mut().enumerate() {
                let (k, led) = (row * LANES + lane, (row + 1) * LANES + lane);
                let (chord_x, chord_y) = (x_m[k] - x_m[led], y_m[k] - y_m[led]);
                let (tangent_x, tangent_y) = (tangent_x_m[led], tangent_y_m[led]);
                let square_m2 = links.squares[k];
                let mut excess_m2 =
                    multiply_add::<FUSED>(chord_x, chord_x, multiply_add::<FUSED>(chord_y, chord_y, -square_m2));
                let mut rear = multiply_add::<FUSED>(chord_x, tangent_x, chord_y * tangent_y);
                let mut front = multiply_add::<FUSED>(chord_x, tangent_x_m[k], chord_y * tangent_y_m[k]);
                let mut speed_m2 = multiply_add::<FUSED>(tangent_x, tangent_x, tangent_y * tangent_y);
                if ON_GROUND {
                    let (chord_z, tangent_z) = (z_m[k] - z_m[led], tangent_z_m[led]);
                    excess_m2 = multiply_add::<FUSED>(chord_z, chord_z, excess_m2);
                    rear = multiply_add::<FUSED>(chord_z, tangent_z, rear);
                    front = multiply_add::<FUSED>(chord_z, tangent_z_m[k], front);
                    speed_m2 = multiply_add::<FUSED>(tangent_z, tangent_z, speed_m2);
                }
                let per_rear = 1.0 / rear;
                corrections[led] = 0.5 * excess_m2 * per_rear;
                ratios[led] = front * per_rear;
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

/// Writes the value ahead of each lane: first that of the handle ahead of the section, then those of the last handles of the lanes
/// before.
#[inline(always)]
fn lead(values: &mut LedValues, first: f64) {
    values.copy_within(HANDLES..HANDLES + LANES - 1, 1);
    values[0] = first;
}
