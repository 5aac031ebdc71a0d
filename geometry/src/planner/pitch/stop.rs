//! Witness: a radius of the head at which its link does not walk.
//!
//! The head is at that radius, and the rear handle is further out by Δ. The link, from front to rear, has the component q
//! outward and the component q' across, with q² + q'² = d². A link that has walked in from where Δ < π still has Δ < π, and its
//! angle with the tangent is less than a right angle: b·q + r·q' > 0. At Δ = π this condition would fail, and a jump is not a
//! walk.
//!
//! As the pitch grows from p to p', Δ only falls, so the link turns outward. q only grows, and q' grows with it as long as
//! q < 0. So the link walks at no pitch of the step in two cases. Δ ≥ π at p'. Or, with q and q' as they are at p', q < 0 and
//! b·q + r·q' < 0 even with the b of p.

use std::f64::consts::{PI, TAU};

use super::{LeadIn, MAX_PITCH_M};

/// Number of radii sampled for the one with the strongest proof.
const LOOKS: u32 = 64;

/// First step, as a share of the pitch.
const FIRST_STEP: f64 = 0.1;

/// A radius of the head at which its link does not walk.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stop {
    radius_m: f64,
}

impl Stop {
    /// Finds the radius between circle and start at which the link is furthest from walking. Returns `None` if the link walks
    /// at every sample.
    pub(super) fn tightest(lead_in: &LeadIn<'_>, pitch_m: f64) -> Option<Self> {
        let span_m = lead_in.start_radius_m(pitch_m) - lead_in.circle_radius_m;
        let looks = (0..=LOOKS).map(|look| {
            // Samples are denser towards the circle, where the curve is tighter.
            let part = f64::from(look) / f64::from(LOOKS);
            let stop = Self { radius_m: lead_in.circle_radius_m + part * part * span_m };
            (stop.walk(lead_in, pitch_m, pitch_m), stop)
        });
        let (walk, stop) = looks.min_by(|(ours, _), (theirs, _)| ours.total_cmp(theirs))?;
        (walk < 0.0).then_some(stop)
    }

    /// Returns a pitch up to which the link provably does not walk at this radius. At `pitch_m` it does not walk.
    pub(super) fn proves_up_to(self, lead_in: &LeadIn<'_>, pitch_m: f64) -> f64 {
        let mut proved_m = pitch_m;
        let mut step_m = FIRST_STEP * pitch_m;
        while step_m > lead_in.tolerance_m(pitch_m) && !lead_in.meter.is_spent() {
            step_m = step_m.min(MAX_PITCH_M - proved_m);
            if self.walk(lead_in, proved_m, proved_m + step_m) < 0.0 {
                proved_m += step_m;
            } else {
                step_m *= 0.5;
            }
        }
        proved_m
    }

    /// Upper bound on b·q + r·q' over all pitches from `pitch_m` to `greater_m`, in m². If it is not above 0, the link walks at
    /// none of them.
    fn walk(self, lead_in: &LeadIn<'_>, pitch_m: f64, greater_m: f64) -> f64 {
        let Some(spiral) = lead_in.spiral(greater_m) else { return f64::INFINITY };
        let parameter = LeadIn::parameter(greater_m, self.radius_m);
        let Some(rear) = lead_in.chain(&spiral, parameter).nth(1) else {
            return f64::NEG_INFINITY;
        };
        let angle = parameter - rear.parameter;
        if angle >= PI {
            return f64::NEG_INFINITY;
        }
        let rear_radius_m = LeadIn::radius_m(greater_m, rear.parameter);
        let (outward_m, across_m) = (rear_radius_m * angle.cos() - self.radius_m, rear_radius_m * angle.sin());
        let least_pitch_m = if outward_m < 0.0 { pitch_m } else { greater_m };
        least_pitch_m / TAU * outward_m + self.radius_m * across_m
    }
}
