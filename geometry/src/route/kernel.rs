//! Segments in the route's own parameter, as plain arithmetic. One form evaluates a single point. The other has no branch, so a
//! loop over many handles compiles to vector instructions.
//!
//! Four numbers describe a point: x, y, and their changes per unit of the parameter, all in metres.

#![allow(clippy::inline_always, reason = "a function that is not inlined loses the vector instructions of its caller")]

use glam::DVec2;

use super::RoutePoint;
use crate::numerics::{multiply_add, sine_and_cosine_anywhere};

/// A segment in the route's own parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Kernel {
    Line(LineKernel),
    Polar(PolarKernel),
}

impl Kernel {
    /// The route at a parameter.
    #[inline]
    pub(super) fn at(&self, parameter: f64) -> RoutePoint {
        match self {
            Self::Line(line) => RoutePoint {
                position: line.origin + parameter * line.direction,
                tangent: line.direction,
                speed_m_per_unit: 1.0,
            },
            Self::Polar(polar) => {
                let angle = polar.angle + polar.turn * parameter;
                let (radius_m, slope_m) =
                    (polar.radius_m + polar.radius_per_radian_m * angle, polar.radius_per_radian_m);
                let (sine, cosine) = sine_and_cosine_anywhere(angle);
                let spoke = DVec2::new(cosine, sine);
                let position = polar.centre + radius_m * spoke;
                if slope_m == 0.0 {
                    let tangent = polar.turn.signum() * spoke.perp();
                    return RoutePoint { position, tangent, speed_m_per_unit: 1.0 };
                }
                // Calculates in units of the slope, so that the square of a tiny radius does not underflow to 0.
                let radius = angle - polar.axis;
                let speed = (1.0 + radius * radius).sqrt();
                let forward = 1f64.copysign(polar.turn * slope_m);
                RoutePoint {
                    position,
                    tangent: forward / speed * (spoke + radius * spoke.perp()),
                    speed_m_per_unit: slope_m.abs() * speed,
                }
            }
        }
    }

    /// The parameter at which the segment begins. It ends where the next segment begins.
    #[inline(always)]
    pub(crate) fn begin(&self) -> f64 {
        match self {
            Self::Line(line) => line.begin,
            Self::Polar(polar) => polar.begin,
        }
    }
}

/// A line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LineKernel {
    pub(super) begin: f64,
    /// The point of the line at parameter 0, in metres.
    pub(super) origin: DVec2,
    /// Unit vector.
    pub(super) direction: DVec2,
}

impl LineKernel {
    #[inline(always)]
    pub(crate) fn point<const FUSED: bool>(&self, parameter: f64) -> [f64; 4] {
        let Self { origin, direction, .. } = *self;
        [
            multiply_add::<FUSED>(parameter, direction.x, origin.x),
            multiply_add::<FUSED>(parameter, direction.y, origin.y),
            direction.x,
            direction.y,
        ]
    }
}

/// An arc or a spiral, whose radius is linear in the polar angle about a fixed centre.
///
/// With φ = `angle` + `turn`·parameter, a point lies at the distance `radius_m` + `radius_per_radian_m`·φ from the centre, in
/// the direction φ. For an arc, `radius_per_radian_m` is 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PolarKernel {
    pub(super) begin: f64,
    /// Centre, in metres.
    pub(super) centre: DVec2,
    /// φ at parameter 0, in radians.
    pub(super) angle: f64,
    /// Change of φ per unit of the parameter: ±1 on a spiral, the curvature on an arc.
    pub(crate) turn: f64,
    /// Radius at φ = 0, in metres.
    pub(super) radius_m: f64,
    /// Growth of the radius per radian of φ, in metres.
    pub(super) radius_per_radian_m: f64,
    /// φ at which the radius of a spiral is 0.
    pub(super) axis: f64,
}

impl PolarKernel {
    /// φ at parameter 0.
    pub(super) fn angle(&self) -> f64 {
        self.angle
    }

    /// φ at a parameter.
    #[inline(always)]
    pub(crate) fn polar<const FUSED: bool>(&self, parameter: f64) -> f64 {
        multiply_add::<FUSED>(self.turn, parameter, self.angle)
    }

