//! The Archimedean curve r = b·θ as such, from its centre outward.

use glam::DVec2;

use super::{PolarStretch, RoutePoint};

/// The curve r = b·θ for θ >= 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Archimedean {
    /// b, in metres.
    pub(super) radius_per_radian_m: f64,
}

impl Archimedean {
    /// Arc length from the centre to `angle`.
    pub(super) fn length_m(self, angle: f64) -> f64 {
        self.radius_per_radian_m * unit_length(angle)
    }

    /// The angle at an arc length from the centre; 0 at lengths below 0.
    pub(super) fn angle(self, length_m: f64) -> f64 {
        unit_angle((length_m / self.radius_per_radian_m).max(0.0))
    }

    /// The same as [`angle`](Self::angle) but for rounding, quicker where `guess` is near to it.
    pub(super) fn angle_near(self, length_m: f64, guess: f64) -> f64 {
        unit_angle_near((length_m / self.radius_per_radian_m).max(0.0), guess)
    }

    /// Metres of arc per radian.
    pub(super) fn pace_m(self, angle: f64) -> f64 {
        self.radius_per_radian_m * unit_pace(angle)
    }

    /// The curve at `angle`, walked towards the centre.
    pub(super) fn inward(self, angle: f64) -> RoutePoint {
        let (sin, cos) = angle.sin_cos();
        let unit_pace = unit_pace(angle);
        // −d/dθ of b·θ·(cos θ, sin θ).
        let forward = DVec2::new(angle * sin - cos, -angle * cos - sin);
        RoutePoint {
            position: self.radius_per_radian_m * angle * DVec2::new(cos, sin),
            tangent: forward / unit_pace,
            pace_m: self.radius_per_radian_m * unit_pace,
        }
    }

    /// The curve walked towards the centre, the place being −θ.
    pub(super) fn way_in(self) -> PolarStretch {
        PolarStretch {
            begin: f64::NEG_INFINITY,
            centre: DVec2::ZERO,
            angle: 0.0,
            turn: -1.0,
            radius_m: 0.0,
            radius_per_radian_m: self.radius_per_radian_m,
        }
    }

    /// Radians outward from `angle` that cover at most `arc_m` of arc, and at least 1/√8 of it.
    ///
    /// Outward the pace grows by at most b per radian, so a step of δ covers at most δ·(pace + b·δ) of arc; this is the
    /// δ for which that bound equals `arc_m`. The pace also is at least (pace + b·x)/√2 after x radians, so the step
    /// covers at least 1/√8 of the bound.
    pub(super) fn step_out(self, angle: f64, arc_m: f64) -> f64 {
        let unit_arc = arc_m / self.radius_per_radian_m;
        let unit_pace = unit_pace(angle);
        2.0 * unit_arc / (unit_pace + (unit_pace * unit_pace + 4.0 * unit_arc).sqrt())
    }

    /// Radians inward from `angle` that cover at most `arc_m` of arc, and at least half of it if they end before the
    /// centre.
    ///
    /// Inward the pace falls, and its mean over any stretch that ends at `angle` is at least half of what it is there.
    pub(super) fn step_in(self, angle: f64, arc_m: f64) -> f64 {
        arc_m / self.pace_m(angle)
    }

    /// |κ| = (2 + θ²) / (b·(1 + θ²)^(3/2)) in 1/m, which falls all the way out.
    pub(super) fn curvature(self, angle: f64) -> f64 {
        let squared = angle * angle;
        (2.0 + squared) / (self.radius_per_radian_m * (1.0 + squared).sqrt() * (1.0 + squared))
    }
}

fn unit_pace(angle: f64) -> f64 {
    (1.0 + angle * angle).sqrt()
}

/// Arc length of r = θ from the centre to `angle`: ½(θ·√(1 + θ²) + asinh θ).
fn unit_length(angle: f64) -> f64 {
    0.5 * (angle * unit_pace(angle) + angle.asinh())
}

/// The inverse of [`unit_length`] for `length >= 0`, to the last few units of rounding.
///
/// The length is convex in the angle and at least both θ and ½θ², so Newton's method from the lesser of the two upper
/// bounds that these give falls monotonically onto the root. It starts within a factor 1.31 and each step at least
/// squares the relative error, so six are enough; the loop ends when rounding stops the fall.
fn unit_angle(length: f64) -> f64 {
    let mut angle = length.min((2.0 * length).sqrt());
    for _ in 0..8 {
        let next = angle - (unit_length(angle) - length) / unit_pace(angle);
        if next >= angle {
            break;
        }
        angle = next;
    }
    angle
}

/// The same as [`unit_angle`] but for rounding.
///
/// Newton's method squares the error of a guess: half of its square, as the pace grows by at most 1 per radian and is at
/// least 1. So a step under 10⁻⁸ is the last. A guess from which two steps do not get there was no good.
fn unit_angle_near(length: f64, guess: f64) -> f64 {
    let mut angle = guess;
    for _ in 0..2 {
        let step = (length - unit_length(angle)) / unit_pace(angle);
        angle += step;
        if step.abs() < 1e-8 {
            return angle.max(0.0);
        }
    }
    unit_angle(length)
}
