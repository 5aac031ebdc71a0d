//! The handles of the stage: the points of its outline, of the areas to keep out of, and of the line of the crowd.

use glam::DVec2;
use serde::Deserialize;
use serde_json::json;
use toml_edit::{Array, DocumentMut, Item, TableLike, Value};

use super::change::{Change, Key, Put, rounded_m};
use super::handle::{Field, Handle, HandleId, HandleKind};

/// A border that a hand draws.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum NewBorder {
    Outline,
    KeepOut,
    Crowd,
}

/// The handles of the borders in a text.
pub(super) fn handles(text: &str) -> Vec<Handle> {
    let Ok(document) = text.parse::<DocumentMut>() else { return Vec::new() };
    let Some(stage) = document.get("stage").and_then(Item::as_table_like) else { return Vec::new() };
    let outline = border(stage, "outline").into_iter().flat_map(|line| of_line(line, HandleKind::Outline, 0));
    let areas = border(stage, "keep_out").into_iter().flat_map(|areas| areas.iter().enumerate());
    let keep_out = areas.filter_map(|(at, area)| Some((at, area.as_array()?)));
    let keep_out = keep_out.flat_map(|(at, area)| of_line(area, HandleKind::KeepOut, at));
    let crowd = border(stage, "crowd").into_iter().flat_map(|line| of_line(line, HandleKind::Crowd, 0));
    outline.chain(keep_out).chain(crowd).collect()
}

fn border<'a>(stage: &'a dyn TableLike, key: &str) -> Option<&'a Array> {
    stage.get(key)?.as_array()
}

fn of_line(line: &Array, kind: HandleKind, at: usize) -> Vec<Handle> {
    let handle = |(point, value): (usize, &Value)| {
        let numbers: Vec<f64> = value.as_array()?.iter().filter_map(number).collect();
        let &[x, y] = &numbers[..] else { return None };
        let id = HandleId { dragon: 0, kind, at, point };
        let fields = [("x", x), ("y", y)].into_iter().enumerate();
        let fields = fields.map(|(axis, (label, value))| Field::length(keys(id, axis), label, value)).collect();
        Some(Handle { can_delete: true, ..Handle::new(id, DVec2::new(x, y), name(id), fields) })
    };
    let points: Vec<Handle> = line.iter().enumerate().filter_map(handle).collect();
    let middles = middles(&points, kind);
    points.into_iter().chain(middles).collect()
}

/// The middles of the sides between the points of a border.
fn middles(points: &[Handle], kind: HandleKind) -> Vec<Handle> {
    let middle_kind = match kind {
        HandleKind::KeepOut => HandleKind::KeepOutMiddle,
        HandleKind::Crowd => HandleKind::CrowdMiddle,
        _ => HandleKind::OutlineMiddle,
    };
    let is_line = kind == HandleKind::Crowd;
    let sides =
        points.iter().zip(points.iter().cycle().skip(1)).take(points.len().saturating_sub(usize::from(is_line)));
    let middle = |(from, to): (&Handle, &Handle)| {
        let at = DVec2::new(from.x_m + to.x_m, from.y_m + to.y_m) / 2.0;
        Handle::new(HandleId { kind: middle_kind, ..from.id }, at, format!("After {}", from.name), Vec::new())
    };
    sides.map(middle).collect()
}

fn number(value: &Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64))
}

fn name(id: HandleId) -> String {
    let point = id.point + 1;
    match id.kind {
        HandleKind::KeepOut => format!("Keep out {}, point {point}", id.at + 1),
        HandleKind::Crowd => format!("Crowd, point {point}"),
        _ => format!("Stage, point {point}"),
    }
}

/// The place of a coordinate in the document.
fn keys(id: HandleId, axis: usize) -> Vec<Key> {
    [line_keys(id), vec![Key::Index(id.point), Key::Index(axis)]].concat()
}

/// The place of a border in the document.
fn line_keys(id: HandleId) -> Vec<Key> {
    let name = |text: &str| Key::Name(text.to_owned());
    let mut keys = vec![name("stage")];
    match id.kind {
        HandleKind::KeepOut => keys.extend([name("keep_out"), Key::Index(id.at)]),
        HandleKind::Crowd => keys.push(name("crowd")),
        _ => keys.push(name("outline")),
    }
    keys
}

/// The changes that bring a point of a border elsewhere.
pub(super) fn moved(id: HandleId, to: DVec2) -> Vec<Change> {
    let coordinates = to.to_array().into_iter().enumerate();
    coordinates.map(|(axis, value_m)| Change::Set { keys: keys(id, axis), value: rounded_m(value_m) }).collect()
}

/// The change that puts a new point into a border, between the ends of the side whose middle a hand drags.
pub(super) fn inserted(middle: HandleId, border: HandleKind, to: DVec2) -> Vec<Change> {
    let keys = line_keys(HandleId { kind: border, ..middle });
    vec![Change::Insert { keys, at: middle.point + 1, value: json!(to.to_array().map(rounded_m)) }]
}

/// The change that draws a border. An outline and a crowd take the place of those that were there.
pub(super) fn drawn(text: &str, border: NewBorder, points: &[[f64; 2]]) -> Change {
    let points: Vec<[f64; 2]> = points.iter().map(|point| point.map(rounded_m)).collect();
    let name = |text: &str| Key::Name(text.to_owned());
    let areas = areas(text);
    let (keys, value) = match border {
        NewBorder::Outline => (vec![name("stage"), name("outline")], json!(points)),
        NewBorder::Crowd => (vec![name("stage"), name("crowd")], json!(points)),
        NewBorder::KeepOut if areas == 0 => (vec![name("stage"), name("keep_out")], json!([points])),
        NewBorder::KeepOut => (vec![name("stage"), name("keep_out"), Key::Index(areas)], json!(points)),
    };
    Put::new(keys, value).into()
}

/// The change that takes out a point of a border, or the border if it needs the point; `None` if there is no such point.
pub(super) fn deleted(text: &str, id: HandleId) -> Option<Change> {
    let of_same = |other: &HandleId| (other.kind, other.at) == (id.kind, id.at);
    let points = handles(text).iter().filter(|handle| of_same(&handle.id)).count();
    let least = if id.kind == HandleKind::Crowd { 2 } else { 3 };
    let keys = match points {
        0 => return None,
        points if points > least => [line_keys(id), vec![Key::Index(id.point)]].concat(),
        _ if id.kind == HandleKind::KeepOut && areas(text) == 1 => line_keys(id).into_iter().take(2).collect(),
        _ => line_keys(id),
    };
    Some(Put::nothing(keys).into())
}

/// Number of areas to keep out of.
fn areas(text: &str) -> usize {
    let document = text.parse::<DocumentMut>().ok();
    let stage = document.as_ref().and_then(|document| document.get("stage")?.as_table_like());
    stage.and_then(|stage| border(stage, "keep_out")).map_or(0, Array::len)
}
