//! Changes of a configuration: numbers, and segments of a path that come or go.

use bench_dragon_geometry::route::PathSegment;
use serde::{Deserialize, Serialize};
use serde_json::Value as Json;
use toml::{Table, Value};

/// A step into a TOML document: the key of a table, or the index of an entry.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub(super) enum Key {
    Index(usize),
    Name(String),
}

/// The place of a value, from the top of the document.
pub(super) type Keys = Vec<Key>;

/// A change of a document.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Change {
    /// A number gets another value.
    Set { keys: Keys, value: f64 },
    /// A value of any kind takes the place of another one; `None` removes it.
    Put { keys: Keys, value: Option<Json> },
    /// The entries of an array are put in the opposite order.
    Reverse { keys: Keys },
    /// From an index on, segments of a path are taken out, and others put in.
    Splice { keys: Keys, at: usize, removed: usize, inserted: Vec<PathSegment> },
    /// An array gets one more entry, before the one of an index.
    Insert { keys: Keys, at: usize, value: Json },
}

/// A value for a place, as the page and an answer of the planner write it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Put {
    keys: Keys,
    /// `None` removes what is there.
    value: Option<Json>,
}

impl Put {
    pub(super) fn new(keys: Keys, value: impl Into<Json>) -> Self {
        Self { keys, value: Some(value.into()) }
    }

    /// Removes what is at a place.
    pub(super) fn nothing(keys: Keys) -> Self {
        Self { keys, value: None }
    }
}

impl From<Put> for Change {
    fn from(Put { keys, value }: Put) -> Self {
        Self::Put { keys, value }
    }
}

/// What has to be put where so that one document becomes another.
pub(super) fn difference(before: &Table, after: &Table) -> Vec<Put> {
    let mut puts = Vec::new();
    of_tables(before, after, &mut Vec::new(), &mut puts);
    puts
}

fn of_tables(before: &Table, after: &Table, keys: &mut Keys, puts: &mut Vec<Put>) {
    let gone = before.keys().filter(|key| !after.contains_key(*key));
    puts.extend(gone.map(|key| Put { keys: [&**keys, &[Key::Name(key.clone())]].concat(), value: None }));
    for (key, new) in after {
        keys.push(Key::Name(key.clone()));
        of_values(before.get(key), new, keys, puts);
        keys.pop();
    }
}

fn of_values(before: Option<&Value>, after: &Value, keys: &mut Keys, puts: &mut Vec<Put>) {
    match (before, after) {
        (Some(before), after) if before == after => {}
        (Some(Value::Table(before)), Value::Table(after)) => of_tables(before, after, keys, puts),
        (Some(Value::Array(before)), Value::Array(after))
            if before.len() == after.len() && after.iter().all(Value::is_table) =>
        {
            for (index, (before, after)) in before.iter().zip(after).enumerate() {
                keys.push(Key::Index(index));
                of_values(Some(before), after, keys, puts);
                keys.pop();
            }
        }
        _ => puts.push(Put { keys: keys.clone(), value: serde_json::to_value(after).ok() }),
    }
}

/// The tables of one dragon: those of the document, or of an entry of `[[dragons]]`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Owner(pub(super) Option<usize>);

impl Owner {
    /// The place of a key of `[route]`.
    pub(super) fn route(self, key: &str) -> Keys {
        let dragon = self.0.into_iter().flat_map(|dragon| [Key::Name("dragons".to_owned()), Key::Index(dragon)]);
        dragon.chain(["route", key].map(|name| Key::Name(name.to_owned()))).collect()
    }

    /// The place of a key of a segment of a path.
    pub(super) fn segment(self, segment: usize, key: &str) -> Keys {
        let mut keys = self.route("segments");
        keys.extend([Key::Index(segment), Key::Name(key.to_owned())]);
        keys
    }
}

/// Lengths are rounded to a millimetre.
pub(super) fn rounded_m(length_m: f64) -> f64 {
    round(length_m, 1e3)
}

/// Angles are rounded to a ten-thousandth of a degree, 0.2 mm at 100 m.
pub(super) fn rounded_deg(angle: f64) -> f64 {
    round(angle.to_degrees(), 1e4)
}

/// A direction in degrees, above −180° and at most 180°.
pub(super) fn heading_deg(angle: f64) -> f64 {
    let deg = rounded_deg(angle).rem_euclid(360.0);
    round(if deg > 180.0 { deg - 360.0 } else { deg }, 1e4)
}

/// Rounds to a number of steps per unit, without a negative zero.
pub(super) fn round(value: f64, steps: f64) -> f64 {
    (value * steps).round() / steps + 0.0
}

/// The keys of a segment with their values, in the units of the configuration.
pub(super) fn numbers_of(segment: &PathSegment) -> Vec<(&'static str, f64)> {
    match *segment {
        PathSegment::Line { length_m } => vec![("length_m", rounded_m(length_m))],
        PathSegment::Arc { radius_m, turn } => {
            vec![("radius_m", rounded_m(radius_m)), ("turn_deg", rounded_deg(turn))]
        }
        PathSegment::Spiral { start_radius_m, end_radius_m, turn } => vec![
            ("start_radius_m", rounded_m(start_radius_m)),
            ("end_radius_m", rounded_m(end_radius_m)),
            ("turn_deg", rounded_deg(turn)),
        ],
    }
}

/// The changes that make one segment another of the same kind. Numbers that round to the same value stay as they are written.
pub(super) fn between(owner: Owner, number: usize, before: &PathSegment, after: &PathSegment) -> Vec<Change> {
    let pairs = numbers_of(before).into_iter().zip(numbers_of(after));
    let changed = pairs.filter(|((_, before), (_, after))| before != after);
    changed.map(|(_, (key, value))| Change::Set { keys: owner.segment(number, key), value }).collect()
}
