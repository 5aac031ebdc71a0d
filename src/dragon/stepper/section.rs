//! A stretch of the chain that is stepped as one, in vectors of four handles.
//!
//! Handle i of a section, counted from its front, lies at the index (i mod [`ROWS`])·[`LANES`] + i / [`ROWS`]. So the
//! handle ahead of the one at index k lies at k − [`LANES`], and what one handle takes over from the next one ahead is
//! worked out for four stretches, the lanes, at once. In the end the lanes are joined.

use super::curve::Curve;
use super::sine::{multiply_add, sine_and_cosine, small_sine_and_versine};
use crate::dragon::chain::Handle;
use crate::route::PolarStretch;

pub(super) const LANES: usize = 4;
/// Handles of a lane. Four sections hold the handles of the paper's dragon but for the head's, which is given.
pub(super) const ROWS: usize = 14;
/// Handles of a section.
pub(super) const HANDLES: usize = LANES * ROWS;

/// One value for each handle of a section.
pub(super) type Values = [f64; HANDLES];
/// The same, and before them those of the handles ahead of the four lanes.
type LedValues = [f64; LANES + HANDLES];

/// Corrections of a step that are tried before it is given up.
const MAX_CORRECTIONS: usize = 6;
/// Angle from its anchor, in radians, up to which a handle's sine and cosine are worked out from the anchor's.
const ANCHOR_RANGE: f64 = 1.0 / 64.0;

/// How the head moves from the last pose to the next.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    /// Metres.
    pub(super) step_m: f64,
    /// Half of the step squared ÷ the step before, in metres; 0 if there was none.
    pub(super) bend_m: f64,
}

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
    pub(super) place: f64,
    pub(super) position_m: [f64; 2],
    /// Change of the position per unit of place.
    pub(super) tangent_m: [f64; 2],
    /// Change of the place per metre of the head's travel.
    pub(super) rate: f64,
}

/// What is worked out on the way to a pose, one section after the other in the same memory.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Scratch {
    x_m: LedValues,
    y_m: LedValues,
    /// Changes of the position per unit of place.
    tangent_x_m: LedValues,
    tangent_y_m: LedValues,
    /// By how much each place must change for a link to have its length, the handle ahead staying; then from the lane's
    /// front on.
    corrections: LedValues,
    /// By how much each place changes as that of the handle ahead does; then of the handle ahead of the lane.
    ratios: LedValues,
    velocity_x_mps: Values,
    velocity_y_mps: Values,
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

    /// Position and velocity of a handle.
    #[inline(always)]
    pub(super) fn moving(&self, index: usize) -> ([f64; 2], [f64; 2]) {
        let led = LANES + index;
        ([self.x_m[led], self.y_m[led]], [self.velocity_x_mps[index], self.velocity_y_mps[index]])
    }

    /// Puts the handles ahead of the lanes before the others: of the first lane that ahead of the section, of each other
    /// lane the last handle of the one before.
    #[inline(always)]
    fn lead(&mut self, ahead: &Ahead) {
        let ([x_m, y_m], [tangent_x_m, tangent_y_m]) = (ahead.position_m, ahead.tangent_m);
        let Self { x_m: xs, y_m: ys, tangent_x_m: tangent_xs, tangent_y_m: tangent_ys, .. } = self;
        for (values, first) in [(xs, x_m), (ys, y_m), (tangent_xs, tangent_x_m), (tangent_ys, tangent_y_m)] {
            values.copy_within(HANDLES..HANDLES + LANES - 1, 1);
            values[0] = first;
        }
    }
}

/// The handles of a section at the last pose.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Section {
    places: Values,
    /// Changes of the places per metre of the head's travel.
    rates: Values,
    /// The same one pose earlier.
    last_rates: Values,
    /// Places near the present ones at which sine and cosine are known.
    anchors: Values,
    anchor_sines: Values,
    anchor_cosines: Values,
    /// Number of the stretch on which the anchors lie; none if they are not to be used.
    anchored_on: Option<usize>,
}

impl Section {
    /// A section without handles: it has to be [`placed`](Self::place).
    pub(super) fn new() -> Self {
        let none = [f64::NAN; HANDLES];
        Self {
            places: none,
            rates: none,
            last_rates: none,
            anchors: none,
            anchor_sines: none,
            anchor_cosines: none,
            anchored_on: None,
        }
    }

