//! A section of the chain, stepped as a whole in vectors of four handles.

use super::Curve;
use super::lanes::{HANDLES, LANES, ROWS, Values, index};
use super::scratch::{Ahead, Links, Scratch};
use crate::dragon::chain::Handle;
use crate::numerics::{multiply_add, sine_and_cosine, small_sine_and_versine};
use crate::route::{Kernel, PolarKernel};

/// Largest number of corrections in a step. A step that needs more fails.
const MAX_CORRECTIONS: usize = 6;
/// Largest angle from its anchor, in radians, at which a handle's sine and cosine are derived from those of the anchor.
const ANCHOR_RANGE: f64 = 1.0 / 64.0;

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
    /// Parameters near the present ones at which sine and cosine are known.
    anchors: Values,
    anchor_sines: Values,
    anchor_cosines: Values,
    /// Index of the segment that contains the anchors; `None` if the anchors are invalid.
    anchored_on: Option<usize>,
}

impl Section {
    /// A section without handles. [`place`](Self::place) must set them.
    pub(super) fn new() -> Self {
        let none = [f64::NAN; HANDLES];
        Self {
            parameters: none,
            rates: none,
            last_rates: none,
            anchors: none,
            anchor_sines: none,
            anchor_cosines: none,
            anchored_on: None,
        }
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
        }
        self.last_rates = self.rates;
    }

    /// Whether every handle has a position.
    #[inline(always)]
    pub(super) fn is_placed(&self) -> bool {
        !self.parameters[HANDLES - 1].is_nan()
    }

    /// Calculates the velocities for this speed of the head.
    #[inline(always)]
    pub(super) fn set_velocities(&self, scratch: &mut Scratch, speed_mps: f64) {
        for k in 0..HANDLES {
            let places_per_s = self.rates[k] * speed_mps;
            scratch.velocity_x_mps[k] = scratch.tangent_x_m[LANES + k] * places_per_s;
            scratch.velocity_y_mps[k] = scratch.tangent_y_m[LANES + k] * places_per_s;
        }
    }

    /// The last handle of the section.
    #[inline(always)]
    pub(super) fn last(&self, scratch: &Scratch) -> Ahead {
        let (last, k) = (HANDLES - 1, LANES + HANDLES - 1);
        Ahead {
            parameter: self.parameters[last],
            position_m: [scratch.x_m[k], scratch.y_m[k]],
            tangent_m: [scratch.tangent_x_m[k], scratch.tangent_y_m[k]],
            rate: self.rates[last],
        }
    }

    /// Follows the handle ahead by one step. Returns whether the step succeeded. If it failed, the section must be placed
    /// again.
    ///
    /// Each handle is extrapolated by its last two rates. Newton's method on the squares of the links' lengths then corrects
    /// all handles at once. It repeats until the correction is so small that its own error, which is of the order of its
    /// square, vanishes.
    #[inline(always)]
    pub(super) fn follow<const FUSED: bool>(
        &mut self,
        scratch: &mut Scratch,
        curve: Curve<'_>,
        links: &Links,
        ahead: &Ahead,
        step: Step,
    ) -> bool {
        self.extrapolate::<FUSED>(step);
        for _ in 0..MAX_CORRECTIONS {
            self.stand::<FUSED>(scratch, curve);
            scratch.lead(ahead);
            let walks = scratch.linearise::<FUSED>(links);
            scratch.sum_up_lanes::<FUSED>();
            let moved_m2 = self.correct::<FUSED>(scratch, ahead.rate);
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

    /// Calculates positions and tangents at the handles' parameters.
    #[inline(always)]
    pub(super) fn stand<const FUSED: bool>(&mut self, scratch: &mut Scratch, curve: Curve<'_>) {
        let [rear, front] = [HANDLES - 1, 0].map(|end| curve.segment_at(self.parameters[end]));
        // A NaN parameter lies on no segment. The step that produced it fails.
        let (Some(rear), Some(front)) = (rear, front) else { return };
        match &curve.kernels[front] {
            Kernel::Polar(polar) if rear == front => self.stand_on_polar::<FUSED>(scratch, front, polar),
            Kernel::Line(line) if rear == front => {
                self.anchored_on = None;
                for k in 0..HANDLES {
                    scratch.set(k, line.point::<FUSED>(self.parameters[k]));
                }
            }
            _ => {
                self.anchored_on = None;
                for kernel in curve.kernels.iter().take(front + 1).skip(rear) {
                    self.stand_from_its_begin_on::<FUSED>(scratch, kernel);
                }
            }
        }
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

    /// Places all handles on one arc or spiral. Their sines and cosines are those of their anchors, rotated by the angle from
    /// the anchor.
    #[inline(always)]
    fn stand_on_polar<const FUSED: bool>(&mut self, scratch: &mut Scratch, number: usize, polar: &PolarKernel) {
        if self.anchored_on != Some(number) || self.farthest_from_anchor() > ANCHOR_RANGE {
            self.anchor::<FUSED>(number, polar);
        }
        for k in 0..HANDLES {
            let from_anchor = polar.turn * (self.parameters[k] - self.anchors[k]);
            let (small_sine, versine) = small_sine_and_versine::<FUSED>(from_anchor);
            let (sine, cosine) = (self.anchor_sines[k], self.anchor_cosines[k]);
            let sine_here = sine + multiply_add::<FUSED>(sine, versine, cosine * small_sine);
            let cosine_here = cosine + multiply_add::<FUSED>(cosine, versine, -(sine * small_sine));
            scratch.set(k, polar.point::<FUSED>(polar.polar::<FUSED>(self.parameters[k]), sine_here, cosine_here));
        }
    }

    /// Places the handles behind the beginning of a segment, as if the segment had no end. The call for the next segment
    /// overwrites the handles beyond that end.
    #[inline(always)]
    fn stand_from_its_begin_on<const FUSED: bool>(&self, scratch: &mut Scratch, kernel: &Kernel) {
        match kernel {
            Kernel::Line(line) => {
                self.stand_where_from(scratch, kernel.begin(), |parameter| line.point::<FUSED>(parameter));
            }
            Kernel::Polar(polar) => self.stand_where_from(scratch, kernel.begin(), |parameter| {
                let angle = polar.polar::<FUSED>(parameter);
                let (sine, cosine) = sine_and_cosine::<FUSED>(angle);
                polar.point::<FUSED>(angle, sine, cosine)
            }),
        }
    }

    #[inline(always)]
    fn stand_where_from(&self, scratch: &mut Scratch, begin: f64, point: impl Fn(f64) -> [f64; 4]) {
        for k in 0..HANDLES {
            let (here, before) = (point(self.parameters[k]), scratch.get(k));
            let is_here = self.parameters[k] >= begin;
            scratch.set(k, std::array::from_fn(|i| if is_here { here[i] } else { before[i] }));
        }
    }

    #[inline(always)]
    fn farthest_from_anchor(&self) -> f64 {
        let mut farthest = [0.0; LANES];
        for row in 0..ROWS {
            for (lane, farthest) in farthest.iter_mut().enumerate() {
                let k = row * LANES + lane;
                let distance = (self.parameters[k] - self.anchors[k]).abs();
                *farthest = if distance > *farthest { distance } else { *farthest };
            }
        }
        farthest.into_iter().fold(0.0, f64::max)
    }

    #[inline(always)]
    fn anchor<const FUSED: bool>(&mut self, number: usize, polar: &PolarKernel) {
        self.anchored_on = Some(number);
        self.anchors = self.parameters;
        for k in 0..HANDLES {
            let angle = polar.polar::<FUSED>(self.anchors[k]);
            (self.anchor_sines[k], self.anchor_cosines[k]) = sine_and_cosine::<FUSED>(angle);
        }
    }

    /// Joins the lanes and applies the corrections. Returns the sum of the squared corrections, in m².
    #[inline(always)]
    fn correct<const FUSED: bool>(&mut self, scratch: &mut Scratch, rate_ahead: f64) -> f64 {
        let Scratch { x_m, y_m, tangent_x_m, tangent_y_m, corrections, ratios, .. } = scratch;
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
            }
        }
        moved_m2.into_iter().sum()
    }
}
