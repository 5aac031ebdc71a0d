//! A configuration as text, in which numbers change and all else stays: comments, order, spaces.

use bench_dragon_geometry::route::PathSegment;
use serde_json::Value as Json;
use toml_edit::{Array, ArrayOfTables, DocumentMut, InlineTable, Item, RawString, Table, TableLike, Value};

use super::change::{Change, Key, numbers_of};

/// Applies changes to a text.
///
/// # Errors
/// The text is not TOML, or has no such place, in one line.
pub(super) fn changed(text: &str, changes: &[Change]) -> Result<String, String> {
    let mut document: DocumentMut = text.parse().map_err(|_| "the text is not TOML".to_owned())?;
    for change in changes {
        let is_done = match change {
            Change::Set { keys, value } => set(&mut document, keys, *value),
            Change::Put { keys, value } => put_value(&mut document, keys, value.as_ref()),
            Change::Reverse { keys } => reverse(&mut document, keys),
            Change::Splice { keys, at, removed, inserted } => splice(&mut document, keys, *at, *removed, inserted),
            Change::Insert { keys, at, value } => insert(&mut document, keys, *at, value),
        };
        is_done.ok_or_else(|| format!("the text has no place for {}", words(change)))?;
    }
    Ok(document.to_string())
}

fn words(change: &Change) -> String {
    let (Change::Set { keys, .. }
    | Change::Put { keys, .. }
    | Change::Reverse { keys }
    | Change::Splice { keys, .. }
    | Change::Insert { keys, .. }) = change;
    let word = |key: &Key| match key {
        Key::Index(index) => (index + 1).to_string(),
        Key::Name(name) => name.clone(),
    };
    keys.iter().map(word).collect::<Vec<_>>().join(" ")
}

