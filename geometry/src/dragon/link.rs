//! One link of the chain: from its front handle to its rear handle.

use glam::DVec3;

use super::meter::Meter;
use crate::route::{CHORD_BEND, CHORD_MARGIN, Route, RoutePoint};

/// Upper bound on the arc per metre of chord, for a curve with |κ| ≤ K and K times the chord under 2: (2/x)·asin(x/2) at x = 2,
/// which is π/2, rounded up.
pub(crate) const ARC_PER_CHORD: f64 = 1.571;

/// Bound on the steps of the walk back. Each step covers a good part of the missing distance, so only a link that spans very
/// many turns of the route needs nearly as many.
const MAX_STEPS: u32 = 10_000;

/// Bound on the steps towards a bracketed crossing. In the worst case every second step bisects the bracket.
const MAX_REFINEMENTS: usize = 128;

/// Largest one-sided error of the last step towards a crossing, as a share of rounding. Over 10⁴ links it adds up to less than
/// the random rounding of the links, which grows with the square root of their number.
const LAST_STEP_ERROR: f64 = 1.0 / 1024.0;

/// The work of [`Route::chord_back`], in steps.
const GUESS_STEPS: u64 = 1;

/// The rear end of a link, and the angles of the link with the route.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RearEnd {
    pub(crate) parameter: f64,
    pub(crate) point: RoutePoint,
    /// Cosine of the angle between the link, rear to front, and the tangent at the front handle.
    pub(crate) cos_front: f64,
    /// Cosine of the angle between the link and the tangent at the rear handle.
    pub(crate) cos_rear: f64,
}

impl RearEnd {
    /// Speed of the rear handle divided by the speed of the front handle. Both have the same speed component along a rigid
    /// link.
    pub(crate) fn speed_ratio(&self) -> f64 {
        self.cos_front / self.cos_rear
    }

    /// Whether the rear handle walks forward as the front handle does. If not, the rear handle stops, reverses or jumps.
    pub(crate) fn walks(&self) -> bool {
        self.cos_front > 0.0 && self.cos_rear > 0.0
    }
}

/// A link of `length_m` metres with its front handle at `front`. The meter counts the route points that it evaluates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link<'a> {
    pub(crate) route: &'a Route,
    pub(crate) front: RoutePoint,
    pub(crate) length_m: f64,
    pub(crate) meter: &'a Meter,
}

/// A point of the walk back, relative to the front handle.
#[derive(Clone, Copy)]
struct WalkPoint {
    parameter: f64,
    point: RoutePoint,
    distance_m: f64,
    /// Growth of the distance per metre walked back: the cosine of the angle between the chord and the tangent at this point.
    growth: f64,
}

/// Interval that contains the rear end of a link, and in which the distance from the front handle only grows backwards.
#[derive(Clone, Copy)]
struct Bracket {
    near_parameter: f64,
    far_parameter: f64,
    /// A bound on the route's |curvature| in the bracket, in 1/m.
    curvature: f64,
}

