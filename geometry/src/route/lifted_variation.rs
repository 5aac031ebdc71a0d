//! Change of a route on ground with one of its measures.
//!
//! Let σ be the travel in the plan, P(σ) its point with the tangent t and the curvature κ, and z the height of the ground. The
//! grade is g = ∇z·t, the angle of the climb φ = arctan g, and the travel in space s = ∫ dσ / cos φ.
//!
//! 1. *Along the curve.* dg/dσ = t·∇²z·t + κ·∇z·t⊥. So the tangent pitches by dφ/dσ = cos²φ · dg/dσ, and a metre of s is cos φ
//!    metres of σ.
//! 2. *At fixed σ*, let the measure p move the point by V and turn the tangent by ω. Then the height grows by ∇z·V, and the grade by
//!    γ = t·∇²z·V + ω·∇z·t⊥, so φ grows by cos²φ · γ.
//! 3. *The arc.* ∂s/∂p at fixed σ is ∫ sin φ · γ dσ, from t = 0. The integral is calculated piece by piece of the profile:
//!    within one, segment and cell of the ground are the same, and everything is smooth. Gauss's rule of five points is
//!    exact for polynomials of degree 9; those of the profile have degree 7, and fit to rounding.
//! 4. *At fixed s*, the point moves back from that of step 2 by ∂s/∂p · cos φ metres of σ.

use glam::DVec2;

use super::family::{RouteFamily, RouteMeasure, RouteVariation};
use crate::ground::{Ground, Slopes};

/// Nodes and weights of Gauss's rule between −1 and 1 (Abramowitz and Stegun 1964, table 25.4).
const GAUSS: [[f64; 2]; 5] = [
    [-0.906_179_845_938_664, 0.236_926_885_056_189_1],
    [-0.538_469_310_105_683_1, 0.478_628_670_499_366_5],
    [0.0, 0.568_888_888_888_888_9],
    [0.538_469_310_105_683_1, 0.478_628_670_499_366_5],
    [0.906_179_845_938_664, 0.236_926_885_056_189_1],
];

/// The changes of the arc at the beginnings of a profile's pieces.
#[derive(Clone, Debug)]
pub(super) struct Lifted {
    measure: RouteMeasure,
    /// Change of the arc from the beginning of the profile to that of each piece, in metres per unit of the measure.
    arcs: Vec<f64>,
    /// Change of the arc from the beginning of the profile to t = 0.
    origin: f64,
}

impl Lifted {
    pub(super) fn of(family: &RouteFamily, ground: &Ground, measure: RouteMeasure) -> Self {
        let route = family.route();
        let cuts: Vec<f64> = route.profile().cuts().collect();
        let mut lifted = Self { measure, arcs: Vec::with_capacity(cuts.len()), origin: 0.0 };
        let mut arc = 0.0;
        for ends in cuts.windows(2) {
            lifted.arcs.push(arc);
            arc += lifted.arc_between(family, ground, ends[0], ends[1]);
        }
        lifted.origin = lifted.arc_variation(family, ground, route.plan_parameter(0.0));
        lifted
    }

    /// Change of the arc in space from t = 0 to the point at a parameter, at fixed travel in the plan.
    pub(super) fn arc_variation(&self, family: &RouteFamily, ground: &Ground, parameter: f64) -> f64 {
        let (number, begin, _) = family.route().profile().place(parameter);
        self.arcs[number] - self.origin + self.arc_between(family, ground, begin, parameter)
    }

    /// Change of the arc in space between two parameters of a piece.
    fn arc_between(&self, family: &RouteFamily, ground: &Ground, begin: f64, end: f64) -> f64 {
        if family.is_fixed() {
            return 0.0;
        }
        let (middle, half) = (0.5 * (begin + end), 0.5 * (end - begin));
        let at = |parameter: f64| {
            let spot = Spot::at(family, ground, parameter);
            let plan = family.plan_variation(parameter, Some(self.measure));
            let sine = spot.grade / spot.grade.hypot(1.0);
            sine * spot.grade_variation(&plan) * family.route().plan_point(parameter).speed_m_per_unit
        };
        half * GAUSS.iter().map(|[node, weight]| weight * at(middle + half * node)).sum::<f64>()
    }
}

/// Change of the route near a parameter, at fixed travel in space. `plan` is that of the curve in the plan, `arc` that of the arc in
/// space at fixed travel in the plan.
pub(super) fn at(
    family: &RouteFamily,
    ground: &Ground,
    parameter: f64,
    plan: &RouteVariation,
    arc: f64,
) -> RouteVariation {
    let spot = Spot::at(family, ground, parameter);
    let cosine = spot.grade.hypot(1.0).recip();
    let bend = cosine * cosine * spot.grade_growth(plan);
    let back = cosine * arc;
    RouteVariation {
        curvature: cosine * plan.curvature,
        bend: cosine * bend,
        position: plan.position - back * spot.tangent,
        rise: spot.slopes.rise.dot(plan.position) - back * spot.grade,
        turn: plan.turn - back * plan.curvature,
        lift: cosine * cosine * spot.grade_variation(plan) - back * bend,
    }
}

/// A place of the route on the ground.
struct Spot {
    slopes: Slopes,
    /// Tangent in the plan.
    tangent: DVec2,
    grade: f64,
}

impl Spot {
    fn at(family: &RouteFamily, ground: &Ground, parameter: f64) -> Self {
        let route = family.route();
        let point = route.plan_point(parameter);
        let (_, _, anchor) = route.profile().place(parameter);
        // The whole piece is over the cell of its anchor, but for rounding. A piece whose anchor has no cell is shorter than 20 µm,
        // at an edge of the map.
        let cell = ground.cell(route.plan_point(anchor).position);
        let slopes = cell.map_or_else(Slopes::default, |cell| ground.patch(cell).slopes(point.position));
        Self { slopes, tangent: point.tangent, grade: slopes.rise.dot(point.tangent) }
    }

    /// Growth of the grade per metre of the plan, along the curve.
    fn grade_growth(&self, plan: &RouteVariation) -> f64 {
        self.tangent.dot(self.slopes.bend * self.tangent) + plan.curvature * self.slopes.rise.dot(self.tangent.perp())
    }

    /// Growth of the grade per unit of the measure, at fixed travel in the plan.
    fn grade_variation(&self, plan: &RouteVariation) -> f64 {
        self.tangent.dot(self.slopes.bend * plan.position) + plan.turn * self.slopes.rise.dot(self.tangent.perp())
    }
}
