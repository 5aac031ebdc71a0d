//! Segments in the route's own parameter, as plain arithmetic. A [`Kernel`] evaluates any point of a segment. A [`PlanPiece`]
//! is a short part of any segment in a form without a branch, so a loop over many handles compiles to vector instructions.

use glam::DVec2;

use super::RoutePoint;
use super::kinds::kinds;
use crate::numerics::sine_and_cosine_anywhere;

/// Largest angle from its anchor, in radians, up to which a piece extends. Sine and cosine are derived from those at the
/// anchor.
const PIECE_ANGLE: f64 = 1.0 / 64.0;
/// Largest distance from its anchor, in metres, up to which a piece of a line extends.
const PIECE_M: f64 = 64.0;
/// Error of a sine or cosine, in units of `f64::EPSILON`.
const SINE_ERROR_EPSILONS: f64 = 2.0;
/// Share of a piece that lies behind the handle for which it is made. Handles walk forward, but corrections may be backward.
const PIECE_BEHIND: f64 = 0.125;

/// A part of a segment about an anchor. From the anchor, in units of the parameter, a point lies at the distance `radius_m` +
/// `slope_m`·s from the centre, and its direction has turned by `turn`·s.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlanPiece {
    /// Parameter of the anchor.
    pub(crate) anchor: f64,
    /// Largest distance from the anchor, in units of the parameter.
    pub(crate) reach: f64,
    /// Centre, in metres. A line's is its anchor.
    pub(crate) centre: DVec2,
    /// Direction from the centre to the anchor; a line's own direction.
    pub(crate) cosine: f64,
    pub(crate) sine: f64,
    /// Turn of the direction per unit of the parameter, in radians; 0 on a line.
    pub(crate) turn: f64,
    /// Distance from the centre to the anchor, in metres; 0 on a line.
    pub(crate) radius_m: f64,
    /// Growth of the distance per unit of the parameter, in metres; 1 on a line, 0 on an arc.
    pub(crate) slope_m: f64,
}

kinds! {
    $ as of_formula;
    /// A formula for the points of a segment in the route's own parameter.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub(crate) enum Formula {
        /// A line.
        Line(LineFormula),
        /// An arc or a spiral.
        Polar(PolarFormula),
    }
}

/// A segment in the route's own parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Kernel {
    /// The parameter at which the segment begins. It ends where the next segment begins.
    pub(crate) begin: f64,
    pub(super) formula: Formula,
}

/// Rounding between a parameter and its point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rounding {
    /// Number of roundings of the size of the parameter.
    pub(super) parameters: f64,
    /// Further rounding, in units of the parameter.
    pub(super) units: f64,
}

impl Kernel {
    /// The route at a parameter.
    #[inline]
    pub(super) fn at(&self, parameter: f64) -> RoutePoint {
        of_formula!(&self.formula, formula => formula.at(parameter))
    }

    /// A bound on the change of the speed per unit of the parameter.
    pub(super) fn acceleration_bound(&self) -> f64 {
        of_formula!(&self.formula, formula => formula.acceleration_bound())
    }

    pub(super) fn rounding(&self) -> Rounding {
        of_formula!(&self.formula, formula => formula.rounding())
    }

    /// The piece for a handle at a parameter of the segment, within an interval that ends no later than the segment. `None` for
    /// a formula without pieces.
    pub(crate) fn piece(&self, parameter: f64, [begin, end]: [f64; 2]) -> Option<PlanPiece> {
        let length = of_formula!(&self.formula, formula => formula.piece_length())?;
        let low = self.begin.max(begin).max(parameter - PIECE_BEHIND * length);
        let high = end.min(parameter + (1.0 - PIECE_BEHIND) * length);
        let anchor = 0.5 * (low + high);
        // Half of the length may be shorter, by rounding, than the distance of the parameter from the anchor.
        let reach = (high - anchor).max(anchor - low);
        of_formula!(&self.formula, formula => formula.piece(anchor, reach))
    }
}

/// The values that a formula can compute. Without pieces, handles on it are found by the reference solver, which takes longer.
pub(super) trait Evaluate {
    /// The route at a parameter.
    fn at(&self, parameter: f64) -> RoutePoint;

    /// A bound on the change of the speed per unit of the parameter.
    fn acceleration_bound(&self) -> f64 {
        0.0
    }

    fn rounding(&self) -> Rounding {
        Rounding { parameters: 1.0, units: 0.0 }
    }

    /// Greatest length of a piece, in units of the parameter.
    fn piece_length(&self) -> Option<f64> {
        None
    }

    /// The piece about an anchor.
    fn piece(&self, _anchor: f64, _reach: f64) -> Option<PlanPiece> {
        None
    }
}

/// A line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LineFormula {
    /// The point of the line at parameter 0, in metres.
    pub(super) origin: DVec2,
    /// Unit vector.
    pub(super) direction: DVec2,
}

impl Evaluate for LineFormula {
    #[inline]
    fn at(&self, parameter: f64) -> RoutePoint {
        RoutePoint::level(self.origin + parameter * self.direction, self.direction, 1.0)
    }

    fn piece_length(&self) -> Option<f64> {
        Some(2.0 * PIECE_M)
    }

    fn piece(&self, anchor: f64, reach: f64) -> Option<PlanPiece> {
        let centre = self.origin + anchor * self.direction;
        let [cosine, sine] = self.direction.into();
        Some(PlanPiece { anchor, reach, centre, cosine, sine, turn: 0.0, radius_m: 0.0, slope_m: 1.0 })
    }
}

