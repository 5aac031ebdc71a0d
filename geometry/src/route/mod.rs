//! Routes: the curves that the handles of a dragon follow.
//!
//! A route is a curve with a walking direction. *Travel* is signed arc length in metres, 0 where t = 0. A *place* names
//! a point of the route by whatever number suits the curve; it grows in walking direction. Angles are counter-clockwise
//! from +x, x to the right and y away.

mod arc;
mod archimedean;
mod coil;
mod error;
mod polar_stretch;
mod spec;
mod spiral;
mod turnaround;
mod variation;

use std::fmt::Debug;

use glam::DVec2;

pub use arc::CircularArc;
pub use coil::Coil;
pub use error::{RADIUS_RATIO, RouteError};
pub use polar_stretch::PolarStretch;
pub use spec::{RouteSpec, SpiralSpec, TurnaroundSpec};
pub use spiral::Spiral;
pub use turnaround::Turnaround;
pub use variation::{PitchFamily, RouteVariation};

/// The route at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoutePoint {
    /// Metres.
    pub position: DVec2,
    /// Unit vector in walking direction.
    pub tangent: DVec2,
    /// Metres of arc per unit of place, above 0 except perhaps at the very ends of the curve.
    pub pace_m: f64,
}

/// A curve with a walking direction, once continuously differentiable, whose curvature is bounded.
///
/// Behind the start it goes on far enough for a whole dragon to stand on it. Every method is a pure function and takes
/// any place of the curve; none allocates but [`polar_stretches`](Self::polar_stretches).
pub trait Route: Debug + Send + Sync {
    /// Where the run begins, in metres of travel: 0, or less on a route whose t = 0 lies further on.
    fn start_travel_m(&self) -> f64;

    /// Where the route ends, in metres of travel.
    fn end_travel_m(&self) -> f64;

    /// Distance between neighbouring turns, in metres: boards wider than this overlap from one turn to the next.
    fn pitch_m(&self) -> f64;

    /// Signed arc length from t = 0 to a place, strictly increasing with it.
    fn travel(&self, place: f64) -> f64;

    /// The inverse of [`travel`](Self::travel); travel beyond the route's end gives the end.
    fn place(&self, travel_m: f64) -> f64;

    /// The same as [`place`](Self::place) but for rounding, quicker where `guess` is near to it.
    fn place_near(&self, travel_m: f64, guess: f64) -> f64 {
        let _ = guess;
        self.place(travel_m)
    }

    /// Position, walking direction and pace at a place.
    fn point(&self, place: f64) -> RoutePoint;

    /// A place behind `place`: at most `arc_m` of arc behind it, which a caller may rely on, and at least a third of
    /// that.
    ///
    /// Cheaper than [`place`](Self::place), which would give it exactly.
    fn step_back(&self, place: f64, arc_m: f64) -> f64;

    /// A bound on |curvature| in 1/m between two places, `rear <= front`.
    ///
    /// It never lies under the true maximum and tends to it as the stretch shrinks.
    fn curvature_bound(&self, rear: f64, front: f64) -> f64;

    /// How far rounding may move the point at a place, where the pace is `pace_m`, along the curve.
    fn rounding_m(&self, place: f64, pace_m: f64) -> f64 {
        f64::EPSILON * place.abs() * pace_m
    }

    /// The places at which the curvature jumps, in walking order.
    fn joints(&self) -> &[f64] {
        &[]
    }

    /// The whole route as stretches with a radius linear in the polar angle, in walking order; none for another curve.
    ///
    /// The first one has no beginning.
    fn polar_stretches(&self) -> Vec<PolarStretch> {
        Vec::new()
    }

    /// The route's rear part that is a spiral, if it has one: there, contacts can be ruled out without a search.
    fn coil(&self) -> Option<Coil> {
        None
    }
}
