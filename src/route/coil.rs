//! The part of a route that is wound up as a spiral, of which more can be said than of any curve.

/// The rear part of a route, up to `end_place`, where it is the spiral r = b·θ about some centre.
///
/// Places grow by one per radian walked inward, and the route is wound outward without end. So the angle of a place is
/// `end_angle + end_place − place`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coil {
    /// The last place of the coil.
    pub end_place: f64,
    /// θ there, 0 or more.
    pub end_angle: f64,
    /// b in metres: the pitch over 2π.
    pub radius_per_radian_m: f64,
}

impl Coil {
    /// θ at a place, or none if the coil ends before it.
    pub fn angle(&self, place: f64) -> Option<f64> {
        (place <= self.end_place).then_some(self.end_angle + (self.end_place - place))
    }

    /// The place with this θ, which must be at least `end_angle`.
    pub fn place(&self, angle: f64) -> f64 {
        self.end_place - (angle - self.end_angle)
    }
}
