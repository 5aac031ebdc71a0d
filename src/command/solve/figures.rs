//! The figures' data, taken from the dragon.

use anyhow::bail;
use bench_dragon_geometry::clearance::{ClearanceSearch, Contact};
use bench_dragon_geometry::dragon::{Board, ChainSolver, Dragon, Handle, Meter};
use bench_dragon_geometry::planner::{ClosestApproach, LargestRatio, clearance_profile};
use bench_dragon_geometry::route::{Route, RouteSpec, Turnaround};
use glam::DVec2;

use super::caption::{caption, caption_at_speed};
use super::contact::NearMiss;
use super::turn::passage_time_s;
use crate::cli::{FigureArgs, Format};
use crate::command::print::print_line;
use crate::config::Config;
use crate::output::figure::{
    Caption, Circle, ClearanceOverTime, ContactMark, ContactView, DragonInPlan, Drawing, HandleSpeed, LargestSpeed,
    NearMissMark, NearestPair, PlanView, SpeedRange, SpeedsOverTime, TurnMarks,
};
use crate::output::terminal_text::Printable;
use crate::system::whole_file;

/// How far a drawn route may lie off the true one: a fortieth of a millimetre where the surroundings of a contact are
/// shown 50 mm to the metre.
const SAGITTA_M: f64 = 0.0005;
/// Most points of a drawn route. One that needs more is drawn coarser.
const MAX_POINTS: f64 = 20_000.0;
/// Points of a line over time: a few for each dot of a printed page.
const SAMPLES: u32 = 4_000;
/// Handles that are placed for such a line, at most: of a long dragon it has fewer points.
const MAX_PLACED: usize = 10_000_000;
/// Handles whose speeds are drawn, where the dragon has them: those that a turn sets apart, and one far back.
const DRAWN_HANDLES: [usize; 5] = [0, 1, 2, 5, 51];
/// Seconds around the largest speed that are drawn larger, at a head speed of 1 m/s: the head's way through a turn.
const DETAIL_S: f64 = 16.0;

/// Draws into the file that was asked for, on the paper that was asked for.
pub(super) fn save(drawing: Drawing, args: &FigureArgs) -> anyhow::Result<()> {
    let Some(file) = &args.figure else { return Ok(()) };
    let drawing = if let Some(paper) = args.paper { drawing.on_paper(paper) } else { drawing };
    whole_file::write(&file.path, &drawing.encode(file.format))
}

/// The same, and tells people where the figure went.
pub(super) fn save_and_tell(drawing: Drawing, args: &FigureArgs, format: Format) -> anyhow::Result<()> {
    save(drawing, args)?;
    match &args.figure {
        Some(file) if format == Format::Text => Ok(print_line(format_args!("drawn to {}", Printable(&file.path)))?),
        _ => Ok(()),
    }
}

/// Fails where a figure was asked for and there is nothing to draw.
pub(super) fn refuse(args: &FigureArgs, reason: &str) -> anyhow::Result<()> {
    match &args.figure {
        Some(_) => bail!("--figure has nothing to show: {reason}"),
        None => Ok(()),
    }
}

pub(super) fn plan_view(args: &FigureArgs, config: &Config, time_s: f64, travel_m: f64) -> PlanView {
    let caption = caption(args, config, format!("The dragon at {time_s} s"));
    let plan = plan_of(config.dragon(), caption, travel_m);
    match turnaround(config) {
        Some(turnaround) => on_turn(plan, &turnaround),
        None => plan,
    }
}

/// The dragon on a turn, with its head at a travel, and these benches or else the nearest pair from near.
pub(super) fn turn_view(
    caption: Caption,
    dragon: &Dragon,
    turnaround: &Turnaround,
    travel_m: f64,
    benches: Option<[usize; 2]>,
) -> PlanView {
    let pair = pair(dragon, travel_m, benches);
    PlanView { pair, ..on_turn(plan_of(dragon, caption, travel_m), turnaround) }
}

/// The dragon on a spiral that the head walks as far as a circle, and these benches or else the nearest pair from near.
pub(super) fn pitch_view(
    caption: Caption,
    dragon: &Dragon,
    turn_diameter_m: f64,
    travel_m: f64,
    benches: Option<[usize; 2]>,
) -> PlanView {
    let circle = Circle { radius_m: 0.5 * turn_diameter_m, name: format!("circle of diameter {turn_diameter_m} m") };
    let pair = pair(dragon, travel_m, benches);
    PlanView { circle: Some(circle), pair, ..plan_of(dragon, caption, travel_m) }
}

