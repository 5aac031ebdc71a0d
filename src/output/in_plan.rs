//! Dragons and stages of a configuration as figures draw them: points in the plan.

use std::f64::consts::TAU;

use bench_dragon_geometry::dragon::{Board, ChainSolver, Dragon, Handle};
use bench_dragon_geometry::route::{Coil, Route};
use bench_dragon_geometry::stage::{Border, Stage};
use glam::DVec2;

use super::dragon_colours;
use super::figure::{DragonInPlan, NamedInPlan, StageInPlan};
use crate::config::{Config, FormationDocument};

/// Greatest distance of a drawn route from the true one, in metres. It is a fortieth of a millimetre on paper where the
/// surroundings of a contact are drawn at 50 mm to the metre.
const SAGITTA_M: f64 = 0.0005;
/// Most points of a drawn route. A route that needs more points is drawn coarser.
const MAX_POINTS: f64 = 20_000.0;

/// A dragon on its route with its head at a travel.
pub(crate) fn in_plan(config: &Config, dragon: &Dragon, travel_m: f64) -> DragonInPlan {
    let handles = handles(dragon, travel_m);
    DragonInPlan {
        stage: stage_in_plan(config.stage()),
        route: route_around(dragon, &handles),
        boards: boards(dragon, &handles).iter().map(Board::corners).collect(),
        hinges: handles.iter().map(|handle| handle.position).collect(),
    }
}

/// The dragons of a formation on their routes at a plan time, in their colours.
pub(crate) fn dragons_in_plan(document: &FormationDocument, time_s: f64) -> Vec<NamedInPlan> {
    let planned = document.formation().dragons();
    let dragons = document.dragons().iter().zip(planned).zip(dragon_colours(document));
    dragons
        .map(|((named, planned), colour)| NamedInPlan {
            name: named.name.clone(),
            colour: Some(colour),
            dragon: in_plan(&named.config, &planned.dragon, planned.travel_m(time_s)),
        })
        .collect()
}

/// The borders of a stage.
pub(crate) fn stage_in_plan(stage: &Stage) -> StageInPlan {
    let corners = |border: Option<&Border>| border.map_or_else(Vec::new, |border| border.corners().to_vec());
    StageInPlan {
        outline: corners(stage.outline()),
        keep_out: stage.keep_out().iter().map(|area| area.corners().to_vec()).collect(),
        crowd: corners(stage.crowd()),
    }
}

/// The handles of a dragon with its head at a travel of its run.
pub(crate) fn handles(dragon: &Dragon, travel_m: f64) -> Vec<Handle> {
    let mut solver = ChainSolver::new(dragon);
    solver.solve(dragon, travel_m).expect("the travel lies within the run").to_vec()
}

/// The boards between these handles.
pub(crate) fn boards(dragon: &Dragon, handles: &[Handle]) -> Vec<Board> {
    let mut boards = Vec::new();
    dragon.place_boards(handles, &mut boards);
    boards
}

/// The visible route: from behind the tail to the route's end.
fn route_around(dragon: &Dragon, handles: &[Handle]) -> Vec<DVec2> {
    let route = dragon.route();
    let tail = handles.last().expect("a dragon has handles");
    // On a coil: the length of at least one turn behind the tail.
    let coil = route.coil().filter(|coil| tail.parameter <= coil.end);
    let turn_m = |coil: Coil| TAU * (tail.position.distance(coil.centre) + TAU * coil.radius_per_radian_m);
    let behind_m = coil.map_or(dragon.dimensions().link_m(0), turn_m);
    polyline(route, route.travel(tail.parameter) - behind_m, route.end_travel_m())
}

/// Points of a route. Their distance follows from the curvature and [`SAGITTA_M`].
pub(crate) fn polyline(route: &Route, from_m: f64, to_m: f64) -> Vec<DVec2> {
    route.polyline(from_m, to_m, SAGITTA_M, (to_m - from_m) / MAX_POINTS..=f64::INFINITY)
}
