//! Height maps: files that hold heights of the ground on a regular grid, as GeoTIFF, ESRI ASCII grid or 16-bit PNG.
//!
//! All of them give heights in metres, row after row from the south-west.

mod esri_ascii;
mod geotiff;
mod png;
mod sidecar;

use std::path::Path;

use bench_dragon_geometry::number::Number;

use crate::system::input_file::{self, InputFileError, quoted, utf8};

/// Most heights of a map.
const MAX_HEIGHTS: usize = 16_000_000;
/// Largest height above or below zero, in metres.
const MAX_HEIGHT_M: f64 = 10_000.0;
/// Smallest and largest distance of neighbouring heights, in metres.
const MIN_SPACING_M: f64 = 0.01;
const MAX_SPACING_M: f64 = 1000.0;
/// Largest coordinate of the first height, in metres: coordinates of maps on the earth are smaller.
const MAX_POSITION_M: f64 = 1e8;

/// Reason why a file has no heights, in one line. The caller adds the file's name.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct HeightMapError(String);

impl From<InputFileError> for HeightMapError {
    fn from(error: InputFileError) -> Self {
        Self(error.to_string())
    }
}

/// Heights on a regular grid, in metres.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Number of heights from west to east, at least 2.
    pub columns: usize,
    /// Number of heights from south to north, at least 2.
    pub rows: usize,
    /// x of the first height: column 0, row 0, in the south-west.
    pub x_m: f64,
    /// y of the first height.
    pub y_m: f64,
    /// Distance of neighbouring columns, from 0.01 to 1000.
    pub spacing_x_m: f64,
    /// Distance of neighbouring rows, from 0.01 to 1000.
    pub spacing_y_m: f64,
    /// Row after row from the south, each from the west, from -10000 to 10000; NaN where the file has no data.
    pub heights_m: Vec<f64>,
}

/// Unit and position of a height map, where the file does not have them or they are to be others.
#[derive(Clone, Copy, Debug, Default)]
pub struct Placing {
    /// Length of a unit of the heights, in metres. A PNG needs it; without it, other formats have metres.
    pub metres_per_unit: Option<f64>,
    /// x of the map's lower left corner: the outer corner of the south-west pixel. Without it, that of the file; 0 for
    /// a PNG.
    pub x_m: Option<f64>,
    /// y of the map's lower left corner.
    pub y_m: Option<f64>,
    /// Distance of neighbouring pixels. A PNG needs it; other formats have their own.
    pub metres_per_pixel: Option<f64>,
}

/// Format of a height map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeightMapFormat {
    /// A TIFF image with a position.
    GeoTiff,
    /// A table of heights, as text.
    EsriAscii,
    /// A grey Portable Network Graphics image, with 16 bits a pixel.
    Png,
}

impl HeightMapFormat {
    /// All formats.
    pub const ALL: [Self; 3] = [Self::GeoTiff, Self::EsriAscii, Self::Png];

    /// The extensions of its files, the usual one first.
    const fn extensions(self) -> &'static [&'static str] {
        match self {
            Self::GeoTiff => &["tif", "tiff"],
            Self::EsriAscii => &["asc"],
            Self::Png => &["png"],
        }
    }

    /// The format of a file's extension, in any case of letters; `None` for another one.
    pub fn of(file: &Path) -> Option<Self> {
        let extension = file.extension()?.to_string_lossy().to_ascii_lowercase();
        Self::ALL.into_iter().find(|format| format.extensions().contains(&extension.as_str()))
    }
}

/// Heights as a file has them: in its unit, and where it puts them.
struct FileGrid {
    columns: usize,
    rows: usize,
    /// Position of the south-west height, in metres.
    first_m: [f64; 2],
    spacing_m: [f64; 2],
    /// Row after row from the south; NaN without data.
    heights: Vec<f64>,
}

