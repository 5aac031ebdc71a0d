//! The handles of a path: its start, its corners, the ends of its segments.

use std::f64::consts::{PI, TAU};

use bench_dragon_geometry::route::{PathSegment, Placement};
use glam::DVec2;

use super::change::{Change, Owner, between, heading_deg, numbers_of};
use super::corner_run::{CornerRun, runs};
use super::handle::{Field, Handle, HandleId, HandleKind, headed, place_fields, placed_at};

/// Distance of the handle that turns the whole route from its start, in metres.
const HEADING_M: f64 = 4.0;
/// Radius of a new corner beside no other, in metres.
const NEW_RADIUS_M: f64 = 3.0;
/// Smallest radius and length that a hand can drag, in metres, and smallest turn.
const LEAST_M: f64 = 0.01;
const LEAST_TURN: f64 = 0.0002;
/// Steps in which the end of a spiral is brought under the hand.
const AIMING_STEPS: usize = 12;

/// Where each segment begins, and the end.
pub(super) fn placements(segments: &[PathSegment], begin: &Placement) -> Vec<Placement> {
    let ends = segments.iter().scan(*begin, |at, segment| {
        *at = segment.end(at);
        Some(*at)
    });
    std::iter::once(*begin).chain(ends).collect()
}

/// The handles of an open path.
pub(super) fn handles(dragon: usize, owner: Owner, segments: &[PathSegment], begin: &Placement) -> Vec<Handle> {
    let placed = placements(segments, begin);
    let id = |kind, at| HandleId { dragon, kind, at, point: 0 };
    let behind = begin.position - DVec2::from_angle(begin.heading) * HEADING_M;
    let mut all = vec![
        Handle::new(id(HandleKind::Start, 0), begin.position, "Start", place_fields(owner, begin)),
        Handle::new(id(HandleKind::Heading, 0), behind, "Direction of the start", place_fields(owner, begin)),
    ];
    let mut corners = 0;
    let runs = runs(segments, &placed);
    for run in &runs {
        all.extend(of_run(dragon, owner, segments, run, &mut corners));
    }
    let is_in_run =
        |number: usize| runs.iter().any(|run| (run.first..=run.first + 2 * run.corners()).contains(&number));
    for number in (0..segments.len()).filter(|&number| !is_in_run(number)) {
        all.extend(of_curve(dragon, owner, number, &segments[number], &placed[number..=number + 1]));
    }
    all
}

/// The handles of a run: its corners, the middles of its lines, its end.
fn of_run(dragon: usize, owner: Owner, segments: &[PathSegment], run: &CornerRun, corners: &mut usize) -> Vec<Handle> {
    let id = |kind, at| HandleId { dragon, kind, at, point: 0 };
    let mut all = Vec::new();
    for line in 0..=run.corners() {
        let number = run.first + 2 * line;
        let middle = run.points[line].midpoint(run.points[line + 1]);
        let fields = fields(owner, number, &segments[number]);
        if run.is_first || line > 0 {
            all.push(Handle::new(
                id(HandleKind::Middle, number),
                middle,
                format!("Line {}", number + 1),
                fields.clone(),
            ));
        }
        if line < run.corners() {
            *corners += 1;
            let of_arc = self::fields(owner, number + 1, &segments[number + 1]);
            let name = format!("Corner {corners}");
            let corner = Handle::new(id(HandleKind::Corner, number + 1), run.points[line + 1], name, of_arc);
            all.push(Handle { can_delete: run.is_first || line > 0, ..corner });
        } else {
            let name = if run.is_last { "End".to_owned() } else { format!("End of line {}", number + 1) };
            all.push(Handle::new(id(HandleKind::End, number), run.points[run.end()], name, fields));
        }
    }
    all
}