    /// Puts the section where its handles have been found, front first. Where there are too few of them to fill it, it
    /// cannot be stepped.
    pub(super) fn place(&mut self, scratch: &mut Scratch, handles: impl Iterator<Item = (Handle, f64)>) {
        *self = Self::new();
        for (i, (handle, pace_m)) in handles.take(HANDLES).enumerate() {
            let k = index(i);
            self.places[k] = handle.place;
            self.rates[k] = handle.speed_ratio / pace_m;
            scratch.x_m[LANES + k] = handle.position.x;
            scratch.y_m[LANES + k] = handle.position.y;
            scratch.tangent_x_m[LANES + k] = handle.tangent.x * pace_m;
            scratch.tangent_y_m[LANES + k] = handle.tangent.y * pace_m;
        }
        self.last_rates = self.rates;
    }

    /// Whether every handle has its place.
    #[inline(always)]
    pub(super) fn is_placed(&self) -> bool {
        !self.places[HANDLES - 1].is_nan()
    }

    /// Works out the velocities with the head at this speed.
    #[inline(always)]
    pub(super) fn set_velocities(&self, scratch: &mut Scratch, speed_mps: f64) {
        for k in 0..HANDLES {
            let places_per_s = self.rates[k] * speed_mps;
            scratch.velocity_x_mps[k] = scratch.tangent_x_m[LANES + k] * places_per_s;
            scratch.velocity_y_mps[k] = scratch.tangent_y_m[LANES + k] * places_per_s;
        }
    }

    /// The last handle.
    #[inline(always)]
    pub(super) fn last(&self, scratch: &Scratch) -> Ahead {
        let (last, k) = (HANDLES - 1, LANES + HANDLES - 1);
        Ahead {
            place: self.places[last],
            position_m: [scratch.x_m[k], scratch.y_m[k]],
            tangent_m: [scratch.tangent_x_m[k], scratch.tangent_y_m[k]],
            rate: self.rates[last],
        }
    }

