//! ESRI ASCII grids: a header of keys and values, then one height after the other from the north-west.
//!
//! Format: "Esri ASCII raster format", documentation of Esri; `dx` and `dy` as GDAL's driver `AAIGrid` reads them.
//! This reader is our own: the crate `esri_ascii_grid` needs the keys in one order, and has neither `dx` and `dy` nor
//! a limit of memory.

use bench_dragon_geometry::number::Number;

use super::{FileGrid, HeightMapError, flip_rows, quoted, require_size, utf8};

/// Value without data, if the header has none.
const DEFAULT_NODATA: f64 = -9999.0;

/// The header of a file.
#[derive(Default)]
struct Header {
    columns: Option<f64>,
    rows: Option<f64>,
    x: Option<Origin>,
    y: Option<Origin>,
    cell_size_m: Option<f64>,
    dx_m: Option<f64>,
    dy_m: Option<f64>,
    nodata: Option<f64>,
}

/// The point of the grid whose position the header gives.
#[derive(Clone, Copy)]
enum Origin {
    /// The outer corner of the south-west cell.
    Corner(f64),
    /// The centre of the south-west cell.
    Centre(f64),
}

/// The heights of a file.
pub(super) fn grid(bytes: &[u8]) -> Result<FileGrid, HeightMapError> {
    let text = utf8(bytes)?.trim_start_matches('\u{feff}');
    let mut words = text.split_ascii_whitespace().peekable();
    let mut header = Header::default();
    while let Some(key) = words.next_if(|word| word.parse::<f64>().is_err()) {
        header.set(key, words.next())?;
    }
    let columns = count("ncols", header.columns)?;
    let rows = count("nrows", header.rows)?;
    require_size(columns as u64, rows as u64)?;
    let spacing_m = [header.dx_m, header.dy_m].map(|spacing_m| spacing_m.or(header.cell_size_m));
    let [Some(dx_m), Some(dy_m)] = spacing_m else { return Err(missing("cellsize")) };
    let first_m = [
        header.x.ok_or_else(|| missing("xllcorner"))?.centre(dx_m),
        header.y.ok_or_else(|| missing("yllcorner"))?.centre(dy_m),
    ];
    let nodata = header.nodata.unwrap_or(DEFAULT_NODATA);
    // A height takes two bytes of the file: a digit and a space.
    let mut heights = Vec::with_capacity((columns * rows).min(text.len() / 2 + 1));
    for word in words.by_ref().take(columns * rows) {
        let Ok(height) = word.parse::<f64>() else {
            let (column, row) = (heights.len() % columns + 1, heights.len() / columns + 1);
            let place = format!("row {row} from the north, column {column}");
            return Err(HeightMapError(format!("has {} at {place}, must be a number", quoted(word))));
        };
        heights.push(if height == nodata { f64::NAN } else { height });
    }
    let more = words.count();
    if heights.len() + more != columns * rows {
        let wanted = format!("{columns} × {rows} = {}", columns * rows);
        return Err(HeightMapError(format!("has {} heights, must have {wanted}", heights.len() + more)));
    }
    flip_rows(&mut heights, columns);
    Ok(FileGrid { columns, rows, first_m, spacing_m: [dx_m, dy_m], heights })
}

impl Header {
    /// Reads the value of a key.
    fn set(&mut self, key: &str, value: Option<&str>) -> Result<(), HeightMapError> {
        let number = value.and_then(|value| value.parse().ok());
        let name = key.to_ascii_lowercase();
        let is_known = match name.as_str() {
            "ncols" => put(&mut self.columns, number),
            "nrows" => put(&mut self.rows, number),
            "xllcorner" => put(&mut self.x, number.map(Origin::Corner)),
            "xllcenter" => put(&mut self.x, number.map(Origin::Centre)),
            "yllcorner" => put(&mut self.y, number.map(Origin::Corner)),
            "yllcenter" => put(&mut self.y, number.map(Origin::Centre)),
            "cellsize" => put(&mut self.cell_size_m, number),
            "dx" => put(&mut self.dx_m, number),
            "dy" => put(&mut self.dy_m, number),
            "nodata_value" => put(&mut self.nodata, number),
            _ => return Err(HeightMapError(format!("has the unknown key {} in its header", quoted(key)))),
        };
        if number.is_none() {
            let value = value.map_or("without a value".to_owned(), quoted);
            return Err(HeightMapError(format!("{name} is {value}, must be a number")));
        }
        if is_known { Ok(()) } else { Err(HeightMapError(format!("{name} is there twice, or in two forms"))) }
    }
}

