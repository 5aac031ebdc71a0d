//! Edits of a whole path: mirrored, reversed, closed, made longer, or drawn anew through corners.

use std::f64::consts::{PI, TAU};

use bench_dragon_geometry::route::{PathSegment, Placement};
use glam::DVec2;
use serde::Deserialize;
use serde_json::{Value, json};

use super::change::{Change, Owner, Put, between, heading_deg, numbers_of, rounded_m};
use super::corner_run::CornerRun;
use super::handle::{headed, placed_at};
use super::path_handles::placements;

/// A segment that is put into a path.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum NewSegment {
    Line,
    Arc,
    Spiral,
    /// Half a circle, back to where the path came from.
    Turnaround,
}

impl NewSegment {
    fn segment(self) -> PathSegment {
        match self {
            Self::Line => PathSegment::Line { length_m: 5.0 },
            Self::Arc => PathSegment::Arc { radius_m: 4.0, turn: 0.5 * PI },
            Self::Spiral => PathSegment::Spiral { start_radius_m: 6.0, end_radius_m: 4.0, turn: TAU },
            Self::Turnaround => PathSegment::Arc { radius_m: 3.0, turn: PI },
        }
    }
}

/// Arcs that turn by less, in radians, and shorter lines, in metres, are left out of the part that closes a path.
const LEAST_TURN: f64 = 1e-5;
const LEAST_M: f64 = 1e-3;
/// Radius of the arcs of that part on a path without arcs, in metres.
const CLOSING_RADIUS_M: f64 = 4.0;

/// The mirror image about the direction of the start.
pub(super) fn mirrored(owner: Owner, segments: &[PathSegment]) -> Vec<Change> {
    let all = segments.iter().enumerate();
    all.flat_map(|(number, segment)| between(owner, number, segment, &turned_over(*segment))).collect()
}

fn turned_over(segment: PathSegment) -> PathSegment {
    match segment {
        PathSegment::Line { length_m } => PathSegment::Line { length_m },
        PathSegment::Arc { radius_m, turn } => PathSegment::Arc { radius_m, turn: -turn },
        PathSegment::Spiral { start_radius_m, end_radius_m, turn } => {
            PathSegment::Spiral { start_radius_m, end_radius_m, turn: -turn }
        }
    }
}

/// The same path, walked from its end to its beginning.
pub(super) fn reversed(owner: Owner, segments: &[PathSegment], begin: &Placement) -> Vec<Change> {
    let end = *placements(segments, begin).last().expect("a path has a beginning");
    let backward = |segment: PathSegment| match turned_over(segment) {
        PathSegment::Spiral { start_radius_m, end_radius_m, turn } => {
            PathSegment::Spiral { start_radius_m: end_radius_m, end_radius_m: start_radius_m, turn }
        }
        other => other,
    };
    let mut changes = vec![Change::Reverse { keys: owner.route("segments") }];
    for (number, segment) in segments.iter().rev().enumerate() {
        changes.extend(between(owner, number, segment, &backward(*segment)));
    }
    changes.extend(placed_at(owner, end.position));
    changes.push(headed(owner, end.heading + PI));
    changes
}

/// The path with a segment more, after the one of this number, or at its end.
pub(super) fn longer(owner: Owner, segments: &[PathSegment], after: Option<usize>, new: NewSegment) -> Vec<Change> {
    let at = after.map_or(segments.len(), |after| (after + 1).min(segments.len()));
    vec![Change::Splice { keys: owner.route("segments"), at, removed: 0, inserted: vec![new.segment()] }]
}

