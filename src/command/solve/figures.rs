//! The figures' data, taken from the dragon.

use bench_dragon::config::{Config, RoutePlan};
use bench_dragon::dragon::{Board, ChainSolver, Contact, Dragon, Handle};
use bench_dragon::figure::{ContactView, Drawing, PlanView, TurnMarks};
use bench_dragon::route::{Route, Turnaround};
use glam::DVec2;

use crate::cli::FigureFile;
use crate::command::whole_file;

/// How far a drawn route may lie off the true one: a fortieth of a millimetre where the surroundings of a contact are
/// shown 50 mm to the metre.
const SAGITTA_M: f64 = 0.0005;
/// Most points of a drawn route. One that needs more is drawn coarser.
const MAX_POINTS: f64 = 20_000.0;

/// Draws into a file.
pub(super) fn save(drawing: &Drawing, file: &FigureFile) -> anyhow::Result<()> {
    whole_file::write(&file.path, &drawing.encode(file.format))
}

/// The dragon on its route at a time.
pub(super) fn plan_view(config: &Config, time_s: f64, travel_m: f64) -> PlanView {
    let dragon = config.dragon();
    let handles = handles(dragon, travel_m);
    PlanView {
        title: format!("The dragon at {time_s} s"),
        route: route_around(dragon, &handles),
        boards: corners(dragon, &handles),
        hinges: handles.iter().map(|handle| handle.position).collect(),
        turn: turnaround(config).map(|turnaround| turn_marks(&turnaround)),
    }
}

/// The boards at a contact.
pub(super) fn contact_view(config: &Config, contact: &Contact) -> ContactView {
    let dragon = config.dragon();
    let handles = handles(dragon, contact.travel_m);
    let time_s = contact.travel_m / config.head_speed_mps();
    let [first, second] = contact.benches;
    ContactView {
        title: format!("First contact, at {time_s:.6} s: benches {first} and {second}"),
        route: route_around(dragon, &handles),
        boards: corners(dragon, &handles),
        hinges: handles.iter().map(|handle| handle.position).collect(),
        benches: contact.benches,
        point: contact.point,
    }
}

fn handles(dragon: &Dragon, travel_m: f64) -> Vec<Handle> {
    let mut solver = ChainSolver::new(dragon);
    solver.solve(dragon, travel_m).expect("the travel lies within the run").to_vec()
}

fn corners(dragon: &Dragon, handles: &[Handle]) -> Vec<[DVec2; 4]> {
    let mut boards = Vec::new();
    dragon.place_boards(handles, &mut boards);
    boards.iter().map(Board::corners).collect()
}

/// The route from where it can be seen behind the tail to its end.
fn route_around(dragon: &Dragon, handles: &[Handle]) -> Vec<DVec2> {
    let route = dragon.route();
    let tail = handles.last().expect("a dragon has handles");
    // From here on a whole turn of a spiral lies behind the tail.
    let behind_m = std::f64::consts::TAU * (tail.position.length() + route.pitch_m());
    polyline(route, route.travel(tail.place) - behind_m, route.end_travel_m())
}

/// Points of a route, as near to each other as its curvature asks for.
fn polyline(route: &dyn Route, from_m: f64, to_m: f64) -> Vec<DVec2> {
    let least_m = (to_m - from_m) / MAX_POINTS;
    let mut points = Vec::new();
    let mut travel_m = from_m;
    while travel_m < to_m {
        let place = route.place(travel_m);
        points.push(route.point(place).position);
        // A chord of length s under a curve of curvature κ leaves a sagitta of κ·s²/8.
        let curvature = route.curvature_bound(place, place);
        travel_m += (8.0 * SAGITTA_M / curvature).sqrt().max(least_m);
    }
    points.push(route.point(route.place(to_m)).position);
    points
}

fn turnaround(config: &Config) -> Option<Turnaround> {
    let RoutePlan::Turnaround(plan) = config.route() else { return None };
    Some(plan.turnaround(config.head_speed_mps()).expect("a valid configuration has a route"))
}

fn turn_marks(turnaround: &Turnaround) -> TurnMarks {
    let [entry_arc, exit_arc] = turnaround.arcs();
    let middle_m = entry_arc.length_m();
    let end_m = middle_m + exit_arc.length_m();
    let joints = [0.0, middle_m, end_m].map(|travel_m| turnaround.point(turnaround.place(travel_m)).position);
    TurnMarks {
        radius_m: joints[0].length(),
        arcs: [polyline(turnaround, 0.0, middle_m), polyline(turnaround, middle_m, end_m)],
        joints,
    }
}
