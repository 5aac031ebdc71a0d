//! Drawings: files that hold the route as a drawn path, in SVG, DXF or CSV. All of them give a path in metres, with y up.

mod csv;
mod dxf;
mod svg;

use std::path::Path;

use bench_dragon_geometry::drawing::Drawing;

use crate::system::input_file::{self, InputFileError, quoted, utf8};

/// Most pieces of a path: lines, arcs and curves.
const MAX_PIECES: usize = 2_000_000;
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
}

impl DrawingFormat {
    /// The format of a file's extension, `.svg`, `.dxf` or `.csv`; `None` for another one.
    pub fn of(file: &Path) -> Option<Self> {
        let extension = file.extension()?.to_string_lossy().to_ascii_lowercase();
        match extension.as_str() {
            "svg" => Some(Self::Svg),
            "dxf" => Some(Self::Dxf),
            "csv" => Some(Self::Csv),
            _ => None,
        }
    }
}

/// Reads a path from a file, in the format of its extension.
///
/// # Errors
/// The file cannot be read, is too long, or does not have the path.
pub fn read(file: &Path, choice: &PathChoice<'_>) -> Result<Drawing, DrawingFileError> {
    let format = DrawingFormat::of(file)
        .ok_or_else(|| DrawingFileError("has no known format, must be .svg, .dxf or .csv".to_owned()))?;
    parse(&input_file::read(file)?, format, choice)
}

/// Reads a path from the bytes of a file.
///
/// # Errors
/// The bytes do not have the path.
pub fn parse(bytes: &[u8], format: DrawingFormat, choice: &PathChoice<'_>) -> Result<Drawing, DrawingFileError> {
    let mut drawing = match format {
        DrawingFormat::Svg => svg::path(bytes, choice)?,
        DrawingFormat::Dxf => dxf::path(bytes, choice)?,
        DrawingFormat::Csv => csv::path(bytes, choice)?,
    };
    if drawing.pieces.len() > MAX_PIECES {
        let count = drawing.pieces.len();
        return Err(DrawingFileError(format!("the path has {count} parts, at most {MAX_PIECES} are allowed")));
    }
    drawing.is_closed = choice.is_closed.unwrap_or(drawing.is_closed);
    Ok(drawing)
}

/// Whether a file has points of a curve, and not the lines between them.
pub fn has_points(file: &Path) -> bool {
    DrawingFormat::of(file) == Some(DrawingFormat::Csv)
}

/// A few names for a message, each in quotes.
fn listed<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<String> = names.take(MAX_LISTED + 1).map(quoted).collect();
    let more = if names.len() > MAX_LISTED { " and others" } else { "" };
    names[..names.len().min(MAX_LISTED)].join(", ") + more
}