impl Origin {
    /// Position of the south-west height.
    fn centre(self, spacing_m: f64) -> f64 {
        match self {
            Self::Corner(m) => m + 0.5 * spacing_m,
            Self::Centre(m) => m,
        }
    }
}

/// Puts a value in its place. Returns whether the place was empty.
fn put<T>(place: &mut Option<T>, value: Option<T>) -> bool {
    let was_empty = place.is_none();
    *place = value;
    was_empty
}

fn count(key: &str, value: Option<f64>) -> Result<usize, HeightMapError> {
    let value = value.ok_or_else(|| missing(key))?;
    if value.fract() == 0.0 && (0.0..=1e9).contains(&value) {
        return Ok(value as usize);
    }
    Err(HeightMapError(format!("{key} is {}, must be a whole number of at least 2", Number(value))))
}

fn missing(key: &str) -> HeightMapError {
    HeightMapError(format!("{key} is missing in the header"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "ncols 2\nnrows 2\nxllcorner 10\nyllcorner 20\ncellsize 4\n";

    #[test]
    fn every_form_of_the_header_gives_the_same_grid() {
        for header in [
            HEADER,
            "NROWS 2\r\nNCOLS 2\r\nCellSize 4.0\r\nXLLCENTER 12\r\nYLLCENTER 22\r\nNODATA_VALUE -9999\r\n",
            "ncols 2 nrows 2 xllcenter 12 yllcorner 2e1 dx 4 dy 4",
            "\u{feff}ncols\t2\nnrows\t2\nxllcorner 10\nyllcorner 20\ncellsize 9\ndx 4\ndy 4\n",
        ] {
            let grid = grid(format!("{header} 3 4.5\n1 -2\n").as_bytes()).expect(header);
            assert_eq!(([grid.columns, grid.rows], grid.first_m, grid.spacing_m), ([2, 2], [12.0, 22.0], [4.0, 4.0]));
            assert_eq!(grid.heights, [1.0, -2.0, 3.0, 4.5], "{header}");
        }
    }

    #[test]
    fn heights_may_break_lines_anywhere_and_may_be_missing() {
        let text = format!("{HEADER}NODATA_value -1e30\n1\n2 3\n\n -1e+30");
        let heights = grid(text.as_bytes()).expect("a grid").heights;
        assert_eq!(heights[..1], [3.0]);
        assert!(heights[1].is_nan());
        assert_eq!(heights[2..], [1.0, 2.0]);
    }

    #[test]
    fn faults_are_refused_in_one_line() {
        let with = |heights: &str| format!("{HEADER}{heights}");
        for (text, reason) in [
            (String::new(), "ncols is missing in the header"),
            (with("1 2 3"), "has 3 heights, must have 2 × 2 = 4"),
            (with("1 2 3 4 5 6"), "has 6 heights, must have 2 × 2 = 4"),
            (with("1 2 3,5 4"), "has \"3,5\" at row 2 from the north, column 1, must be a number"),
            (with("ncols 2 1 2 3 4"), "ncols is there twice, or in two forms"),
            (with("xllcenter 2 1 2 3 4"), "xllcenter is there twice, or in two forms"),
            (with("colour 2 1 2 3 4"), "has the unknown key \"colour\" in its header"),
            ("ncols two".to_owned(), "ncols is \"two\", must be a number"),
            ("ncols".to_owned(), "ncols is without a value, must be a number"),
            ("ncols 2.5 nrows 2".to_owned(), "ncols is 2.5, must be a whole number of at least 2"),
            ("ncols 1 nrows 2".to_owned(), "has 1 × 2 heights, must have at least 2 × 2"),
            ("ncols 1e6 nrows 1e6 1".to_owned(), "has 1000000 × 1000000 heights, at most 16000000 are allowed"),
            ("ncols 2 nrows 2 xllcorner 0 dx 1 dy 1 1 2 3 4".to_owned(), "yllcorner is missing in the header"),
            ("ncols 2 nrows 2 xllcorner 0 yllcorner 0 dx 1 1 2 3 4".to_owned(), "cellsize is missing in the header"),
        ] {
            let error = grid(text.as_bytes()).err().map(|error| error.to_string());
            assert_eq!(error.as_deref(), Some(reason), "{text:?}");
        }
    }
}
