//! Lines and rings of GeoJSON files.
//!
//! Source: RFC 7946. Positions are longitude and latitude. The outline of a polygon is a ring.

use std::fmt::{self, Formatter};

use serde::de::{Deserialize, Deserializer, Error, SeqAccess, Visitor};
use serde_json::{Map, Value};

use super::super::{DrawingFileError, MAX_PIECES, quoted};
use super::{Line, LonLat};

/// Names of a coordinate system in degrees, in files of 2008.
const DEGREES: [&str; 3] = ["CRS84", "EPSG:4326", "EPSG::4326"];

/// An object of any type.
#[derive(serde::Deserialize)]
struct Object {
    #[serde(rename = "type")]
    kind: String,
    id: Option<Id>,
    properties: Option<Map<String, Value>>,
    geometry: Option<Box<Object>>,
    #[serde(default)]
    features: Vec<Object>,
    #[serde(default)]
    geometries: Vec<Object>,
    coordinates: Option<Coordinates>,
    crs: Option<Crs>,
}

#[derive(serde::Deserialize)]
#[serde(untagged)]
enum Id {
    Text(String),
    Number(f64),
}

#[derive(serde::Deserialize)]
struct Crs {
    properties: Option<CrsProperties>,
}

#[derive(serde::Deserialize)]
struct CrsProperties {
    name: Option<String>,
}

/// A position, or a list of lists of them.
enum Coordinates {
    Position(LonLat),
    List(Vec<Coordinates>),
}

pub(super) fn lines(text: &str) -> Result<Vec<Line>, DrawingFileError> {
    let object: Object = serde_json::from_str(text).map_err(|error| {
        DrawingFileError(format!("is not a valid GeoJSON file: {}", error.to_string().replace('\n', " ")))
    })?;
    let name = object.crs.as_ref().and_then(|crs| crs.properties.as_ref()?.name.as_deref());
    if let Some(name) = name.filter(|name| !DEGREES.iter().any(|known| name.ends_with(known))) {
        return Err(DrawingFileError(format!("has positions in {}, must be longitude and latitude", quoted(name))));
    }
    let mut lines = vec![];
    add(object, &Line::default(), &mut lines);
    Ok(lines)
}

/// Adds the lines of an object. They have the names of the feature that contains them.
fn add(object: Object, named: &Line, lines: &mut Vec<Line>) {
    let mut named = named.clone();
    if object.kind == "Feature" {
        let properties = object.properties.unwrap_or_default();
        let text =
            |names: [&str; 2]| names.into_iter().find_map(|name| properties.get(name)?.as_str().map(str::to_owned));
        (named.label, named.layer) = (text(["name", "Name"]), text(["layer", "Layer"]));
        named.id = object.id.map(|id| match id {
            Id::Text(id) => id,
            Id::Number(number) => number.to_string(),
        });
    }
    for inner in object.geometry.map(|inner| *inner).into_iter().chain(object.features).chain(object.geometries) {
        add(inner, &named, lines);
    }
    let mut push = |points: Coordinates, is_ring: bool| {
        if let Coordinates::List(points) = points {
            let positions = points.into_iter().filter_map(|point| match point {
                Coordinates::Position(position) => Some(position),
                Coordinates::List(_) => None,
            });
            lines.push(Line { points: positions.collect(), is_ring, ..named.clone() });
        }
    };
    let inner = |coordinates: Coordinates| match coordinates {
        Coordinates::List(list) => list,
        Coordinates::Position(_) => vec![],
    };
    let Some(coordinates) = object.coordinates else { return };
    match &*object.kind {
        "LineString" => push(coordinates, false),
        "MultiLineString" => inner(coordinates).into_iter().for_each(|line| push(line, false)),
        "Polygon" => inner(coordinates).into_iter().take(1).for_each(|ring| push(ring, true)),
        "MultiPolygon" => {
            let outlines = inner(coordinates).into_iter().filter_map(|polygon| inner(polygon).into_iter().next());
            outlines.for_each(|ring| push(ring, true));
        }
        _ => {}
    }
}

impl<'de> Deserialize<'de> for Coordinates {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Reader)
    }
}

/// Reads a position, or a list.
struct Reader;

/// An element of a list.
enum Item {
    Number(f64),
    Inner(Coordinates),
}

impl<'de> Visitor<'de> for Reader {
    type Value = Coordinates;

    fn expecting(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        formatter.write_str("a position or a list of positions")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Coordinates, A::Error> {
        let mut numbers = vec![];
        let mut inner = vec![];
        while let Some(item) = list.next_element::<Item>()? {
            match item {
                Item::Number(number) if inner.is_empty() && numbers.len() < 8 => numbers.push(number),
                Item::Inner(item) if numbers.is_empty() => inner.push(item),
                _ => return Err(Error::custom("a position or a list has another element")),
            }
            if inner.len() > MAX_PIECES {
                return Err(Error::custom("a list has too many positions"));
            }
        }
        match numbers[..] {
            [lon, lat, ..] => Ok(Coordinates::Position(LonLat { lon, lat })),
            [_] => Err(Error::custom("a position has one number, must have two")),
            [] => Ok(Coordinates::List(inner)),
        }
    }
}

impl<'de> Deserialize<'de> for Item {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ItemReader)
    }
}

struct ItemReader;

impl<'de> Visitor<'de> for ItemReader {
    type Value = Item;

    fn expecting(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        formatter.write_str("a number or a list")
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Item, E> {
        Ok(Item::Number(value))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Item, E> {
        Ok(Item::Number(value as f64))
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Item, E> {
        Ok(Item::Number(value as f64))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<Item, A::Error> {
        Reader.visit_seq(list).map(Item::Inner)
    }
}
