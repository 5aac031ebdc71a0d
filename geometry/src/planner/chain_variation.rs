//! First-order changes of the handles when a parameter of the plan changes: the linearised chain rule.
//!
//! Every handle stays on the route. It moves with the route at the handle's travel, plus a displacement σ along the tangent.
//! Every link keeps its length d. So, with u its heading and p and r its front and rear handles, (p − r)·u changes by the
//! change of d. The head's σ is known. The equations of the links give the others one after the other, exactly (implicit
//! function theorem).

use glam::{DVec2, DVec3};

use super::Parameter;
use crate::dragon::{Dimensions, Handle};
use crate::route::{RouteFamily, RouteMeasure};

/// A small change of the dragon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// The head walks forward; all parameters of the plan are fixed.
    Travel,
    /// A parameter of the plan grows; the head's travel is fixed.
    Measure(Parameter),
}

impl Change {
    /// Change of the length of a bench, per metre.
    pub(super) fn length(self, bench: usize) -> f64 {
        match self {
            Self::Measure(Parameter::HeadLength) if bench == 0 => 1.0,
            Self::Measure(Parameter::BodyLength) if bench > 0 => 1.0,
            _ => 0.0,
        }
    }

    /// The measure of the route that changes.
    fn of_route(self) -> Option<RouteMeasure> {
        if let Self::Measure(parameter) = self { parameter.of_route() } else { None }
    }

    /// Change of the width, per metre.
    pub(super) fn width(self) -> f64 {
        if self == Self::Measure(Parameter::Width) { 1.0 } else { 0.0 }
    }

    /// Change of the length of a link, per metre.
    pub(super) fn link(self, bench: usize) -> f64 {
        if self == Self::Measure(Parameter::HoleOffset) { -2.0 } else { self.length(bench) }
    }
}

/// Change of a handle per unit of a [`Change`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandleVariation {
    /// Displacement of the handle in the plan, in metres.
    pub position: DVec2,
    /// Growth of the handle's height, in metres; 0 on level ground.
    pub rise: f64,
    /// Growth of the handle's travel, in metres.
    pub travel: f64,
    /// Counter-clockwise rotation of the tangent, seen from above, in radians.
    pub turn: f64,
    /// Growth of the tangent's angle of climb, in radians; 0 on level ground.
    pub lift: f64,
    /// Growth of the speed ratio.
    pub speed_ratio: f64,
}

impl HandleVariation {
    /// Displacement in space, in metres.
    fn in_space(&self) -> DVec3 {
        self.position.extend(self.rise)
    }

    /// Change of the handle's unit tangent in space.
    fn tangent(&self, handle: &Handle) -> DVec3 {
        let cosine = handle.tangent.length();
        let pitched = -handle.climb / cosine * handle.tangent;
        (self.turn * handle.tangent.perp() + self.lift * pitched).extend(self.lift * cosine)
    }
}

/// The change of each of `handles`, which are the first handles of a chain, in the same order.
///
/// At a seam, the change of the speed ratio is the one on the side of the handle's parameter.
pub fn handle_variations(
    dimensions: &Dimensions,
    route: &RouteFamily,
    handles: &[Handle],
    change: Change,
) -> Vec<HandleVariation> {
    let walks = if change == Change::Travel { 1.0 } else { 0.0 };
    let mut variations = Vec::with_capacity(handles.len());
    let step = Step { route, change };
    variations.extend(handles.first().map(|head| step.on_route(head, walks)));
    for (bench, ends) in handles.windows(2).enumerate() {
        let front = variations[bench];
        variations.push(step.behind(&ends[0], &front, &ends[1], dimensions.link_m(bench), bench));
    }
    variations
}

/// The change of a handle, from the change of the handle before it.
struct Step<'a> {
    route: &'a RouteFamily,
    change: Change,
}

impl Step<'_> {
    /// The change of a handle whose travel grows by `travel`.
    fn on_route(&self, handle: &Handle, travel: f64) -> HandleVariation {
        let route = self.route.variation(handle.parameter, self.change.of_route());
        HandleVariation {
            position: route.position + travel * handle.tangent,
            rise: route.rise + travel * handle.climb,
            travel,
            turn: route.turn + travel * route.curvature,
            lift: route.lift + travel * route.bend,
            speed_ratio: 0.0,
        }
    }

    fn behind(
        &self,
        front: &Handle,
        front_variation: &HandleVariation,
        rear: &Handle,
        link_m: f64,
        bench: usize,
    ) -> HandleVariation {
        let heading = (front.in_space() - rear.in_space()) / link_m;
        let held = self.on_route(rear, 0.0);
        let gain = (front_variation.in_space() - held.in_space()).dot(heading) - self.change.link(bench);
        let mut variation = self.on_route(rear, gain / rear.tangent.extend(rear.climb).dot(heading));

        // The ratio of the two speeds is cos(front tangent, heading) ÷ cos(rear tangent, heading).
        let ends = [(front, front_variation), (rear, &variation)];
        let [front_cosine, rear_cosine] = if self.route.route().is_on_ground() {
            cosines_in_space(ends, heading, link_m)
        } else {
            cosines_in_plan(ends, heading.truncate(), link_m)
        };
        let link_ratio = front_cosine - rear_cosine;
        variation.speed_ratio = rear.speed_ratio * (front_variation.speed_ratio / front.speed_ratio + link_ratio);
        variation
    }
}

/// Changes of the logarithms of cos(tangent, heading) at both ends of a link, on level ground.
fn cosines_in_plan(ends: [(&Handle, &HandleVariation); 2], heading: DVec2, link_m: f64) -> [f64; 2] {
    let heading_turn = heading.perp_dot(ends[0].1.position - ends[1].1.position) / link_m;
    ends.map(|(handle, variation)| {
        let angle_tangent = heading.perp_dot(handle.tangent) / heading.dot(handle.tangent);
        -angle_tangent * (variation.turn - heading_turn)
    })
}

/// The same in space. Of the difference of the displacements, the part along the heading is the change of the link's length.
fn cosines_in_space(ends: [(&Handle, &HandleVariation); 2], heading: DVec3, link_m: f64) -> [f64; 2] {
    let displaced = ends[0].1.in_space() - ends[1].1.in_space();
    let heading_change = (displaced - displaced.dot(heading) * heading) / link_m;
    ends.map(|(handle, variation)| {
        let tangent = handle.tangent.extend(handle.climb);
        (variation.tangent(handle).dot(heading) + tangent.dot(heading_change)) / tangent.dot(heading)
    })
}
