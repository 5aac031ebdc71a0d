//! Lines on the earth: tracks and routes of GPX files, lines and rings of KML and GeoJSON files.

mod geojson;
mod gpx;
mod kml;

use bench_dragon_geometry::drawing::Drawing;
use roxmltree::{Document, Node, ParsingOptions};

use super::geographic::{LonLat, local};
use super::{DrawingFileError, DrawingFormat, ListedPath, MAX_PIECES, PathChoice, listed, quoted, text};

/// Most elements and texts of an XML file.
const MAX_NODES: u32 = 4_000_000;

/// A line of a file.
#[derive(Clone, Debug, Default)]
struct Line {
    id: Option<String>,
    /// Its name, or that of what contains it.
    label: Option<String>,
    /// The folder that contains it.
    layer: Option<String>,
    points: Vec<LonLat>,
    is_ring: bool,
    /// Why it cannot be the path, in words.
    fault: Option<String>,
}

/// The path of a file.
pub(super) fn path(bytes: &[u8], format: DrawingFormat, choice: &PathChoice<'_>) -> Result<Drawing, DrawingFileError> {
    let lines = lines(bytes, format)?;
    let of = lines.len();
    let is = |name: &Option<String>, wanted: Option<&str>| wanted.is_none_or(|wanted| name.as_deref() == Some(wanted));
    let is_wanted = |&(number, line): &(u32, &Line)| {
        let is_named = is(&line.id, choice.id) || is(&line.label, choice.id);
        is_named
            && is(&line.label, choice.label)
            && is(&line.layer, choice.layer)
            && choice.number.is_none_or(|wanted| wanted == number)
    };
    let found: Vec<&Line> = (1..).zip(&lines).filter(is_wanted).map(|(_, line)| line).collect();
    match &found[..] {
        [only] => only.drawing(choice),
        _ if choice.is_open() && of == 0 => Err(DrawingFileError("has no line".to_owned())),
        several if choice.is_open() => {
            let names = listed(several.iter().filter_map(|line| line.label.as_deref().or(line.id.as_deref())));
            let names = if names.is_empty() { String::new() } else { format!(": {names}") };
            Err(DrawingFileError(format!("has {of} lines{names}; set label or number to one of them")))
        }
        several => Err(choice.not_one(several.len(), of)),
    }
}

/// All paths of a file.
pub(super) fn list(
    bytes: &[u8],
    format: DrawingFormat,
    choice: &PathChoice<'_>,
) -> Result<Vec<ListedPath>, DrawingFileError> {
    let listed = |line: Line| {
        let drawing = line.drawing(choice);
        ListedPath { id: line.id, label: line.label, layer: line.layer, drawing }
    };
    Ok(lines(bytes, format)?.into_iter().map(listed).collect())
}

fn lines(bytes: &[u8], format: DrawingFormat) -> Result<Vec<Line>, DrawingFileError> {
    let text = text(bytes)?.trim_start_matches('\u{feff}');
    let mut lines = match format {
        DrawingFormat::Gpx => gpx::lines(&document(text)?),
        DrawingFormat::Kml => kml::lines(&document(text)?),
        _ => geojson::lines(text)?,
    };
    lines.retain(|line| !line.points.is_empty() || line.fault.is_some());
    Ok(lines)
}

impl Line {
    fn drawing(&self, choice: &PathChoice<'_>) -> Result<Drawing, DrawingFileError> {
        if let Some(reason) = &self.fault {
            return Err(DrawingFileError(reason.clone()));
        }
        let count = self.points.len();
        if count < 2 {
            return Err(DrawingFileError(format!("has a line of {count} point, must have at least 2")));
        }
        if count > MAX_PIECES {
            return Err(DrawingFileError(format!("has a line of {count} points, at most {MAX_PIECES} are allowed")));
        }
        let points = local(&self.points, choice)?;
        let is_back = count > 2 && points[0] == points[count - 1];
        let drawing = Drawing::polyline(&points, self.is_ring && !is_back);
        Ok(Drawing { is_closed: self.is_ring || is_back, ..drawing })
    }
}

fn document(text: &str) -> Result<Document<'_>, DrawingFileError> {
    let options = ParsingOptions { allow_dtd: false, nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    Document::parse_with_options(text, options)
        .map_err(|error| DrawingFileError(format!("is not valid XML: {}", error.to_string().replace('\n', " "))))
}

/// The text of the first child with a name.
fn child_text(node: Node<'_, '_>, name: &str) -> Option<String> {
    let child = node.children().find(|child| child.tag_name().name() == name)?;
    Some(whole_text(child).trim().to_owned()).filter(|text| !text.is_empty())
}

/// The whole text of an element. Comments and instructions in it divide it into several nodes.
fn whole_text(node: Node<'_, '_>) -> String {
    node.children().filter(Node::is_text).filter_map(|child| child.text()).collect()
}

/// The error of a text that is no position.
fn no_position(text: &str) -> DrawingFileError {
    DrawingFileError(format!("has the position {}, must be a longitude and a latitude", quoted(text)))
}