    /// The point at φ, from the sine and cosine of φ.
    #[inline(always)]
    pub(crate) fn point<const FUSED: bool>(&self, polar: f64, sine: f64, cosine: f64) -> [f64; 4] {
        let Self { centre, turn, radius_m, radius_per_radian_m: slope_m, .. } = *self;
        let radius_here_m = multiply_add::<FUSED>(slope_m, polar, radius_m);
        let (turned_slope_m, turned_radius_m) = (turn * slope_m, turn * radius_here_m);
        [
            multiply_add::<FUSED>(radius_here_m, cosine, centre.x),
            multiply_add::<FUSED>(radius_here_m, sine, centre.y),
            multiply_add::<FUSED>(turned_slope_m, cosine, -(turned_radius_m * sine)),
            multiply_add::<FUSED>(turned_slope_m, sine, turned_radius_m * cosine),
        ]
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::numerics::sine_and_cosine;
    use crate::route::{CircularArc, Line, Route, Segment, Spiral, Turn, Turnaround};

    /// A point at a parameter of a segment.
    fn point(kernel: &Kernel, parameter: f64) -> [f64; 4] {
        match kernel {
            Kernel::Line(line) => line.point::<false>(parameter),
            Kernel::Polar(polar) => {
                let angle = polar.polar::<false>(parameter);
                let (sine, cosine) = sine_and_cosine::<false>(angle);
                polar.point::<false>(angle, sine, cosine)
            }
        }
    }

    /// Compares the kernels with the route. Near parameter 0 of the route, the segment's own parameter may be large, and its
    /// rounding counts.
    fn assert_same(route: &Route) -> Result<(), TestCaseError> {
        let kernels = route.kernels();
        let (start_m, end_m) = (route.start_travel_m(), route.end_travel_m());
        for step in 1..500 {
            let parameter = route.parameter(start_m + f64::from(step) / 500.0 * (end_m - start_m));
            let kernel = kernels.iter().rfind(|kernel| kernel.begin() < parameter).expect("the first has no beginning");
            let expected = route.point(parameter);
            let [x, y, change_x, change_y] = point(kernel, parameter);
            let (position, change) = (DVec2::new(x, y), DVec2::new(change_x, change_y));
            let scale = 1.0 + expected.position.length();
            prop_assert!(position.distance(expected.position) < 1e-11 * scale, "{parameter}: {expected:?}");
            let off_m = (change - expected.tangent * expected.speed_m_per_unit).length();
            prop_assert!(off_m < 1e-11 * (1.0 + expected.speed_m_per_unit), "{change} is not that of {expected:?}");
            let near = route.parameter_near(route.travel(parameter), parameter + 1e-3);
            let exact = route.parameter(route.travel(parameter));
            prop_assert!((near - exact).abs() < 1e-13 * (100.0 + parameter.abs()));
        }
        Ok(())
    }

    proptest! {
        #[test]
        fn a_kernel_has_the_points_of_its_route(pitch_m in 0.2..3.0_f64, size in 2.0..20.0_f64, ratio in 0.1..10.0_f64) {
            assert_same(&Turnaround::new(pitch_m, size, ratio).expect("a valid turnaround").route())?;
            assert_same(&Route::spiral(pitch_m, size).expect("a valid spiral"))?;
        }

        #[test]
        fn a_spiral_anywhere_and_a_line_have_the_points_of_their_route(
            pitch_m in 0.2..3.0_f64, centre in (-50.0..50.0_f64, -50.0..50.0_f64), axis in -3.0..3.0_f64, left in any::<bool>(),
        ) {
            let winding = if left { Turn::Clockwise } else { Turn::CounterClockwise };
            let spiral = Segment::Spiral(Spiral::new(pitch_m, f64::INFINITY, 10.0).about(centre.into(), axis, winding));
            let end = spiral.point(-10.0);
            let line = Segment::Line(Line::from_begin(end.position, end.tangent, 5.0));
            let arc = CircularArc::from_begin(line.point(5.0).position, end.tangent, 2.0, 3.0, winding);
            let route = Route::new(&[spiral, line, Segment::Arc(arc)], 100.0, [0.0, 111.0]).expect("the segments are joined");
            assert_same(&route)?;
        }
    }
}