/// An arc or a spiral, whose radius is linear in the polar angle about a fixed centre.
///
/// With φ = `angle` + `turn`·parameter, a point lies at the distance `radius_m` + `radius_per_radian_m`·φ from the centre, in
/// the direction φ. For an arc, `radius_per_radian_m` is 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PolarFormula {
    /// Centre, in metres.
    pub(super) centre: DVec2,
    /// φ at parameter 0, in radians.
    pub(super) angle: f64,
    /// Change of φ per unit of the parameter: ±1 on a spiral, the curvature on an arc.
    pub(super) turn: f64,
    /// Radius at φ = 0, in metres.
    pub(super) radius_m: f64,
    /// Growth of the radius per radian of φ, in metres.
    pub(super) radius_per_radian_m: f64,
    /// φ at which the radius of a spiral is 0.
    pub(super) axis: f64,
}

impl Evaluate for PolarFormula {
    #[inline]
    fn at(&self, parameter: f64) -> RoutePoint {
        let angle = self.angle + self.turn * parameter;
        let (radius_m, slope_m) = (self.radius_m + self.radius_per_radian_m * angle, self.radius_per_radian_m);
        let (sine, cosine) = sine_and_cosine_anywhere(angle);
        let spoke = DVec2::new(cosine, sine);
        let position = self.centre + radius_m * spoke;
        if slope_m == 0.0 {
            let tangent = self.turn.signum() * spoke.perp();
            return RoutePoint::level(position, tangent, 1.0);
        }
        // Calculates in units of the slope, so that the square of a tiny radius does not underflow to 0.
        let radius = angle - self.axis;
        let speed = (1.0 + radius * radius).sqrt();
        let forward = 1f64.copysign(self.turn * slope_m);
        let tangent = forward / speed * (spoke + radius * spoke.perp());
        RoutePoint::level(position, tangent, slope_m.abs() * speed)
    }

    /// With r = b·θ the speed is b·√(1 + θ²).
    fn acceleration_bound(&self) -> f64 {
        self.radius_per_radian_m.abs()
    }

    /// The direction from the centre is rounded once more than the parameter, unless it equals the parameter.
    fn rounding(&self) -> Rounding {
        let angle = self.angle.abs();
        let parameters = if angle == 0.0 { 1.0 } else { 2.0 };
        Rounding { parameters, units: (angle + SINE_ERROR_EPSILONS) / self.turn.abs() }
    }

    fn piece_length(&self) -> Option<f64> {
        Some(2.0 * PIECE_ANGLE / self.turn.abs())
    }

    fn piece(&self, anchor: f64, reach: f64) -> Option<PlanPiece> {
        let angle = self.angle + self.turn * anchor;
        let (sine, cosine) = sine_and_cosine_anywhere(angle);
        Some(PlanPiece {
            anchor,
            reach,
            centre: self.centre,
            cosine,
            sine,
            turn: self.turn,
            radius_m: self.radius_m + self.radius_per_radian_m * angle,
            slope_m: self.turn * self.radius_per_radian_m,
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use test_support::property::random_cases;

    use super::*;
    use crate::numerics::small_sine_and_versine;
    use crate::route::{CircularArc, Line, Route, Segment, Spiral, Turn, Turnaround};

    /// Position and its change per unit of the parameter, at a parameter of a piece.
    fn point(piece: &PlanPiece, parameter: f64) -> (DVec2, DVec2) {
        let s = parameter - piece.anchor;
        assert!(s.abs() <= piece.reach, "{parameter} is not on {piece:?}");
        let (sine, versine) = small_sine_and_versine::<false>(piece.turn * s);
        let spoke = DVec2::new(piece.cosine, piece.sine).rotate(DVec2::new(1.0 + versine, sine));
        let radius_m = piece.radius_m + piece.slope_m * s;
        (piece.centre + radius_m * spoke, piece.slope_m * spoke + piece.turn * radius_m * spoke.perp())
    }

    /// Compares the pieces with the route. Near parameter 0 of the route, the segment's own parameter may be large, and its
    /// rounding counts.
    fn assert_same(route: &Route) -> Result<(), TestCaseError> {
        let kernels = route.kernels();
        let (start_m, end_m) = (route.start_travel_m(), route.end_travel_m());
        for step in 1..500 {
            let parameter = route.parameter(start_m + f64::from(step) / 500.0 * (end_m - start_m));
            let number =
                kernels.iter().rposition(|kernel| kernel.begin < parameter).expect("the first has no beginning");
            let end = kernels.get(number + 1).map_or(f64::INFINITY, |next| next.begin);
            let expected = route.point(parameter);
            let piece = kernels[number].piece(parameter, [f64::NEG_INFINITY, end]).expect("a line, an arc or a spiral");
            let (position, change) = point(&piece, parameter);
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

    #[test]
    fn a_piece_at_the_end_of_its_segment_has_its_own_parameter() {
        let turnaround = Turnaround::new(1.967_984_220_254_569_4, 2.503_463_375_783_984_4, 0.1).expect("a valid turn");
        assert_same(&turnaround.between(-2.0, 60.0).expect("a valid span").route()).expect("pieces with their points");
    }

    proptest! {
        #![proptest_config(random_cases(256))]

        #[test]
        fn a_piece_has_the_points_of_its_route(pitch_m in 0.2..3.0_f64, size in 2.0..20.0_f64, ratio in 0.1..10.0_f64) {
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