/// A part of a document.
enum Place<'a> {
    Item(&'a mut Item),
    Table(&'a mut dyn TableLike),
    Value(&'a mut Value),
}

impl<'a> Place<'a> {
    fn of(document: &'a mut DocumentMut, keys: &[Key]) -> Option<Self> {
        let top = Place::Table(document.as_table_mut());
        keys.iter().try_fold(top, Place::step)
    }

    fn table(self) -> Option<&'a mut dyn TableLike> {
        match self {
            Place::Item(item) => item.as_table_like_mut(),
            Place::Table(table) => Some(table),
            Place::Value(value) => value.as_inline_table_mut().map(|table| table as &mut dyn TableLike),
        }
    }

    /// Number of entries of an array of values.
    fn length(&self) -> Option<usize> {
        match self {
            Place::Item(Item::Value(Value::Array(array))) | Place::Value(Value::Array(array)) => Some(array.len()),
            _ => None,
        }
    }

    /// Adds an entry to the end of an array of values.
    fn push(self, value: Value) -> Option<()> {
        match self {
            Place::Item(Item::Value(Value::Array(array))) | Place::Value(Value::Array(array)) => array.push(value),
            _ => return None,
        }
        Some(())
    }

    /// Removes an entry of an array.
    fn remove(self, index: usize) -> Option<()> {
        match self {
            Place::Item(Item::ArrayOfTables(tables)) if index < tables.len() => drop(tables.remove(index)),
            Place::Item(Item::Value(Value::Array(array))) | Place::Value(Value::Array(array))
                if index < array.len() =>
            {
                drop(array.remove(index));
            }
            _ => return None,
        }
        Some(())
    }

    fn is_inline(&self) -> bool {
        matches!(self, Place::Value(_) | Place::Item(Item::Value(_)))
    }

    fn step(self, key: &Key) -> Option<Self> {
        match (key, self) {
            (Key::Name(name), place) => {
                let table = place.table()?;
                // A table without keys has its default values.
                if table.get(name).is_none() {
                    table.insert(name, Item::Table(Table::new()));
                }
                table.get_mut(name).map(Place::Item)
            }
            (Key::Index(index), Place::Item(Item::ArrayOfTables(tables))) => {
                tables.get_mut(*index).map(|table| Place::Table(table))
            }
            (Key::Index(index), Place::Item(Item::Value(Value::Array(array))) | Place::Value(Value::Array(array))) => {
                array.get_mut(*index).map(Place::Value)
            }
            _ => None,
        }
    }
}

fn set(document: &mut DocumentMut, keys: &[Key], number: f64) -> Option<()> {
    let (last, path) = keys.split_last()?;
    let place = Place::of(document, path)?;
    match last {
        Key::Name(name) => {
            let table = place.table()?;
            match table.get_mut(name) {
                Some(item) => put(item.as_value_mut()?, number),
                None => drop(table.insert(name, Item::Value(number.into()))),
            }
        }
        Key::Index(_) => match place.step(last)? {
            Place::Value(value) => put(value, number),
            Place::Item(_) | Place::Table(_) => return None,
        },
    }
    Some(())
}

/// Replaces a value, and keeps the spaces and comments around it. A whole number stays whole if it can.
fn put(value: &mut Value, number: f64) {
    let is_whole = value.is_integer() && number.fract() == 0.0 && number.abs() < 1e9;
    let decor = value.decor().clone();
    *value = if is_whole { (number as i64).into() } else { number.into() };
    *value.decor_mut() = decor;
}

/// Puts a value in the place of another one, or removes it.
fn put_value(document: &mut DocumentMut, keys: &[Key], value: Option<&Json>) -> Option<()> {
    let (last, path) = keys.split_last()?;
    let place = Place::of(document, path)?;
    let is_inline = place.is_inline();
    match (last, value) {
        (Key::Name(name), None) => drop(place.table()?.remove(name)),
        (Key::Name(name), Some(value)) => {
            let table = place.table()?;
            match (table.get_mut(name), item(value, is_inline)?) {
                (Some(Item::Value(old)), Item::Value(new)) => replace(old, new),
                (_, item) => drop(table.insert(name, item)),
            }
        }
        (Key::Index(index), None) => place.remove(*index)?,
        (Key::Index(index), Some(json)) if place.length() == Some(*index) => place.push(toml_value(json)?)?,
        (Key::Index(_), Some(value)) => match (place.step(last)?, item(value, true)?) {
            (Place::Value(old), Item::Value(new)) => replace(old, new),
            _ => return None,
        },
    }
    Some(())
}

/// Puts the entries of an array in the opposite order. Their comments go with them.
fn reverse(document: &mut DocumentMut, keys: &[Key]) -> Option<()> {
    match Place::of(document, keys)? {
        Place::Item(Item::ArrayOfTables(tables)) => {
            let positions: Vec<Option<isize>> = tables.iter().map(Table::position).collect();
            let mut all: Vec<Table> = tables.iter().cloned().collect();
            all.reverse();
            for (table, position) in all.iter_mut().zip(positions) {
                table.set_position(position);
            }
            tables.clear();
            tables.extend(all);
        }
        Place::Item(Item::Value(Value::Array(array))) | Place::Value(Value::Array(array)) => {
            let mut all: Vec<Value> = array.iter().cloned().collect();
            all.reverse();
            // The spaces before an entry, with the comment of the one before, stay where they are.
            for (value, old) in all.iter_mut().zip(array.iter_mut()) {
                *value.decor_mut() = old.decor().clone();
                *old = value.clone();
            }
        }
        _ => return None,
    }
    Some(())
}

fn replace(old: &mut Value, mut new: Value) {
    *new.decor_mut() = old.decor().clone();
    *old = new;
}

/// A value in the form that its place allows: tables of their own, or inline.
fn item(json: &Json, is_inline: bool) -> Option<Item> {
    match json {
        Json::Object(entries) if !is_inline => {
            let pairs = entries.iter().map(|(key, value)| Some((key, item(value, false)?)));
            pairs.collect::<Option<Table>>().map(Item::Table)
        }
        Json::Array(entries) if !is_inline && !entries.is_empty() && entries.iter().all(Json::is_object) => {
            let tables = entries.iter().map(|entry| item(entry, false)?.into_table().ok());
            tables.collect::<Option<ArrayOfTables>>().map(Item::ArrayOfTables)
        }
        _ => toml_value(json).map(Item::Value),
    }
}

fn toml_value(json: &Json) -> Option<Value> {
    Some(match json {
        Json::Null => return None,
        Json::Bool(flag) => (*flag).into(),
        Json::Number(number) => match number.as_i64() {
            Some(whole) => whole.into(),
            None => number.as_f64()?.into(),
        },
        Json::String(text) => text.as_str().into(),
        Json::Array(entries) => Value::Array(entries.iter().map(toml_value).collect::<Option<Array>>()?),
        Json::Object(entries) => {
            let pairs = entries.iter().map(|(key, entry)| Some((key, toml_value(entry)?)));
            Value::InlineTable(pairs.collect::<Option<InlineTable>>()?)
        }
    })
}

fn splice(document: &mut DocumentMut, keys: &[Key], at: usize, removed: usize, inserted: &[PathSegment]) -> Option<()> {
    match Place::of(document, keys)? {
        Place::Item(Item::ArrayOfTables(tables)) => splice_tables(tables, at, removed, inserted),
        Place::Item(Item::Value(Value::Array(array))) | Place::Value(Value::Array(array)) => {
            let values = inserted.iter().map(|segment| Value::InlineTable(pairs(segment).collect::<InlineTable>()));
            splice_array(array, at, removed, values.collect())
        }
        _ => None,
    }
}

/// Inserts a value into an array of values.
fn insert(document: &mut DocumentMut, keys: &[Key], at: usize, value: &Json) -> Option<()> {
    match Place::of(document, keys)? {
        Place::Item(Item::Value(Value::Array(array))) | Place::Value(Value::Array(array)) => {
            splice_array(array, at, 0, vec![toml_value(value)?])
        }
        _ => None,
    }
}

fn splice_tables(tables: &mut ArrayOfTables, at: usize, removed: usize, inserted: &[PathSegment]) -> Option<()> {
    let mut all: Vec<Table> = tables.iter().cloned().collect();
    let range = at..at.checked_add(removed).filter(|&end| end <= all.len())?;
    // Tables are written in the order of their positions. A new one follows the one before it.
    let position = all[..at].last().or(all.first()).and_then(Table::position);
    let new = inserted.iter().map(|segment| {
        let mut table: Table = pairs(segment).map(|(key, value)| (key, Item::Value(value))).collect();
        table.decor_mut().set_prefix("\n");
        table.set_position(position);
        table
    });
    all.splice(range, new.collect::<Vec<_>>());
    tables.clear();
    tables.extend(all);
    Some(())
}

/// In an array, the comment after an entry is before the next one, or before the end. It stays after its entry.
fn splice_array(array: &mut Array, at: usize, removed: usize, inserted: Vec<Value>) -> Option<()> {
    if at.checked_add(removed)? > array.len() {
        return None;
    }
    let before = prefix(array, at);
    let plain = line_break(&prefix(array, at.min(array.len().saturating_sub(1))));
    (0..removed).for_each(|_| drop(array.remove(at)));
    let end = at + inserted.len();
    let is_at_end = end > at && at == array.len();
    for (index, value) in (at..).zip(inserted) {
        array.insert_formatted(index, value);
        set_prefix(array, index, plain.clone());
    }
    if end < array.len() {
        set_prefix(array, end, plain);
    } else if end > at {
        array.set_trailing(line_break(&before));
    }
    if !is_at_end || before.contains('#') {
        set_prefix(array, at, before);
    }
    Some(())
}

/// The spaces and comments before an entry, or before the end.
fn prefix(array: &Array, index: usize) -> String {
    let raw = match array.get(index) {
        Some(value) => value.decor().prefix(),
        None => Some(array.trailing()),
    };
    raw.and_then(RawString::as_str).unwrap_or_default().to_owned()
}

fn set_prefix(array: &mut Array, index: usize, prefix: String) {
    match array.get_mut(index) {
        Some(value) => value.decor_mut().set_prefix(prefix),
        None => array.set_trailing(prefix),
    }
}

/// The line break and the indent of a prefix, without its comments.
fn line_break(prefix: &str) -> String {
    let last = prefix.rfind('\n').map_or(prefix, |at| &prefix[at..]);
    if last.contains('#') { String::new() } else { last.to_owned() }
}

/// The keys of a segment, as TOML.
fn pairs(segment: &PathSegment) -> impl Iterator<Item = (&'static str, Value)> {
    let kind = match segment {
        PathSegment::Line { .. } => "line",
        PathSegment::Arc { .. } => "arc",
        PathSegment::Spiral { .. } => "spiral",
    };
    let numbers = numbers_of(segment).into_iter().map(|(key, value)| (key, value.into()));
    [("kind", kind.into())].into_iter().chain(numbers)
}
