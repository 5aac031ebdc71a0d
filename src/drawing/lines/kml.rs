//! Lines, rings and tracks of KML files.
//!
//! Source: OGC KML 2.3 (OGC 12-007r2). Folders are layers. The outline of a polygon is a ring.

use roxmltree::{Document, Node};

use super::super::DrawingFileError;
use super::{Line, LonLat, child_text, no_position, whole_text};

pub(super) fn lines(document: &Document<'_>) -> Vec<Line> {
    let mut lines = vec![];
    for node in document.descendants() {
        let points = match node.tag_name().name() {
            "LineString" => coordinates(node),
            // The holes of a polygon are no paths.
            "LinearRing" if !node.ancestors().any(|node| node.tag_name().name() == "innerBoundaryIs") => {
                coordinates(node)
            }
            "Track" => track(node),
            _ => continue,
        };
        // A wrong position is refused where its line is chosen.
        let (points, fault) = match points {
            Ok(points) => (points, None),
            Err(error) => (vec![], Some(error.to_string())),
        };
        let around = |name: &str| node.ancestors().find(|node| node.tag_name().name() == name);
        let placemark = around("Placemark");
        lines.push(Line {
            id: placemark.and_then(|placemark| placemark.attribute("id")).map(str::to_owned),
            label: placemark.and_then(|placemark| child_text(placemark, "name")),
            layer: around("Folder").and_then(|folder| child_text(folder, "name")),
            points,
            is_ring: node.tag_name().name() == "LinearRing",
            fault,
        });
    }
    lines
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
            let text = whole_text(tuple);
            position(&text, text.split_whitespace())
        })
        .collect()
}

fn position<'a>(text: &str, mut parts: impl Iterator<Item = &'a str>) -> Result<LonLat, DrawingFileError> {
    let mut degrees = || parts.next().and_then(|part| part.parse().ok());
    let (Some(lon), Some(lat)) = (degrees(), degrees()) else { return Err(no_position(text)) };
    Ok(LonLat { lon, lat })
}

#[cfg(test)]
mod tests {
    use super::super::super::{DrawingFormat, PathChoice};
    use super::super::{document, path};
    use super::*;

    /// The longitudes of each line of a file.
    fn longitudes(body: &str) -> Vec<Vec<f64>> {
        let text = format!("<kml xmlns:gx=\"http://www.google.com/kml/ext/2.2\"><Placemark>{body}</Placemark></kml>");
        let lines = lines(&document(&text).expect(body));
        lines.iter().map(|line| line.points.iter().map(|point| point.lon).collect()).collect()
    }

    #[test]
    fn comments_and_instructions_leave_no_position_out() {
        for body in [
            "<LineString><coordinates>1,50 2,50 <!-- bend --> 3,50</coordinates></LineString>",
            "<LineString><coordinates><!-- bend -->1,50 2,50 3,50</coordinates></LineString>",
            "<LineString><coordinates>1,50 <?a b?>2,50 <![CDATA[3,50]]></coordinates></LineString>",
            "<gx:Track><gx:coord><!-- a -->1 50</gx:coord><gx:coord>2 50</gx:coord><gx:coord>3<!-- b --> 50</gx:coord></gx:Track>",
        ] {
            assert_eq!(longitudes(body), [[1.0, 2.0, 3.0]], "{body}");
        }
    }

    #[test]
    fn a_wrong_position_is_a_fault_of_its_line_alone() {
        let line = |name: &str, tuples: &str| {
            let inner = format!("<LineString><coordinates>{tuples}</coordinates></LineString>");
            format!("<Placemark><name>{name}</name>{inner}</Placemark>")
        };
        let text = format!("<kml>{}{}</kml>", line("bad", "10,50 x,y"), line("good", "10,50 10.001,50 10.002,50"));
        let error = |label| {
            let choice = PathChoice { label: Some(label), ..PathChoice::default() };
            path(text.as_bytes(), DrawingFormat::Kml, &choice).err().map(|error| error.to_string())
        };
        assert_eq!(error("good"), None);
        assert_eq!(error("bad").as_deref(), Some("has the position \"x,y\", must be a longitude and a latitude"));
    }
}
