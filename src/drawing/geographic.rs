//! Positions on the earth, projected to metres about their centre.
//!
//! A point keeps its direction and its distance from the centre (an azimuthal equidistant projection of WGS 84). At the greatest
//! distance, [`MAX_DISTANCE_M`], lengths across that direction are too long by less than one part in a million.

use bench_dragon_geometry::number::Number;
use glam::{DVec2, DVec3};

use super::{DrawingFileError, PathChoice};

/// Semi-major axis in metres, and flattening, of WGS 84.
const RADIUS_M: f64 = 6_378_137.0;
const FLATTENING: f64 = 1.0 / 298.257_223_563;
/// Greatest distance of a point from the centre of its path, in metres.
const MAX_DISTANCE_M: f64 = 10_000.0;

/// Longitude and latitude in degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LonLat {
    pub(super) lon: f64,
    pub(super) lat: f64,
}

/// Points in metres about their centre, x to the east and y to the north.
///
/// # Errors
/// A point is not on the earth, or far from the centre, or the choice has a unit.
pub(super) fn local(points: &[LonLat], choice: &PathChoice<'_>) -> Result<Vec<DVec2>, DrawingFileError> {
    if choice.metres_per_unit.is_some() || choice.scale.is_some() {
        return Err(DrawingFileError("has positions in degrees: omit metres_per_unit and scale".to_owned()));
    }
    if choice.has_origin {
        return Err(DrawingFileError(
            "has positions in degrees, which lie about their own centre: omit [origin]".to_owned(),
        ));
    }
    let wrong = points.iter().find(|point| !(point.lon.abs() <= 360.0 && point.lat.abs() <= 90.0));
    if let Some(&LonLat { lon, lat }) = wrong {
        if lon.is_nan() || lat.is_nan() {
            return Err(DrawingFileError(
                "has a position whose longitude or latitude is missing or no number".to_owned(),
            ));
        }
        let [lon, lat] = [lon, lat].map(Number);
        let range = "must be from -360 to 360 and from -90 to 90";
        return Err(DrawingFileError(format!("has the longitude {lon} and the latitude {lat}, {range}")));
    }
    let Some(first) = points.first() else { return Ok(vec![]) };
    // Longitudes within half a turn of the first one: a path may cross the date line.
    let lon = |point: &LonLat| first.lon + (point.lon - first.lon + 540.0).rem_euclid(360.0) - 180.0;
    let middle = |values: &mut dyn Iterator<Item = f64>| {
        let (low, high) =
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        0.5 * (low + high)
    };
    let centre =
        LonLat { lon: middle(&mut points.iter().map(lon)), lat: middle(&mut points.iter().map(|point| point.lat)) };
    let plane = Plane::about(centre);
    let projected: Vec<DVec2> = points.iter().map(|&point| plane.point(point)).collect();
    let furthest_m = projected.iter().map(|point| point.length()).fold(0.0, f64::max);
    if furthest_m > MAX_DISTANCE_M {
        let (furthest_km, most_km) = ((furthest_m / 1000.0).ceil(), MAX_DISTANCE_M / 1000.0);
        return Err(DrawingFileError(format!(
            "has points {furthest_km} km from their centre, at most {most_km} km can be projected to a plane"
        )));
    }
    Ok(projected)
}

/// The plane that touches the earth at a centre.
struct Plane {
    centre: DVec3,
    east: DVec3,
    north: DVec3,
}

impl Plane {
    fn about(centre: LonLat) -> Self {
        let (lon, lat) = (centre.lon.to_radians(), centre.lat.to_radians());
        Self {
            centre: in_space(centre),
            east: DVec3::new(-lon.sin(), lon.cos(), 0.0),
            north: DVec3::new(-lat.sin() * lon.cos(), -lat.sin() * lon.sin(), lat.cos()),
        }
    }

    fn point(&self, point: LonLat) -> DVec2 {
        let chord = in_space(point) - self.centre;
        let flat = DVec2::new(chord.dot(self.east), chord.dot(self.north));
        let chord_m = chord.length();
        // The arc over a chord, to the third order.
        let arc_m = chord_m * (1.0 + chord_m * chord_m / (24.0 * RADIUS_M * RADIUS_M));
        if flat == DVec2::ZERO { DVec2::ZERO } else { flat.normalize() * arc_m }
    }
}

/// The position on the ellipsoid, in metres from the centre of the earth.
fn in_space(LonLat { lon, lat }: LonLat) -> DVec3 {
    let (lon, lat) = (lon.to_radians(), lat.to_radians());
    let squared = FLATTENING * (2.0 - FLATTENING);
    let normal_m = RADIUS_M / (1.0 - squared * lat.sin() * lat.sin()).sqrt();
    DVec3::new(
        normal_m * lat.cos() * lon.cos(),
        normal_m * lat.cos() * lon.sin(),
        normal_m * (1.0 - squared) * lat.sin(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn distance_m(from: [f64; 2], to: [f64; 2]) -> f64 {
        let points = [from, to].map(|[lon, lat]| LonLat { lon, lat });
        let local = local(&points, &PathChoice::default()).expect("near each other");
        local[0].distance(local[1])
    }

    /// The geodesics are those of GeographicLib 2.
    #[test]
    fn distances_are_those_along_the_ellipsoid() {
        for (from, to, expected_m) in [
            ([0.0, 0.0], [0.1, 0.0], 11_131.949),
            ([0.0, -0.05], [0.0, 0.05], 11_057.427),
            ([140.946, 37.941], [140.949, 37.943], 344.703),
            ([179.99, 10.0], [-179.99, 10.0], 2_192.787),
        ] {
            let found_m = distance_m(from, to);
            assert!((found_m - expected_m).abs() < 0.01, "{from:?} to {to:?} is {found_m}");
        }
    }

    #[test]
    fn paths_that_are_far_or_not_on_the_earth_are_refused() {
        let error = |points: &[[f64; 2]]| {
            let points: Vec<LonLat> = points.iter().map(|&[lon, lat]| LonLat { lon, lat }).collect();
            local(&points, &PathChoice::default()).expect_err("refused").to_string()
        };
        assert_eq!(
            error(&[[0.0, 0.0], [1.0, 0.0]]),
            "has points 56 km from their centre, at most 10 km can be projected to a plane"
        );
        assert!(
            error(&[[37.9, 140.9], [37.9, 140.8]])
                .starts_with("has the longitude 37.9 and the latitude 140.9, must be")
        );
        assert!(error(&[[f64::NAN, 0.0]]).starts_with("has a position whose longitude"));
    }
}