/// The handles of an arc that rounds no corner, or of a part of a spiral.
fn of_curve(dragon: usize, owner: Owner, number: usize, segment: &PathSegment, ends: &[Placement]) -> Vec<Handle> {
    let id = |kind| HandleId { dragon, kind, at: number, point: 0 };
    let fields = fields(owner, number, segment);
    let name = |what: &str| format!("{what} {}", number + 1);
    match *segment {
        PathSegment::Line { .. } => Vec::new(),
        PathSegment::Arc { radius_m, turn } => {
            let middle = PathSegment::Arc { radius_m, turn: 0.5 * turn }.end(&ends[0]).position;
            vec![
                Handle::new(id(HandleKind::ArcRadius), middle, name("Radius of arc"), fields.clone()),
                Handle::new(id(HandleKind::ArcEnd), ends[1].position, name("End of arc"), fields),
            ]
        }
        PathSegment::Spiral { .. } => {
            vec![Handle::new(id(HandleKind::SpiralEnd), ends[1].position, name("End of spiral"), fields)]
        }
    }
}

/// The numbers of a segment.
fn fields(owner: Owner, number: usize, segment: &PathSegment) -> Vec<Field> {
    let field = |(key, value)| {
        let (label, unit) = match key {
            "length_m" => ("length", "m"),
            "radius_m" => ("radius", "m"),
            "start_radius_m" => ("radius at its start", "m"),
            "end_radius_m" => ("radius at its end", "m"),
            _ => ("turn", "°"),
        };
        Field { keys: owner.segment(number, key), label, value, unit }
    };
    numbers_of(segment).into_iter().map(field).collect()
}

/// The changes that bring a handle of an open path to a point; `None` for no handle of this path.
pub(super) fn moved(
    owner: Owner,
    segments: &[PathSegment],
    begin: &Placement,
    id: HandleId,
    to: DVec2,
) -> Option<Vec<Change>> {
    let placed = placements(segments, begin);
    let runs = runs(segments, &placed);
    let run_of = |number: usize| runs.iter().find(|run| (run.first..=run.first + 2 * run.corners()).contains(&number));
    let index = |run: &CornerRun| (id.at - run.first).div_ceil(2);
    match id.kind {
        HandleKind::Start => {
            let run = runs.first().filter(|run| run.is_first && (run.corners() > 0 || run.is_last));
            Some(match run {
                Some(run) => {
                    [placed_at(owner, to), of_new_run(owner, segments, begin, &run.clone().with_point(0, to))].concat()
                }
                None => placed_at(owner, to),
            })
        }
        HandleKind::Whole => Some(placed_at(owner, to)),
        HandleKind::Heading => Some(vec![headed(owner, (begin.position - to).to_angle())]),
        HandleKind::Corner => {
            let run = run_of(id.at)?;
            Some(of_new_run(owner, segments, begin, &run.clone().with_point(index(run), to)))
        }
        HandleKind::End => {
            let run = run_of(id.at)?;
            Some(of_new_run(owner, segments, begin, &run.clone().with_point(run.end(), to)))
        }
        HandleKind::Middle => {
            let run = run_of(id.at)?;
            let line = (id.at - run.first) / 2;
            let beside = run.radii_m.get(line).or(line.checked_sub(1).map(|corner| &run.radii_m[corner]));
            let radius_m = beside.copied().unwrap_or(NEW_RADIUS_M);
            Some(of_longer_run(owner, segments, begin, &run.clone().with_corner(line + 1, to, radius_m), line))
        }
        HandleKind::ArcRadius | HandleKind::ArcEnd | HandleKind::SpiralEnd => {
            let segment = segments.get(id.at)?;
            let after = curve_to(segment, &placed[id.at], id.kind, to)?;
            Some(between(owner, id.at, segment, &after))
        }
        _ => None,
    }
}

/// The changes that take out a corner; `None` for a handle that is none.
pub(super) fn deleted(owner: Owner, segments: &[PathSegment], begin: &Placement, id: HandleId) -> Option<Vec<Change>> {
    let placed = placements(segments, begin);
    let runs = runs(segments, &placed);
    let run = runs.iter().find(|run| (run.first..run.first + 2 * run.corners()).contains(&id.at))?;
    let index = (id.at - run.first).div_ceil(2);
    if id.kind != HandleKind::Corner || (!run.is_first && index == 1) {
        return None;
    }
    let shorter = run.clone().without_corner(index);
    let taken = Change::Splice { keys: owner.route("segments"), at: id.at, removed: 2, inserted: Vec::new() };
    let kept = [&segments[..id.at], &segments[id.at + 2..]].concat();
    Some([vec![taken], of_new_run(owner, &kept, begin, &shorter)].concat())
}

