//! Lines, rings and tracks of KML files.
//!
//! Source: OGC KML 2.3 (OGC 12-007r2). Folders are layers. The outline of a polygon is a ring.

use roxmltree::{Document, Node};

use super::super::DrawingFileError;
use super::{Line, LonLat, child_text, no_position};

pub(super) fn lines(document: &Document<'_>) -> Result<Vec<Line>, DrawingFileError> {
    let mut lines = vec![];
    for node in document.descendants() {
        let points = match node.tag_name().name() {
            "LineString" => coordinates(node)?,
            // The holes of a polygon are no paths.
            "LinearRing" if !node.ancestors().any(|node| node.tag_name().name() == "innerBoundaryIs") => {
                coordinates(node)?
            }
            "Track" => track(node)?,
            _ => continue,
        };
        let around = |name: &str| node.ancestors().find(|node| node.tag_name().name() == name);
        let placemark = around("Placemark");
        lines.push(Line {
            id: placemark.and_then(|placemark| placemark.attribute("id")).map(str::to_owned),
            label: placemark.and_then(|placemark| child_text(placemark, "name")),
            layer: around("Folder").and_then(|folder| child_text(folder, "name")),
            points,
            is_ring: node.tag_name().name() == "LinearRing",
        });
    }
    Ok(lines)
}

/// Positions as `longitude,latitude[,height]`, divided by spaces.
fn coordinates(node: Node<'_, '_>) -> Result<Vec<LonLat>, DrawingFileError> {
    let text = child_text(node, "coordinates").unwrap_or_default();
    text.split_whitespace().map(|tuple| position(tuple, tuple.split(','))).collect()
}

/// Positions of a track as `longitude latitude height`, one an element.
fn track(node: Node<'_, '_>) -> Result<Vec<LonLat>, DrawingFileError> {
    let tuples = node.children().filter(|child| child.tag_name().name() == "coord");
    tuples
        .map(|tuple| {
            let text = tuple.text().unwrap_or_default();
            position(text, text.split_whitespace())
        })
        .collect()
}

fn position<'a>(text: &str, mut parts: impl Iterator<Item = &'a str>) -> Result<LonLat, DrawingFileError> {
    let mut degrees = || parts.next().and_then(|part| part.parse().ok());
    let (Some(lon), Some(lat)) = (degrees(), degrees()) else { return Err(no_position(text)) };
    Ok(LonLat { lon, lat })
}
