//! The handles of a spiral and of a turnaround. Both lie about their centre: at the angle θ, the radius is pitch · θ / 2π.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use bench_dragon_geometry::route::{Placement, SpiralSpec, TurnaroundSpec};
use glam::DVec2;

use super::change::{Change, Owner, round, rounded_m};
use super::handle::{Field, Handle, HandleId, HandleKind, headed, place_fields, placed_at};

/// Distance of the handle that turns the whole route from the outermost dragged point, as a share.
const OUTSIDE: f64 = 1.15;
/// Smallest pitch, diameter and number of turns that a hand can drag.
const LEAST: f64 = 0.01;

/// The handles of a spiral: centre, start, pitch, direction.
pub(super) fn of_spiral(dragon: usize, owner: Owner, spiral: &SpiralSpec, place: &Placement) -> Vec<Handle> {
    let id = |kind, at| HandleId { dragon, kind, at, point: 0 };
    let at = |angle: f64, radius_m: f64| place.place(DVec2::from_angle(angle) * radius_m);
    let start = TAU * spiral.start_turns;
    let start_m = spiral.pitch_m * spiral.start_turns;
    let numbers = vec![
        Field::length(owner.route("pitch_m"), "pitch", spiral.pitch_m),
        Field { keys: owner.route("start_turns"), label: "turns", value: round(spiral.start_turns, 1e5), unit: "" },
    ];
    // Half a turn inside the start, on the same side of the centre at every pitch.
    let inner = (start - PI).max(0.5 * start);
    vec![
        Handle::new(id(HandleKind::Whole, 0), place.position, "Centre", place_fields(owner, place)),
        Handle::new(id(HandleKind::SpiralStart, 0), at(start, start_m), "Start", numbers.clone()),
        Handle::new(id(HandleKind::Pitch, 0), at(inner, spiral.pitch_m * inner / TAU), "Pitch", numbers),
        Handle::new(id(HandleKind::Heading, 0), at(PI, OUTSIDE * start_m), "Direction", place_fields(owner, place)),
    ]
}

/// The handles of a turnaround: centre, circle, pitch, direction.
pub(super) fn of_turnaround(dragon: usize, owner: Owner, turn: &TurnaroundSpec, place: &Placement) -> Vec<Handle> {
    let id = |kind, at| HandleId { dragon, kind, at, point: 0 };
    let at = |angle: f64, radius_m: f64| place.place(DVec2::from_angle(angle) * radius_m);
    let radius_m = 0.5 * turn.turn_diameter_m;
    let lap = ((radius_m / turn.pitch_m - 0.25).ceil().max(0.0)) as usize;
    let on_spiral = FRAC_PI_2 + TAU * lap as f64;
    let numbers = vec![
        Field::length(owner.route("pitch_m"), "pitch", turn.pitch_m),
        Field::length(owner.route("turn_diameter_m"), "circle", turn.turn_diameter_m),
        Field {
            keys: owner.route("radius_ratio"),
            label: "ratio of radii",
            value: round(turn.radius_ratio, 1e5),
            unit: "",
        },
        Field::length(owner.route("turn_line_m"), "line", turn.line_m),
    ];
    let outside_m = OUTSIDE * (radius_m + turn.pitch_m);
    vec![
        Handle::new(id(HandleKind::Whole, 0), place.position, "Centre", place_fields(owner, place)),
        Handle::new(id(HandleKind::TurnCircle, 0), at(-FRAC_PI_2, radius_m), "Turning circle", numbers.clone()),
        Handle::new(id(HandleKind::Pitch, lap), at(on_spiral, turn.pitch_m * on_spiral / TAU), "Pitch", numbers),
        Handle::new(id(HandleKind::Heading, 0), at(PI, outside_m), "Direction", place_fields(owner, place)),
    ]
}

/// The changes that bring a handle of a spiral to a point; `None` for a handle of another kind.
pub(super) fn moved_of_spiral(
    owner: Owner,
    spiral: &SpiralSpec,
    place: &Placement,
    id: HandleId,
    to: DVec2,
) -> Option<Vec<Change>> {
    let local = place.unplace(to);
    match id.kind {
        HandleKind::SpiralStart => {
            let share = local.to_angle() / TAU;
            let turns = share + (local.length() / spiral.pitch_m - share).round();
            Some(vec![Change::Set { keys: owner.route("start_turns"), value: round(turns.max(LEAST), 1e5) }])
        }
        HandleKind::Pitch => {
            let start = TAU * spiral.start_turns;
            Some(vec![pitch(owner, local.length() * TAU / (start - PI).max(0.5 * start))])
        }
        _ => moved_whole(owner, place, id, to),
    }
}

/// The changes that bring a handle of a turnaround to a point; `None` for a handle of another kind.
pub(super) fn moved_of_turnaround(owner: Owner, place: &Placement, id: HandleId, to: DVec2) -> Option<Vec<Change>> {
    let local = place.unplace(to);
    match id.kind {
        HandleKind::TurnCircle => {
            let value = rounded_m((2.0 * local.length()).max(LEAST));
            Some(vec![Change::Set { keys: owner.route("turn_diameter_m"), value }])
        }
        HandleKind::Pitch => Some(vec![pitch(owner, local.length() * TAU / (FRAC_PI_2 + TAU * id.at as f64))]),
        _ => moved_whole(owner, place, id, to),
    }
}

fn pitch(owner: Owner, pitch_m: f64) -> Change {
    Change::Set { keys: owner.route("pitch_m"), value: rounded_m(pitch_m.max(LEAST)) }
}

fn moved_whole(owner: Owner, place: &Placement, id: HandleId, to: DVec2) -> Option<Vec<Change>> {
    match id.kind {
        HandleKind::Whole => Some(placed_at(owner, to)),
        HandleKind::Heading => Some(vec![headed(owner, (place.position - to).to_angle())]),
        _ => None,
    }
}