fn plan_of(dragon: &Dragon, caption: Caption, travel_m: f64) -> PlanView {
    PlanView { caption, dragon: in_plan(dragon, travel_m), circle: None, turn: None, pair: None }
}

fn in_plan(dragon: &Dragon, travel_m: f64) -> DragonInPlan {
    let handles = handles(dragon, travel_m);
    DragonInPlan {
        route: route_around(dragon, &handles),
        boards: corners(&boards(dragon, &handles)),
        hinges: handles.iter().map(|handle| handle.position).collect(),
    }
}

fn on_turn(plan: PlanView, turnaround: &Turnaround) -> PlanView {
    let circle = Circle { radius_m: 0.5 * turnaround.turn_diameter_m(), name: "turning circle".to_owned() };
    PlanView { circle: Some(circle), turn: Some(turn_marks(turnaround)), ..plan }
}

/// These benches or else the nearest pair, if there are more than two benches.
fn pair(dragon: &Dragon, travel_m: f64, benches: Option<[usize; 2]>) -> Option<NearestPair> {
    let boards = boards(dragon, &handles(dragon, travel_m));
    let benches = benches.or_else(|| Some(ClearanceSearch::default().nearest(&boards)?.benches))?;
    let approach = boards[benches[0]].approach(&boards[benches[1]]);
    let half = 0.5 * approach.clearance_m.max(0.0) * approach.direction;
    Some(NearestPair {
        benches,
        clearance_m: approach.clearance_m,
        points: [approach.point - half, approach.point + half],
    })
}

pub(super) fn contact_view(args: &FigureArgs, config: &Config, contact: &Contact) -> ContactView {
    let dragon = config.dragon();
    let time_s = config.timetable().time_s(contact.travel_m);
    let [first, second] = contact.benches;
    ContactView {
        caption: caption(args, config, format!("First contact, at {time_s:.6} s: benches {first} and {second}")),
        dragon: in_plan(dragon, contact.travel_m),
        benches: contact.benches,
        point: contact.point,
    }
}

/// The clearance up to a travel, with its near misses.
pub(super) fn clearance_over_time(
    args: &FigureArgs,
    config: &Config,
    meter: &Meter,
    to_m: f64,
    contact: Option<&Contact>,
    near_misses: &[NearMiss],
) -> ClearanceOverTime {
    let (dragon, timetable) = (config.dragon().metered(meter), config.timetable());
    let points = clearance_profile(&dragon, &even_travels(&dragon, dragon.start_travel_m(), to_m), || ());
    let sample = |point: &ClosestApproach| DVec2::new(timetable.time_s(point.travel_m), point.pair.clearance_m);
    let near_miss =
        |miss: &NearMiss| NearMissMark { time_s: miss.time_s, clearance_m: miss.clearance_m, benches: miss.benches };
    ClearanceOverTime {
        caption: caption(args, config, "Least clearance of all pairs of benches"),
        samples: points.approaches.iter().map(sample).collect(),
        near_misses: near_misses.iter().map(near_miss).collect(),
        contact: contact
            .map(|contact| ContactMark { time_s: timetable.time_s(contact.travel_m), benches: contact.benches }),
    }
}

/// Speeds of some handles around the time of the largest, with the head as fast as a limit allows.
pub(super) fn speeds_over_time(
    args: &FigureArgs,
    config: &Config,
    dragon: &Dragon,
    largest: &LargestRatio,
    limit_mps: f64,
) -> SpeedsOverTime {
    let (head_speed_mps, planned_speed_mps) = (limit_mps / largest.ratio, config.head_speed_mps());
    let time_s = |travel_m| passage_time_s(config, head_speed_mps, travel_m);
    let (start_m, end_m) = (dragon.start_travel_m(), dragon.end_travel_m());
    let detail_m = [largest.travel_m - DETAIL_S, largest.travel_m + DETAIL_S].map(|at_m| at_m.clamp(start_m, end_m));
    let mut travels_m = even_travels(dragon, start_m, end_m);
    travels_m.extend(even_travels(dragon, detail_m[0], detail_m[1]));
    travels_m.sort_unstable_by(f64::total_cmp);
    let mut all = Vec::with_capacity(travels_m.len());
    let mut handles: Vec<HandleSpeed> = drawn_handles(dragon, largest.handle)
        .map(|handle| HandleSpeed { name: handle_name(handle), samples: Vec::with_capacity(travels_m.len()) })
        .collect();
    let mut solver = ChainSolver::new(dragon);
    for &travel_m in &travels_m {
        let chain = solver.solve(dragon, travel_m).expect("the travel lies within the run");
        for (speeds, handle) in handles.iter_mut().zip(drawn_handles(dragon, largest.handle)) {
            let speed_mps = head_speed_mps * chain[handle].speed_ratio;
            speeds.samples.push(DVec2::new(time_s(travel_m), speed_mps));
        }
        let [least, most] = chain.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], handle| {
            [least.min(handle.speed_ratio), most.max(handle.speed_ratio)]
        });
        let time_s = time_s(travel_m);
        all.push(SpeedRange { time_s, least_mps: head_speed_mps * least, most_mps: head_speed_mps * most });
    }
    let time_s = time_s(largest.travel_m);
    let detail_s = DETAIL_S / head_speed_mps;
    let title = format!("Speeds of handles, the head at {head_speed_mps:.6} m/s (planned: {planned_speed_mps} m/s)");
    SpeedsOverTime {
        caption: caption_at_speed(args, config, head_speed_mps, title),
        all,
        handles,
        largest: Some(LargestSpeed { time_s, speed_mps: limit_mps, handle: largest.handle }),
        limit_mps: Some(limit_mps),
        detail_s: Some(time_s - detail_s..=time_s + detail_s),
    }
}

