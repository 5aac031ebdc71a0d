//! The map of heights of the examples is made here: a square that falls to the south-west, with a rise and a hollow.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// Heights in a row and in a column, one each half metre, about the origin.
const COUNT: usize = 61;
const SPACING_M: f64 = 0.5;

fn height_m(x: f64, y: f64) -> f64 {
    let hump = |x0: f64, y0: f64, squared: f64| (-((x - x0).powi(2) + (y - y0).powi(2)) / squared).exp();
    0.02 * x - 0.01 * y + 0.45 * hump(3.0, -2.0, 40.0) - 0.25 * hump(-6.0, 5.0, 30.0)
}

/// The map as an ESRI ASCII grid, to a millimetre.
fn map() -> String {
    let first_m = -0.5 * SPACING_M * (COUNT - 1) as f64;
    let at = |index: usize| first_m + SPACING_M * index as f64;
    let mut text = format!("ncols {COUNT}\nnrows {COUNT}\nxllcenter {first_m}\nyllcenter {first_m}\n");
    let _ = writeln!(text, "cellsize {SPACING_M}\nNODATA_value -9999");
    for row in (0..COUNT).rev() {
        let heights: Vec<String> = (0..COUNT).map(|column| format!("{:.3}", height_m(at(column), at(row)))).collect();
        let _ = writeln!(text, "{}", heights.join(" "));
    }
    text
}

/// Set `BENCH_DRAGON_WRITE_HILL=1` to write the file.
#[test]
fn the_hill_of_the_examples_is_the_one_that_is_made_here() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/hill.asc");
    if std::env::var_os("BENCH_DRAGON_WRITE_HILL").is_some() {
        fs::write(&path, map()).expect("the file can be written");
    }
    assert!(fs::read_to_string(&path).expect("an example") == map(), "examples/hill.asc is another map");
}
