//! Drawings: files that hold the route as a drawn path, in SVG, DXF or CSV, or as a line on the earth, in GPX, KML or GeoJSON. All of
//! them give a path in metres, with y up.

mod content;
mod csv;
mod dxf;
mod geographic;
mod lines;
mod svg;

use std::path::Path;

use bench_dragon_geometry::drawing::Drawing;

use crate::system::input_file::{self, InputFileError, quoted, utf8};

/// Most pieces of a path: lines, arcs and curves.
const MAX_PIECES: usize = 2_000_000;
/// Largest coordinate of a file, in metres: coordinates of surveys are smaller.
pub const MAX_POSITION_M: f64 = 1e8;
/// Extensions of drawings, for messages.
pub const FORMATS: &str = ".svg, .dxf, .csv, .gpx, .kml or .geojson";
/// Most names that a message lists.
const MAX_LISTED: usize = 8;

/// Reason why a file has no path, in one line. The caller adds the file's name.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct DrawingFileError(String);

impl From<InputFileError> for DrawingFileError {
    fn from(error: InputFileError) -> Self {
        Self(error.to_string())
    }
}

/// Which path of a file is the route, and its scale.
#[derive(Clone, Copy, Debug, Default)]
pub struct PathChoice<'a> {
    /// Name of the path in the file; without one, the file must have one path.
    pub id: Option<&'a str>,
    /// Length of a unit of the drawing, in metres; without one, that of the format.
    pub metres_per_unit: Option<f64>,
    /// Whether the end of the path joins its beginning; without one, as it is drawn.
    pub is_closed: Option<bool>,
    /// Largest gap between two entities of a path, in metres.
    pub gap_m: f64,
    /// Inkscape's label of the path or of what contains it; the name of a track or a line.
    pub label: Option<&'a str>,
    /// Layer of the path.
    pub layer: Option<&'a str>,
    /// Number of the path among all of the file, from 1.
    pub number: Option<u32>,
    /// Metres of the plan for a metre of the page, in place of `metres_per_unit`.
    pub scale: Option<f64>,
    /// Whether the plan has its origin at a point of a survey.
    pub has_origin: bool,
}

impl PathChoice<'_> {
    /// Whether any path of the file may be the route.
    fn is_open(&self) -> bool {
        self.id.is_none() && !self.is_narrowed()
    }

    /// Whether the path is chosen by its id alone.
    fn is_id(&self) -> bool {
        self.id.is_some() && !self.is_narrowed()
    }

    fn is_narrowed(&self) -> bool {
        self.label.is_some() || self.layer.is_some() || self.number.is_some()
    }

    /// The error of a choice that does not leave one path.
    fn not_one(&self, found: usize, of: usize) -> DrawingFileError {
        let texts = [("id", self.id), ("label", self.label), ("layer", self.layer)];
        let keys = texts.into_iter().filter_map(|(key, value)| Some(format!("{key} {}", quoted(value?))));
        let keys: Vec<String> = keys.chain(self.number.map(|number| format!("number {number}"))).collect();
        DrawingFileError(format!(
            "has {found} paths with {}, must have 1; solve route --list shows all {of}",
            keys.join(" and ")
        ))
    }
}

/// A path of a file, for a list.
#[derive(Debug)]
pub struct ListedPath {
    /// Its name in the file: the id of an element, or the handle of an entity.
    pub id: Option<String>,
    /// Its label, or the name of a track or a line.
    pub label: Option<String>,
    /// Its layer.
    pub layer: Option<String>,
    /// The path in metres, or the reason why it cannot be one.
    pub drawing: Result<Drawing, DrawingFileError>,
}

/// Format of a drawing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DrawingFormat {
    /// Scalable Vector Graphics.
    Svg,
    /// Drawing Exchange Format, as text.
    Dxf,
    /// A table of points.
    Csv,
    /// Tracks and routes of satellite receivers.
    Gpx,
    /// Keyhole Markup Language.
    Kml,
    /// Geographic features in JSON.
    GeoJson,
}

