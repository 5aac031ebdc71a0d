//! One link of the chain: from the parameter of its front handle to that of its rear handle.

use super::meter::Meter;
use crate::route::{Route, RoutePoint};

/// Bound on steps of the walk back. A step covers a good part of the distance that is lacking, so only a link that
/// spans very many turns of the route comes near it.
const MAX_STEPS: u32 = 10_000;

/// Bound on steps towards a bracketed crossing: in the worst case every second one halves the bracket.
const MAX_REFINEMENTS: usize = 128;

/// Share of rounding that the last step towards a crossing may leave to one side. Over 10⁴ links it adds up to less than
/// the rounding of each link, which grows with the root of their number.
const LAST_STEP_ERROR: f64 = 1.0 / 1024.0;

/// The rear end of a link and how the link lies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RearEnd {
    pub(crate) parameter: f64,
    pub(crate) point: RoutePoint,
    /// Cosine of the angle between the link, rear to front, and the tangent at the front handle.
    pub(crate) cos_front: f64,
    /// The same at the rear handle.
    pub(crate) cos_rear: f64,
}

impl RearEnd {
    /// Rear ÷ front handle speed. A rigid link gives both handles the same speed along it.
    pub(crate) fn speed_ratio(&self) -> f64 {
        self.cos_front / self.cos_rear
    }

    /// Whether the rear handle walks on as the front handle does: it neither stands still nor jumps.
    pub(crate) fn walks(&self) -> bool {
        self.cos_front > 0.0 && self.cos_rear > 0.0
    }
}

/// A link of `length_m` metres whose front handle stands on `front`. The points of the route that it looks at count on the meter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link<'a> {
    pub(crate) route: &'a Route,
    pub(crate) front: RoutePoint,
    pub(crate) length_m: f64,
    pub(crate) meter: &'a Meter,
}

/// A point of the walk back, seen from the front handle.
#[derive(Clone, Copy)]
struct WalkPoint {
    parameter: f64,
    point: RoutePoint,
    distance_m: f64,
    /// How fast the distance grows per metre walked back: the cosine between the chord and the tangent here.
    growth: f64,
}

/// Where a link's end lies: behind a point of the walk back, up to here.
#[derive(Clone, Copy)]
struct Bracket {
    far_parameter: f64,
    /// A bound on the route's |curvature| in the bracket, in 1/m.
    curvature: f64,
}

impl Link<'_> {
    /// The first parameter behind `front_parameter` at the link's length from it; none if [`MAX_STEPS`] do not reach it.
    ///
    /// Walks back by steps that cannot pass the first crossing, until the crossing is bracketed where the distance only
    /// grows, then refines it. The distance is off by rounding alone, to either side: some 10⁻¹⁴ of the distance from
    /// the route's centre.
    pub(crate) fn rear(&self, front_parameter: f64) -> Option<RearEnd> {
        let start = self.route.step_back(front_parameter, self.length_m);
        let mut sight = self.look(start);
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
        let chord = self.front.position - point.position;
        let distance_m = chord.length();
        WalkPoint { parameter, point, distance_m, growth: chord.dot(point.tangent) / distance_m }
    }

    /// Arc that can be walked back with the distance staying under the link's length.
    ///
    /// The distance D changes by at most the arc walked (sphere tracing: Hart 1996, The Visual Computer 12). Its second
    /// derivative is at most |κ| + 1/D, which over the next D/2 of arc is at most |κ| + 2/D, so D also stays under D +
    /// D'σ + (|κ|/2 + 1/D)σ². The second bound walks briskly past a parameter where the distance almost reaches the length.
    fn safe_step(&self, sight: &WalkPoint) -> f64 {
        let gap_m = self.length_m - sight.distance_m;
        let limit_m = 0.5 * sight.distance_m;
        let curvature =
            self.route.curvature_bound(self.route.step_back(sight.parameter, 3.0 * limit_m), sight.parameter);
        let bend = 0.5 * curvature + 1.0 / sight.distance_m;
        let root = (sight.growth * sight.growth + 4.0 * bend * gap_m).sqrt();
        let smooth_m =
            if sight.growth > 0.0 { 2.0 * gap_m / (sight.growth + root) } else { (root - sight.growth) / (2.0 * bend) };
        gap_m.max(smooth_m.min(limit_m))
    }

    /// A parameter behind `sight` up to which the distance only grows and reaches the link's length, if there is one near.
    ///
    /// The second derivative of the distance D is at least −|κ|. So D still grows after 6·gap/D' of arc if D'² ≥
    /// 6·|κ|·gap, and has grown by the gap after a third of that, which the step back covers.
    fn far_bracket(&self, sight: &WalkPoint) -> Option<Bracket> {
        let gap_m = self.length_m - sight.distance_m;
        if gap_m <= 0.0 {
            return Some(Bracket { far_parameter: sight.parameter, curvature: 0.0 });
        }
        if sight.growth <= 0.0 {
            return None;
        }
        let far_parameter = self.route.step_back(sight.parameter, 6.0 * gap_m / sight.growth);
        let curvature = self.route.curvature_bound(far_parameter, sight.parameter);
        (sight.growth * sight.growth >= 6.0 * curvature * gap_m).then_some(Bracket { far_parameter, curvature })
    }

    /// Newton's method on the distance from `near`, which is the front of the bracket, kept within the bracket.
    ///
    /// A step that would leave the bracket halves it instead. `looks` were taken before.
    ///
    /// The steps approach the crossing from one side. To end where the distance is within rounding would therefore leave
    /// the links of a chain all too short, and their errors would add up. So a last step follows once the distance is so
    /// near that this step ends at the crossing but for rounding, which falls to either side: a step of σ metres of arc
    /// leaves ½·|D″|·σ², where |D″| is at most |κ| + 1/D, and at most |κ| more where the route's pace changes.
    fn refine(&self, near: WalkPoint, bracket: &Bracket, mut looks: u32) -> RearEnd {
        let rounding_m =
            self.route.rounding_m(near.parameter, near.point.speed_m_per_unit) + f64::EPSILON * self.length_m;
        let bend = bracket.curvature + 0.5 / self.length_m;
        let last_step_m2 = LAST_STEP_ERROR * rounding_m / bend;
        let (mut near_parameter, mut far_parameter) = (near.parameter, bracket.far_parameter);
        let mut sight = near;
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
        let chord = self.front.position - sight.point.position;
        RearEnd {
            parameter: sight.parameter,
            point: sight.point,
            cos_front: chord.dot(self.front.tangent) / sight.distance_m,
            cos_rear: sight.growth,
        }
    }
}