/// The path, closed by two arcs and a line, in the shortest way. `None` if there is none.
pub(super) fn closed(owner: Owner, segments: &[PathSegment], begin: &Placement) -> Option<Vec<Change>> {
    let end = *placements(segments, begin).last()?;
    let radii = segments.iter().filter_map(|segment| match segment {
        PathSegment::Arc { radius_m, .. } => Some(*radius_m),
        _ => None,
    });
    let radius_m = radii.min_by(f64::total_cmp).unwrap_or(CLOSING_RADIUS_M);
    let sides = [[1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0]];
    let ways = sides.into_iter().filter_map(|sides| joined(&end, begin, sides, radius_m));
    let way = ways.min_by(|one, other| length_m(one).total_cmp(&length_m(other)))?;
    let keys = owner.route("segments");
    let mut changes = vec![Change::Splice { keys, at: segments.len(), removed: 0, inserted: way.clone() }];
    for (number, segment) in (segments.len()..).zip(&way) {
        // A closed path closes to a millimetre, so these numbers are not rounded to one.
        changes.extend(exact(segment).map(|(key, value)| Change::Set { keys: owner.segment(number, key), value }));
    }
    changes.push(Put::new(owner.route("closed"), true).into());
    Some(changes)
}

fn length_m(segments: &[PathSegment]) -> f64 {
    segments.iter().map(PathSegment::length_m).sum()
}

/// Keys and values of a line or an arc, to a nanometre.
fn exact(segment: &PathSegment) -> impl Iterator<Item = (&'static str, f64)> {
    let fine = |value: f64| (value * 1e9).round() / 1e9;
    match *segment {
        PathSegment::Line { length_m } => vec![("length_m", fine(length_m))],
        PathSegment::Arc { radius_m, turn } => {
            vec![("radius_m", fine(radius_m)), ("turn_deg", fine(turn.to_degrees()))]
        }
        PathSegment::Spiral { .. } => Vec::new(),
    }
    .into_iter()
}

/// An arc, a line and an arc from one place to another (Dubins, 1957). `sides`: +1 turns left, −1 turns right.
fn joined(from: &Placement, to: &Placement, sides: [f64; 2], radius_m: f64) -> Option<Vec<PathSegment>> {
    let centre = |at: &Placement, side: f64| at.position + DVec2::from_angle(at.heading + 0.5 * PI * side) * radius_m;
    let across = centre(to, sides[1]) - centre(from, sides[0]);
    let (distance_m, angle) = (across.length(), across.to_angle());
    let (line_m, heading) = if sides[0] == sides[1] {
        (distance_m, if distance_m > LEAST_M { angle } else { from.heading })
    } else {
        let sine = 2.0 * radius_m / distance_m;
        if sine > 1.0 || !sine.is_finite() {
            return None;
        }
        (distance_m * (1.0 - sine * sine).sqrt(), angle + sides[0] * sine.asin())
    };
    let turn = |side: f64, from: f64, to: f64| {
        let turn = (side * (to - from)).rem_euclid(TAU);
        side * if TAU - turn < LEAST_TURN { 0.0 } else { turn }
    };
    let turns = [turn(sides[0], from.heading, heading), turn(sides[1], heading, to.heading)];
    let arc = |turn: f64| (turn.abs() > LEAST_TURN).then_some(PathSegment::Arc { radius_m, turn });
    let line = (line_m > LEAST_M).then_some(PathSegment::Line { length_m: line_m });
    Some([arc(turns[0]), line, arc(turns[1])].into_iter().flatten().collect())
}

/// A new route through corners, in place of the route that was there. `None` as of [`CornerRun::through`].
pub(super) fn through(owner: Owner, points: &[DVec2], radius_m: f64) -> Option<Put> {
    let run = CornerRun::through(points, radius_m)?;
    let segments = run.segments();
    let table = |segment: &PathSegment| {
        let kind = if matches!(segment, PathSegment::Line { .. }) { "line" } else { "arc" };
        let mut table = json!({ "kind": kind });
        for (key, value) in numbers_of(segment) {
            table[key] = value.into();
        }
        table
    };
    let route = json!({
        "kind": "path",
        "start_x_m": rounded_m(points[0].x),
        "start_y_m": rounded_m(points[0].y),
        "start_heading_deg": heading_deg(run.heading()),
        "segments": segments.iter().map(table).collect::<Vec<Value>>(),
    });
    let mut keys = owner.route("kind");
    keys.pop();
    Some(Put::new(keys, route))
}
