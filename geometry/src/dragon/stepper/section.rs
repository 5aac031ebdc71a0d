//! A section of the chain, stepped as a whole in vectors of four handles.

use super::Curve;
use super::lanes::{HANDLES, LANES, ROWS, Values, index};
use super::places::Places;
use super::scratch::{Ahead, Links, Scratch};
use crate::dragon::chain::Handle;
use crate::numerics::multiply_add;

/// Largest number of corrections in a step. A step that needs more fails.
const MAX_CORRECTIONS: usize = 6;
/// Step of the head from the last pose to the next.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    /// Length of the step, in metres.
    pub(super) step_m: f64,
    /// Half of the step squared, divided by the step before, in metres; 0 if there was none.
    pub(super) bend_m: f64,
}

/// The handles of a section at the last pose.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Section {
    parameters: Values,
    /// Changes of the parameters per metre of the head's travel.
    rates: Values,
    /// The rates one pose earlier.
    last_rates: Values,
    places: Places,
}

impl Section {
    /// A section without handles. [`place`](Self::place) must set them.
    pub(super) fn new() -> Self {
        let none = [f64::NAN; HANDLES];
        Self { parameters: none, rates: none, last_rates: none, places: Places::new() }
    }

    /// Sets the handles of the section, front first. A section with too few handles to fill it cannot be stepped.
    pub(super) fn place(&mut self, scratch: &mut Scratch, handles: impl Iterator<Item = (Handle, f64)>) {
        *self = Self::new();
        for (i, (handle, speed_m_per_unit)) in handles.take(HANDLES).enumerate() {
            let k = index(i);
            self.parameters[k] = handle.parameter;
            self.rates[k] = handle.speed_ratio / speed_m_per_unit;
            let (position, tangent_m) = (handle.position, handle.tangent * speed_m_per_unit);
            scratch.set(k, [position.x, position.y, tangent_m.x, tangent_m.y]);
            scratch.set_height(k, [handle.height_m, handle.climb * speed_m_per_unit]);
        }
        self.last_rates = self.rates;
    }

    /// Parameter and rate of each handle, front first.
    pub(super) fn places(&self) -> impl Iterator<Item = [f64; 2]> {
        (0..HANDLES).map(|i| self.place_of(i))
    }

    /// Parameter and rate of a handle, counted from the front.
    pub(super) fn place_of(&self, i: usize) -> [f64; 2] {
        [self.parameters[index(i)], self.rates[index(i)]]
    }

    /// Whether every handle has a position.
    #[inline(always)]
    pub(super) fn is_placed(&self) -> bool {
        !self.parameters[HANDLES - 1].is_nan()
    }

    /// Calculates the velocities for this speed of the head.
    #[inline(always)]
    pub(super) fn set_velocities<const ON_GROUND: bool>(&self, scratch: &mut Scratch, speed_mps: f64) {
        for k in 0..HANDLES {
            let places_per_s = self.rates[k] * speed_mps;
            scratch.velocity_x_mps[k] = scratch.tangent_x_m[LANES + k] * places_per_s;
            scratch.velocity_y_mps[k] = scratch.tangent_y_m[LANES + k] * places_per_s;
            if ON_GROUND {
                scratch.velocity_z_mps[k] = scratch.tangent_z_m[LANES + k] * places_per_s;
            }
        }
    }

    /// The last handle of the section.
    #[inline(always)]
    pub(super) fn last<const ON_GROUND: bool>(&self, scratch: &Scratch) -> Ahead {
        let (last, k) = (HANDLES - 1, LANES + HANDLES - 1);
        let [z_m, tangent_z_m] = if ON_GROUND { [scratch.z_m[k], scratch.tangent_z_m[k]] } else { [0.0; 2] };
        Ahead {
            parameter: self.parameters[last],
            position_m: [scratch.x_m[k], scratch.y_m[k], z_m],
            tangent_m: [scratch.tangent_x_m[k], scratch.tangent_y_m[k], tangent_z_m],
            rate: self.rates[last],
        }
    }

