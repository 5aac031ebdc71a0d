//! The handles of the stage: the points of its outline, of the areas to keep out of, and of the line of the crowd.

use glam::DVec2;
use toml_edit::{Array, DocumentMut, Item, TableLike, Value};

use super::change::{Change, Key, rounded_m};
use super::handle::{Field, Handle, HandleId, HandleKind};

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
        Some(Handle::new(id, DVec2::new(x, y), name(id), fields))
    };
    line.iter().enumerate().filter_map(handle).collect()
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
    let name = |text: &str| Key::Name(text.to_owned());
    let mut keys = vec![name("stage")];
    match id.kind {
        HandleKind::KeepOut => keys.extend([name("keep_out"), Key::Index(id.at)]),
        HandleKind::Crowd => keys.push(name("crowd")),
        _ => keys.push(name("outline")),
    }
    keys.extend([Key::Index(id.point), Key::Index(axis)]);
    keys
}

/// The changes that bring a point of a border elsewhere.
pub(super) fn moved(id: HandleId, to: DVec2) -> Vec<Change> {
    let coordinates = to.to_array().into_iter().enumerate();
    coordinates.map(|(axis, value_m)| Change::Set { keys: keys(id, axis), value: rounded_m(value_m) }).collect()
}