impl Link<'_> {
    /// Finds the first parameter behind `front_parameter` at the distance of the link's length; `None` if [`MAX_STEPS`] do not
    /// reach it.
    ///
    /// [`Route::chord_back`] gives a guess up to which there is at most one crossing. From a good guess, one step of Newton's method
    /// is enough. A poor guess either brackets the crossing, or begins the walk back. Without a guess, the walk back begins at an
    /// arc of the link's length.
    ///
    /// The walk back takes steps that cannot pass the first crossing. It stops once the crossing is bracketed in an interval in
    /// which the distance only grows; then it refines the crossing. The error of the distance is rounding with either sign,
    /// about 10⁻¹⁴ of the distance from the route's centre.
    pub(crate) fn rear(&self, front_parameter: f64) -> Option<RearEnd> {
        let Some(guess) = self.route.chord_back(front_parameter, self.length_m) else {
            return self.walk_back(self.look(self.route.step_back(front_parameter, self.length_m)));
        };
        let sight = self.look(guess);
        if let Some(rear) = self.last_step(&sight) {
            return Some(rear);
        }
        self.meter.add(GUESS_STEPS);
        if sight.distance_m < self.length_m {
            return self.walk_back(sight);
        }
        let curvature = self.route.curvature_bound(guess, front_parameter);
        Some(self.refine(sight, &Bracket { near_parameter: front_parameter, far_parameter: guess, curvature }, 1))
    }

    /// The crossing, one step of Newton's method from a guess by [`Route::chord_back`]; it is the guess itself where the step is
    /// below the rounding of the parameter. `None` if the step might leave more than the last step of [`refine`](Self::refine).
    ///
    /// As there, a step of σ metres leaves at most (|κ| + ½/D)·σ²; [`CHORD_BEND`] bounds |κ|.
    fn last_step(&self, sight: &WalkPoint) -> Option<RearEnd> {
        let step_m = (self.length_m - sight.distance_m) / sight.growth;
        let parameter = sight.parameter - step_m / sight.point.speed_m_per_unit;
        if parameter == sight.parameter {
            self.meter.add(GUESS_STEPS + 1);
            return Some(self.rear_end(sight));
        }
        let bend = (CHORD_BEND + 0.5) / self.length_m;
        let is_exact = bend * step_m * step_m <= LAST_STEP_ERROR * self.rounding_m(sight);
        (is_exact && step_m.abs() <= CHORD_MARGIN * self.length_m).then(|| {
            self.meter.add(GUESS_STEPS + 2);
            self.rear_end(&self.look(parameter))
        })
    }

    /// Walks back from a point in front of which the distance is nowhere the link's length; `None` if [`MAX_STEPS`] do not reach it.
    fn walk_back(&self, mut sight: WalkPoint) -> Option<RearEnd> {
        for step in 1..=MAX_STEPS {
            if let Some(bracket) = self.far_bracket(&sight) {
                return Some(self.refine(sight, &bracket, step));
            }
            sight = self.look(self.route.step_back(sight.parameter, self.safe_step(&sight)));
        }
        self.meter.add(u64::from(MAX_STEPS));
        None
    }

    fn look(&self, parameter: f64) -> WalkPoint {
        let point = self.route.point(parameter);
        let chord = self.chord(&point);
        let distance_m = chord.length();
        WalkPoint { parameter, point, distance_m, growth: chord.dot(point.tangent.extend(point.climb)) / distance_m }
    }

    /// The link in space, from a point of the route to the front handle.
    fn chord(&self, rear: &RoutePoint) -> DVec3 {
        (self.front.position - rear.position).extend(self.front.height_m - rear.height_m)
    }

    /// Arc that can be walked back while the distance stays below the link's length.
    ///
    /// The distance D changes by at most the arc walked (sphere tracing: Hart 1996, The Visual Computer 12). Its second
    /// derivative is at most |κ| + 1/D, which is at most |κ| + 2/D over the next D/2 of arc. So D also stays below D + D'σ +
    /// (|κ|/2 + 1/D)σ². The second bound gives long steps past a parameter at which the distance almost reaches the length.
    fn safe_step(&self, sight: &WalkPoint) -> f64 {
        let gap_m = self.length_m - sight.distance_m;
        let limit_m = 0.5 * sight.distance_m;
        let rear = self.route.step_back(sight.parameter, 3.0 * limit_m * self.route.steepest());
        let curvature = self.route.curvature_bound(rear, sight.parameter);
        let bend = 0.5 * curvature + 1.0 / sight.distance_m;
        let root = (sight.growth * sight.growth + 4.0 * bend * gap_m).sqrt();
        let smooth_m =
            if sight.growth > 0.0 { 2.0 * gap_m / (sight.growth + root) } else { (root - sight.growth) / (2.0 * bend) };
        gap_m.max(smooth_m.min(limit_m))
    }

    /// Returns a bracket behind `sight` in which the distance only grows and reaches the link's length; `None` if no such
    /// bracket is near.
    ///
    /// The second derivative of the distance D is at least −|κ|. So if D'² ≥ 6·|κ|·gap, D still grows after 6·gap/D' of arc. D
    /// has grown by the gap after a third of that arc, which the step back covers. On ground, the step back is shorter by the
    /// greatest slope, and the arc longer by it.
    fn far_bracket(&self, sight: &WalkPoint) -> Option<Bracket> {
        let gap_m = self.length_m - sight.distance_m;
        if gap_m <= 0.0 {
            return Some(Bracket { near_parameter: sight.parameter, far_parameter: sight.parameter, curvature: 0.0 });
        }
        if sight.growth <= 0.0 {
            return None;
        }
        let arcs = 6.0 * self.route.steepest();
        let far_parameter = self.route.step_back(sight.parameter, arcs * gap_m / sight.growth);
        let curvature = self.route.curvature_bound(far_parameter, sight.parameter);
        let bracket = Bracket { near_parameter: sight.parameter, far_parameter, curvature };
        (sight.growth * sight.growth >= arcs * curvature * gap_m).then_some(bracket)
    }

    /// Newton's method on the distance, from a point of the bracket. The iterates stay in the bracket.
    ///
    /// If a step would leave the bracket, the bracket is bisected instead. `looks` is the number of points evaluated before.
    ///
    /// The steps approach the crossing from one side. If they ended as soon as the distance is within rounding, all links of a
    /// chain would be too short, and the errors would add up. So one more step follows, once the distance is so near that this
    /// step ends at the crossing up to rounding of either sign. A step of σ metres of arc leaves ½·|D″|·σ², where |D″| is at
    /// most |κ| + 1/D, plus at most |κ| where the route's speed per parameter changes.
    fn refine(&self, mut sight: WalkPoint, bracket: &Bracket, mut looks: u32) -> RearEnd {
        let rounding_m = self.rounding_m(&sight);
        let bend = bracket.curvature + 0.5 / self.length_m;
        let last_step_m2 = LAST_STEP_ERROR * rounding_m / bend;
        let Bracket { mut near_parameter, mut far_parameter, .. } = *bracket;
        let mut last_is_taken = false;
        for _ in 0..MAX_REFINEMENTS {
            let gap_m = self.length_m - sight.distance_m;
            if (last_is_taken && gap_m.abs() <= rounding_m) || near_parameter <= far_parameter {
                break;
            }
            let newton = sight.parameter - gap_m / (sight.growth * sight.point.speed_m_per_unit);
            if gap_m > 0.0 {
                near_parameter = sight.parameter;
            } else {
                far_parameter = sight.parameter;
            }
            let within = newton >= far_parameter && newton <= near_parameter;
            let next = if within { newton } else { 0.5 * (near_parameter + far_parameter) };
            if next == sight.parameter {
                break;
            }
            last_is_taken = within && gap_m * gap_m <= last_step_m2 * sight.growth * sight.growth;
            sight = self.look(next);
            looks += 1;
        }
        self.meter.add(u64::from(looks));
        self.rear_end(&sight)
    }

    /// Bound on the rounding of the distance to a point, in metres.
    fn rounding_m(&self, sight: &WalkPoint) -> f64 {
        self.route.rounding_m(sight.parameter, sight.point.speed_m_per_unit) + f64::EPSILON * self.length_m
    }

    /// The link with its rear end at this point.
    fn rear_end(&self, sight: &WalkPoint) -> RearEnd {
        let chord = self.chord(&sight.point);
        RearEnd {
            parameter: sight.parameter,
            point: sight.point,
            cos_front: chord.dot(self.front.tangent.extend(self.front.climb)) / sight.distance_m,
            cos_rear: sight.growth,
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use test_support::property::random_cases;

    use super::super::meter::UNLIMITED;
    use super::*;
    use crate::route::Turnaround;

    proptest! {
        #![proptest_config(random_cases(2000))]

        /// On a turnaround: on the spirals, the arcs, and the seams between them.
        #[test]
        fn a_link_that_begins_at_a_guess_ends_where_the_walk_back_ends(
            (pitch_m, diameter_m, ratio) in (0.3..3.0_f64, 0.5..12.0_f64, 0.5..3.0_f64),
            (share, length_m) in (0.0..1.0_f64, 0.05..4.0_f64),
        ) {
            let turnaround = Turnaround::new(pitch_m, diameter_m, ratio);
            prop_assume!(turnaround.is_ok());
            let route = turnaround.expect("checked").between(-20.0, 60.0).expect("a route without an end").route();
            let parameter = route.parameter(80.0 * share - 20.0);
            let link = Link { route: &route, front: route.point(parameter), length_m, meter: &UNLIMITED };
            let walked = link.walk_back(link.look(route.step_back(parameter, length_m)));
            let (Some(rear), Some(walked)) = (link.rear(parameter), walked) else { panic!("the spiral has no beginning") };
            // Each is at the link's length from the front, up to the rounding of its last step and of the distance.
            let at = link.look(walked.parameter);
            let tolerance_m = 4.0 * link.rounding_m(&at) / at.growth;
            let apart_m = (rear.parameter - walked.parameter).abs() * at.point.speed_m_per_unit;
            prop_assert!(at.growth <= 0.0 || apart_m <= tolerance_m, "{rear:?}, {walked:?}, {apart_m}, {tolerance_m}");
        }
    }
}