/// Reads heights from a file, in the format of its extension. Files beside it must agree that it has metres (see `sidecar`).
///
/// # Errors
/// The file cannot be read, is too long, or does not have heights in the allowed ranges.
pub fn read(file: &Path, placing: &Placing) -> Result<Grid, HeightMapError> {
    let format = HeightMapFormat::of(file)
        .ok_or_else(|| HeightMapError("has no known format, must be .tif, .tiff, .asc or .png".to_owned()))?;
    let grid = parse(&input_file::read(file)?, format, placing)?;
    sidecar::require_unscaled_metres(file, format, placing)?;
    Ok(grid)
}

/// Reads heights from the bytes of a file.
///
/// # Errors
/// The bytes do not have heights in the allowed ranges.
pub fn parse(bytes: &[u8], format: HeightMapFormat, placing: &Placing) -> Result<Grid, HeightMapError> {
    if let Some(metres) = placing.metres_per_pixel.filter(|_| format != HeightMapFormat::Png) {
        let (metres, extension) = (Number(metres), format.extensions()[0]);
        return Err(HeightMapError(format!(
            "metres_per_pixel is {metres}, but a .{extension} has its own: omit the key"
        )));
    }
    let grid = match format {
        HeightMapFormat::GeoTiff => geotiff::grid(bytes, placing),
        HeightMapFormat::EsriAscii => esri_ascii::grid(bytes),
        HeightMapFormat::Png => png::grid(bytes, placing),
    };
    grid?.placed(placing)
}

impl FileGrid {
    /// The grid in metres, where it is wanted, with everything in its range.
    fn placed(self, placing: &Placing) -> Result<Grid, HeightMapError> {
        require_size(self.columns as u64, self.rows as u64)?;
        let metres_per_unit = placing.metres_per_unit.unwrap_or(1.0);
        if !(metres_per_unit.is_finite() && metres_per_unit > 0.0) {
            let metres_per_unit = Number(metres_per_unit);
            return Err(HeightMapError(format!("metres_per_unit is {metres_per_unit}, must be above 0")));
        }
        for (axis, spacing_m) in ["x", "y"].into_iter().zip(self.spacing_m) {
            if !(MIN_SPACING_M..=MAX_SPACING_M).contains(&spacing_m) {
                let range = format!("from {MIN_SPACING_M} to {MAX_SPACING_M} m");
                let spacing_m = Number(spacing_m);
                return Err(HeightMapError(format!("has heights every {spacing_m} m in {axis}, must be {range}")));
            }
        }
        let corner_m = [placing.x_m, placing.y_m];
        let position = |axis: usize| corner_m[axis].map_or(self.first_m[axis], |m| m + 0.5 * self.spacing_m[axis]);
        let [x_m, y_m] = [0, 1].map(position);
        if !(x_m.abs() <= MAX_POSITION_M && y_m.abs() <= MAX_POSITION_M) {
            let range = format!("from -{MAX_POSITION_M} to {MAX_POSITION_M} m");
            let [x_m, y_m] = [x_m, y_m].map(Number);
            return Err(HeightMapError(format!("has its first height at ({x_m}, {y_m}) m, must be {range}")));
        }
        let mut heights_m = self.heights;
        for (index, height_m) in heights_m.iter_mut().enumerate() {
            *height_m *= metres_per_unit;
            if height_m.abs() > MAX_HEIGHT_M {
                let (column, row) = (index % self.columns, index / self.columns);
                let [x, y] = [x_m + column as f64 * self.spacing_m[0], y_m + row as f64 * self.spacing_m[1]];
                let range = format!("from -{MAX_HEIGHT_M} to {MAX_HEIGHT_M} m");
                let [height_m, x, y] = [*height_m, x, y].map(Number);
                return Err(HeightMapError(format!("has the height {height_m} m at ({x}, {y}) m, must be {range}")));
            }
        }
        let [spacing_x_m, spacing_y_m] = self.spacing_m;
        Ok(Grid { columns: self.columns, rows: self.rows, x_m, y_m, spacing_x_m, spacing_y_m, heights_m })
    }
}