    /// Advances behind the handle ahead by one step. Returns whether the step succeeded. If it failed, the section must be placed
    /// again.
    ///
    /// Each handle is extrapolated by its last two rates. Newton's method on the squares of the links' lengths then corrects
    /// all handles at once. It repeats until the correction is so small that its own error, which is of the order of its
    /// square, vanishes.
    #[inline(always)]
    pub(super) fn advance<const FUSED: bool, const ON_GROUND: bool>(
        &mut self,
        scratch: &mut Scratch,
        curve: Curve<'_>,
        links: &Links,
        ahead: &Ahead,
        step: Step,
    ) -> bool {
        self.extrapolate::<FUSED>(step);
        for _ in 0..MAX_CORRECTIONS {
            if !self.stand::<FUSED, ON_GROUND>(scratch, curve) {
                return false;
            }
            scratch.lead::<ON_GROUND>(ahead);
            let walks = scratch.linearise::<FUSED, ON_GROUND>(links);
            scratch.sum_up_lanes::<FUSED>();
            let moved_m2 = self.correct::<FUSED, ON_GROUND>(scratch, ahead.rate);
            // A NaN meets neither condition.
            if !(walks && moved_m2 <= links.far_m2) {
                return false;
            }
            if moved_m2 <= links.exact_m2 {
                return true;
            }
        }
        false
    }

    /// Calculates positions and tangents at the handles' parameters. Returns false, and changes nothing, if one of the handles is
    /// on no piece of the route.
    #[inline(always)]
    pub(super) fn stand<const FUSED: bool, const ON_GROUND: bool>(
        &mut self,
        scratch: &mut Scratch,
        curve: Curve<'_>,
    ) -> bool {
        let Self { parameters, places, .. } = self;
        if !(places.has_all(parameters) || places.renew(parameters, curve)) {
            return false;
        }
        for (k, &parameter) in parameters.iter().enumerate() {
            scratch.set(k, places.point::<FUSED>(k, parameter));
            if ON_GROUND {
                scratch.set_height(k, places.height::<FUSED>(k, parameter));
            }
        }
        true
    }

    #[inline(always)]
    fn extrapolate<const FUSED: bool>(&mut self, step: Step) {
        for k in 0..HANDLES {
            let rate = self.rates[k];
            let straight = multiply_add::<FUSED>(step.step_m, rate, self.parameters[k]);
            self.parameters[k] = multiply_add::<FUSED>(step.bend_m, rate - self.last_rates[k], straight);
            self.last_rates[k] = rate;
        }
    }

    /// Joins the lanes and applies the corrections. Returns the sum of the squared corrections, in m².
    #[inline(always)]
    fn correct<const FUSED: bool, const ON_GROUND: bool>(&mut self, scratch: &mut Scratch, rate_ahead: f64) -> f64 {
        let Scratch { x_m, y_m, z_m, tangent_x_m, tangent_y_m, tangent_z_m, corrections, ratios, .. } = scratch;
        let (mut lane_corrections, mut lane_rates) = ([0.0; LANES], [rate_ahead; LANES]);
        for lane in 1..LANES {
            let k = HANDLES + lane - 1;
            lane_corrections[lane] = multiply_add::<FUSED>(ratios[k], lane_corrections[lane - 1], corrections[k]);
            lane_rates[lane] = ratios[k] * lane_rates[lane - 1];
        }
        let mut moved_m2 = [0.0; LANES];
        for row in 0..ROWS {
            for lane in 0..LANES {
                let (k, led) = (row * LANES + lane, (row + 1) * LANES + lane);
                let correction = multiply_add::<FUSED>(ratios[led], lane_corrections[lane], corrections[led]);
                self.parameters[k] += correction;
                self.rates[k] = ratios[led] * lane_rates[lane];
                let (step_x_m, step_y_m) = (tangent_x_m[led] * correction, tangent_y_m[led] * correction);
                x_m[led] += step_x_m;
                y_m[led] += step_y_m;
                moved_m2[lane] += multiply_add::<FUSED>(step_x_m, step_x_m, step_y_m * step_y_m);
                if ON_GROUND {
                    z_m[led] += tangent_z_m[led] * correction;
                }
            }
        }
        moved_m2.into_iter().sum()
    }
}
