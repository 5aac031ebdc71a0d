//! Tracks and routes of GPX files.
//!
//! Source: Topografix, *GPX 1.1 Schema Documentation*. Each segment of a track is a line.

use roxmltree::{Document, Node};

use super::{Line, LonLat, child_text};

pub(super) fn lines(document: &Document<'_>) -> Vec<Line> {
    let tracks = document.descendants().filter(|node| ["trkseg", "rte"].contains(&node.tag_name().name()));
    tracks.map(line).collect()
}

fn line(node: Node<'_, '_>) -> Line {
    let named = if node.tag_name().name() == "trkseg" { node.parent_element().unwrap_or(node) } else { node };
    let points = node.children().filter(|child| ["trkpt", "rtept"].contains(&child.tag_name().name()));
    // A point without a place is not on the earth: it is refused where the line is chosen.
    let degrees = |point: Node<'_, '_>, name: &str| {
        point.attribute(name).and_then(|value| value.trim().parse().ok()).unwrap_or(f64::NAN)
    };
    Line {
        label: child_text(named, "name"),
        points: points.map(|point| LonLat { lon: degrees(point, "lon"), lat: degrees(point, "lat") }).collect(),
        ..Line::default()
    }
}
