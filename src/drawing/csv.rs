//! Points of a CSV file: one a row, x and y.

use std::collections::HashMap;

use bench_dragon_geometry::drawing::Drawing;
use glam::DVec2;

use super::{DrawingFileError, MAX_PIECES, PathChoice, quoted, utf8};

/// The polyline of the file's points. It is closed if its last point is its first.
///
/// The columns are those named `x_m` and `y_m`, else the first two. Numbers are divided by commas, semicolons, tabs or spaces.
/// Lines that begin with `#` are comments.
pub(super) fn path(bytes: &[u8], choice: &PathChoice<'_>) -> Result<Drawing, DrawingFileError> {
    if let Some(id) = choice.id {
        return Err(DrawingFileError(format!("id is {}, but a CSV file has one path without a name", quoted(id))));
    }
    let text = utf8(bytes)?.trim_start_matches('\u{feff}');
    let is_content = |line: &&str| !line.trim().is_empty() && !line.starts_with('#');
    let first = text.lines().find(is_content).unwrap_or_default();
    let delimiter = [';', ',', '\t'].into_iter().find(|&delimiter| first.contains(delimiter)).unwrap_or(' ');
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(delimiter as u8)
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let (mut points, mut columns) = (vec![], [0, 1]);
    for (number, row) in reader.records().enumerate() {
        let row = row.map_err(|error| DrawingFileError(error.to_string().replace('\n', " ")))?;
        let line = row.position().map_or(0, csv::Position::line);
        let field = |column: usize| row.get(column).and_then(|field| field.parse::<f64>().ok());
        match (field(columns[0]), field(columns[1])) {
            (Some(x), Some(y)) => points.push(scaled(x, y, choice, line)?),
            _ if number == 0 => columns = named_columns(&row).unwrap_or(columns),
            _ if row.iter().all(str::is_empty) => {}
            _ => {
                let shown = quoted(&row.iter().collect::<Vec<_>>().join(","));
                return Err(DrawingFileError(format!("line {line} is {shown}, must be two numbers, x_m and y_m")));
            }
        }
        if points.len() > MAX_PIECES {
            return Err(DrawingFileError(format!("has more than {MAX_PIECES} points, the most that is allowed")));
        }
    }
    if points.len() < 2 {
        return Err(DrawingFileError(format!("has {} points, must have at least 2", points.len())));
    }
    let is_closed = points.len() > 2 && points[0] == points[points.len() - 1];
    Ok(Drawing { is_closed, ..Drawing::polyline(&points, false) })
}

/// A point in metres.
fn scaled(x: f64, y: f64, choice: &PathChoice<'_>, line: u64) -> Result<DVec2, DrawingFileError> {
    let point = DVec2::new(x, y) * choice.metres_per_unit.unwrap_or(1.0);
    if point.is_finite() {
        Ok(point)
    } else {
        Err(DrawingFileError(format!("line {line} has the point ({x}, {y}), must be finite numbers")))
    }
}

/// The columns of x and y in a row of names.
fn named_columns(row: &csv::StringRecord) -> Option<[usize; 2]> {
    let columns: HashMap<String, usize> = row.iter().map(str::to_ascii_lowercase).zip(0..).collect();
    let of = |names: [&str; 2]| names.into_iter().find_map(|name| columns.get(name).copied());
    Some([of(["x_m", "x"])?, of(["y_m", "y"])?])
}