/// The handles that are drawn, the fastest among them.
fn drawn_handles(dragon: &Dragon, fastest: usize) -> impl Iterator<Item = usize> {
    let count = dragon.dimensions().handles();
    let mut drawn: Vec<usize> = DRAWN_HANDLES.into_iter().chain([fastest]).filter(|&handle| handle < count).collect();
    drawn.sort_unstable();
    drawn.dedup();
    drawn.into_iter()
}

fn handle_name(handle: usize) -> String {
    if handle == 0 { "head".to_owned() } else { format!("handle {handle}") }
}

fn even_travels(dragon: &Dragon, from_m: f64, to_m: f64) -> Vec<f64> {
    let samples = SAMPLES.min((MAX_PLACED / dragon.dimensions().handles()) as u32);
    (0..=samples).map(|i| from_m + (to_m - from_m) * f64::from(i) / f64::from(samples)).collect()
}

fn handles(dragon: &Dragon, travel_m: f64) -> Vec<Handle> {
    let mut solver = ChainSolver::new(dragon);
    solver.solve(dragon, travel_m).expect("the travel lies within the run").to_vec()
}

fn boards(dragon: &Dragon, handles: &[Handle]) -> Vec<Board> {
    let mut boards = Vec::new();
    dragon.place_boards(handles, &mut boards);
    boards
}

fn corners(boards: &[Board]) -> Vec<[DVec2; 4]> {
    boards.iter().map(Board::corners).collect()
}

/// The route from where it can be seen behind the tail to its end.
fn route_around(dragon: &Dragon, handles: &[Handle]) -> Vec<DVec2> {
    let route = dragon.route();
    let tail = handles.last().expect("a dragon has handles");
    // From here on a whole turn of a spiral lies behind the tail.
    let behind_m = std::f64::consts::TAU * (tail.position.length() + route.pitch_m());
    polyline(route, route.travel(tail.parameter) - behind_m, route.end_travel_m())
}

/// Points of a route, as near to each other as its curvature asks for.
fn polyline(route: &Route, from_m: f64, to_m: f64) -> Vec<DVec2> {
    let least_m = (to_m - from_m) / MAX_POINTS;
    let mut points = Vec::new();
    let mut travel_m = from_m;
    while travel_m < to_m {
        let parameter = route.parameter(travel_m);
        points.push(route.point(parameter).position);
        // A chord of length s under a curve of curvature κ leaves a sagitta of κ·s²/8.
        let curvature = route.curvature_bound(parameter, parameter);
        travel_m += (8.0 * SAGITTA_M / curvature).sqrt().max(least_m);
    }
    points.push(route.point(route.parameter(to_m)).position);
    points
}

fn turnaround(config: &Config) -> Option<Turnaround> {
    let RouteSpec::Turnaround(plan) = config.route() else { return None };
    Some(plan.turnaround(config.head_speed_mps()).expect("a valid configuration has a route"))
}

fn turn_marks(turnaround: &Turnaround) -> TurnMarks {
    let [entry_arc, exit_arc] = turnaround.arcs();
    let middle_m = entry_arc.length_m();
    let end_m = middle_m + exit_arc.length_m();
    let route = turnaround.route();
    let seams = [0.0, middle_m, end_m].map(|travel_m| route.point(route.parameter(travel_m)).position);
    TurnMarks { arcs: [polyline(&route, 0.0, middle_m), polyline(&route, middle_m, end_m)], seams }
}
