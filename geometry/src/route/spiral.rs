//! The Archimedean spiral r = b·θ, walked inward.

use std::f64::consts::TAU;

use super::archimedean::Archimedean;
use super::variation::PieceVariation;
use super::{Coil, PitchFamily, PolarStretch, Route, RouteError, RoutePoint, RouteVariation};

/// The spiral r = b·θ with pitch 2π·b, walked clockwise from θ = 2π·`start_turns` into the centre.
///
/// Its place is −θ: it grows in walking direction and is 0 at the centre. Outward the spiral has no end.
///
/// ```
/// use bench_dragon_geometry::route::{Route, Spiral};
///
/// let spiral = Spiral::new(0.55, 16.0)?;
/// let start = spiral.point(spiral.place(0.0));
/// assert!((start.position.x - 8.8).abs() < 1e-12 && start.tangent.y < -0.99);
/// # Ok::<(), crate::route::RouteError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spiral {
    pitch_m: f64,
    curve: Archimedean,
    /// Arc length from the centre to t = 0.
    start_length_m: f64,
    end_travel_m: f64,
}

impl Spiral {
    /// A spiral of this pitch whose t = 0 lies `start_turns` full turns out from the centre, on +x if that is whole.
    ///
    /// # Errors
    /// The pitch must be above 0 and at most 1000 m, the turns above 0 and at most 10 000.
    pub fn new(pitch_m: f64, start_turns: f64) -> Result<Self, RouteError> {
        RouteError::check_pitch(pitch_m)?;
        RouteError::check_start_turns(start_turns)?;
        let curve = Archimedean { radius_per_radian_m: pitch_m / TAU };
        let start_length_m = curve.length_m(TAU * start_turns);
        Ok(Self { pitch_m, curve, start_length_m, end_travel_m: start_length_m })
    }

    /// The same spiral, walked only as far as a circle of this diameter about its centre.
    ///
    /// # Errors
    /// The circle must lie inside the start.
    pub fn to_circle(self, diameter_m: f64) -> Result<Self, RouteError> {
        let end_travel_m = self.travel(-0.5 * diameter_m.max(0.0) / self.curve.radius_per_radian_m);
        RouteError::check_span(self.start_travel_m(), end_travel_m)?;
        Ok(Self { end_travel_m, ..self })
    }
}

impl Route for Spiral {
    fn start_travel_m(&self) -> f64 {
        0.0
    }

    fn end_travel_m(&self) -> f64 {
        self.end_travel_m
    }

    fn pitch_m(&self) -> f64 {
        self.pitch_m
    }

    fn travel(&self, place: f64) -> f64 {
        self.start_length_m - self.curve.length_m(-place)
    }

    fn place(&self, travel_m: f64) -> f64 {
        -self.curve.angle(self.start_length_m - travel_m.min(self.end_travel_m))
    }

    fn place_near(&self, travel_m: f64, guess: f64) -> f64 {
        -self.curve.angle_near(self.start_length_m - travel_m.min(self.end_travel_m), -guess)
    }

    fn point(&self, place: f64) -> RoutePoint {
        self.curve.inward(-place)
    }

    fn step_back(&self, place: f64, arc_m: f64) -> f64 {
        place - self.curve.step_out(-place, arc_m)
    }

    /// Exact: the curvature grows all the way in, so its maximum is at the front.
    fn curvature_bound(&self, _rear: f64, front: f64) -> f64 {
        self.curve.curvature(-front)
    }

    fn polar_stretches(&self) -> Vec<PolarStretch> {
        vec![self.curve.way_in()]
    }

    fn coil(&self) -> Option<Coil> {
        Some(Coil {
            end_place: 0.0,
            end_angle: 0.0,
            radius_per_radian_m: self.curve.radius_per_radian_m,
            way_out: None,
        })
    }
}

/// Held is the number of turns at the start.
impl PitchFamily for Spiral {
    /// At a fixed angle everything grows as the pitch does.
    fn variation(&self, place: f64) -> RouteVariation {
        let point = self.point(place);
        PieceVariation { position: point.position / self.pitch_m, turn: 0.0, travel: self.travel(place) / self.pitch_m }
            .at_travel(&point, -self.curve.curvature(-place))
    }
}
