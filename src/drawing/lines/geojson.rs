//! Lines and rings of GeoJSON files.
//!
//! Source: RFC 7946. Positions are longitude and latitude. The outline of a polygon is a ring; its holes are no paths.

use std::fmt::{self, Formatter};

use serde::de::{Deserialize, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Value};

use super::super::{DrawingFileError, MAX_PIECES, quoted};
use super::{Line, LonLat};

/// Names of a coordinate system in degrees, in files of 2008.
const DEGREES: [&str; 3] = ["CRS84", "EPSG:4326", "EPSG::4326"];

/// An object of any type.
#[derive(serde::Deserialize)]
#[serde(expecting = "an object with a type")]
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
    crs: Option<Value>,
}

#[derive(serde::Deserialize)]
#[serde(untagged)]
enum Id {
    Text(String),
    Number(f64),
}

/// What a list of coordinates has.
enum Coordinates {
    Number(f64),
    Position(LonLat),
    List(Vec<Coordinates>),
    /// A list that is neither a position nor a list of lists, and why.
    Wrong(&'static str),
    /// Neither a number nor a list.
    Other,
}

pub(super) fn lines(text: &str) -> Result<Vec<Line>, DrawingFileError> {
    // A list would be read as the fields of an object in their order.
    if text.trim_start().starts_with('[') {
        return Err(DrawingFileError(
            "is not a valid GeoJSON file: it is a list, must be an object with a type".to_owned(),
        ));
    }
    let object: Object = serde_json::from_str(text).map_err(|error| {
        DrawingFileError(format!("is not a valid GeoJSON file: {}", error.to_string().replace('\n', " ")))
    })?;
    if let Some(reason) = object.crs.as_ref().and_then(other_system) {
        return Err(DrawingFileError(reason));
    }
    let mut lines = vec![];
    add(object, &Line::default(), &mut lines);
    Ok(lines)
}

/// Why a coordinate system is not one of degrees.
fn other_system(crs: &Value) -> Option<String> {
    let name = crs.pointer("/properties/name").and_then(Value::as_str);
    let is_known = name.is_some_and(|name| DEGREES.iter().any(|known| name.ends_with(known)));
    let shown = || quoted(&name.map_or_else(|| crs.to_string(), str::to_owned));
    (!is_known).then(|| format!("has positions in {}, must be longitude and latitude", shown()))
}

/// Adds the lines of an object. They have the names of the feature that contains them.
fn add(object: Object, named: &Line, lines: &mut Vec<Line>) {
    let mut named = named.clone();
    named.fault = named.fault.or_else(|| object.crs.as_ref().and_then(other_system));
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
    let mut push = |line: Coordinates, is_ring: bool| {
        let (points, wrong) = match positions(line) {
            Ok(points) => (points, None),
            Err(reason) => (vec![], Some(reason.to_owned())),
        };
        lines.push(Line { points, is_ring, fault: named.fault.clone().or(wrong), ..named.clone() });
    };
    let inner = |coordinates: Coordinates| match coordinates {
        Coordinates::List(list) => list,
        // It is the fault of a line.
        wrong => vec![wrong],
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

/// The positions of a line, or why it has others.
fn positions(line: Coordinates) -> Result<Vec<LonLat>, &'static str> {
    const PLACE: &str = "has a position in place of a line, must have a list of positions";
    let points = match line {
        Coordinates::List(points) => points,
        Coordinates::Position(_) => return Err(PLACE),
        Coordinates::Wrong(reason) => return Err(reason),
        Coordinates::Number(_) | Coordinates::Other => return Err("has a line that is no list of positions"),
    };
    let position = |point| match point {
        Coordinates::Position(position) => Ok(position),
        Coordinates::Wrong(reason) => Err(reason),
        _ => Err("has a list in place of a position, must have a longitude and a latitude"),
    };
    points.into_iter().map(position).collect()
}

impl<'de> Deserialize<'de> for Coordinates {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Reader)
    }
}

/// Reads coordinates. What is wrong with them is only a fault of the line that has them.
struct Reader;

impl<'de> Visitor<'de> for Reader {
    type Value = Coordinates;

