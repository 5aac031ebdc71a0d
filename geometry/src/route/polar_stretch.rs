//! What spirals and arcs have in common: the radius is linear in the polar angle about a fixed centre.

use glam::DVec2;

/// A stretch of a route on which r = `radius_m` + `radius_per_radian_m`·φ, φ being the polar angle about `centre` and
/// linear in the place: φ = `angle` + `turn`·place.
///
/// A spiral about the origin has `radius_m` 0, an arc has `radius_per_radian_m` 0. The radius may be negative: the point
/// then lies across the centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PolarStretch {
    /// Place at which it begins; it ends where the next one begins.
    pub begin: f64,
    /// Metres.
    pub centre: DVec2,
    /// Radians at place 0.
    pub angle: f64,
    /// 1 where the angle grows with the place (counter-clockwise), −1 where it falls.
    pub turn: f64,
    /// Metres at the angle 0.
    pub radius_m: f64,
    /// Metres.
    pub radius_per_radian_m: f64,
}
