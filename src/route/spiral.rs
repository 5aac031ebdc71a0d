//! The Archimedean spiral r = b·θ, walked inward.

use std::f64::consts::TAU;

use glam::DVec2;
use thiserror::Error;

use super::{Route, RoutePoint};
use crate::number::Number;

const MAX_PITCH_M: f64 = 1_000.0;
const MAX_START_TURNS: f64 = 10_000.0;

/// Why a route cannot be.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum RouteError {
    /// Not a distance between neighbouring turns.
    #[error("pitch_m is {}, must be above 0 and at most {MAX_PITCH_M}", Number(*.0))]
    Pitch(f64),
    /// Not a number of turns from the centre.
    #[error("start_turns is {}, must be above 0 and at most {MAX_START_TURNS}", Number(*.0))]
    StartTurns(f64),
}

/// The spiral r = b·θ with pitch 2π·b, walked clockwise from θ = 2π·`start_turns` into the centre.
///
/// Its place is −θ: it grows in walking direction and is 0 at the centre. Outward the spiral has no end.
///
/// ```
/// use bench_dragon::route::{Route, Spiral};
///
/// let spiral = Spiral::new(0.55, 16.0)?;
/// let start = spiral.point(spiral.place(0.0));
/// assert!((start.position.x - 8.8).abs() < 1e-12 && start.tangent.y < -0.99);
/// # Ok::<(), bench_dragon::route::RouteError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spiral {
    pitch_m: f64,
    radius_per_radian_m: f64,
    /// Arc length from the centre to t = 0, in units of `radius_per_radian_m`.
    start_unit_length: f64,
}

impl Spiral {
    /// A spiral of this pitch whose t = 0 lies `start_turns` full turns out from the centre, on +x if that is whole.
    ///
    /// # Errors
    /// The pitch must be above 0 and at most 1000 m, the turns above 0 and at most 10 000.
    pub fn new(pitch_m: f64, start_turns: f64) -> Result<Self, RouteError> {
        if !(pitch_m > 0.0 && pitch_m <= MAX_PITCH_M) {
            return Err(RouteError::Pitch(pitch_m));
        }
        if !(start_turns > 0.0 && start_turns <= MAX_START_TURNS) {
            return Err(RouteError::StartTurns(start_turns));
        }
        let start_unit_length = unit_length(TAU * start_turns);
        Ok(Self { pitch_m, radius_per_radian_m: pitch_m / TAU, start_unit_length })
    }
}

impl Route for Spiral {
    fn start_travel_m(&self) -> f64 {
        0.0
    }

    fn end_travel_m(&self) -> f64 {
        self.radius_per_radian_m * self.start_unit_length
    }

    fn pitch_m(&self) -> f64 {
        self.pitch_m
    }

    fn travel(&self, place: f64) -> f64 {
        self.radius_per_radian_m * (self.start_unit_length - unit_length(-place))
    }

    fn place(&self, travel_m: f64) -> f64 {
        let left = self.start_unit_length - travel_m / self.radius_per_radian_m;
        -unit_angle(left.max(0.0))
    }

    fn point(&self, place: f64) -> RoutePoint {
        let angle = -place;
        let (sin, cos) = angle.sin_cos();
        let unit_pace = (1.0 + angle * angle).sqrt();
        // d/dplace of b·θ·(cos θ, sin θ), with θ = −place.
        let forward = DVec2::new(angle * sin - cos, -angle * cos - sin);
        RoutePoint {
            position: self.radius_per_radian_m * angle * DVec2::new(cos, sin),
            tangent: forward / unit_pace,
            pace_m: self.radius_per_radian_m * unit_pace,
        }
    }

    /// Outward the pace grows by at most b per radian, so a step of δ covers at most δ·(pace + b·δ) of arc; this is the
    /// δ for which that bound equals `arc_m`. The pace also is at least (pace + b·x)/√2 after x radians, so the step
    /// covers at least 1/√8 of the bound.
    fn step_back(&self, place: f64, arc_m: f64) -> f64 {
        let unit_arc = arc_m / self.radius_per_radian_m;
        let unit_pace = (1.0 + place * place).sqrt();
        place - 2.0 * unit_arc / (unit_pace + (unit_pace * unit_pace + 4.0 * unit_arc).sqrt())
    }

    /// Exact: |κ| = (2 + θ²) / (b·(1 + θ²)^(3/2)) grows all the way in, so its maximum is at the front.
    fn curvature_bound(&self, _rear: f64, front: f64) -> f64 {
        let squared = front * front;
        let unit_pace = (1.0 + squared).sqrt();
        (2.0 + squared) / (self.radius_per_radian_m * unit_pace * (1.0 + squared))
    }
}

/// Arc length of r = θ from the centre to `angle`: ½(θ·√(1 + θ²) + asinh θ).
fn unit_length(angle: f64) -> f64 {
    0.5 * (angle * (1.0 + angle * angle).sqrt() + angle.asinh())
}

/// The inverse of [`unit_length`] for `length >= 0`, to the last few units of rounding.
///
/// The length is convex in the angle and at least both θ and ½θ², so Newton's method from the lesser of the two upper
/// bounds that these give falls monotonically onto the root. It starts within a factor 1.31 and each step at least
/// squares the relative error, so six are enough; the loop ends when rounding stops the fall.
fn unit_angle(length: f64) -> f64 {
    let mut angle = length.min((2.0 * length).sqrt());
    for _ in 0..8 {
        let next = angle - (unit_length(angle) - length) / (1.0 + angle * angle).sqrt();
        if next >= angle {
            break;
        }
        angle = next;
    }
    angle
}