    fn expecting(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        formatter.write_str("a position or a list of positions")
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Coordinates, E> {
        Ok(Coordinates::Number(value))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Coordinates, E> {
        Ok(Coordinates::Number(value as f64))
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Coordinates, E> {
        Ok(Coordinates::Number(value as f64))
    }

    fn visit_bool<E: Error>(self, _: bool) -> Result<Coordinates, E> {
        Ok(Coordinates::Other)
    }

    fn visit_str<E: Error>(self, _: &str) -> Result<Coordinates, E> {
        Ok(Coordinates::Other)
    }

    fn visit_unit<E: Error>(self) -> Result<Coordinates, E> {
        Ok(Coordinates::Other)
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Coordinates, A::Error> {
        while map.next_entry::<IgnoredAny, IgnoredAny>()?.is_some() {}
        Ok(Coordinates::Other)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Coordinates, A::Error> {
        const MOST_NUMBERS: usize = 8;
        let (mut numbers, mut inner, mut wrong) = (vec![], vec![], None);
        while let Some(item) = list.next_element()? {
            match item {
                Coordinates::Number(_) if numbers.len() == MOST_NUMBERS => {
                    wrong = Some("has a position of more than 8 numbers, must have a longitude and a latitude");
                }
                Coordinates::Number(number) => numbers.push(number),
                Coordinates::Other => wrong = Some("has a coordinate that is no number"),
                item => inner.push(item),
            }
            if inner.len() > MAX_PIECES {
                return Err(Error::custom("a list has too many positions"));
            }
        }
        Ok(match (wrong, &numbers[..]) {
            (Some(reason), _) => Coordinates::Wrong(reason),
            (None, []) => Coordinates::List(inner),
            (None, _) if !inner.is_empty() => {
                Coordinates::Wrong("has a list of numbers and lists, must have one of them")
            }
            (None, [_]) => Coordinates::Wrong("has a position of one number, must have a longitude and a latitude"),
            (None, &[lon, lat, ..]) => Coordinates::Position(LonLat { lon, lat }),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::{DrawingFormat, PathChoice};
    use super::super::path;

    /// The error of a file of two lines whose first is this object, or of another choice among them.
    fn error(first: &str, label: &str) -> Option<String> {
        let good = "{\"type\":\"Feature\",\"properties\":{\"name\":\"good\"},\"geometry\":\
                    {\"type\":\"LineString\",\"coordinates\":[[10,50],[10.001,50],[10.002,50]]}}";
        let text = format!("{{\"type\":\"FeatureCollection\",\"features\":[{first},{good}]}}");
        let choice = PathChoice { label: Some(label), ..PathChoice::default() };
        path(text.as_bytes(), DrawingFormat::GeoJson, &choice).err().map(|error| error.to_string())
    }

    fn feature(kind: &str, coordinates: &str, crs: &str) -> String {
        format!(
            "{{\"type\":\"Feature\",\"properties\":{{\"name\":\"w\"}},\"geometry\":\
             {{\"type\":\"{kind}\",\"crs\":{crs},\"coordinates\":{coordinates}}}}}"
        )
    }

    #[test]
    fn a_wrong_position_is_a_fault_of_its_line_alone() {
        for (kind, coordinates, reason) in [
            ("LineString", "[[10,50],[[10.001,50]],[10.002,50]]", "has a list in place of a position"),
            ("LineString", "[[10,50],[],[10.002,50]]", "has a list in place of a position"),
            ("LineString", "[[10,50],[10],[10.002,50]]", "has a position of one number"),
            ("LineString", "[[10,50],[null,null]]", "has a coordinate that is no number"),
            ("LineString", "[[10,50],[\"10\",{\"a\":1},true]]", "has a coordinate that is no number"),
            ("LineString", "[[10,50],[1,2,3,4,5,6,7,8,9]]", "has a position of more than 8 numbers"),
            ("LineString", "[[10,50],[1,[2]]]", "has a list of numbers and lists"),
            ("LineString", "[10,50]", "has a position in place of a line"),
            ("Polygon", "[[10,50]]", "has a position in place of a line"),
            ("MultiPolygon", "[[10,50]]", "has a position in place of a line"),
        ] {
            let wrong = feature(kind, coordinates, "null");
            let found = error(&wrong, "w").expect(coordinates);
            assert!(found.starts_with(reason), "{coordinates} gives {found:?}");
            assert_eq!(error(&wrong, "good"), None, "{coordinates}");
        }
        for coordinates in ["[1]", "[null,null]"] {
            assert_eq!(error(&feature("Point", coordinates, "null"), "good"), None, "{coordinates}");
        }
    }

    #[test]
    fn a_list_in_place_of_an_object_is_refused_in_plain_words() {
        let fault = |text: &str| {
            path(text.as_bytes(), DrawingFormat::GeoJson, &PathChoice::default()).expect_err(text).to_string()
        };
        for text in ["[]", " [{\"type\":\"Point\"}]"] {
            let reason = "is not a valid GeoJSON file: it is a list, must be an object with a type";
            assert_eq!(fault(text), reason, "{text}");
        }
        let inner = fault("{\"type\":\"FeatureCollection\",\"features\":[[]]}");
        assert!(inner.contains("expected an object with a type"), "{inner}");
    }

    #[test]
    fn a_polygon_is_its_outline_without_its_holes() {
        let rings =
            "[[[0,0],[0.001,0],[0.001,0.001],[0,0]],[[0.0002,0.0001],[0.0004,0.0001],[0.0004,0.0003],[0.0002,0.0001]]]";
        for (kind, coordinates) in [("Polygon", rings.to_owned()), ("MultiPolygon", format!("[{rings}]"))] {
            let text = format!("{{\"type\":\"{kind}\",\"coordinates\":{coordinates}}}");
            assert_eq!(super::lines(&text).expect("lines").len(), 1, "{kind}");
        }
    }

    #[test]
    fn every_coordinate_system_must_be_known() {
        let line = "[[0,0],[0.05,0]]";
        for (crs, shown) in [
            ("{\"type\":\"name\",\"properties\":{\"name\":\"EPSG:25832\"}}", "EPSG:25832"),
            ("{\"type\":\"EPSG\",\"properties\":{\"code\":25832}}", "{\"properties\":{\"code\":25832}"),
            ("{\"properties\":{\"href\":\"http://a\"}}", "{\"properties\":{\"href\":"),
        ] {
            let wrong = feature("LineString", line, crs);
            let found = error(&wrong, "w").expect(crs);
            let (begin, end) = (format!("has positions in \"{shown}"), ", must be longitude and latitude");
            assert!(found.starts_with(&begin) && found.ends_with(end), "{found:?}");
            assert_eq!(error(&wrong, "good"), None, "{crs}");
            let whole = format!("{{\"type\":\"LineString\",\"crs\":{crs},\"coordinates\":{line}}}");
            assert!(path(whole.as_bytes(), DrawingFormat::GeoJson, &PathChoice::default()).is_err(), "{crs}");
        }
        let known = "{\"properties\":{\"name\":\"urn:ogc:def:crs:OGC:1.3:CRS84\"}}";
        assert_eq!(error(&feature("LineString", line, known), "w"), None);
    }
}
