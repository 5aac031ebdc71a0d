//! Height maps that rasterio, which reads with GDAL, wrote.

use std::fs;
use std::path::Path;

use bench_dragon::height_map::{Grid, Placing, read};
use serde::Deserialize;
use test_support::pytest::python;

/// The heights of a file and their places, as rasterio reads them.
#[derive(Deserialize)]
struct Found {
    file: String,
    /// From the west.
    x_m: Vec<f64>,
    /// From the south.
    y_m: Vec<f64>,
    heights_m: Vec<Vec<Option<f64>>>,
}

#[test]
fn geotiffs_of_rasterio_have_the_same_heights_at_the_same_places() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("height_maps");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder");
    let written = python().arg("tests/python/height_maps.py").arg(&folder).output().expect("Python is installed");
    assert!(written.status.success(), "{}", String::from_utf8_lossy(&written.stderr));
    let files: Vec<Found> = serde_json::from_slice(&written.stdout).expect("JSON");
    assert!(files.len() > 50, "{} files", files.len());
    for found in &files {
        let grid = read(&folder.join(&found.file), &Placing::default());
        assert_found(&grid.unwrap_or_else(|error| panic!("{}: {error}", found.file)), found);
    }
    for (file, reason) in [
        ("degrees.tif", "has positions in degrees (GTModelType 2): reproject it to a grid in metres"),
        ("feet.tif", "has positions in unit 9003 of EPSG, must be 9001: metres"),
        ("scaled.tif", "GDAL_METADATA has the scale \"0.125\", must be 1: write the heights themselves"),
        ("rotated.tif", "is rotated or sheared, must have rows from west to east"),
        ("bands.tif", "has 2 bands, must have 1"),
        ("sparse.tif", "is a sparse file, must have all of its strips or tiles"),
        ("mask.tif", "has a mask, must have a NODATA value where heights are missing"),
    ] {
        let error = read(&folder.join(file), &Placing::default()).expect_err(file);
        assert_eq!(error.to_string(), reason, "{file}");
    }
}

/// Asserts that heights and positions are equal. The positions are multiples of powers of two, which are not rounded.
fn assert_found(grid: &Grid, found: &Found) {
    let Found { file, x_m, y_m, heights_m } = found;
    assert_eq!((grid.columns, grid.rows), (x_m.len(), y_m.len()), "{file}");
    for (column, x_m) in x_m.iter().enumerate() {
        assert_eq!(grid.x_m + column as f64 * grid.spacing_x_m, *x_m, "{file}");
    }
    for (row, y_m) in y_m.iter().enumerate() {
        assert_eq!(grid.y_m + row as f64 * grid.spacing_y_m, *y_m, "{file}");
    }
    for (height_m, found_m) in grid.heights_m.iter().zip(heights_m.iter().flatten()) {
        match found_m {
            Some(found_m) => assert_eq!(height_m, found_m, "{file}"),
            None => assert!(height_m.is_nan(), "{file} has the height {height_m} m where rasterio has none"),
        }
    }
}