impl DrawingFormat {
    /// The format of a file's extension: `.svg`, `.dxf`, `.csv`, `.gpx`, `.kml`, `.geojson` or `.json`; `None` for another one.
    pub fn of(file: &Path) -> Option<Self> {
        let extension = file.extension()?.to_string_lossy().to_ascii_lowercase();
        match extension.as_str() {
            "svg" => Some(Self::Svg),
            "dxf" => Some(Self::Dxf),
            "csv" => Some(Self::Csv),
            "gpx" => Some(Self::Gpx),
            "kml" => Some(Self::Kml),
            "geojson" | "json" => Some(Self::GeoJson),
            _ => None,
        }
    }
}

/// Reads a path from a file, in the format of its extension.
///
/// # Errors
/// The file cannot be read, is too long, or does not have the path.
pub fn read(file: &Path, choice: &PathChoice<'_>) -> Result<Drawing, DrawingFileError> {
    let format = format_of(file)?;
    parse(&input_file::read(file)?, format, choice)
}

/// Reads a path from the bytes of a file.
///
/// # Errors
/// The bytes do not have the path.
pub fn parse(bytes: &[u8], format: DrawingFormat, choice: &PathChoice<'_>) -> Result<Drawing, DrawingFileError> {
    content::require(bytes)?;
    let mut drawing = match format {
        DrawingFormat::Svg => svg::path(text(bytes)?, choice)?,
        DrawingFormat::Dxf => dxf::path(bytes, choice)?,
        DrawingFormat::Csv => csv::path(bytes, choice)?,
        DrawingFormat::Gpx | DrawingFormat::Kml | DrawingFormat::GeoJson => lines::path(bytes, format, choice)?,
    };
    if drawing.pieces.len() > MAX_PIECES {
        let count = drawing.pieces.len();
        return Err(DrawingFileError(format!("the path has {count} parts, at most {MAX_PIECES} are allowed")));
    }
    drawing.is_closed = choice.is_closed.unwrap_or(drawing.is_closed);
    Ok(drawing)
}

/// All paths of a file.
#[derive(Debug)]
pub struct PathList {
    /// The paths, in the order of the file.
    pub paths: Vec<ListedPath>,
    /// Whether the file has a unit of length. Otherwise the paths are in its own units, such as pixels.
    pub is_in_metres: bool,
}

/// All paths of a file.
///
/// # Errors
/// The file cannot be read.
pub fn list(file: &Path, choice: &PathChoice<'_>) -> Result<PathList, DrawingFileError> {
    let format = format_of(file)?;
    let bytes = input_file::read(file)?;
    content::require(&bytes)?;
    let in_metres = |paths| PathList { paths, is_in_metres: true };
    match format {
        DrawingFormat::Svg => Ok(PathList { paths: svg::list(text(&bytes)?, choice)?, is_in_metres: false }),
        DrawingFormat::Dxf => dxf::list(&bytes, choice),
        DrawingFormat::Csv => {
            let drawing = csv::path(&bytes, choice);
            Ok(in_metres(vec![ListedPath { id: None, label: None, layer: None, drawing }]))
        }
        DrawingFormat::Gpx | DrawingFormat::Kml | DrawingFormat::GeoJson => {
            lines::list(&bytes, format, choice).map(in_metres)
        }
    }
}

/// The text of a file in UTF-8.
fn text(bytes: &[u8]) -> Result<&str, DrawingFileError> {
    utf8(bytes).map_err(|error| content::declared_encoding(bytes).unwrap_or_else(|| error.into()))
}

/// The format of a file by its name. The error names a format that the content shows, such as that of a `.dwg`.
fn format_of(file: &Path) -> Result<DrawingFormat, DrawingFileError> {
    if let Some(format) = DrawingFormat::of(file) {
        return Ok(format);
    }
    if let Ok(bytes) = input_file::read(file) {
        content::require(&bytes)?;
    }
    Err(DrawingFileError(format!("has no known format, must be {FORMATS}")))
}

/// Whether a file has points of a curve, and not the lines between them.
pub fn has_points(file: &Path) -> bool {
    use DrawingFormat::{Csv, GeoJson, Gpx, Kml};
    matches!(DrawingFormat::of(file), Some(Csv | GeoJson | Gpx | Kml))
}

/// A few names for a message, each in quotes.
fn listed<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<String> = names.take(MAX_LISTED + 1).map(quoted).collect();
    let more = if names.len() > MAX_LISTED { " and others" } else { "" };
    names[..names.len().min(MAX_LISTED)].join(", ") + more
}
