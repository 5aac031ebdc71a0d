//! A radius at which the head's link does not walk.
//!
//! With the head there and the rear handle further out by Δ, the link, from front to rear, has the components q outward
//! and q' across, q² + q'² = d². A link that has walked in from where Δ < π still has Δ < π and makes less than a right angle with
//! the tangent: b·q + r·q' > 0. For at Δ = π it would not, and a jump is no walk.
//!
//! As the pitch grows from p to p', Δ only falls, so the link turns outward: q only grows, and q' with it as long as
//! q < 0. So if Δ ≥ π at p', the link walks at no pitch of the step; nor if, with q and q' as they are at p', q < 0 and
//! b·q + r·q' < 0 even with the b of p.

use std::f64::consts::{PI, TAU};

use super::{LeadIn, MAX_PITCH_M};

/// Radii looked at for the one with the most to prove.
const LOOKS: u32 = 64;

/// First step, in pitches.
const FIRST_STEP: f64 = 0.1;

/// The head's radius at which its link does not walk.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stop {
    radius_m: f64,
}

impl Stop {
    /// The radius between the circle and the start at which the link is furthest from walking, if there is one at which
    /// it does not.
    pub(super) fn tightest(lead_in: &LeadIn<'_>, pitch_m: f64) -> Option<Self> {
        let span_m = lead_in.start_radius_m(pitch_m) - lead_in.circle_radius_m;
        let looks = (0..=LOOKS).map(|look| {
            // Denser towards the circle, where the curve is tighter.
            let part = f64::from(look) / f64::from(LOOKS);
            let stop = Self { radius_m: lead_in.circle_radius_m + part * part * span_m };
            (stop.walk(lead_in, pitch_m, pitch_m), stop)
        });
        let (walk, stop) = looks.min_by(|(ours, _), (theirs, _)| ours.total_cmp(theirs))?;
        (walk < 0.0).then_some(stop)
    }

    /// A pitch up to which the link provably does not walk here, from one at which it stops.
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

    /// Greatest cosine between link and tangent over all pitches from one to a greater one, in m²: not over 0 if the link
    /// walks at none of them.
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