/// Fails if a map has too few or too many heights. Readers call it before they allocate memory for heights.
fn require_size(columns: u64, rows: u64) -> Result<(), HeightMapError> {
    if columns < 2 || rows < 2 {
        return Err(HeightMapError(format!("has {columns} × {rows} heights, must have at least 2 × 2")));
    }
    if columns.saturating_mul(rows) > MAX_HEIGHTS as u64 {
        return Err(HeightMapError(format!("has {columns} × {rows} heights, at most {MAX_HEIGHTS} are allowed")));
    }
    Ok(())
}

/// Reverses the order of the rows. Files begin in the north.
fn flip_rows(heights: &mut [f64], columns: usize) {
    heights.reverse();
    flip_columns(heights, columns);
}

/// Reverses the order of the columns.
fn flip_columns(heights: &mut [f64], columns: usize) {
    heights.chunks_exact_mut(columns).for_each(<[f64]>::reverse);
}

#[cfg(test)]
mod tests {
    use super::*;

    const MAP: &str = "ncols 3\nnrows 2\nxllcorner 100\nyllcorner 200\ncellsize 2\n4 5 6\n1 -9999 3\n";

    fn map(placing: &Placing) -> Result<Grid, HeightMapError> {
        parse(MAP.as_bytes(), HeightMapFormat::EsriAscii, placing)
    }

    #[test]
    fn extensions_select_the_format_in_any_case_of_letters() {
        for (file, format) in [
            ("a.tif", Some(HeightMapFormat::GeoTiff)),
            ("b/a.TIFF", Some(HeightMapFormat::GeoTiff)),
            ("a.Asc", Some(HeightMapFormat::EsriAscii)),
            ("a.png", Some(HeightMapFormat::Png)),
            ("a.jpg", None),
            ("png", None),
        ] {
            assert_eq!(HeightMapFormat::of(Path::new(file)), format, "{file}");
        }
    }

    #[test]
    fn a_map_is_moved_by_its_outer_corner_and_scaled_in_height() {
        let grid = map(&Placing::default()).expect("a map");
        assert_eq!([grid.x_m, grid.y_m], [101.0, 201.0]);
        let placing = Placing { metres_per_unit: Some(0.5), x_m: Some(-10.0), ..Placing::default() };
        let moved = map(&placing).expect("a map");
        assert_eq!([moved.x_m, moved.y_m, moved.spacing_x_m, moved.spacing_y_m], [-9.0, 201.0, 2.0, 2.0]);
        assert_eq!([moved.columns, moved.rows], [3, 2]);
        assert_eq!(moved.heights_m[0], 0.5);
        assert!(moved.heights_m[1].is_nan(), "no data stays no data");
        assert_eq!(moved.heights_m[2..], [1.5, 2.0, 2.5, 3.0]);
    }

    #[test]
    fn values_out_of_range_are_refused_in_one_line() {
        let unit = |metres| Placing { metres_per_unit: Some(metres), ..Placing::default() };
        for (placing, reason) in [
            (unit(1e4), "has the height 30000 m at (105, 201) m, must be from -10000 to 10000 m"),
            (unit(0.0), "metres_per_unit is 0, must be above 0"),
            (unit(f64::NAN), "metres_per_unit is NaN, must be above 0"),
            (
                Placing { metres_per_pixel: Some(2.0), ..Placing::default() },
                "metres_per_pixel is 2, but a .asc has its own: omit the key",
            ),
            (
                Placing { y_m: Some(-1e9), ..Placing::default() },
                "has its first height at (101, -999999999) m, must be from -100000000 to 100000000 m",
            ),
        ] {
            assert_eq!(map(&placing).expect_err(reason).to_string(), reason);
        }
        for (columns, rows, reason) in [
            (1, 9, "has 1 × 9 heights, must have at least 2 × 2"),
            (4001, 4000, "has 4001 × 4000 heights, at most 16000000 are allowed"),
            (1 << 32, 1 << 32, "has 4294967296 × 4294967296 heights, at most 16000000 are allowed"),
        ] {
            assert_eq!(require_size(columns, rows).expect_err(reason).to_string(), reason);
        }
    }
}
