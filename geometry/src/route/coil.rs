//! The part of a route that is wound up as a spiral, of which more can be said than of any curve.

/// The rear part of a route, up to `end_place`, where it is the spiral r = b·θ about some centre.
///
/// Places grow by one per radian walked inward, and the route is wound outward without end. So the angle of a place is
/// `end_angle + end_place − place`.
///
/// The route may go on to a *way out*: the same spiral, turned by half a turn about the same centre and walked outward
/// from the same angle on. All between the two then lies within the circle around the centre on which both end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coil {
    /// The last place of the coil.
    pub end_place: f64,
    /// θ there, 0 or more.
    pub end_angle: f64,
    /// b in metres: the pitch over 2π.
    pub radius_per_radian_m: f64,
    /// Where the way out begins, if there is one. Places grow by one per radian there too.
    pub way_out: Option<f64>,
}

impl Coil {
    /// θ at a place, or none if the coil ends before it.
    pub fn angle(&self, place: f64) -> Option<f64> {
        (place <= self.end_place).then_some(self.end_angle + (self.end_place - place))
    }

    /// θ at a place on the way out, or none before it.
    pub fn angle_out(&self, place: f64) -> Option<f64> {
        self.way_out.filter(|&way_out| place >= way_out).map(|way_out| self.end_angle + (place - way_out))
    }

    /// The place with this θ, which must be at least `end_angle`.
    pub fn place(&self, angle: f64) -> f64 {
        self.end_place - (angle - self.end_angle)
    }
}