    /// Follows the handle ahead by a step. Returns whether it could: if not, the section has to be placed anew.
    ///
    /// Each handle is put where its last two rates take it. Newton's method on the squares of the links' lengths then
    /// corrects all of them at once, until the correction is small enough for its own error, which goes with its square,
    /// to vanish.
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
            let walks = linearise::<FUSED>(scratch, links);
            sum_up_lanes::<FUSED>(scratch);
            let moved_m2 = self.correct::<FUSED>(scratch, ahead.rate);
            // Not a number is neither.
            if !(walks && moved_m2 <= links.far_m2) {
                return false;
            }
            if moved_m2 <= links.exact_m2 {
                return true;
            }
        }
        false
    }

    /// Works out positions and tangents where the handles stand.
    #[inline(always)]
    pub(super) fn stand<const FUSED: bool>(&mut self, scratch: &mut Scratch, curve: Curve<'_>) {
        let front = curve.stretch_at(self.places[0]);
        match front.filter(|_| curve.stretch_at(self.places[HANDLES - 1]) == front) {
            Some(number) => self.stand_on::<FUSED>(scratch, number, &curve.stretches[number]),
            None => self.stand_across(scratch, curve),
        }
    }

    #[inline(always)]
    fn extrapolate<const FUSED: bool>(&mut self, step: Step) {
        for k in 0..HANDLES {
            let rate = self.rates[k];
            let straight = multiply_add::<FUSED>(step.step_m, rate, self.places[k]);
            self.places[k] = multiply_add::<FUSED>(step.bend_m, rate - self.last_rates[k], straight);
            self.last_rates[k] = rate;
        }
    }

    /// All handles on one stretch. Their sines and cosines are those of their anchors, turned by the angle from there.
    #[inline(always)]
    fn stand_on<const FUSED: bool>(&mut self, scratch: &mut Scratch, number: usize, stretch: &PolarStretch) {
        if self.anchored_on != Some(number) || self.farthest_from_anchor() > ANCHOR_RANGE {
            self.anchor::<FUSED>(number, stretch);
        }
        let PolarStretch { centre, angle, turn, radius_m, radius_per_radian_m, .. } = *stretch;
        let (turned_radius_m, turned_slope_m) = (turn * radius_m, turn * radius_per_radian_m);
        for k in 0..HANDLES {
            let from_anchor = turn * (self.places[k] - self.anchors[k]);
            let (small_sine, versine) = small_sine_and_versine::<FUSED>(from_anchor);
            let (sine, cosine) = (self.anchor_sines[k], self.anchor_cosines[k]);
            let (sine, cosine) = (
                sine + multiply_add::<FUSED>(sine, versine, cosine * small_sine),
                cosine + multiply_add::<FUSED>(cosine, versine, -(sine * small_sine)),
            );
            let polar = multiply_add::<FUSED>(turn, self.places[k], angle);
            let radius_m = multiply_add::<FUSED>(radius_per_radian_m, polar, radius_m);
            scratch.x_m[LANES + k] = multiply_add::<FUSED>(radius_m, cosine, centre.x);
            scratch.y_m[LANES + k] = multiply_add::<FUSED>(radius_m, sine, centre.y);
            let turned_m = multiply_add::<FUSED>(turned_slope_m, polar, turned_radius_m);
            scratch.tangent_x_m[LANES + k] = multiply_add::<FUSED>(turned_slope_m, cosine, -(turned_m * sine));
            scratch.tangent_y_m[LANES + k] = multiply_add::<FUSED>(turned_slope_m, sine, turned_m * cosine);
        }
    }

    #[inline(always)]
    fn farthest_from_anchor(&self) -> f64 {
        let mut farthest = [0.0; LANES];
        for row in 0..ROWS {
            for (lane, farthest) in farthest.iter_mut().enumerate() {
                let k = row * LANES + lane;
                let distance = (self.places[k] - self.anchors[k]).abs();
                *farthest = if distance > *farthest { distance } else { *farthest };
            }
        }
        farthest.into_iter().fold(0.0, f64::max)
    }

    #[inline(always)]
    fn anchor<const FUSED: bool>(&mut self, number: usize, stretch: &PolarStretch) {
        self.anchored_on = Some(number);
        self.anchors = self.places;
        for k in 0..HANDLES {
            let polar = multiply_add::<FUSED>(stretch.turn, self.anchors[k], stretch.angle);
            (self.anchor_sines[k], self.anchor_cosines[k]) = sine_and_cosine::<FUSED>(polar);
        }
    }

    /// Handles on several stretches, or on a curve that has none: the route is asked for each.
    fn stand_across(&mut self, scratch: &mut Scratch, curve: Curve<'_>) {
        self.anchored_on = None;
        for k in 0..HANDLES {
            let point = curve.route.point(self.places[k]);
            scratch.x_m[LANES + k] = point.position.x;
            scratch.y_m[LANES + k] = point.position.y;
            scratch.tangent_x_m[LANES + k] = point.tangent.x * point.pace_m;
            scratch.tangent_y_m[LANES + k] = point.tangent.y * point.pace_m;
        }
    }

    /// Joins the lanes and applies the corrections. Returns the sum of their squares, in m².
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
                self.places[k] += correction;
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

/// The index at which a section keeps its handle i, counted from the front.
#[inline(always)]
pub(super) fn index(i: usize) -> usize {
    (i % ROWS) * LANES + i / ROWS
}

/// How each link's length goes with the places of its two handles.
///
/// With the chord c from a handle to the one ahead and the tangents t here and t' there, |c|² = d² is corrected to first
/// order by c·t·δ = (|c|² − d²)/2 + c·t'·δ'. Returns whether every handle moves towards the one ahead, by an angle under
/// some 75° to the chord: then no other place at the same distance is near.
#[inline(always)]
fn linearise<const FUSED: bool>(scratch: &mut Scratch, links: &Links) -> bool {
    const LEAST_COSINE_SQUARE: f64 = 1.0 / 16.0;
    let Scratch { x_m, y_m, tangent_x_m, tangent_y_m, corrections, ratios, .. } = scratch;
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
            let pace_m2 = multiply_add::<FUSED>(tangent_x, tangent_x, tangent_y * tangent_y);
            let margin = multiply_add::<FUSED>(rear.abs(), rear, -(LEAST_COSINE_SQUARE * square_m2) * pace_m2);
            *least = if margin < *least { margin } else { *least };
        }
    }
    least.into_iter().fold(f64::INFINITY, f64::min) > 0.0
}

/// Makes each correction and ratio one from the front of its lane on.
#[inline(always)]
fn sum_up_lanes<const FUSED: bool>(scratch: &mut Scratch) {
    let Scratch { corrections, ratios, .. } = scratch;
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