/// The changes that give a path's segments the measures of a run.
fn of_new_run(owner: Owner, segments: &[PathSegment], begin: &Placement, run: &CornerRun) -> Vec<Change> {
    let new = run.segments();
    let numbered = (run.first..).zip(&new);
    let mut changes: Vec<Change> =
        numbered.flat_map(|(number, after)| between(owner, number, &segments[number], after)).collect();
    if run.is_first && heading_deg(run.heading()) != heading_deg(begin.heading) {
        changes.push(headed(owner, run.heading()));
    }
    changes
}

/// The same for a run with a corner more on one of its lines.
fn of_longer_run(
    owner: Owner,
    segments: &[PathSegment],
    begin: &Placement,
    run: &CornerRun,
    line: usize,
) -> Vec<Change> {
    let (new, at) = (run.segments(), run.first + 2 * line + 1);
    let inserted = new[2 * line + 1..2 * line + 3].to_vec();
    let longer = [&segments[..at], &inserted[..], &segments[at..]].concat();
    let put_in = Change::Splice { keys: owner.route("segments"), at, removed: 0, inserted };
    [vec![put_in], of_new_run(owner, &longer, begin, run)].concat()
}

/// An arc or a part of a spiral whose dragged point is at a place, or as near as it can be.
fn curve_to(segment: &PathSegment, begin: &Placement, kind: HandleKind, to: DVec2) -> Option<PathSegment> {
    match (kind, *segment) {
        (HandleKind::ArcRadius, PathSegment::Arc { radius_m, turn }) => {
            let half = PathSegment::Arc { radius_m: 1.0, turn: 0.5 * turn };
            let reach = half.end(begin).position - begin.position;
            let radius_m = if reach.length() > LEAST_M {
                reach.dot(to - begin.position) / reach.length_squared()
            } else {
                radius_m
            };
            Some(PathSegment::Arc { radius_m: radius_m.max(LEAST_M), turn })
        }
        (HandleKind::ArcEnd, PathSegment::Arc { radius_m, turn }) => {
            let spoke = DVec2::from_angle(begin.heading - 0.5 * PI * turn.signum());
            let centre = begin.position - spoke * radius_m;
            let turned = turn.signum() * spoke.angle_to(to - centre);
            let turned = if turned.is_finite() { turned } else { 0.0 };
            Some(PathSegment::Arc { radius_m, turn: near_turn(turn, turned) })
        }
        (HandleKind::SpiralEnd, PathSegment::Spiral { .. }) => Some(spiral_to(*segment, begin, to)),
        _ => None,
    }
}

/// The turn of the same direction that is nearest to a turn, in whole turns from an angle of that direction.
fn near_turn(turn: f64, turned: f64) -> f64 {
    let laps = ((turn.abs() - turned) / TAU).round();
    (turned + TAU * laps).max(LEAST_TURN).copysign(turn)
}

/// The part of a spiral that ends at a point. Its centre moves with its end, so it is aimed in steps.
fn spiral_to(segment: PathSegment, begin: &Placement, to: DVec2) -> PathSegment {
    let mut spiral = segment;
    let mut aim = to;
    for _ in 0..AIMING_STEPS {
        let PathSegment::Spiral { start_radius_m, end_radius_m, turn } = spiral else { return spiral };
        let side = turn.signum();
        let slope = f64::atan2((end_radius_m - start_radius_m) / turn.abs(), start_radius_m);
        let spoke = DVec2::from_angle(begin.heading - side * (0.5 * PI - slope));
        let centre = begin.position - spoke * start_radius_m;
        let turned = side * spoke.angle_to(aim - centre);
        let end_radius_m = (aim - centre).length().max(LEAST_M);
        let turned = if turned.is_finite() { turned } else { 0.0 };
        spiral = PathSegment::Spiral { start_radius_m, end_radius_m, turn: near_turn(turn, turned) };
        aim += to - spiral.end(begin).position;
        if !aim.is_finite() {
            return segment;
        }
    }
    spiral
}
